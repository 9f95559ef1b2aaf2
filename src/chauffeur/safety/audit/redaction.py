"""Erasing what a person said from a log: the words and their salts go, the chain and every earlier head still hold."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from chauffeur.concept import ConfigError, DataError, PersonId
from chauffeur.safety.audit.entries import AuditRecord, NotARecordError, canonical, parse, seal, stamp, torn_end
from chauffeur.safety.audit.heads import SEALED_SINCE, leave_head
from chauffeur.safety.audit.reader import lines, opened
from chauffeur.safety.audit.storage import LogFile, replace_whole
from chauffeur.safety.audit.texts import erased, says
from chauffeur.safety.audit.verification import verify
from chauffeur.safety.audit.writer import utc_now

PERSON = "person"
"""Name of the text that says whose texts a record holds."""


@dataclass(frozen=True, slots=True)
class Redaction:
    """Result of a redaction.

    Attributes:
        records: Records that held the person's texts.
        texts: Texts erased.
        head: Hash of the log's last record afterwards.
    """

    records: int
    texts: int
    head: str


def redact(
    path: Path, person: PersonId, *, key: bytes | None = None, clock: Callable[[], datetime] = utc_now
) -> Redaction:
    """Erase every text of a person from a log: their name, wishes, situations, plans and what quotes them.

    The file is replaced in one step, and a last record says how many texts of which records are gone, not whose. What
    remains are numbers: times, verdicts, commands. Copies, exports and old disk blocks are out of reach.

    Args:
        path: The log; nobody may be writing it.
        person: Whose texts; `NOBODY` for wishes without a name.
        key: The log's key, if it has one.
        clock: Present time, with a time zone.

    Raises:
        DataError: The log cannot be read or written, is being written, or was changed since it was written.
        ConfigError: The log has a key, and it was not given.
    """
    path = path.resolve()  # a link must not be replaced in the place of what it points to
    with opened(path):
        pass  # opening for writing would make it
    file = LogFile(path)
    try:
        return _redact(path, person, key, clock)
    except OSError as error:
        raise DataError(
            f"The audit log {path} cannot be written: {error.strerror or error}. Nothing was erased."
        ) from error
    finally:
        file.close()


def _redact(path: Path, person: PersonId, key: bytes | None, clock: Callable[[], datetime]) -> Redaction:
    found = verify(path, key=key)
    if not found.usable:
        raise DataError(
            f"The audit log {path} is not as it was written ({found.findings[0]}); nothing was erased.",
            hint=f"Look at it with: chauffeur audit verify {path}",
        )
    if found.key == "unchecked":
        raise ConfigError(f"The audit log {path} has a key, which erasing needs.", hint="Give it with --key FILE.")
    kept: list[bytes] = []
    numbers: list[int] = []
    texts = 0
    torn = b""
    with opened(path) as file:
        for line in lines(file):
            if not line.whole:  # it is the last one
                torn = line.content
                break
            record = _parse(path, line.content)
            if says(record, PERSON, person, key):
                numbers.append(record.seq)
                texts += len(record.texts)
                kept.append(canonical({**json.loads(line.content), "texts": erased(record)}) + b"\n")
            else:
                kept.append(line.content + b"\n")
    if not numbers:
        return Redaction(0, 0, found.head)
    body: dict[str, Any] = {"records": numbers, "redacted_texts": texts}
    if torn:
        # The rest of a cut-off write may hold words too, and nothing in the chain stands for it.
        body |= torn_end(torn)
    last, head = seal(found.records, found.head, "redaction", stamp(clock()), body, {}, key)
    kept.append(last)
    sealing = key if found.format >= SEALED_SINCE else None
    if sealing is not None:  # between the two files, a crash must leave a log that was not closed, and not a wrong head
        leave_head(path, found.head, found.records, key=sealing, closed=False)
    replace_whole(path, b"".join(kept))
    leave_head(path, head, found.records + 1, key=sealing, closed=found.end != "open")
    return Redaction(len(numbers), texts, head)


def _parse(path: Path, content: bytes) -> AuditRecord:
    try:
        return parse(content)
    except NotARecordError as error:  # verified a moment ago: somebody writes past the lock
        raise DataError(f"The audit log {path} changed while it was read; nothing was erased.") from error
