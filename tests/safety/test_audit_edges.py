"""What seldom happens to an audit log: disks that fail half-way, files that change meanwhile, clocks that fail."""

from __future__ import annotations

import errno
import json
import logging
import os
import threading
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from audit_logs import ABOUT, KEY, fields, look, ticking, write

from chauffeur.concept import DataError
from chauffeur.safety.audit import AuditLog, head_path, read_records, redact, redaction, storage, verify
from chauffeur.safety.audit.entries import canonical, seal
from chauffeur.safety.audit.storage import LogFile

WAIT_S = 20.0


def until(holds: Callable[[], bool]) -> None:
    """Wait for another thread."""
    end = time.monotonic() + WAIT_S
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.005)


def refusing(number: int = errno.EIO) -> Callable[..., Any]:
    def refuse(*_: Any, **__: Any) -> Any:
        raise OSError(number, os.strerror(number))

    return refuse


@pytest.mark.parametrize("named", [None, 3, 0.5, True, {}, "abc", [[1]], ["1"]])
def test_a_redaction_that_names_no_records_announces_none(tmp_path: Path, named: object) -> None:
    """Found by fuzzing: what stands under `records` may be anything in a log that somebody has rewritten."""
    write(tmp_path / "log")
    content = (tmp_path / "log").read_bytes()
    lines = content.splitlines(keepends=True)
    erased = fields(lines[1])
    erased["texts"] = {name: {"redacted": True} for name in erased["texts"]}
    lines[1] = canonical(erased) + b"\n"
    found = look(content)
    last, _ = seal(
        found.records, found.head, "redaction", "2026-01-02T03:04:09.000+00:00", {"records": named}, {}, None
    )
    told = look(b"".join([*lines, last]))
    assert [(finding.line, finding.code) for finding in told.findings] == [(2, "erased_unsaid")]


# Erasing -----------------------------------------------------------------------------------------------------------


def test_erasing_that_cannot_be_written_leaves_the_log_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "log"
    write(path)
    before = path.read_bytes()
    draft = tmp_path / f".log.{os.getpid()}.draft"
    draft.mkdir()  # where the new content would be drafted
    with pytest.raises(DataError, match=r"cannot be written: .* Nothing was erased"):
        redact(path, "ana")
    assert path.read_bytes() == before
    assert verify(path).ok
    draft.rmdir()
    assert redact(path, "ana").texts  # the lock was given back


def test_a_log_that_changes_while_it_is_erased_is_left_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "log"
    write(path)

    def verified_then_spoilt(*args: Any, **options: Any) -> Any:
        found = verify(*args, **options)
        path.write_bytes(path.read_bytes().replace(b'{"body"', b'["body"', 1))
        return found

    monkeypatch.setattr(redaction, "verify", verified_then_spoilt)
    with pytest.raises(DataError) as caught:
        redact(path, "ana")
    assert caught.value.message == f"The audit log {path} changed while it was read; nothing was erased."
    assert path.read_bytes().startswith(b'["body"')
    assert b"ana" in path.read_bytes()


# The file ----------------------------------------------------------------------------------------------------------


def test_half_a_batch_is_gone_before_the_next_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also when taking it off failed at first."""
    file = LogFile(tmp_path / "log")
    file.append(b"one\n")
    written = os.write
    monkeypatch.setattr(os, "write", lambda fd, data: written(fd, data[:3]) if len(data) > 3 else refusing()())
    with monkeypatch.context() as patch:
        patch.setattr(os, "ftruncate", refusing())
        with pytest.raises(OSError, match=os.strerror(errno.EIO)):
            file.append(b"twoo\n")
    assert (tmp_path / "log").read_bytes() == b"one\ntwo"
    monkeypatch.setattr(os, "write", written)
    file.append(b"three\n")
    assert file.size == len(b"one\nthree\n")
    file.close()
    assert (tmp_path / "log").read_bytes() == b"one\nthree\n"


def test_a_pipe_keeps_what_half_a_batch_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing can be cut back there, and that must not be tried."""
    os.mkfifo(tmp_path / "pipe")
    reader = os.open(tmp_path / "pipe", os.O_RDONLY | os.O_NONBLOCK)
    file = LogFile(tmp_path / "pipe")
    with monkeypatch.context() as patch:
        patch.setattr(os, "write", refusing(errno.EPIPE))
        with pytest.raises(BrokenPipeError):
            file.append(b"one\n")
    file.append(b"two\n")
    file.sync()
    assert os.read(reader, 100) == b"two\n"
    file.close()
    os.close(reader)


