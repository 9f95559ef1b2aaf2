"""Reading a log line by line, whatever its length."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from chauffeur.concept import DataError
from chauffeur.safety.audit.entries import MAX_LINE_BYTES, AuditRecord, NotARecordError, parse


@dataclass(frozen=True, slots=True)
class AuditLine:
    """One line of a file.

    Attributes:
        number: 1-based.
        content: Its bytes without the line end.
        whole: Whether the line end is there; what follows the last line end is the rest of a write cut short.
    """

    number: int
    content: bytes
    whole: bool


@contextmanager
def opened(path: Path) -> Generator[BinaryIO]:
    """A log open for reading. Raises DataError where there is none, or it cannot be read."""
    try:
        with path.open("rb") as file:
            yield file
    except FileNotFoundError as error:
        raise DataError(
            f"There is no audit log at {path}.", hint="Write one with `chauffeur drive ... --audit FILE`."
        ) from error
    except OSError as error:
        raise DataError(f"The audit log {path} cannot be read: {error.strerror or error}.") from error


def lines(file: BinaryIO) -> Iterator[AuditLine]:
    """The lines of a log. A line that is too long for a record comes in pieces, none of which is one."""
    number = 0
    while content := file.readline(MAX_LINE_BYTES):
        number += 1
        whole = content.endswith(b"\n")
        yield AuditLine(number, content[:-1] if whole else content, whole or len(content) == MAX_LINE_BYTES)


def read_records(path: Path) -> Iterator[tuple[int, AuditRecord]]:
    """Every record of a log with its line number; lines that are none are passed over, for `verify` names them.

    Raises:
        DataError: The file cannot be read.
    """
    with opened(path) as file:
        for line in lines(file):
            try:
                record = parse(line.content) if line.whole else None
            except NotARecordError:
                continue
            if record is not None:
                yield line.number, record
