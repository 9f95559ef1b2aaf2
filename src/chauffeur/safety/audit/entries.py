"""One line of an audit log: what it holds, its one written form, and the hash that ties it to the line before.

A line is a JSON object in canonical form: keys sorted, no spaces, ASCII only, numbers as Python writes them. Its `hash`
is the SHA-256 of the same object without `hash` and `texts`; `prev` is the hash of the line before. What a
person said, or what could quote them, stands in `texts`, outside the hash: the chained body holds a salted digest of
it only, so that it can be erased and the chain still holds (`texts.py`).
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Final, Literal, get_args

from chauffeur.safety.audit.findings import LineCode
from chauffeur.safety.audit.keys import is_sealed, sealed

FORMAT: Final = 2
"""Version of the log; a reader refuses newer ones. Lines are as in 1, whose key did not seal the head."""

Kind = Literal[
    "opened", "wish", "context", "plan", "verdict", "intervention", "actuation", "outcome", "gap", "redaction", "closed"
]  # fmt: skip
"""Kind of record. `gap`: records were lost here; `redaction`: personal texts of earlier records were erased."""

KINDS: Final[tuple[Kind, ...]] = get_args(Kind)

NO_RECORD: Final = "0" * 64
"""`prev` of the first record."""

LINE_START: Final = b'{"body":{'
"""First bytes of every line."""

MAX_LINE_BYTES: Final = 16 << 20
"""Nothing Chauffeur writes is nearly as long."""

_MOST_RECORDS = 1 << 63
_CORE = ("body", "kind", "prev", "seq", "time")
_KEYS = {*_CORE, "hash"}
_OPTIONAL_KEYS = {"mac", "texts"}
_MAC_PURPOSE = b"chauffeur-audit-record-1\0"


@dataclass(frozen=True, slots=True)
class AuditRecord:
    """A record as it stands in a log.

    Attributes:
        seq: Its number; the first is 0.
        time: When it was handed over, ISO 8601 UTC.
        kind: What it tells of.
        body: Its content, without anything a person said.
        prev: Hash of the record before.
        hash: Its own.
        texts: Personal texts beside the body, by name, as `texts.py` writes them.
        mac: HMAC-SHA256 of body, kind, prev, seq and time; empty in a log without a key.
    """

    seq: int
    time: str
    kind: Kind
    body: Mapping[str, Any]
    prev: str
    hash: str
    texts: Mapping[str, Mapping[str, Any]]
    mac: str = ""


class NotARecordError(ValueError):
    """A line that Chauffeur did not write; `code` says why."""

    def __init__(self, code: LineCode) -> None:
        super().__init__(code)
        self.code: LineCode = code


def canonical(value: Any) -> bytes:
    """Canonical JSON of a value. Raises TypeError or ValueError for a value that JSON cannot hold."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()


def storable(value: Any) -> Any:
    """A value with every key as text, and NaN and infinity, which JSON lacks, as text too."""
    if isinstance(value, float) and not math.isfinite(value):
        return json.dumps(value)  # NaN, Infinity or -Infinity
    if isinstance(value, Mapping):
        mapping: Mapping[Any, Any] = value
        return {str(key): storable(item) for key, item in mapping.items()}
    if isinstance(value, list | tuple):
        items: Iterable[Any] = value
        return list(map(storable, items))
    return value


def seal(
    seq: int,
    prev: str,
    kind: Kind,
    time: str,
    body: Mapping[str, Any],
    texts: Mapping[str, Mapping[str, Any]],
    key: bytes | None,
) -> tuple[bytes, str]:
    """A record's line, with its line end, and its hash.

    Raises:
        TypeError, ValueError: The body holds something that is not a JSON value.
    """
    line: dict[str, Any] = {"body": storable(body), "kind": kind, "prev": prev, "seq": seq, "time": time}
    if key is not None:
        line["mac"] = sealed(key, _MAC_PURPOSE, canonical(line))
    digest = line["hash"] = hashlib.sha256(canonical(line)).hexdigest()
    if texts:
        line["texts"] = texts
    return canonical(line) + b"\n", digest


def parse(line: bytes) -> AuditRecord:
    """The record of a line without its line end; whether its hash is right is not looked at.

    Raises:
        NotARecordError: It is not one, or not in canonical form.
    """
    try:
        value = json.loads(line)
    except (ValueError, RecursionError) as error:
        raise NotARecordError("not_json") from error
    if not isinstance(value, dict):
        raise NotARecordError("not_json")
    fields: dict[str, Any] = value
    keys = set(fields)
    if not _KEYS <= keys <= _KEYS | _OPTIONAL_KEYS:
        raise NotARecordError("not_fields")
    try:
        same = canonical(fields) == line
    except (ValueError, RecursionError):
        same = False
    if not same:
        raise NotARecordError("not_canonical")
    texts: dict[str, Any] | None = fields.setdefault("texts", {})
    fields.setdefault("mac", "")
    if not (
        type(fields["seq"]) is int
        and 0 <= fields["seq"] < _MOST_RECORDS
        and fields["kind"] in KINDS
        and isinstance(fields["body"], dict)
        and isinstance(texts, dict)
        and all(isinstance(text, dict) for text in texts.values())
        and all(isinstance(fields[name], str) for name in ("time", "prev", "hash", "mac"))
    ):
        raise NotARecordError("not_typed")
    return AuditRecord(**fields)


def content_hash(record: AuditRecord) -> str:
    """The hash that a record's content gives."""
    fields = _core(record)
    if record.mac:
        fields["mac"] = record.mac
    return hashlib.sha256(canonical(fields)).hexdigest()


def is_sealed_with(record: AuditRecord, key: bytes) -> bool:
    """True if a record was written under this key."""
    return is_sealed(record.mac, key, _MAC_PURPOSE, canonical(_core(record)))


def stamp(moment: datetime) -> str:
    """A time as records state it: UTC, to the millisecond."""
    return moment.astimezone(UTC).isoformat(timespec="milliseconds")


def torn_end(content: bytes) -> dict[str, Any]:
    """Fields of a record that account for a cut-off write removed from the end of a log."""
    return {"torn_bytes": len(content), "torn_sha256": hashlib.sha256(content).hexdigest()}


def _core(record: AuditRecord) -> dict[str, Any]:
    return {name: getattr(record, name) for name in _CORE}
