"""From rows to tables: one line a family, the seed's columns, the causes beside the outcomes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import fmean

from chauffeur.bench.lampilot.families import FAMILIES
from chauffeur.bench.lampilot.metrics import driving_score
from chauffeur.bench.lampilot.paper import TABLE_IV
from chauffeur.bench.store import Row


@dataclass(frozen=True, slots=True)
class Summary:
    """Aggregate over a set of planned items; every rate has all of them as its denominator.

    Attributes:
        label: What the items are.
        items: How many were planned.
        collision, completion: Rates, 0..1.
        ttc, speed_variance, time_efficiency: Mean points over completed items; None when none was completed.
        driving_score: LaMPilot's aggregate, points.
        policy_failed, infra_failed, refused, fallback_used: Counts.
    """

    label: str
    items: int
    collision: float
    completion: float
    ttc: float | None
    speed_variance: float | None
    time_efficiency: float | None
    driving_score: float
    policy_failed: int
    infra_failed: int
    refused: int
    fallback_used: int


def summarise(label: str, rows: Sequence[Row]) -> Summary:
    """Aggregate rows (one per planned item). Raises ValueError for no rows."""
    if not rows:
        raise ValueError(f"no items to summarise for {label!r}")
    done = [row for row in rows if row["success"]]
    completion = len(done) / len(rows)
    collision = fmean(bool(row["collision"]) for row in rows)

    def mean(column: str) -> float | None:
        return fmean(float(row[column]) for row in done) if done else None

    return Summary(
        label=label,
        items=len(rows),
        collision=collision,
        completion=completion,
        ttc=mean("ttc"),
        speed_variance=mean("speed_variance"),
        time_efficiency=mean("time_efficiency"),
        driving_score=driving_score(completion, mean("score") or 0.0, collision),
        policy_failed=sum(bool(row["policy_failed"]) for row in rows),
        infra_failed=sum(bool(row["infra_failed"]) for row in rows),
        refused=sum(bool(row["refused"]) for row in rows),
        fallback_used=sum(bool(row["fallback_used"]) for row in rows),
    )


def summaries(rows: Sequence[Row]) -> list[Summary]:
    """One per family that occurs, then one for all."""
    found: list[Summary] = []
    for family in (*FAMILIES, "other"):
        chosen = [row for row in rows if row["family"] == family]
        if chosen:
            found.append(summarise(family, chosen))
    return [*found, summarise("all", rows)]


COLUMNS = (
    "Collision %",
    "Completion %",
    "TTC pt",
    "SV pt",
    "TE pt",
    "Driving score pt",
)
_CAUSES = ("policy failed", "infra failed", "refused", "fallback used")


def _number(value: float | None) -> str:
    return "n/a" if value is None else f"{value:.1f}"


def cells(summary: Summary) -> list[str]:
    """A summary's cells under COLUMNS."""
    return [
        f"{100 * summary.collision:.2f}",
        f"{100 * summary.completion:.1f}",
        _number(summary.ttc),
        _number(summary.speed_variance),
        _number(summary.time_efficiency),
        _number(summary.driving_score),
    ]


def markdown(header: Iterable[str], lines: Iterable[Sequence[str]]) -> str:
    """A Markdown table; the first column is text, the others are numbers."""
    names = list(header)
    rule = ["---", *("---:" for _ in names[1:])]
    return "\n".join("| " + " | ".join(line) + " |" for line in [names, rule, *lines])


Table = tuple[tuple[str, ...], list[list[str]]]
"""(header, lines) of a table, every cell as text."""


def family_lines(rows: Sequence[Row]) -> Table:
    """A run by family, with causes."""
    lines = [
        [s.label, str(s.items), *cells(s), *map(str, (s.policy_failed, s.infra_failed, s.refused, s.fallback_used))]
        for s in summaries(rows)
    ]
    return ("Family", "Items", *COLUMNS, *_CAUSES), lines


def comparison_lines(name: str, rows: Sequence[Row], *more: tuple[str, Sequence[Row]]) -> Table:
    """Runs in the columns of the seed's Tab. IV, the published rows below them, marked as the paper's."""
    lines = [[label, str(len(found)), *cells(summarise(label, found))] for label, found in [(name, rows), *more]]
    for method, setting, collision, *points in TABLE_IV:
        label = method if setting == "-" else f"{method}, {setting}"
        items = "110" if setting == "human feedback" else "98"
        lines.append([f"paper: {label}", items, f"{collision:.2f}", *(f"{p:.1f}" for p in points)])
    return ("Method", "Items", *COLUMNS), lines
