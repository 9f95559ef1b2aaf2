"""From rows to tables: one line a family, the paper's columns, the causes beside the outcomes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import fmean

import numpy as np

from chauffeur.bench.kernel.report import interval_text
from chauffeur.bench.kernel.stats import DRAWS, Array, Estimator, Interval, bootstrap, cluster_totals
from chauffeur.bench.kernel.store import Row
from chauffeur.bench.lampilot.families import FAMILIES
from chauffeur.bench.lampilot.metrics import ORIGIN, Ruler, driving_score, ruler_named
from chauffeur.bench.lampilot.paper import TABLE_IV, items_behind


@dataclass(frozen=True, slots=True)
class Summary:
    """Aggregate over a set of planned items; every rate has all of them as its denominator.

    Attributes:
        label: What the items are.
        items: How many were planned.
        collision, completion: Rates, 0..1.
        ttc, speed_variance, time_efficiency: Mean points over completed items; None when none was completed.
        driving_score: The ruler's aggregate, points.
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


def ruler_of(rows: Sequence[Row]) -> Ruler:
    """The ruler that rows were scored by; rows that name none are of the time when there was only LaMPilot's.

    Raises:
        ValueError: There are no rows, or they were scored by several rulers.
    """
    ids = {str(row.get("metrics", ORIGIN.id)) for row in rows}
    if len(ids) != 1:
        raise ValueError(f"rows of one ruler are needed, not of {sorted(ids)}")
    return ruler_named(ids.pop())


def summarise(label: str, rows: Sequence[Row]) -> Summary:
    """Aggregate rows (one per planned item). Raises ValueError for no rows, or rows of several rulers."""
    ruler = ruler_of(rows)
    done = [row for row in rows if row["success"]]
    completion = len(done) / len(rows)
    collision = fmean(bool(row["collision"]) for row in rows)

    def mean(column: str) -> float | None:
        values = [float(row[column]) for row in done if row[column] is not None]
        return fmean(values) if values else None

    return Summary(
        label=label,
        items=len(rows),
        collision=collision,
        completion=completion,
        ttc=mean("ttc"),
        speed_variance=mean("speed_variance"),
        time_efficiency=mean("time_efficiency"),
        driving_score=driving_score(completion, mean("score") or 0.0, collision, ruler),
        policy_failed=sum(bool(row["policy_failed"]) for row in rows),
        infra_failed=sum(bool(row["infra_failed"]) for row in rows),
        refused=sum(bool(row["refused"]) for row in rows),
        fallback_used=sum(bool(row["fallback_used"]) for row in rows),
    )


def summaries(rows: Sequence[Row]) -> list[Summary]:
    """One per family that occurs, then one for all."""
    found = [summarise(family, [row for row in rows if row["family"] == family]) for family in families_in(rows)]
    return [*found, summarise("all", rows)]


def families_in(rows: Iterable[Row]) -> list[str]:
    """Families that occur: the paper's in its order, then any others as they come."""
    names = dict.fromkeys(str(row["family"]) for row in rows)
    return [*(f for f in FAMILIES if f in names), *(f for f in names if f not in FAMILIES)]


_POINTS = ("ttc", "speed_variance", "time_efficiency")
_ITEMS, _COLLISIONS, _SUCCESSES, _SCORE, _PENALTY, _FIRST_POINT = range(6)


def scene_totals(rows: Sequence[Row]) -> Array:
    """What MEASURES are made of, summed over each sample's items.

    Returns:
        Shape (samples, 11): items, collisions, successes, score, the ruler's penalty for collisions, then sum and
        count of each kind of points over completed items. Samples stand in order of their first item, so runs over
        the same items give the same rows.

    Raises:
        ValueError: See ruler_of.
    """
    weight = ruler_of(rows).collision_weight
    values = np.zeros((len(rows), _FIRST_POINT + 2 * len(_POINTS)))
    for line, row in zip(values, rows, strict=True):
        line[_ITEMS] = 1.0
        line[_COLLISIONS] = bool(row["collision"])
        line[_PENALTY] = weight * bool(row["collision"])
        if not row["success"]:
            continue
        line[_SUCCESSES] = 1.0
        line[_SCORE] = row["score"] or 0.0
        for place, name in enumerate(_POINTS):
            if row[name] is not None:
                at = _FIRST_POINT + 2 * place
                line[at : at + 2] = row[name], 1.0
    return cluster_totals([str(row["sample"]) for row in rows], values)


