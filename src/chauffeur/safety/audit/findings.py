"""Findings in audit logs: a code for each kind, and its sentence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Literal, get_args

LineCode = Literal["not_json", "not_fields", "not_canonical", "not_typed"]
"""Reasons for which a line is no record."""

TextCode = Literal["text_added", "text_removed", "text_changed"]
"""Tampering with a personal text."""

Code = (
    LineCode
    | TextCode
    | Literal[
        "changed", "begin_missing", "missing", "out_of_place", "exchanged", "erased_unsaid", "empty", "head_absent",
        "no_key", "other_key", "seal_missing", "seal_added", "seal_wrong",
        "headfile_missing", "headfile_unsealed", "headfile_other", "end_cut", "end_open",
    ]
)  # fmt: skip

TEXT_CODES: Final[tuple[TextCode, ...]] = get_args(TextCode)

SENTENCES: Final[Mapping[Code, str]] = {
    "not_json": "it is not a record in JSON.",
    "not_fields": "it has not the fields of a record.",
    "not_canonical": "it is not written the way Chauffeur writes a record.",
    "not_typed": "its fields are not of the kinds a record has.",
    "text_added": "{record}: its text {name!r} was added.",
    "text_removed": "{record}: its text {name!r} was removed.",
    "text_changed": "{record}: its text {name!r} was changed.",
    "changed": "{record} was changed: its content does not give its hash.",
    "begin_missing": "the log begins with {record}: its beginning was removed.",
    "missing": "{record} stands here; what belongs before it, from record {expected} on, does not.",
    "out_of_place": "{record} stands here, where record {expected} belongs.",
    "exchanged": "{record} was not written after the record before it: one of them was exchanged or changed.",
    "erased_unsaid": "a personal text of record {seq} was erased, and no redaction record says so.",
    "empty": "the log holds no record.",
    "head_absent": "no record with the head {head} is in the log: its end was cut off, or it was written anew.",
    "no_key": "the log was written without a key, and a key was given.",
    "other_key": "the log was written under the key {name}, and the key given is {given}.",
    "seal_missing": "{record} lacks a seal of the key.",
    "seal_added": "{record} has a seal of the key.",
    "seal_wrong": "{record} was not written with this key.",
    "headfile_missing": "the head file {name} is missing: whether the end of the log is cannot be told.",
    "headfile_unsealed": "the head file {name} was not written with this key.",
    "headfile_other": (
        "the head file {name} is not this log's last: it counts {counted} records, and {found} are there, or the last "
        "one is another."
    ),
    "end_cut": "the end was cut off: the head counts {counted} records, and {found} are there.",
    "end_open": "the log was not closed, or is being written: behind record {counted} its end may have been cut off.",
}


@dataclass(frozen=True, slots=True)
class AuditFinding:
    """Something that is not as it was written.

    Attributes:
        line: Line of the file, 1-based; None where it is about the log as a whole.
        code: What it is.
        details: What its sentence names.
    """

    line: int | None
    code: Code
    details: Mapping[str, object] = field(default_factory=dict[str, object])

    def __str__(self) -> str:
        said = SENTENCES[self.code].format_map(dict(self.details))
        return said if self.line is None else f"line {self.line}: {said}"
