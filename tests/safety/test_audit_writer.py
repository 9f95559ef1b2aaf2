"""The writer: it survives kill -9, full disks and slow ones, and whoever hands records over never notices."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import threading
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from audit_logs import ABOUT, KEY, OTHER_KEY, fields, look, write
from hypothesis import given, settings
from hypothesis import strategies as st

from chauffeur.concept import DataError
from chauffeur.safety.audit import AuditLog, head_path, read_records, verify

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


def write_short(path: Path) -> bytes:
    with AuditLog(path, about=ABOUT) as log:
        log.append("wish", {"source": "text"}, {"person": "ana", "wish": "faster"})
    return path.read_bytes()


def test_a_file_that_is_no_log_is_left_alone(tmp_path: Path) -> None:
    for content in (b"no line end", b"a line\n", b"a line\nand a half"):
        path = tmp_path / "notes.txt"
        path.write_bytes(content)
        with pytest.raises(DataError, match="not an audit log"):
            AuditLog(path, about={})
        assert path.read_bytes() == content


def test_a_changed_log_is_not_continued(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    write(path, key=KEY)
    with pytest.raises(DataError, match="under a key"):
        AuditLog(path, about={})
    with pytest.raises(DataError, match="not as it was written"):
        AuditLog(path, about={}, key=OTHER_KEY)
    content = path.read_bytes()
    AuditLog(path, about={}, key=KEY).close()
    assert verify(path, key=KEY).ok
    path.write_bytes(content.replace(b"format-v1", b"format-v2", 1))
    with pytest.raises(DataError, match="line 4"):
        AuditLog(path, about={}, key=KEY)
    path.write_bytes(content[: content.index(b"\n") + 1])
    with pytest.raises(DataError, match="cut off"):
        AuditLog(path, about={}, key=KEY)


def test_one_writer_at_a_time(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    log = AuditLog(path, about={})
    with pytest.raises(DataError, match="somebody else"):
        AuditLog(path, about={})
    log.close()
    AuditLog(path, about={}).close()
    assert verify(path).kinds["opened"] == 2


def test_a_place_that_cannot_be_written_is_said_before_anything_moves(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for path in (tmp_path, tmp_path / "file" / "audit.jsonl", Path("/proc/audit.jsonl")):
        with pytest.raises(DataError, match="cannot be opened"):
            AuditLog(path, about={})


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


def test_what_cannot_be_written_as_json_is_said_in_its_place(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    with AuditLog(path, about={}) as log:
        no_text: Any = 5
        log.append("plan", {"secret": object()}, {"person": "ana"})
        log.append("plan", {}, {"thoughts": no_text})
        log.append("plan", {"fine": 1})
        assert log.flush()
    found = verify(path)
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


def test_actuations_reach_the_disk_without_being_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    log = AuditLog(path, about={}, sync_every_s=0.05)
    assert log.flush()
    log.append("actuation", {"number": 1})
    deadline = time.monotonic() + 10
    while verify(path).kinds.get("actuation") != 1:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    log.close()


def test_all_but_actuations_are_synced_at_once(tmp_path: Path) -> None:
    log = AuditLog(tmp_path / "audit.jsonl", about={}, sync_every_s=1000.0)
    log.append("verdict", {})
    deadline = time.monotonic() + 10
    while log.on_disk < 2:
        assert time.monotonic() < deadline
        time.sleep(0.005)
    log.append("actuation", {})
    time.sleep(0.05)
    assert log.on_disk == 2
    assert log.flush()
    assert log.on_disk == 3
    assert log.close().complete
    assert not log.append("verdict", {})
    assert log.close().lost == 1
    assert verify(log.path).records == 4


def test_the_file_is_for_its_owner_alone(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "audit.jsonl"
    write(path)
    assert path.stat().st_mode & 0o777 == 0o600
    assert head_path(path).stat().st_mode & 0o777 == 0o600


def test_time_comes_from_the_clock_given(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    with AuditLog(path, about={}, clock=lambda: datetime(2001, 2, 3, tzinfo=UTC)):
        pass
    times = {fields(line)["time"] for line in path.read_bytes().splitlines()}
    assert times == {"2001-02-03T00:00:00.000+00:00"}


def test_the_same_drive_gives_the_same_bytes(tmp_path: Path) -> None:
    one, other = tmp_path / "one", tmp_path / "other"
    assert write(one, key=KEY) == write(other, key=KEY)
    assert one.read_bytes() == other.read_bytes()
