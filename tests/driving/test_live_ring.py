"""Messages in shared memory: whole ones are read, broken ones are not, and nobody waits."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chauffeur.concept import DataError
from chauffeur.driving.live.ring import Reader, Ring

SLOTS, SIZE = 4, 256


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "ring"


@pytest.fixture
def pair(path: Path) -> Iterator[tuple[Ring, Ring]]:
    with Ring(path, SLOTS, SIZE, create=True) as writer, Ring(path, SLOTS, SIZE) as reader:
        yield writer, reader


def test_an_empty_ring_has_nothing(pair: tuple[Ring, Ring]) -> None:
    assert pair[1].latest() is None
    assert Reader(pair[1], old=True).news() == ((), 0)
    assert pair[1].torn == 0


@given(st.lists(st.binary(max_size=SIZE), max_size=20), st.integers(0, 20))
@settings(max_examples=60, deadline=None)
def test_newest_messages_come_in_order_and_the_lost_are_counted(payloads: list[bytes], heard: int) -> None:
    path = Path(f"/dev/shm/test-ring-{os.getpid()}") if Path("/dev/shm").is_dir() else Path(f"/tmp/ring-{os.getpid()}")
    try:
        with Ring(path, SLOTS, SIZE, create=True) as writer, Ring(path, SLOTS, SIZE) as reader:
            for payload in payloads[:heard]:
                writer.write(payload)
            news = Reader(reader)
            for payload in payloads[heard:]:
                writer.write(payload)
            latest = reader.latest()
            assert (latest.payload if latest else None) == (payloads[-1] if payloads else None)
            messages, lost = news.news()
            new = payloads[heard:]
            assert [m.payload for m in messages] == new[-SLOTS:]
            assert lost == max(0, len(new) - SLOTS)
            assert [m.number for m in messages] == list(range(len(payloads) - len(messages) + 1, len(payloads) + 1))
    finally:
        path.unlink(missing_ok=True)


@given(st.integers(0, 20_000), st.binary(min_size=1, max_size=64))
@settings(max_examples=200, deadline=None)
def test_whatever_is_scribbled_over_a_message_it_is_whole_or_none(at: int, garbage: bytes) -> None:
    path = Path(f"/dev/shm/test-scribble-{os.getpid()}") if Path("/dev/shm").is_dir() else Path(f"/tmp/s-{os.getpid()}")
    try:
        with Ring(path, SLOTS, SIZE, create=True) as writer, Ring(path, SLOTS, SIZE) as reader:
            sent = [bytes([k]) * 100 for k in range(1, 4)]
            for payload in sent:
                writer.write(payload)
            with path.open("r+b") as file:
                file.seek(at % path.stat().st_size)
                file.write(garbage[: path.stat().st_size - file.tell()])
            latest = reader.latest()
            assert latest is None or latest.payload in sent
            assert all(message.payload in sent for message in Reader(reader, old=True).news()[0])
            writer.write(b"after")  # the writer goes on, and is heard
            after = reader.latest()
            assert after is not None
            assert after.payload == b"after"
    finally:
        path.unlink(missing_ok=True)


def test_a_message_that_does_not_fit_is_refused_and_nothing_is_written(pair: tuple[Ring, Ring]) -> None:
    pair[0].write(b"first")
    with pytest.raises(ValueError, match="does not fit"):
        pair[0].write(bytes(SIZE + 1))
    latest = pair[1].latest()
    assert latest is not None
    assert latest.payload == b"first"


def test_a_writer_that_follows_a_dead_one_counts_on(path: Path) -> None:
    with Ring(path, SLOTS, SIZE, create=True) as first:
        first.write(b"a")
    with Ring(path, SLOTS, SIZE) as second:
        assert second.write(b"b") == 2


def test_other_sizes_other_files_and_files_that_are_there_are_refused(path: Path, tmp_path: Path) -> None:
    with Ring(path, SLOTS, SIZE, create=True):
        with pytest.raises(DataError, match="no ring"):
            Ring(path, SLOTS, SIZE * 2)
        with pytest.raises(FileExistsError):
            Ring(path, SLOTS, SIZE, create=True)
    assert path.stat().st_mode & 0o077 == 0
    zeros = tmp_path / "zeros"
    zeros.write_bytes(bytes(path.stat().st_size))
    with pytest.raises(DataError, match="no ring"):
        Ring(zeros, SLOTS, SIZE)


_WRITER = """
import sys
from pathlib import Path
from chauffeur.driving.live.ring import Ring
ring = Ring(Path(sys.argv[1]), 4, 256)
k = 0
while True:
    k += 1
    ring.write(str(k).encode() * 40)
"""


def test_a_reader_beside_a_writer_that_is_killed_at_any_moment_never_sees_half_a_message(path: Path) -> None:
    with Ring(path, SLOTS, SIZE, create=True) as reader:
        whole = 0
        for _ in range(3):
            process = subprocess.Popen([sys.executable, "-c", _WRITER, str(path)])
            until = time.monotonic() + 20.0
            start = reader.head
            while reader.head < start + 2000 and time.monotonic() < until:
                message = reader.latest()
                if message is not None:
                    text = message.payload.decode()
                    assert text == text[: len(text) // 40] * 40
                    whole += 1
            process.send_signal(signal.SIGKILL)
            process.wait()
        assert whole > 100
