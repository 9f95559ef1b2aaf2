"""The writer: it survives kill -9, full disks and slow ones, and whoever hands records over never notices."""

from __future__ import annotations

import hashlib
import json
import logging
import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path
from typing import Any

import pytest
from audit_logs import (
    ABOUT,
    BROKEN,
    KEY,
    OTHER_KEY,
    counting_salt,
    far_east,
    fields,
    look,
    refusing,
    ticking,
    write,
)
from hypothesis import given, settings
from hypothesis import strategies as st

from chauffeur.safety.audit import AuditLog, Closing, head_path, heads, read_records, verify, writer
from chauffeur.safety.audit.heads import read_head
from chauffeur.safety.audit.keys import key_name
from chauffeur.safety.audit.storage import LogFile
from chauffeur.safety.audit.writer import utc_now
from chauffeur.version import __version__

KILLS = 24
KILLS_A_LOG = 4

KILLED_WRITERS = """
import os, signal, sys
from pathlib import Path
from chauffeur.safety.audit import AuditLog

def write_on():
    log = AuditLog(path, about={}, sync_every_s=0.01)
    for number in range(100):
        log.append("actuation", {"number": number, "padding": "x" * (number % 3 * 9000)})
        log.append("verdict", {"writer": os.getpid(), "number": number})
        if log.flush():
            os.write(1, b"%d %d\\n" % (os.getpid(), number))
    signal.pause()

for turn in range(int(sys.argv[2])):
    path = Path(sys.argv[1]) / str(turn // int(sys.argv[3]))
    child = os.fork()
    if not child:
        write_on()
    os.write(1, b"pid %d\\n" % child)
    os.waitpid(child, 0)
    os.write(1, b"dead\\n")
"""
"""Writers, one after another, some to a log; each tells what it was told is on the disk, and is killed from outside."""

FULL_DISK_WRITER = """
import json, resource, signal, sys, time
from pathlib import Path
from chauffeur.safety.audit import AuditLog

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
log = AuditLog(Path(sys.argv[1]), about={}, capacity=20)
told = {"before": log.append("wish", {"number": 0}) and log.flush()}
resource.setrlimit(resource.RLIMIT_FSIZE, (6000, resource.RLIM_INFINITY))
told["taken"] = [log.append("actuation", {"number": number, "padding": "x" * 500}) for number in range(1, 60)]
told["full"] = log.flush()
told["trouble"] = log.trouble
log.append("verdict", {"number": 60})
resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
deadline = time.monotonic() + 20
while not log.flush() and time.monotonic() < deadline:
    pass
log.append("wish", {"number": 61})
closing = log.close()
told |= {"lost": closing.lost, "head": closing.head}
print(json.dumps(told))
"""


def _run(script: str, *arguments: object) -> subprocess.Popen[bytes]:
    return subprocess.Popen([sys.executable, "-c", script, *map(str, arguments)], stdout=subprocess.PIPE)


