"""The file of a policy repository: JSON lines that may come from anybody, read and written with care."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Generator
from dataclasses import dataclass
from pathlib import Path

from chauffeur.concept import DataError
from chauffeur.memory.files import locked, open_plain
from chauffeur.memory.policies_entry import PolicyEntry, read_entry

FILE = "policies.jsonl"
_LOCK = ".lock"

MAX_FILE_BYTES = 32 << 20
MAX_LINE_BYTES = 128 << 10
MAX_ENTRIES = 2_000


@dataclass(frozen=True, slots=True)
class Rejected:
    """A line that is not believed.

    Attributes:
        line: Its number, from 1.
        reason: Why.
        raw: The line, so that rewriting the file does not lose it; empty where it is too long to keep.
    """

    line: int
    reason: str
    raw: bytes = b""


def read_policies(path: Path) -> tuple[tuple[PolicyEntry, ...], tuple[Rejected, ...]]:
    """Entries of a file of JSON lines that anybody may have written, and what in it is not believed.

    Raises:
        DataError: It is not a plain file, is missing, or is too large.
    """
    with as_data_error(path), os.fdopen(open_plain(path), "rb") as file:
        about = os.fstat(file.fileno())
        if about.st_size > MAX_FILE_BYTES:
            raise DataError(f"{path} has {about.st_size} bytes; {MAX_FILE_BYTES} are the most it may have.")
        content = file.read(MAX_FILE_BYTES + 1)
    entries: list[PolicyEntry] = []
    rejected: list[Rejected] = []
    names: set[str] = set()
    ids: set[str] = set()
    for number, line in enumerate(content.split(b"\n"), start=1):
        if not line.strip():
            continue
        read = read_line(line) if len(entries) < MAX_ENTRIES else f"There are {MAX_ENTRIES} programs before it."
        if isinstance(read, PolicyEntry) and (read.id in ids or read.callable_name in names):
            read = f"There is a program {read.callable_name} before it."
        if isinstance(read, str):
            rejected.append(Rejected(number, read, line if len(line) <= MAX_LINE_BYTES else b""))
            continue
        entries.append(read)
        ids.add(read.id)
        names.add(read.callable_name)
    return tuple(entries), tuple(rejected)


def read_line(line: bytes) -> PolicyEntry | str:
    """An entry, or why the line is not believed."""
    if len(line) > MAX_LINE_BYTES:
        return f"It has {len(line)} bytes; {MAX_LINE_BYTES} are the most a line may have."
    try:
        return read_entry(line)
    except DataError as error:
        return str(error)


def append_lines(path: Path, lines: bytes) -> None:
    """Add whole lines at the end of the file, through to the disk.

    Raises:
        DataError: The file cannot be written.
    """
    if not lines:
        return
    with as_data_error(path):
        # Never through a link: a repository from elsewhere could point at any file of this person's.
        descriptor = open_plain(path, os.O_RDWR | os.O_APPEND | os.O_CREAT)
        with os.fdopen(descriptor, "r+b", buffering=0) as file:
            end = file.seek(0, os.SEEK_END)
            if end:
                file.seek(end - 1)
                if file.read(1) != b"\n":  # a line cut off by a crash must not swallow the next one
                    lines = b"\n" + lines
            if file.write(lines) != len(lines):
                raise DataError(f"{path} could not be written to its end.", hint="Is the disk full?")
            os.fsync(file.fileno())


@contextlib.contextmanager
def writing(folder: Path, load: Callable[[], None]) -> Generator[None]:
    """Alone in a repository's folder, once what others added meanwhile is read."""
    with contextlib.ExitStack() as stack:
        with as_data_error(folder):
            stack.enter_context(locked(folder / _LOCK, alone=True))
        load()
        yield


@contextlib.contextmanager
def as_data_error(path: Path) -> Generator[None]:
    """The operating system's refusals, in our words."""
    try:
        yield
    except OSError as error:
        raise DataError(f"{path} cannot be used: {error.strerror or error}.", hint="Check path and rights.") from error
