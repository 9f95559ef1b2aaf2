"""Verification of audit logs: every line is checked, and every finding has a code.

The chain shows any change, removal, insertion or swap of lines that were written before the last one. It cannot show
that lines are missing at the end, nor that the whole log was written anew. A log under a key shows both: every record
and the head beside the log are sealed. For a log without one, keep the hash of the last record elsewhere (`head`).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, BinaryIO, Final, Literal

from chauffeur.concept import DataError
from chauffeur.safety.audit.entries import (
    FORMAT,
    NO_RECORD,
    AuditRecord,
    NotARecordError,
    content_hash,
    is_sealed_with,
    parse,
)
from chauffeur.safety.audit.findings import TEXT_CODES, AuditFinding, Code
from chauffeur.safety.audit.heads import SEALED_SINCE, Head, as_hash, head_path, read_head
from chauffeur.safety.audit.keys import key_name
from chauffeur.safety.audit.reader import AuditLine, lines, opened
from chauffeur.safety.audit.texts import states

MAX_FINDINGS: Final = 100
"""Findings kept; the others are counted."""


@dataclass(frozen=True, slots=True)
class AuditVerification:
    """Result of verifying a log.

    Attributes:
        findings: What is wrong, in the order of the file; at most `MAX_FINDINGS`.
        more_findings: How many more there are.
        records: Records read.
        kinds: How many of each kind.
        head: Hash of the last record.
        torn_bytes: Bytes after the last whole line: a write that was cut off, e.g. by a crash, or is going on now.
        redacted: Personal texts erased since.
        withheld: Personal texts of which at most a digest was ever written (privacy mode).
        lost: Records that could not be written in time; the log itself says so.
        closed: Whether the log was closed, and not cut off.
        key: `none` (the log has no key), `unchecked` (it has, none was given) or `checked`.
        after_head: Records behind the one that the given head names; None when no head was given.
        format: What the log says of its own layout; 0 when it says nothing.
        unclosed: How often the log was gone on with although it had not been closed: after a crash, or an end cut off.
        end: Whether nothing is missing at the end: `unknown` (no key, none given, or a log of before such heads),
            `whole` (the head sealed with the key says so, or the head given is the last record), `open` (it was not
            closed, or is being written: what came behind the head may be missing), or `doubtful` (a head that is
            missing, of another key, or says otherwise).
    """

    findings: tuple[AuditFinding, ...]
    more_findings: int
    records: int
    kinds: Mapping[str, int]
    head: str
    torn_bytes: int
    redacted: int
    withheld: int
    lost: int
    closed: bool
    key: Literal["none", "unchecked", "checked"]
    after_head: int | None
    format: int = 0
    unclosed: int = 0
    end: Literal["unknown", "whole", "open", "doubtful"] = "unknown"

    @property
    def ok(self) -> bool:
        """True if nothing is wrong. A torn end is no finding: what was never whole was never acknowledged."""
        return not self.findings

    @property
    def usable(self) -> bool:
        """True if the log may be continued: nothing is wrong, but that it may not have been closed."""
        return not self.findings or (self.end == "open" and len(self.findings) == 1)


def verify(path: Path, *, head: str | None = None, key: bytes | None = None) -> AuditVerification:
    """Look at every record of a log, and under a key at the head beside it, too.

    Args:
        path: The log.
        head: Hash of a record that must be in it, as printed when the log was closed; by default the one in the head
            file beside the log, if there is one.
        key: The log's key.

    Raises:
        DataError: The file cannot be read, is not an audit log, or is of a newer format.
        ConfigError: The head is not a hash.
    """
    given = None if head is None else as_hash(head, "The head given")
    beside = read_head(path) if given is None or key is not None else None
    # A log that was being opened for the first time had no record yet that could be found in it.
    named = beside.hash if beside is not None and beside.records != 0 else None
    anchor = given or named
    with opened(path) as file:
        found = verify_stream(file, str(path), head=anchor, key=key)
    if key is None or found.key != "checked" or found.format < SEALED_SINCE:
        return found
    if given is not None and found.after_head == 0:
        return replace(found, end="whole")
    end, code = _look_at_end(found, beside, key)
    if code is None:
        return replace(found, end=end)
    counted = None if beside is None else beside.records
    details = {"name": head_path(path).name, "counted": counted, "found": found.records}
    return replace(found, end=end, findings=(*found.findings, AuditFinding(None, code, details)))


def _look_at_end(
    found: AuditVerification, head: Head | None, key: bytes
) -> tuple[Literal["whole", "open", "doubtful"], Code | None]:
    """State of the end of a log under a key by the head beside it, and the finding; None for none."""
    if head is None:
        return "doubtful", "headfile_missing"
    if not head.is_sealed_with(key):
        return "doubtful", "headfile_unsealed"
    assert head.records is not None  # what is sealed has a number
    if head.records > found.records:
        return "doubtful", "end_cut"
    if not head.closed:
        return "open", "end_open"
    if head.records < found.records or head.hash != found.head:
        return "doubtful", "headfile_other"
    return "whole", None


def verify_stream(file: BinaryIO, name: str, *, head: str | None = None, key: bytes | None = None) -> AuditVerification:
    """As `verify`, of an open file; `name` is what errors call it."""
    examination = _Examination(name, head, key)
    for line in lines(file):
        examination.look_at(line)
    return examination.result()


@dataclass(slots=True)
class _Examination:
    name: str
    anchor: str | None
    key: bytes | None
    findings: list[AuditFinding] = field(default_factory=list[AuditFinding])
    found: int = 0
    kinds: Counter[str] = field(default_factory=Counter[str])
    last: AuditRecord | None = None
    keyed: bool = False
    foreign_key: bool = False
    """True if the log names another key than the one given; its seals are then not looked at one by one."""
    closed: bool = False
    format: int = 0
    unclosed: int = 0
    torn_bytes: int = 0
    lost: int = 0
    withheld: int = 0
    anchor_at: int | None = None
    erased: dict[int, tuple[int, int]] = field(default_factory=dict[int, tuple[int, int]])
    """Sequence number -> (line, erased texts) of records with erased texts."""
    announced: set[int] = field(default_factory=set[int])
    """Sequence numbers of the records that a redaction record names."""
    follows_a_gap: bool = False
    """True if the line before could not be read, so that the next one cannot be tied to it."""

    def look_at(self, line: AuditLine) -> None:
        if not line.whole:
            self.torn_bytes = len(line.content)  # it is the last one
            return
        try:
            record = parse(line.content)
        except NotARecordError as error:
            self._say(line.number, error.code)
            self.follows_a_gap = True
            return
        before = self.found
        if self.last is None:
            self._begin(line.number, record)
        self._check_place(line.number, record)
        if content_hash(record) != record.hash:
            self._say_of(line.number, record, "changed")
        self._check_texts(line.number, record)
        self._check_key(line.number, record)
        self._take_note(record, sound=self.found == before)
        self.last, self.follows_a_gap = record, False

    def result(self) -> AuditVerification:
        total = sum(self.kinds.values())
        if not total:
            if self.findings:
                raise DataError(
                    f"{self.name} is not an audit log: none of its lines is a record.",
                    hint="Write one with `chauffeur drive ... --audit FILE`.",
                )
            self._say(None, "empty")
        for seq, (line, _) in self.erased.items():
            if seq not in self.announced:
                self._say(line, "erased_unsaid", seq=seq)
        if self.anchor is not None and self.anchor_at is None:
            self._say(None, "head_absent", head=self.anchor)
        return AuditVerification(
            findings=tuple(self.findings),
            more_findings=self.found - len(self.findings),
            records=total,
            kinds=dict(self.kinds),
            head=NO_RECORD if self.last is None else self.last.hash,
            torn_bytes=self.torn_bytes,
            redacted=sum(texts for _, texts in self.erased.values()),
            withheld=self.withheld,
            lost=self.lost,
            closed=self.closed and not self.torn_bytes,
            key="none" if not self.keyed else "unchecked" if self.key is None else "checked",
            after_head=None if self.anchor_at is None else total - self.anchor_at,
            format=self.format,
            unclosed=self.unclosed,
        )

    def _begin(self, line: int, record: AuditRecord) -> None:
        version = record.body.get("format")
        sound = content_hash(record) == record.hash
        if sound and record.kind == "opened" and isinstance(version, int) and version > FORMAT:
            raise DataError(
                f"{self.name} has audit format {version}; this Chauffeur reads up to {FORMAT}.",
                hint="Upgrade: pip install -U chauffeur",
            )
        if record.kind == "opened" and type(version) is int:
            self.format = version
        name = record.body.get("key") if record.kind == "opened" else record.mac
        self.keyed = bool(name)
        if self.key is None:
            return
        if not self.keyed:
            self._say(line, "no_key")
        elif record.kind == "opened" and name != key_name(self.key):
            self.foreign_key = True
            self._say(line, "other_key", name=name, given=key_name(self.key))

    def _check_place(self, line: int, record: AuditRecord) -> None:
        if self.last is None:
            if not self.follows_a_gap and (record.seq != 0 or record.prev != NO_RECORD or record.kind != "opened"):
                self._say_of(line, record, "begin_missing")
            return
        if self.follows_a_gap:
            return
        expected = self.last.seq + 1
        if record.seq != expected:
            self._say_of(line, record, "missing" if record.seq > expected else "out_of_place", expected=expected)
        elif record.prev != self.last.hash:
            self._say_of(line, record, "exchanged")

    def _check_texts(self, line: int, record: AuditRecord) -> None:
        gone = 0
        for state in states(record):
            if state.state in TEXT_CODES:
                self._say_of(line, record, state.state, name=state.name)
            gone += state.state == "redacted"
            self.withheld += state.state in ("withheld", "digest")
        if gone:
            self.erased[record.seq] = (line, gone)

    def _check_key(self, line: int, record: AuditRecord) -> None:
        if bool(record.mac) != self.keyed:
            self._say_of(line, record, "seal_missing" if self.keyed else "seal_added")
        elif self.keyed and self.key is not None and not self.foreign_key and not is_sealed_with(record, self.key):
            self._say_of(line, record, "seal_wrong")

    def _take_note(self, record: AuditRecord, *, sound: bool) -> None:
        if record.kind == "opened" and self.kinds and not self.closed:
            self.unclosed += 1
        self.kinds[record.kind] += 1
        if record.kind != "redaction":
            self.closed = record.kind == "closed"
        if sound and record.hash == self.anchor:
            self.anchor_at = sum(self.kinds.values())
        if record.kind == "gap":
            lost: dict[str, Any] | None = record.body.get("lost")  # or anything, in a log written anew
            counts = lost.values() if isinstance(lost, dict) else ()
            self.lost += sum(count for count in counts if isinstance(count, int))
        if record.kind == "redaction":
            named: list[Any] | None = record.body.get("records")
            listed = named if isinstance(named, list) else ()
            self.announced.update(seq for seq in listed if isinstance(seq, int))

    def _say_of(self, line: int, record: AuditRecord, code: Code, **details: object) -> None:
        self._say(line, code, record=f"record {record.seq} ({record.kind})", **details)

    def _say(self, line: int | None, code: Code, **details: object) -> None:
        self.found += 1
        if self.found <= MAX_FINDINGS:
            self.findings.append(AuditFinding(line, code, details))