def test_a_log_replaced_between_opening_and_locking_is_opened_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "log"
    path.write_bytes(b"old\n")
    lock = storage.fcntl.flock

    def replaced_first(descriptor: int, how: int) -> None:
        monkeypatch.setattr(storage.fcntl, "flock", lock)
        storage.replace_whole(path, b"new\n")
        lock(descriptor, how)

    monkeypatch.setattr(storage.fcntl, "flock", replaced_first)
    file = LogFile(path)
    file.append(b"more\n")
    file.close()
    assert path.read_bytes() == b"new\nmore\n"


# The writer --------------------------------------------------------------------------------------------------------


def test_a_sync_that_fails_is_told_once_and_made_good(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "log"
    log = AuditLog(path, about=ABOUT, clock=ticking())
    assert log.flush()
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", refusing())
        log.append("wish", {"number": 1})
        assert not log.flush()
        assert log.on_disk == 1
        until(lambda: os.strerror(errno.EIO) in log.trouble)
        log.append("wish", {"number": 2})
        assert not log.flush()
    log.append("wish", {"number": 3})
    assert log.flush()
    assert log.lost == 0
    closing = log.close()
    assert closing.lost == 0
    assert os.strerror(errno.EIO) in closing.trouble
    assert not closing.complete
    records = [record for _, record in read_records(path)]
    told = [record.body["why"] for record in records if record.kind == "gap"]
    assert told == ["a sync failed: after a power cut, records just before this one may be missing"]
    assert [record.body["number"] for record in records if record.kind == "wish"] == [1, 2, 3]
    assert closing.head == log.head == verify(path).head


def test_a_clock_that_fails_in_the_writer_is_said_and_stops_no_drive(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """The writer looks at the clock itself where it tells of a gap."""

    def clock() -> datetime:
        if threading.current_thread().name == "audit log":
            raise ValueError("no time")
        return datetime(2026, 1, 2, tzinfo=UTC)

    with caplog.at_level(logging.ERROR):
        log = AuditLog(tmp_path / "log", about=ABOUT, clock=clock, capacity=1)
        handed = [log.append("actuation", {"number": number}) for number in range(200)]
        assert not all(handed)
        until(lambda: log.trouble != "")
        accepted = log.append("wish", {"number": 200})
        assert not (accepted and log.flush())  # at once, for nobody is writing any more
        closing = log.close()
    assert closing.trouble == "The audit log failed: ValueError."
    assert closing.lost + log.on_disk == 1 + len(handed) + 2  # opened, ..., wish, closed: nothing is unaccounted for
    assert not closing.complete
    assert caplog.messages == [f"the audit log {log.path} is not written any more"]
    assert verify(tmp_path / "log").records == closing.records >= log.on_disk


def test_a_head_that_cannot_be_left_is_said(tmp_path: Path) -> None:
    path = tmp_path / "log"
    log = AuditLog(path, about=ABOUT, clock=ticking(), key=KEY)
    head_path(path).unlink()
    head_path(path).mkdir()
    closing = log.close()
    assert closing.trouble.startswith("The head file could not be written: ")
    assert closing.lost == 0
    last = json.loads(path.read_bytes().splitlines()[-1])
    assert (last["kind"], last["hash"]) == ("closed", closing.head)
