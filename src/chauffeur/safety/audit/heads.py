"""The head of a log: the hash of its last record, in a small file beside it, by which a cut-off end is found.

Of a log under a key, the head says how many records there are and whether the log was closed, under the key as well:
whoever has not the key can neither cut the end off and put the head right, nor pass a closed log off as one that a
crash cut short. What it cannot show is that log and head were both put back to what they were at an earlier moment: for
that, keep heads elsewhere, too.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from chauffeur.concept import ConfigError, DataError
from chauffeur.safety.audit.entries import canonical
from chauffeur.safety.audit.keys import is_sealed, sealed
from chauffeur.safety.audit.storage import replace_whole

HASH_CHARACTERS: Final = 64

SEALED_SINCE: Final = 2
"""Format of the first logs whose key seals the head."""

_KINDS: Final[dict[str, type]] = {"closed": bool, "hash": str, "mac": str, "records": int}
_MAC_PURPOSE = b"chauffeur-audit-head-1\0"


@dataclass(frozen=True, slots=True)
class Head:
    """Content of the head file beside a log.

    Attributes:
        hash: Hash of the last record when it was written.
        records: How many there were then; None in a log without a key, which says no more than the hash.
        closed: Whether the log was closed then; if not, it was being opened.
        mac: HMAC-SHA256 of the others; empty in a log without a key.
    """

    hash: str
    records: int | None = None
    closed: bool = True
    mac: str = ""

    def is_sealed_with(self, key: bytes) -> bool:
        """True if it was written under this key."""
        return self.records is not None and is_sealed(self.mac, key, _MAC_PURPOSE, canonical(_fields(self)))


def head_path(path: Path) -> Path:
    """Path of the head file of a log."""
    return path.with_name(f"{path.name}.head")


def leave_head(path: Path, last: str, records: int, *, key: bytes | None, closed: bool = True) -> None:
    """Put the head beside a log, in one step. Raises OSError; the old one then stands."""
    if key is None:
        content = f"{last}\n".encode()
    else:
        head = Head(last, records, closed)
        mac = sealed(key, _MAC_PURPOSE, canonical(_fields(head)))
        content = canonical({**_fields(head), "mac": mac}) + b"\n"
    replace_whole(head_path(path), content)


def read_head(path: Path) -> Head | None:
    """Read the head file beside a log; None if there is none.

    Raises:
        DataError: It is there and cannot be used.
        ConfigError: It holds neither a hash nor what stands beside a log under a key.
    """
    beside = head_path(path)
    try:
        text = beside.read_text(encoding="ascii").strip()
    except FileNotFoundError:
        return None
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"The head file {beside} cannot be read: {error}.", hint="Remove it, or restore it.") from error
    if not text.startswith("{"):
        return Head(as_hash(text, f"The head in {beside}"))
    try:
        fields: Any = json.loads(text)
    except (ValueError, RecursionError):
        fields = None
    if not isinstance(fields, dict) or {name: type(value) for name, value in fields.items()} != _KINDS:
        raise DataError(f"The head file {beside} is damaged.", hint="Remove it, or restore it.")
    as_hash(fields["hash"], f"The head in {beside}")
    return Head(**fields)


def as_hash(text: str, where: str) -> str:
    """The text, if it is a hash. Raises ConfigError: it is none."""
    if len(text) != HASH_CHARACTERS or set(text) - set("0123456789abcdef"):
        raise ConfigError(
            f"{where} is not a hash of {HASH_CHARACTERS} hexadecimal digits.",
            hint="Give the hash that was printed when the log was closed.",
        )
    return text


def _fields(head: Head) -> dict[str, Any]:
    return {"closed": head.closed, "hash": head.hash, "records": head.records}
