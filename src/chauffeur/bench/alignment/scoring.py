"""How well the judge tells aligned cases from mismatched ones."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from chauffeur.bench.alignment.cases import ALIGNED, KINDS, Case
from chauffeur.safety.alignment import Alignment, judge, read_facts

JUDGE = "alignment-v1"
"""Id of the judge that the figures belong to."""


@dataclass(frozen=True, slots=True)
class Judged:
    """A case and what the judge made of it."""

    case: Case
    alignment: Alignment

    @property
    def right(self) -> bool:
        """Whether the judge is right."""
        return self.alignment.aligned == self.case.aligned


@dataclass(frozen=True, slots=True)
class Score:
    """Figures of one set. A mismatch is what is looked for.

    Attributes:
        found: Mismatched cases called mismatched.
        missed: Mismatched cases called aligned.
        alarms: Aligned cases called mismatched.
        passed: Aligned cases called aligned.
    """

    found: int
    missed: int
    alarms: int
    passed: int

    @property
    def precision(self) -> float:
        """Share of the cases called mismatched that are; 0 where none is called so."""
        return _share(self.found, self.found + self.alarms)

    @property
    def recall(self) -> float:
        """Share of the mismatched cases that are called so."""
        return _share(self.found, self.found + self.missed)

    @property
    def f1(self) -> float:
        """Harmonic mean of precision and recall."""
        return _share(2 * self.found, 2 * self.found + self.alarms + self.missed)

    @property
    def false_alarms(self) -> float:
        """Share of the aligned cases that are called mismatched."""
        return _share(self.alarms, self.alarms + self.passed)


def judge_cases(cases: Iterable[Case], watch: Callable[[int], None] | None = None) -> tuple[Judged, ...]:
    """Judge cases by reading alone.

    Args:
        cases: What is judged.
        watch: Told how many are done.
    """
    judged: list[Judged] = []
    for case in cases:
        judged.append(Judged(case, judge(case.thoughts, read_facts(case.program), case.where)))
        if watch is not None:
            watch(len(judged))
    return tuple(judged)


def score(judged: Sequence[Judged]) -> Score:
    """Figures of a set."""
    called = [(one.case.aligned, one.alignment.aligned) for one in judged]
    return Score(
        found=called.count((False, False)),
        missed=called.count((False, True)),
        alarms=called.count((True, False)),
        passed=called.count((True, True)),
    )


def by_kind(judged: Sequence[Judged]) -> tuple[tuple[str, str, int, int], ...]:
    """(kind, which of R and P was changed, cases, of them called mismatched), in the order of the kinds."""
    rows: list[tuple[str, str, int, int]] = []
    for kind in KINDS:
        for changed in ("", "R", "P"):
            some = [one for one in judged if one.case.kind == kind and one.case.changed == changed]
            if some:
                rows.append((kind, changed, len(some), sum(not one.alignment.aligned for one in some)))
    return tuple(rows)


def table_lines(judged: Sequence[Judged]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Head and lines of a table by kind."""
    lines = [
        (
            kind if not changed else f"{kind} ({changed} changed)",
            str(cases),
            str(called),
            f"{100 * called / cases:.1f}",
            "false alarms" if kind == ALIGNED else "found",
        )
        for kind, changed, cases, called in by_kind(judged)
    ]
    return ("kind", "cases", "called mismatched", "%", ""), lines


def _share(part: int, whole: int) -> float:
    return part / whole if whole else 0.0