def _rate(column: int) -> Estimator:
    return lambda totals: totals[..., column] / totals[..., _ITEMS]


def _mean_points(place: int) -> Estimator:
    at = _FIRST_POINT + 2 * place

    def mean(totals: Array) -> Array:
        with np.errstate(invalid="ignore"):  # no completed item: 0 / 0, undefined
            return totals[..., at] / totals[..., at + 1]

    return mean


def _driving_score(totals: Array) -> Array:
    # completion x mean score of successes is the score summed over successes, over all items
    return (totals[..., _SCORE] - totals[..., _PENALTY]) / totals[..., _ITEMS]


MEASURES: dict[str, Estimator] = {
    "collision": _rate(_COLLISIONS),
    "completion": _rate(_SUCCESSES),
    **{name: _mean_points(place) for place, name in enumerate(_POINTS)},
    "driving_score": _driving_score,
}
"""The aggregates of a Summary, by field name, as functions of scene totals."""


def intervals(rows: Sequence[Row], *, draws: int = DRAWS, seed: int = 0) -> dict[str, Interval]:
    """The aggregates of `summarise` with 95 % intervals; samples are resampled, because the commands of a sample share
    a scene. Raises ValueError for no rows, or rows of several rulers."""
    return bootstrap(scene_totals(rows), MEASURES, draws=draws, seed=seed, rates=("collision", "completion"))


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


def interval_cells(found: dict[str, Interval]) -> list[str]:
    """Cells under COLUMNS with their intervals, e.g. `98.7 [97.4, 99.6]`."""
    return [interval_text(found[name], *_FORMS.get(name, (1.0, 1))) for name in MEASURES]


_FORMS = {"collision": (100.0, 2), "completion": (100.0, 1)}
"""Factor and decimals of a measure in its column; points are shown as they are, with one."""


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


def answers_note(rows: Sequence[Row]) -> str:
    """How many answers were right, where some wishes are to be declined; empty where none is."""
    to_refuse = [row for row in rows if row.get("to_refuse")]
    if not to_refuse:
        return ""
    declined = sum(bool(row["answered_rightly"]) for row in to_refuse)
    right = sum(bool(row.get("answered_rightly")) for row in rows)
    note = (
        f"right answers {right} of {len(rows)}: {declined} of {len(to_refuse)} wishes that must not be driven were "
        "declined or asked back about"
    )
    others = len(rows) - len(to_refuse)
    return f"{note}, {right - declined} of {others} others reached their goal" if others else note


Table = tuple[tuple[str, ...], list[list[str]]]
"""(header, lines) of a table, every cell as text."""


def family_lines(rows: Sequence[Row], *, draws: int = 0) -> Table:
    """A run by family, with causes; with 95 % intervals from so many resamples where `draws` is not 0."""
    lines = [
        [
            s.label,
            str(s.items),
            *_cells(s, [row for row in rows if s.label in (row["family"], "all")], draws),
            *map(str, (s.policy_failed, s.infra_failed, s.refused, s.fallback_used)),
        ]
        for s in summaries(rows)
    ]
    return ("Family", "Items", *COLUMNS, *_CAUSES), lines


def _cells(summary: Summary, rows: Sequence[Row], draws: int) -> list[str]:
    return interval_cells(intervals(rows, draws=draws)) if draws else cells(summary)


def comparison_lines(name: str, rows: Sequence[Row], *more: tuple[str, Sequence[Row]], draws: int = 0) -> Table:
    """Runs in the columns of the paper's Tab. IV, the published rows below them, marked as the paper's.

    The published rows were measured by LaMPilot's code, so they stand below runs of that ruler only.

    Args:
        name, rows: The first run.
        more: Further runs.
        draws: Resamples for 95 % intervals of the runs; 0 for none.

    Raises:
        ValueError: A run is empty, or the runs were scored by several rulers.
    """
    runs = [(name, rows), *more]
    ruler = ruler_of([row for _, found in runs for row in found])
    lines = [[label, str(len(found)), *_cells(summarise(label, found), found, draws)] for label, found in runs]
    for method, setting, collision, *points in TABLE_IV if ruler is ORIGIN else ():
        label = method if setting == "-" else f"{method}, {setting}"
        lines.append([f"paper: {label}", str(items_behind(setting)), f"{collision:.2f}", *(f"{p:.1f}" for p in points)])
    return ("Method", "Items", *COLUMNS), lines
