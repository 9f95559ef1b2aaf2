"""The writer and its file to the last record: what finds room, what a gap or a closing tells, what is synced."""

from __future__ import annotations

import errno
import hashlib
import logging
import os
import threading
import time
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path
from typing import Any

import pytest
from audit_logs import ABOUT, KEY, OTHER_KEY, counting_salt, far_east, fields, ticking

from chauffeur.concept import DataError
from chauffeur.safety.audit import AuditLog, Closing, head_path, heads, read_records, storage, verify, writer
from chauffeur.safety.audit.heads import read_head
from chauffeur.safety.audit.keys import key_name
from chauffeur.safety.audit.storage import LogFile, replace_whole, sync_directory
from chauffeur.safety.audit.texts import states
from chauffeur.safety.audit.writer import utc_now
from chauffeur.version import __version__

WAIT_S = 20.0
NO_ROOM = "there was no room left: the disk was too slow, or failed"
NEW_FILE = "Name another file."


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


def refusing(error: OSError) -> Callable[..., Any]:
    def refuse(*_: Any, **__: Any) -> Any:
        raise error

    return refuse


def said(error: BaseException) -> tuple[str, str]:
    """(message, hint) of an error."""
    return getattr(error, "message", str(error)), getattr(error, "hint", "")


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


def test_a_torn_end_is_cut_off_and_told(tmp_path: Path) -> None:
    torn = b'{"body":{"to the clinic'
    for before in (0, 1):
        path = tmp_path / f"log {before}"
        if before:
            AuditLog(path, about={}).close()
        with path.open("ab") as file:
            file.write(torn)
        AuditLog(path, about={}).close()
        told = bodies(path, "opened")[-1]
        assert (told["torn_bytes"], told["torn_sha256"]) == (len(torn), hashlib.sha256(torn).hexdigest())
        assert verify(path).ok
        assert verify(path).records == 2 + 2 * before


@pytest.mark.parametrize("content", [b'{"body":{', b'{"b'])
def test_the_beginning_of_a_first_line_is_a_log(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "log").write_bytes(content)
    AuditLog(tmp_path / "log", about={}).close()
    assert verify(tmp_path / "log").ok


def test_another_file_is_no_log(tmp_path: Path) -> None:
    path = tmp_path / "notes"
    for content in (b'{"body":[', b"no"):
        path.write_bytes(content)
        with pytest.raises(DataError) as caught:
            AuditLog(path, about={})
        assert said(caught.value) == (f"{path} is not an audit log.", NEW_FILE)
        assert path.read_bytes() == content
        LogFile(path).close()  # the lock was given back


def test_why_a_log_is_not_gone_on_with_is_said(tmp_path: Path) -> None:
    path = tmp_path / "log"
    AuditLog(path, about={}, key=KEY).close()
    with pytest.raises(DataError) as caught:
        AuditLog(path, about={})
    assert said(caught.value) == (
        f"The audit log {path} is written under a key, so it is not continued without it.",
        "Give the key file, or name another file.",
    )
    path.write_bytes(path.read_bytes().replace(b"false", b"true", 1))
    with pytest.raises(DataError) as caught:
        AuditLog(path, about={}, key=KEY)
    assert said(caught.value) == (
        f"The audit log {path} is not as it was written (line 1: record 0 (opened) was changed: its content does not "
        "give its hash.), so it is not continued.",
        f"Look at it with: chauffeur audit verify {path}; and name another file for this drive.",
    )


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
    disk.broken = OSError(errno.EIO, "broken")
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
        for error, why in ((OSError(errno.EIO, "broken"), "broken"), (OSError("no medium"), "no medium")):
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
    disk.broken = OSError(errno.EIO, "broken")
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
    disk.broken = OSError(errno.EIO, "broken")
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
    disk.broken = OSError(errno.EIO, "broken")
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
    disk.unsynced = OSError(errno.EIO, "broken")
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


def test_a_gap_is_told_though_nothing_comes_after_it(tmp_path: Path, disk: Disk) -> None:
    disk.hold()
    log = AuditLog(tmp_path / "log", about={}, capacity=1)
    assert disk.asked.wait(WAIT_S)
    assert not log.append("wish", {})
    disk.go.set()
    until(lambda: log.on_disk == 2)
    assert bodies(log.path, "gap") == [{"lost": {"wish": 1}, "why": NO_ROOM}]
    assert log.close().lost == 1


def test_what_comes_after_the_closing_is_counted(tmp_path: Path) -> None:
    log = AuditLog(tmp_path / "log", about={})
    assert log.close().complete
    assert [log.append("wish", {}) for _ in range(3)] == [False] * 3
    assert log.lost == log.close().lost == 3
    assert log.close().records == 2


@pytest.mark.parametrize(
    ("error", "why"), [(OSError(errno.EIO, "broken"), "broken"), (OSError("no medium"), "no medium")]
)
def test_why_a_head_was_not_left_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: OSError, why: str
) -> None:
    monkeypatch.setattr(heads, "replace_whole", refusing(error))
    closing = AuditLog(tmp_path / "log", about={}).close()
    assert closing.trouble == f"The head file could not be written: {why}."


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


@pytest.mark.parametrize(
    ("key", "private", "kept"),
    [(None, False, "stored"), (KEY, False, "stored"), (None, True, "withheld"), (KEY, True, "digest")],
)
def test_what_is_kept_of_a_text(tmp_path: Path, key: bytes | None, private: bool, kept: str) -> None:
    path = tmp_path / "log"
    with AuditLog(path, about={}, key=key, private=private) as log:
        log.append("wish", {}, {"wish": "to the clinic"})
    (wish,) = (record for _, record in read_records(path) if record.kind == "wish")
    assert [state.state for state in states(wish)] == [kept]
    assert (b"clinic" in path.read_bytes()) == (not private)


