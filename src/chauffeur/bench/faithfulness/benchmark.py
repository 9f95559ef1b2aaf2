"""The alignment benchmark for the kernel: the judge reads every case by itself, and a row says what it made of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

from chauffeur.bench.faithfulness.cases import ALIGNED, KINDS, FaithfulnessCase, half_of, handwritten
from chauffeur.bench.faithfulness.generator import COUNT, SEED, generate
from chauffeur.bench.kernel.benchmark import ItemOutcome, Unasked
from chauffeur.bench.kernel.metrics import AnyRow, Measure, TableSpec, count, register, share
from chauffeur.bench.kernel.stats import Array
from chauffeur.bench.kernel.store import Row
from chauffeur.safety.faithfulness import judge, read_facts

JUDGE: Final = "alignment-v1"
"""Id of the judge that the figures belong to."""

GENERATED: Final = "Generated (synthetic)"
SETS: Final = (GENERATED, "Written by hand, test half", "Written by hand, tuning half")


@dataclass(frozen=True, slots=True)
class JudgeJob:
    """One case to be judged, by reading alone."""

    case: FaithfulnessCase

    @property
    def key(self) -> str:
        """See BenchJob: the run's configuration names the judge and the cases."""
        return self.case.id

    @property
    def near(self) -> str:
        return ""

    def run(self) -> Row:
        verdict = judge(self.case.thoughts, read_facts(self.case.program), self.case.where)
        return {"key": self.key, "infra_failed": False, "verdict": asdict(verdict)}

    def spoiled(self, detail: str) -> Row:
        return {"key": self.key, "infra_failed": True, "detail": detail}


@dataclass(frozen=True, slots=True)
class FaithfulnessRow:
    """A case and what the judge made of it.

    Attributes:
        set: One of SETS.
        kind: `aligned`, or what is wrong.
        changed: Which of text and program was altered; empty where that is not known.
        label: Both in words.
        mismatched: Whether the text does not describe the program.
        called: Whether the judge says so.
        thoughts, program: The text and the program.
        verdict: The judge's, as JSON.
    """

    set: str
    kind: str
    changed: str
    label: str
    mismatched: bool
    called: bool
    thoughts: str
    program: str
    verdict: Mapping[str, Any]


def _confusion(row: AnyRow) -> tuple[float, ...]:
    """Found, missed, false alarm, passed. A mismatch is what is looked for."""
    return tuple(float((row["mismatched"], row["called"]) == cell) for cell in _CELLS)


_CELLS: Final = ((True, True), (True, False), (False, True), (False, False))
_FOUND, _MISSED, _ALARM, _PASSED = range(4)


def _ratio(part: Sequence[int], whole: Sequence[int]) -> Any:
    """Of column totals; 0 where there is nothing to be had."""

    def estimate(totals: Array) -> Array:
        below = totals[..., whole].sum(axis=-1)
        return totals[..., part].sum(axis=-1) / (below + (below == 0.0))

    return estimate


def _score(name: str, part: Sequence[int], whole: Sequence[int], unit: str = "", digits: int = 3) -> Measure:
    title, better = name.replace("-", " "), "" if unit else "higher"
    return register(
        Measure(f"alignment-{name}-v1", title, _confusion, unit, _ratio(part, whole), digits, better=better)
    )


SCORES: Final = (
    _score("precision", [_FOUND], [_FOUND, _ALARM]),
    _score("recall", [_FOUND], [_FOUND, _MISSED]),
    _score("F1", [_FOUND, _FOUND], [_FOUND, _FOUND, _ALARM, _MISSED]),
    _score("false-alarms", [_ALARM], [_ALARM, _PASSED], "%", 1),
)
_CALLED: Final = (
    count("alignment-called-v1", "called mismatched", lambda row: row["called"]),
    share("alignment-called-share-v1", "share", lambda row: row["called"]),
)
_LABELS: Final = tuple(kind + changed for kind in KINDS for changed in ("", " (R changed)", " (P changed)"))


def _table(name: str) -> TableSpec:
    return TableSpec(
        name, _CALLED, "label", _LABELS, rows=lambda row: row["set"] == name, heads=("kind", "cases"), total=False
    )


class FaithfulnessBenchmark(Unasked):
    """Generated cases, and those written by hand."""

    id = JUDGE
    row = FaithfulnessRow
    drives = False
    tables = (*map(_table, SETS), TableSpec("The judge", SCORES, "set", SETS, heads=("set", "cases"), total=False))

    def __init__(self, items: int = COUNT, seed: int = SEED) -> None:
        """Make it.

        Args:
            items: How many generated cases; 0 for the hand-written alone.
            seed: Seed of the generated ones.
        """
        self.config = {"items": items, "seed": seed}

    @cached_property
    def _cases(self) -> tuple[FaithfulnessCase, ...]:
        halves = [[case for case in handwritten() if half_of(case) == half] for half in ("test", "tuning")]
        return (*generate(self.config["items"], self.config["seed"]), *halves[0], *halves[1])

    def items(self) -> Sequence[FaithfulnessCase]:
        """See Benchmark. Raises DataError: the hand-written cases are damaged."""
        return self._cases

    def conclude(self, folder: Path, rows: Sequence[Row], results: Mapping[str, Row | None]) -> Sequence[str]:
        """See Concludes."""
        del folder, rows, results
        return ("A mismatch is what is looked for. Judged by reading alone; nothing was driven.",)

    def job(self, item: FaithfulnessCase, answer: Row | None) -> JudgeJob:
        del answer
        return JudgeJob(item)

    def rows(self, outcome: ItemOutcome[FaithfulnessCase]) -> Sequence[FaithfulnessRow]:
        if outcome.result is None or outcome.result["infra_failed"]:
            return ()
        case, verdict = outcome.item, outcome.result["verdict"]
        row = FaithfulnessRow(
            set=GENERATED if case.scenario else SETS[1 if half_of(case) == "test" else 2],
            kind=case.kind,
            changed=case.changed,
            label=f"{case.kind} ({case.changed} changed)" if case.changed else case.kind,
            mismatched=case.kind != ALIGNED,
            called=not verdict["aligned"],
            thoughts=case.thoughts,
            program=case.program,
            verdict=verdict,
        )
        return (row,)
