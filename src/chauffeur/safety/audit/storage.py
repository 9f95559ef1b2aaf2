"""The file behind an audit log: one writer at a time, and a batch is in it whole or not at all."""

from __future__ import annotations

import contextlib
import fcntl
import os
import stat
from pathlib import Path
from typing import Final

from chauffeur.concept import DataError

PRIVATE_FILE: Final = 0o600


class LogFile:
    """A log open for appending, with a lock that no second writer gets.

    A regular file is cut back to its last whole batch when a write fails half-way. A pipe or a device takes the records
    as they come: nothing can be cut back or synced there.
    """

    def __init__(self, path: Path) -> None:
        """Open a log, making it and its folder if need be.

        Raises:
            DataError: It cannot be opened, or somebody else is writing it.
        """
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._descriptor = _open_locked(path)
        except BlockingIOError as error:
            raise DataError(
                f"The audit log {path} is being written by somebody else.", hint="Name another file."
            ) from error
        except OSError as error:
            raise DataError(
                f"The audit log {path} cannot be opened: {error.strerror or error}.", hint="Name another file."
            ) from error
        self.is_regular: Final = stat.S_ISREG(os.fstat(self._descriptor).st_mode)
        self._end = os.fstat(self._descriptor).st_size if self.is_regular else 0
        self._dirty = False
        self._new_in: Path | None = None if self._end else path.parent

    @property
    def size(self) -> int:
        """Bytes in it that were written whole."""
        return self._end

    def cut(self, size: int) -> None:
        """Take everything behind `size` off. Raises OSError."""
        os.ftruncate(self._descriptor, size)
        self._end = size

    def append(self, data: bytes) -> None:
        """Write a batch. Raises OSError, and what a failed write left behind is gone, at the latest before the next."""
        if self._dirty:
            self._clean()
        self._dirty = True
        try:
            rest = memoryview(data)
            while rest:
                rest = rest[os.write(self._descriptor, rest) :]
        except OSError:
            with contextlib.suppress(OSError):
                self._clean()
            raise
        self._dirty = False
        self._end += len(data)

    def sync(self) -> None:
        """Make what is written survive a power cut. Raises OSError."""
        if not self.is_regular:
            return
        os.fsync(self._descriptor)
        if self._new_in is not None:
            sync_directory(self._new_in)
            self._new_in = None

    def close(self) -> None:
        """Give the file and the lock back."""
        os.close(self._descriptor)

    def _clean(self) -> None:
        if self.is_regular:
            os.ftruncate(self._descriptor, self._end)
        self._dirty = False


def sync_directory(path: Path) -> None:
    """Make new names in a directory survive a power cut. Raises OSError."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def replace_whole(path: Path, content: bytes) -> None:
    """Put content at a path in one step, for its owner alone. Raises OSError; the old content then stands."""
    draft = path.with_name(f".{path.name}.{os.getpid()}.draft")
    try:
        descriptor = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, PRIVATE_FILE)
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        draft.replace(path)
    except OSError:
        with contextlib.suppress(OSError):
            draft.unlink()
        raise
    sync_directory(path.parent)


def _open_locked(path: Path) -> int:
    """The descriptor, locked; once more if the file was replaced between opening and locking."""
    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_APPEND | os.O_CREAT, PRIVATE_FILE)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if os.path.samestat(os.fstat(descriptor), path.stat()):
                return descriptor
        except OSError:
            os.close(descriptor)
            raise
        os.close(descriptor)