def test_what_could_not_be_written_is_told_under_the_key(tmp_path: Path) -> None:
    with AuditLog(tmp_path / "log", about={}, key=KEY) as log:
        log.append("plan", {"n": object()}, {"wish": "to the clinic"})
    assert verify(tmp_path / "log", key=KEY).ok
    assert bodies(tmp_path / "log", "plan") == [{"fault": "the record could not be written as JSON (TypeError)"}]
    assert b"clinic" not in (tmp_path / "log").read_bytes()


# The file ----------------------------------------------------------------------------------------------------------


def test_a_file_and_its_folders_are_made(tmp_path: Path) -> None:
    path = tmp_path / "a" / "b" / "log"
    file = LogFile(path)
    assert (file.is_regular, file.size) == (True, 0)
    file.append(b"one\n")
    assert file.size == 4
    file.close()
    file = LogFile(path)
    assert file.size == 4
    file.append(b"two\nthree\n")
    file.cut(8)
    assert file.size == 8
    file.append(b"four\n")
    file.close()
    assert path.read_bytes() == b"one\ntwo\nfour\n"


def test_why_a_file_cannot_be_had_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "log"
    file = LogFile(path)
    with pytest.raises(DataError) as caught:
        LogFile(path)
    assert said(caught.value) == (f"The audit log {path} is being written by somebody else.", NEW_FILE)
    file.close()
    for error, why in ((OSError(errno.EROFS, "only for reading"), "only for reading"), (OSError("no disk"), "no disk")):
        monkeypatch.setattr(storage.os, "open", refusing(error))
        with pytest.raises(DataError) as caught:
            LogFile(path)
        assert said(caught.value) == (f"The audit log {path} cannot be opened: {why}.", NEW_FILE)


def descriptors(path: Path) -> list[int]:
    """Descriptors of this process that are open on a file."""
    found: list[int] = []
    for entry in Path("/proc/self/fd").iterdir():
        try:
            if entry.samefile(path):
                found.append(int(entry.name))
        except OSError:
            continue
    return found


def test_no_descriptor_is_left_open(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "log"
    file = LogFile(path)
    with pytest.raises(DataError):
        LogFile(path)
    (descriptor,) = descriptors(path)
    assert not os.get_inheritable(descriptor)
    file.close()
    assert descriptors(path) == []
    sync_directory(tmp_path)
    assert descriptors(tmp_path) == []
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", refusing(OSError(errno.EIO, "broken")))
        with pytest.raises(OSError, match="broken"):
            sync_directory(tmp_path)
    assert descriptors(tmp_path) == []


def test_a_new_name_is_synced_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[Path] = []
    monkeypatch.setattr(storage, "sync_directory", synced.append)
    file = LogFile(tmp_path / "log")
    file.append(b"one\n")
    assert synced == []
    file.sync()
    file.sync()
    assert synced == [tmp_path]
    file.close()
    file = LogFile(tmp_path / "log")
    file.sync()
    file.close()
    assert synced == [tmp_path]


def writing_two_at_a_time(write: Callable[[int, memoryview], int], most: int = 1 << 60) -> Callable[..., int]:
    """A write that takes two bytes, and fails once there were so many calls."""
    calls = 0

    def writing(descriptor: int, data: memoryview) -> int:
        nonlocal calls
        calls += 1
        if calls > most:
            raise OSError(errno.ENOSPC, "full")
        return write(descriptor, data[:2])

    return writing


def test_a_write_that_takes_only_a_part_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = LogFile(tmp_path / "log")
    monkeypatch.setattr(os, "write", writing_two_at_a_time(os.write))
    file.append(b"three\n")
    file.append(b"four\n")
    file.close()
    assert (tmp_path / "log").read_bytes() == b"three\nfour\n"


def test_a_batch_that_failed_is_taken_off_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = LogFile(tmp_path / "log")
    file.append(b"one\n")
    with monkeypatch.context() as patch:
        patch.setattr(os, "write", writing_two_at_a_time(os.write, most=1))
        with pytest.raises(OSError, match="full"):
            file.append(b"two\n")
    assert (tmp_path / "log").read_bytes() == b"one\n"
    assert file.size == 4
    monkeypatch.setattr(os, "ftruncate", refusing(OSError(errno.EIO, "broken")))
    file.append(b"two\n")  # nothing is left of the one that failed, and so nothing is cut
    file.append(b"three\n")
    file.close()
    assert (tmp_path / "log").read_bytes() == b"one\ntwo\nthree\n"
    file = LogFile(tmp_path / "log")
    file.append(b"four\n")
    file.close()
    assert (tmp_path / "log").read_bytes() == b"one\ntwo\nthree\nfour\n"


def test_what_is_replaced_is_for_its_owner_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "head"
    path.write_text("a long content of before")
    path.chmod(0o644)
    synced: list[Path] = []
    monkeypatch.setattr(storage, "sync_directory", synced.append)
    replace_whole(path, b"new\n")
    assert path.read_bytes() == b"new\n"
    assert path.stat().st_mode & 0o777 == 0o600
    assert synced == [tmp_path]
    (tmp_path / f".head.{os.getpid()}.draft").write_text("left by a crash, and longer than what follows")
    replace_whole(path, b"newer\n")
    assert path.read_bytes() == b"newer\n"
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", refusing(OSError(errno.EIO, "broken")))
        with pytest.raises(OSError, match="broken"):
            replace_whole(path, b"newest\n")
    assert path.read_bytes() == b"newer\n"
    assert list(tmp_path.iterdir()) == [path]
