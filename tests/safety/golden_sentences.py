"""Compares what checks, findings and explanations say with `sentences.tsv`, where every sentence is pinned once.

After a wanted change of words: CHAUFFEUR_RECORD=1 python -m pytest tests/safety, and read the difference.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path

from chauffeur.concept import Verdict

GOLDEN = Path(__file__).with_name("sentences.tsv")
_ESCAPES = str.maketrans({"\n": "\\n", "\t": "\\t", "\\": "\\\\"})


def compare(group: str, said: Mapping[str, Iterable[object]]) -> None:
    """Hold what was said in each situation of a group against the golden file; record it where that is asked for."""
    found = [[one.translate(_ESCAPES) for one in (group, given, *map(str, row))] for given, row in said.items()]
    rows = [line.split("\t") for line in GOLDEN.read_text(encoding="utf-8").splitlines()]
    if os.environ.get("CHAUFFEUR_RECORD"):
        rows = sorted([row for row in rows if row[0] != group] + found, key=lambda row: row[0])
        GOLDEN.write_text("".join("\t".join(row) + "\n" for row in rows), encoding="utf-8")
    assert found == [row for row in rows if row[0] == group]


def outcome(verdict: Verdict) -> str:
    """How a check ended, in a word."""
    if verdict.not_compared is not None:
        return verdict.not_compared
    return "refused" if not verdict.passed else "fits" if verdict.proven else "not proven"


def row(verdict: Verdict) -> tuple[object, ...]:
    """A verdict as a row of the golden file."""
    line = "" if verdict.line is None else f"line {verdict.line}"
    return outcome(verdict), line, verdict.reason, verdict.remedy
