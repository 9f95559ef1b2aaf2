"""The file behind an audit log: a batch is in it whole or not at all, and nothing of it is left open or unsynced."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable
from pathlib import Path

import pytest
from audit_logs import BROKEN, refusing

from chauffeur.concept import DataError
from chauffeur.safety.audit import storage
from chauffeur.safety.audit.storage import LogFile, replace_whole, sync_directory


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
        patch.setattr(os, "fsync", refusing(BROKEN))
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
    monkeypatch.setattr(os, "ftruncate", refusing(BROKEN))
    file.append(b"two\n")  # nothing is left of the one that failed, and so nothing is cut
    file.append(b"three\n")
    file.close()
    assert (tmp_path / "log").read_bytes() == b"one\ntwo\nthree\n"
    file = LogFile(tmp_path / "log")
    file.append(b"four\n")
    file.close()
    assert (tmp_path / "log").read_bytes() == b"one\ntwo\nthree\nfour\n"


def test_half_a_batch_is_gone_before_the_next_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also when taking it off failed at first."""
    file = LogFile(tmp_path / "log")
    file.append(b"one\n")
    written = os.write
    monkeypatch.setattr(os, "write", lambda fd, data: written(fd, data[:3]) if len(data) > 3 else refusing(BROKEN)())
    with monkeypatch.context() as patch:
        patch.setattr(os, "ftruncate", refusing(BROKEN))
        with pytest.raises(OSError, match="broken"):
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
        patch.setattr(os, "write", refusing(OSError(errno.EPIPE, "gone")))
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
        patch.setattr(os, "fsync", refusing(BROKEN))
        with pytest.raises(OSError, match="broken"):
            replace_whole(path, b"newest\n")
    assert path.read_bytes() == b"newer\n"
    assert list(tmp_path.iterdir()) == [path]
