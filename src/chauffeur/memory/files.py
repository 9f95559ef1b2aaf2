"""Where memory lives, and writing small files so that a crash leaves the old one or the new one, never half of one."""

from __future__ import annotations

import errno
import fcntl
import os
import secrets
import stat
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

PRIVATE_FILE, PRIVATE_DIRECTORY = 0o600, 0o700


def private_directory(path: Path) -> Path:
    """Make a directory only its owner may enter."""
    path.mkdir(mode=PRIVATE_DIRECTORY, parents=True, exist_ok=True)
    return path


class NotPlainFileError(OSError):
    """Something else stands where a plain file belongs: a link, a pipe, a device, a folder."""


def open_plain(path: Path, flags: int = os.O_RDONLY) -> int:
    """Descriptor of a plain file: never through a link, which could lead to any other file, nor of a pipe, which waits.

    Raises:
        NotPlainFileError: Something else stands there.
        OSError: It cannot be opened.
    """
    try:
        descriptor = os.open(path, flags | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK, PRIVATE_FILE)
    except OSError as error:
        # A link, a folder opened for writing, a pipe or a socket that nobody reads.
        if error.errno in (errno.ELOOP, errno.EISDIR, errno.ENXIO):
            raise _not_plain(path) from error
        raise
    # Opened first, asked afterwards: what is at the path cannot change in between.
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise _not_plain(path)
    return descriptor


def read_plain(path: Path) -> bytes:
    """Content of a plain file. Raises as `open_plain`."""
    with os.fdopen(open_plain(path), "rb") as file:
        return file.read()


def require_plain(path: Path) -> None:
    """See that a plain file stands at a path, or nothing, without opening it; raises NotPlainFileError.

    For files that a database opens by itself: to close a descriptor of one gives all of its locks back.
    """
    try:
        mode = path.lstat().st_mode
    except FileNotFoundError:
        return
    if not stat.S_ISREG(mode):
        raise _not_plain(path)


def _not_plain(path: Path) -> NotPlainFileError:
    return NotPlainFileError(errno.EINVAL, "it is a link, a pipe or a folder and not a plain file", str(path))


def write_new(path: Path, content: bytes) -> None:
    """Write a file unless there is one already; of two processes that try at once, one wins, in silence."""
    if path.exists():
        return
    draft = _draft(path, content)
    try:
        path.hardlink_to(draft)
    except FileExistsError:
        pass
    finally:
        draft.unlink()
    sync_directory(path.parent)


def publish(path: Path, content: bytes) -> None:
    """Replace a file as a whole."""
    _draft(path, content).replace(path)
    sync_directory(path.parent)


def sync_directory(path: Path) -> None:
    """Make renames in a directory survive a power cut."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


@contextmanager
def locked(path: Path, *, alone: bool) -> Generator[None]:
    """Hold a lock between processes: many at a time, or `alone`."""
    descriptor = open_plain(path, os.O_RDWR | os.O_CREAT)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX if alone else fcntl.LOCK_SH)
        yield
    finally:
        os.close(descriptor)


def _draft(path: Path, content: bytes) -> Path:
    draft = path.with_name(f"{path.name}.{secrets.token_hex(8)}.draft")
    descriptor = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL, PRIVATE_FILE)
    with os.fdopen(descriptor, "wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    return draft
