"""Where memory lives, and writing small files so that a crash leaves the old one or the new one, never half of one."""

from __future__ import annotations

import fcntl
import os
import secrets
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

PRIVATE_FILE, PRIVATE_DIRECTORY = 0o600, 0o700


def data_home() -> Path:
    """Chauffeur's data directory: CHAUFFEUR_HOME, or the user's own data directory."""
    if home := os.environ.get("CHAUFFEUR_HOME"):
        return Path(home).expanduser()
    if shared := os.environ.get("XDG_DATA_HOME"):
        return Path(shared) / "chauffeur"
    return Path.home() / ".local" / "share" / "chauffeur"


def private_directory(path: Path) -> Path:
    """Make a directory only its owner may enter."""
    path.mkdir(mode=PRIVATE_DIRECTORY, parents=True, exist_ok=True)
    return path


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
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, PRIVATE_FILE)
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