def test_nothing_acknowledged_is_lost_by_kill_9(tmp_path: Path) -> None:
    chance = random.Random(5)
    acknowledged: set[tuple[int, int]] = set()
    kept: set[tuple[int, int]] = set()
    writers = _run(KILLED_WRITERS, tmp_path, KILLS, KILLS_A_LOG)
    assert writers.stdout is not None
    for turn in range(KILLS):
        pid, told = 0, list[bytes]()
        while not pid or (turn % 2 and not told):  # every other one dies with something acknowledged already
            line = writers.stdout.readline()
            if line.startswith(b"pid"):
                pid = int(line[4:])
            else:
                told.append(line)
        time.sleep(chance.uniform(0.0, 0.03))
        os.kill(pid, signal.SIGKILL)
        told += iter(writers.stdout.readline, b"dead\n")
        for line in told:
            writer, number = line.split()
            acknowledged.add((int(writer), int(number)))
        path = tmp_path / str(turn // KILLS_A_LOG)
        found = verify(path) if path.exists() else None
        assert found is None or found.ok or not found.records, found
        if (turn + 1) % KILLS_A_LOG:
            continue
        with AuditLog(path, about={}):
            pass
        found = verify(path)
        assert found.ok
        assert (found.torn_bytes, found.closed, found.lost) == (0, True, 0)
        verdicts = [record.body for _, record in read_records(path) if record.kind == "verdict"]
        kept |= {(body["writer"], body["number"]) for body in verdicts}
    assert writers.wait(20) == 0
    assert len(acknowledged) >= KILLS // 2
    assert acknowledged <= kept


@given(st.integers(1))
@settings(max_examples=60, deadline=None)
def test_a_torn_end_is_not_tampering_and_the_chain_goes_on(tmp_path_factory: pytest.TempPathFactory, cut: int) -> None:
    path = tmp_path_factory.mktemp("torn") / "audit.jsonl"
    whole = len(write_short(path))
    cut %= whole
    os.truncate(path, cut)
    head_path(path).unlink()
    content = path.read_bytes()
    torn = len(content) - (content.rfind(b"\n") + 1)
    found = look(content)
    assert found.torn_bytes == torn
    assert found.ok or not found.records
    with AuditLog(path, about={}) as log:
        log.append("wish", {"again": True})
    found = verify(path)
    assert found.ok
    assert found.torn_bytes == 0
    opened = [record.body for _, record in read_records(path) if record.kind == "opened"][-1]
    assert opened.get("torn_bytes", 0) == torn
    digest = hashlib.sha256(content[len(content) - torn :]).hexdigest()
    assert opened.get("torn_sha256") == (digest if torn else None)


def write_short(path: Path) -> bytes:
    with AuditLog(path, about=ABOUT) as log:
        log.append("wish", {"source": "text"}, {"person": "ana", "wish": "faster"})
    return path.read_bytes()


def test_a_full_device_does_not_raise_into_the_drive(caplog: pytest.LogCaptureFixture) -> None:
    log = AuditLog(Path("/dev/full"), about={}, capacity=10)
    log.append("gap", {"why": "the caller's own"})
    taken = [log.append("actuation", {"number": number}) for number in range(50)]
    assert not log.flush(2.0)
    taken += [log.append("actuation", {"number": number}) for number in range(50)]
    assert taken.count(True) <= 10
    assert not log.flush(2.0)
    assert "No space left" in log.trouble
    closing = log.close()
    assert not closing.complete
    assert closing.lost >= 100
    assert "failed" not in log.trouble  # the writer is alive to the end
    assert "No space left" in closing.trouble
    assert len(caplog.records) == 1  # not one for every try
    assert not log.append("wish", {})
    assert log.close().lost == closing.lost + 1


def test_a_disk_that_was_full_for_a_while_leaves_a_gap_that_is_told(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    writer = _run(FULL_DISK_WRITER, path)
    told = json.loads(writer.communicate(timeout=600)[0])
    assert told["before"]
    assert told["full"] is False
    assert "File too large" in told["trouble"]
    found = verify(path, head=told["head"])
    assert found.ok, found.findings
    assert found.closed
    assert found.lost == told["lost"] > 0
    records = [record for _, record in read_records(path)]
    numbers = [record.body["number"] for record in records if "number" in record.body]
    assert numbers == sorted(numbers)
    assert {number for number, taken in enumerate(told["taken"], start=1) if taken} <= set(numbers)
    assert 61 - len(numbers) + 1 == found.lost
    gap = next(place for place, record in enumerate(records) if record.kind == "gap")
    before, after = records[gap - 1].body["number"], records[gap + 1].body["number"]
    assert after - before - 1 == sum(records[gap].body["lost"].values())  # it stands where the lost records would


def test_a_disk_that_hangs_keeps_nobody_waiting(tmp_path: Path) -> None:
    """A pipe that nobody reads blocks the writer for good, as a dead network disk does."""
    path = tmp_path / "pipe"
    os.mkfifo(path)
    log = AuditLog(path, about={}, capacity=100)
    slowest, taken = 0.0, 0
    for number in range(3000):
        begin = time.perf_counter()
        taken += log.append("actuation", {"number": number, "padding": "x" * 200})
        slowest = max(slowest, time.perf_counter() - begin)
        time.sleep(0.0001)
    assert slowest < 0.25
    assert taken < 3000
    begin = time.perf_counter()
    assert not log.flush(0.2)
    assert time.perf_counter() - begin < 2.0
    lines: list[bytes] = []
    reader = threading.Thread(target=lambda: lines.extend(path.open("rb")))
    reader.start()
    deadline = time.monotonic() + 20
    while not any(b'"kind":"gap"' in line for line in lines):  # told as soon as it can be, without being asked
        assert time.monotonic() < deadline
        time.sleep(0.01)
    assert log.flush(20.0)
    closing = log.close(20.0)
    reader.join(20.0)
    assert closing.lost == 3000 - taken
    found = look(b"".join(lines), head=closing.head)
    assert found.ok, found.findings
    assert found.lost == 3000 - taken
    assert found.closed


@pytest.mark.parametrize("key", [None, KEY])
def test_what_cannot_be_written_as_json_is_said_in_its_place(tmp_path: Path, key: bytes | None) -> None:
    path = tmp_path / "audit.jsonl"
    with AuditLog(path, about={}, key=key) as log:
        no_text: Any = 5
        log.append("plan", {"secret": object()}, {"person": "ana"})
        log.append("plan", {}, {"thoughts": no_text})
        log.append("plan", {"fine": 1})
        assert log.flush()
    found = verify(path, key=key)
    assert found.ok
    bodies = [record.body for _, record in read_records(path) if record.kind == "plan"]
    faults = [f"the record could not be written as JSON ({name})" for name in ("TypeError", "AttributeError")]
    assert bodies == [{"fault": faults[0]}, {"fault": faults[1]}, {"fine": 1}]
    assert "ana" not in path.read_text()


def test_many_threads_share_one_chain(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    log = AuditLog(path, about={}, capacity=10_000)
    threads = [
        threading.Thread(target=lambda who=who: [log.append("verdict", {"who": who, "n": n}) for n in range(200)])
        for who in range(5)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert log.flush()
    assert log.close().complete
    assert verify(path).ok
    bodies = [record.body for _, record in read_records(path) if record.kind == "verdict"]
    for who in range(5):
        assert [body["n"] for body in bodies if body["who"] == who] == list(range(200))


def test_the_file_is_for_its_owner_alone(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "audit.jsonl"
    write(path)
    assert path.stat().st_mode & 0o777 == 0o600
    assert head_path(path).stat().st_mode & 0o777 == 0o600


def test_the_same_drive_gives_the_same_bytes(tmp_path: Path) -> None:
    one, other = tmp_path / "one", tmp_path / "other"
    assert write(one, key=KEY) == write(other, key=KEY)
    assert one.read_bytes() == other.read_bytes()


WAIT_S = 20.0
NO_ROOM = "there was no room left: the disk was too slow, or failed"


class Disk:
    """Stands before the file of a log: writes wait while it is held, and fail while it is broken."""

    def __init__(self) -> None:
        self.go, self.asked = threading.Event(), threading.Event()
        self.go.set()
        self.broken: OSError | None = None
        self.unsynced: OSError | None = None
        self.batches: list[int] = []
        self.syncs = 0
        self.refused = 0

    def hold(self) -> None:
        self.asked.clear()
        self.go.clear()

    def append(self, file: LogFile, data: bytes) -> None:
        self.asked.set()
        assert self.go.wait(WAIT_S)
        if self.broken is not None:
            self.refused += 1
            raise self.broken
        self.batches.append(data.count(b"\n"))
        _APPEND(file, data)

    def wait_for_tries(self, number: int) -> None:
        enough = self.refused + number
        until(lambda: self.refused >= enough)

    def sync(self, file: LogFile) -> None:
        self.syncs += 1
        if self.unsynced is not None:
            raise self.unsynced
        _SYNC(file)


_APPEND, _SYNC = LogFile.append, LogFile.sync


@pytest.fixture
def disk(monkeypatch: pytest.MonkeyPatch) -> Iterator[Disk]:
    one = Disk()

    def append(file: LogFile, data: bytes) -> None:
        one.append(file, data)

    def sync(file: LogFile) -> None:
        one.sync(file)

    monkeypatch.setattr(LogFile, "append", append)
    monkeypatch.setattr(LogFile, "sync", sync)
    monkeypatch.setattr(writer, "RETRY_S", 0.01)
    yield one
    one.broken = one.unsynced = None
    one.go.set()


def until(holds: Callable[[], bool]) -> None:
    """Wait for another thread."""
    end = time.monotonic() + WAIT_S
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.002)


def bodies(path: Path, kind: str) -> list[Any]:
    return [dict(record.body) for _, record in read_records(path) if record.kind == kind]


# Opening and closing -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("key", "private"), [(None, False), (KEY, True)])
def test_a_drive_begins_with_what_wrote_it(tmp_path: Path, key: bytes | None, private: bool) -> None:
    log = AuditLog(tmp_path / "log", about=ABOUT, clock=ticking(), key=key, private=private)
    assert (log.path, log.lost, log.trouble) == (tmp_path / "log", 0, "")
    assert log.flush()
    assert log.on_disk == 1
    closing = log.close()
    assert (closing.records, closing.lost, closing.trouble, closing.complete) == (2, 0, "", True)
    assert log.head == closing.head == verify(tmp_path / "log", key=key).head
    left = read_head(tmp_path / "log")
    assert left is not None
    assert (left.hash, left.records, left.closed) == (closing.head, None if key is None else 2, True)
    assert (left.is_sealed_with(KEY), left.is_sealed_with(OTHER_KEY)) == (key is not None, False)
    name = "" if key is None else key_name(key)
    about = {"format": 2, "chauffeur": __version__, "key": name, "private": private, **ABOUT}
    assert bodies(tmp_path / "log", "opened") == [about]
    assert bodies(tmp_path / "log", "closed") == [{"lost": 0}]
    assert log.close() == closing


def test_a_drive_in_an_old_log_counts_on(tmp_path: Path) -> None:
    first = AuditLog(tmp_path / "log", about={}).close()
    second = AuditLog(tmp_path / "log", about={}).close()
    assert (first.records, second.records, second.lost) == (2, 4, 0)
    line = fields((tmp_path / "log").read_bytes().splitlines()[2])
    assert (line["seq"], line["prev"]) == (2, first.head)


def test_times_are_told_in_one_zone(tmp_path: Path) -> None:
    vienna = datetime(2026, 7, 8, 11, 10, 11, 12_999, tzinfo=timezone(timedelta(hours=2)))
    with far_east():
        AuditLog(tmp_path / "log", about={}, clock=lambda: vienna).close()
    times = {record.time for _, record in read_records(tmp_path / "log")}
    assert times == {"2026-07-08T09:10:11.012+00:00"}
    now = utc_now()
    assert now.tzinfo is UTC
    assert abs(now.timestamp() - time.time()) < 60.0


def test_a_writer_does_not_keep_a_program_from_ending(tmp_path: Path) -> None:
    with AuditLog(tmp_path / "log", about={}) as log:
        (thread,) = (one for one in threading.enumerate() if one.name == "audit log")
        assert thread.daemon
        assert not log.close().lost
    assert not thread.is_alive()


# Room, gaps and failures -------------------------------------------------------------------------------------------


def test_what_finds_no_room_is_counted_by_kind_and_told_in_its_place(tmp_path: Path, disk: Disk) -> None:
    disk.hold()
    log = AuditLog(tmp_path / "log", about={}, capacity=3, clock=ticking())
    assert disk.asked.wait(WAIT_S)  # one is in hand
    kinds = ("actuation", "wish", "plan", "plan", "verdict")
    assert [log.append(kind, {"n": number}) for number, kind in enumerate(kinds)] == [True, True, False, False, False]
    assert log.lost == 3
    begun = time.monotonic()
    assert not log.flush(0.05)
    assert 0.04 < time.monotonic() - begun < 5.0
    disk.go.set()
    until(lambda: log.on_disk == 4)
    assert log.flush()
    assert log.append("wish", {"n": 5})
    assert log.flush()
    closing = log.close()
    assert (closing.records, closing.lost, closing.trouble, closing.complete) == (6, 3, "", False)
    told = [(record.kind, record.body.get("n"), record.body.get("lost")) for _, record in read_records(log.path)]
    assert told == [
        ("opened", None, None),
        ("actuation", 0, None),
        ("wish", 1, None),
        ("gap", None, {"plan": 2, "verdict": 1}),
        ("wish", 5, None),
        ("closed", None, 3),
    ]
    assert bodies(log.path, "gap") == [{"lost": {"plan": 2, "verdict": 1}, "why": NO_ROOM}]
    assert verify(log.path).ok
    assert verify(log.path).lost == 3


def test_a_flush_during_which_something_was_lost_says_so(tmp_path: Path, disk: Disk) -> None:
    log = AuditLog(tmp_path / "log", about={}, capacity=2)
    assert log.flush()
    disk.hold()
    assert log.append("wish", {})
    assert disk.asked.wait(WAIT_S)
    assert log.append("wish", {})
    answers: list[bool] = []
    begun = threading.Event()

    def flush() -> None:
        begun.set()
        answers.append(log.flush(WAIT_S))

    flushing = threading.Thread(target=flush)
    flushing.start()
    assert begun.wait(WAIT_S)
    time.sleep(0.1)
    assert not log.append("wish", {})
    disk.go.set()
    flushing.join(WAIT_S)
    assert answers == [False]
    until(log.flush)
    assert log.close().lost == 1


def test_gaps_that_follow_one_another_are_told_as_one(tmp_path: Path, disk: Disk) -> None:
    log = AuditLog(tmp_path / "log", about={}, capacity=2)
    assert log.flush()
    disk.broken = BROKEN
    taken = [log.append("wish", {"n": 0})]
    for number in range(1, 6):
        disk.wait_for_tries(2)  # so that what was lost has been looked at
        taken.append(log.append("actuation" if number % 2 else "wish", {"n": number}))
    assert taken == [True, True, False, False, False, False]
    assert not log.flush()
    disk.wait_for_tries(3)
    assert log.on_disk == 1
    disk.broken = None
    until(log.flush)
    assert log.on_disk == 4
    closing = log.close()
    assert bodies(log.path, "gap") == [{"lost": {"wish": 2, "actuation": 2}, "why": NO_ROOM}]
    assert (closing.records, closing.lost) == (5, 4)
    assert closing.trouble == "The audit log could not be written: broken."
    assert verify(log.path).ok


def test_a_failure_is_told_once_in_words(tmp_path: Path, disk: Disk, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        log = AuditLog(tmp_path / "log", about={})
        assert log.flush()
        for error, why in ((BROKEN, "broken"), (OSError("no medium"), "no medium")):
            disk.broken = error
            assert log.append("wish", {})
            assert not log.flush()
            disk.wait_for_tries(3)
            assert log.trouble == f"The audit log could not be written: {why}."
        disk.broken = None
        until(log.flush)
        assert log.close().lost == 0
    assert [record.getMessage() for record in caplog.records] == [
        f"{log.path}: The audit log could not be written: broken.",
        f"{log.path}: The audit log could not be written: no medium.",
    ]


def test_a_failing_disk_is_not_asked_all_the_time(tmp_path: Path, disk: Disk, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(writer, "RETRY_S", 0.2)
    log = AuditLog(tmp_path / "log", about={})
    assert log.flush()
    disk.broken = BROKEN
    assert log.append("actuation", {})
    disk.wait_for_tries(1)
    time.sleep(0.3)
    assert disk.refused <= 3
    disk.broken = None
    until(lambda: disk.batches == [1, 1])
    assert log.flush()
    assert log.close().lost == 0


def test_a_flush_and_a_closing_do_not_wait_for_the_next_try(
    tmp_path: Path, disk: Disk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(writer, "RETRY_S", 60.0)
    log = AuditLog(tmp_path / "log", about={})
    assert log.flush()
    disk.broken = BROKEN
    assert log.append("wish", {})
    until(lambda: log.trouble != "")
    begun = time.monotonic()
    assert not log.flush(WAIT_S)
    assert time.monotonic() - begun < WAIT_S / 2
    assert disk.refused == 2
    disk.broken = None
    assert log.close(4.0).lost == 0


def test_a_stuck_disk_keeps_a_closing_as_long_as_was_said(tmp_path: Path, disk: Disk) -> None:
    log = AuditLog(tmp_path / "log", about={})
    assert log.flush()
    head = log.head
    disk.hold()
    assert log.append("wish", {})
    assert disk.asked.wait(WAIT_S)
    closing = log.close(0.05)
    assert closing == Closing(head, 1, 2, "The disk did not answer in time.")
    assert not log.append("wish", {})
    disk.go.set()
    until(lambda: not log.close(0.05).trouble)
    assert log.close() == Closing(verify(log.path).head, 3, 1, "")
    assert bodies(log.path, "closed") == [{"lost": 0}]


def test_what_cannot_be_closed_is_counted_as_lost(tmp_path: Path, disk: Disk) -> None:
    log = AuditLog(tmp_path / "log", about={})
    assert log.flush()
    disk.broken = BROKEN
    assert log.append("wish", {})
    closing = log.close()
    assert (closing.records, closing.lost) == (1, 2)
    assert closing.trouble == "The audit log could not be written: broken."
    assert not head_path(log.path).exists()
    LogFile(log.path).close()  # the file was given back


def test_many_records_are_written_in_small_batches(tmp_path: Path, disk: Disk) -> None:
    disk.hold()
    log = AuditLog(tmp_path / "log", about={})
    assert disk.asked.wait(WAIT_S)
    for number in range(150):
        assert log.append("verdict" if number == 3 else "actuation", {"n": number})
    disk.go.set()
    until(lambda: log.on_disk == 151)  # one of them is no actuation: all are synced at once
    assert disk.batches == [1, 64, 64, 22]
    assert disk.syncs == 2
    assert log.close().complete
    assert verify(log.path).ok
    assert [body["n"] for body in bodies(log.path, "actuation")] == [n for n in range(150) if n != 3]


def test_actuations_wait_for_one_sync_together(tmp_path: Path, disk: Disk) -> None:
    disk.hold()
    log = AuditLog(tmp_path / "log", about={}, sync_every_s=0.3)
    assert disk.asked.wait(WAIT_S)
    for number in range(5):
        assert log.append("actuation", {"n": number})
    begun = time.monotonic()
    disk.go.set()
    until(lambda: log.on_disk == 6)
    assert time.monotonic() - begun > 0.29
    assert (disk.batches, disk.syncs) == ([1, 5], 2)
    time.sleep(0.1)
    assert disk.syncs == 2  # nothing new, nothing to sync
    assert log.close().complete


def test_an_actuation_waits_no_longer_for_the_disk_than_was_said(tmp_path: Path) -> None:
    log = AuditLog(tmp_path / "log", about={}, sync_every_s=0.01)
    assert log.flush()
    waited: list[float] = []
    for number in range(2, 5):
        begun = time.monotonic()
        assert log.append("actuation", {})
        until(lambda wanted=number: log.on_disk == wanted)
        waited.append(time.monotonic() - begun)
    assert min(waited) < 0.9
    assert log.close().complete


def test_a_sync_that_fails_from_the_first_is_told_and_tried_again_unasked(tmp_path: Path, disk: Disk) -> None:
    disk.unsynced = BROKEN
    log = AuditLog(tmp_path / "log", about={})
    until(lambda: disk.syncs > 3)
    assert (log.on_disk, log.trouble) == (0, "The audit log could not be written: broken.")
    disk.unsynced = None
    until(lambda: log.on_disk == 2)
    assert log.append("wish", {})
    assert log.flush()
    assert log.close().lost == 0
    assert [record.kind for _, record in read_records(log.path)] == ["opened", "gap", "wish", "closed"]
    told = {"lost": {}, "why": "a sync failed: after a power cut, records just before this one may be missing"}
    assert bodies(log.path, "gap") == [told]


def test_room_for_one_is_enough_for_a_drive_that_does_nothing(tmp_path: Path) -> None:
    closing = AuditLog(tmp_path / "log", about={}, capacity=1).close()
    assert (closing.records, closing.complete) == (2, True)


def test_a_gap_at_the_end_is_told_before_the_closing(tmp_path: Path, disk: Disk) -> None:
    disk.hold()
    log = AuditLog(tmp_path / "log", about={}, capacity=1)
    assert disk.asked.wait(WAIT_S)
    assert not log.append("wish", {})
    assert log.close(0.05).trouble
    disk.go.set()
    until(lambda: not log.close(0.05).trouble)
    assert log.close().lost == 1
    assert [record.kind for _, record in read_records(log.path)] == ["opened", "gap", "closed"]
    assert bodies(log.path, "closed") == [{"lost": 1}]
    assert verify(log.path).lost == 1


def test_what_comes_after_the_closing_is_counted(tmp_path: Path) -> None:
    log = AuditLog(tmp_path / "log", about={})
    assert log.close().complete
    assert [log.append("wish", {}) for _ in range(3)] == [False] * 3
    assert log.lost == log.close().lost == 3
    assert log.close().records == 2


@pytest.mark.parametrize(("error", "why"), [(BROKEN, "broken"), (OSError("no medium"), "no medium")])
def test_why_a_head_was_not_left_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: OSError, why: str
) -> None:
    monkeypatch.setattr(heads, "replace_whole", refusing(error))
    closing = AuditLog(tmp_path / "log", about={}).close()
    assert closing.trouble == f"The head file could not be written: {why}."
    last = fields((tmp_path / "log").read_bytes().splitlines()[-1])
    assert (closing.lost, last["kind"], last["hash"]) == (0, "closed", closing.head)


def test_a_pipe_gets_no_head(tmp_path: Path) -> None:
    path = tmp_path / "pipe"
    os.mkfifo(path)
    reader = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    file = LogFile(path)
    assert (file.is_regular, file.size) == (False, 0)
    file.close()
    closing = AuditLog(path, about={}).close()
    assert closing.complete
    assert os.read(reader, 1 << 16).count(b"\n") == closing.records == 2
    os.close(reader)
    assert not head_path(path).exists()


def test_texts_go_beside_a_body_that_stays_as_it_was(tmp_path: Path) -> None:
    body: dict[str, Any] = {"n": 1}
    with AuditLog(tmp_path / "log", about={}, make_salt=counting_salt()) as log:
        log.append("wish", body, {"person": "ana"})
        log.append("wish", body)
    assert body == {"n": 1}
    first, second = (fields(line) for line in (tmp_path / "log").read_bytes().splitlines()[1:3])
    assert first["texts"] == {"person": {"salt": "0" * 31 + "1", "text": "ana"}}
    assert list(first["body"]) == ["n", "texts"]
    assert second["body"] == {"n": 1}
    assert "texts" not in second


def test_a_sync_that_fails_is_told_once_and_made_good(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "log"
    log = AuditLog(path, about=ABOUT, clock=ticking())
    assert log.flush()
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", refusing(BROKEN))
        log.append("wish", {"number": 1})
        assert not log.flush()
        assert log.on_disk == 1
        until(lambda: "broken" in log.trouble)
        log.append("wish", {"number": 2})
        assert not log.flush()
    log.append("wish", {"number": 3})
    assert log.flush()
    assert log.lost == 0
    closing = log.close()
    assert closing.lost == 0
    assert "broken" in closing.trouble
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
