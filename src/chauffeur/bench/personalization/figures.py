"""Rates, reductions and their intervals, from rows of trips, of simulated passengers or of people.

Trips of one person hang together, so intervals resample whole persons (cluster bootstrap, `bench/kernel/stats.py`); a
rate that is 0 or 1 throughout gets exact binomial bounds over the persons. All systems of a table are compared over the
same trips: same person, scene, words and mood.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chauffeur.bench.kernel.stats import Interval, bootstrap, cluster_totals
from chauffeur.bench.personalization.sayings import LEVELS
from chauffeur.bench.personalization.scenes import TASKS
from chauffeur.bench.personalization.scoring import TripStatistics, driving_score

Array = NDArray[np.float64]
Rows = Sequence[Mapping[str, Any]]

GROUNDS: Final = ("highway", "intersection", "parking")
LOT_PACE: Final = "pace"
"""The task of Tab. X; the published rules know nothing of it, so it is no part of Tab. IX."""


@dataclass(frozen=True, slots=True)
class Compared:
    """Two systems over the same trips.

    Attributes:
        ground, level: Where, and how directly it was said.
        persons, trips: How many.
        before, after: Their takeover rates.
        reduction: 1 - after / before; its value is None where nobody took over before.
    """

    ground: str
    level: str
    persons: int
    trips: int
    before: Interval
    after: Interval
    reduction: Interval


def compare(rows: Rows, before: str, after: str, where: Callable[[Mapping[str, Any]], bool]) -> Compared | None:
    """Takeover rates of two systems over the measured trips that both have; None where there are none."""
    pairs: dict[tuple[str, ...], dict[str, float]] = {}
    for row in rows:
        if row["phase"] == "measured" and row["arm"] in (before, after) and where(row):
            key = (row["passenger"], row["task"], row["level"], str(row["trip"]))
            pairs.setdefault(key, {})[row["arm"]] = float(row["takeover"])
    both = {key: pair for key, pair in pairs.items() if len(pair) == 2}
    if not both:
        return None
    persons = [key[0] for key in both]
    values = np.array([(pair[before], pair[after], 1.0) for pair in both.values()])
    totals = cluster_totals(persons, values)
    found = bootstrap(
        totals,
        {"before": _share(0), "after": _share(1), "reduction": _reduction},
        rates=("before", "after"),
    )
    return Compared("", "", len(set(persons)), len(both), found["before"], found["after"], found["reduction"])


def _share(column: int) -> Callable[[Array], Array]:
    def estimate(totals: Array) -> Array:
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(totals[..., column] / totals[..., 2])

    return estimate


def _reduction(totals: Array) -> Array:
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(
            np.where(totals[..., 0] > 0.0, 1.0 - totals[..., 1] / np.maximum(totals[..., 0], 1e-12), np.nan)
        )


def table_ix(rows: Rows, before: str = "keyword", after: str = "without") -> list[Compared]:
    """Takeover rates by scenario and level (paper Tab. IX)."""
    return _cells(rows, before, after, lambda row: row["task"] != LOT_PACE)


def table_x(rows: Rows) -> list[Compared]:
    """What memory adds (paper Tab. X), everywhere; the paper's own experiment is the speed in the lot."""
    return _cells(rows, "without", "with", lambda row: True)  # noqa: ARG005


def _cells(rows: Rows, before: str, after: str, also: Callable[[Mapping[str, Any]], bool]) -> list[Compared]:
    cells: list[Compared] = []
    for ground in GROUNDS:
        for level in (*LEVELS, "all"):
            found = compare(
                rows,
                before,
                after,
                lambda row, ground=ground, level=level: (
                    row["ground"] == ground and level in (row["level"], "all") and also(row)
                ),
            )
            if found is not None:
                cells.append(_named(found, ground, level))
    return cells


def by_task(rows: Rows, before: str, after: str) -> list[Compared]:
    """The same task by task, all levels together."""
    cells: list[Compared] = []
    for task in TASKS:
        found = compare(rows, before, after, lambda row, task=task: row["task"] == task)
        if found is not None:
            cells.append(_named(found, task, "all"))
    return cells


def _named(found: Compared, ground: str, level: str) -> Compared:
    return Compared(ground, level, found.persons, found.trips, found.before, found.after, found.reduction)


@dataclass(frozen=True, slots=True)
class Performance:
    """A row of Tab. VIII.

    Attributes:
        task, level, arm: What, how directly said, by whom.
        drives: How many.
        min_ttc_s: Mean of the smallest times to collision of drives that have one; None where none has.
        speed_variance, mean_abs_acceleration_mps2, mean_abs_jerk_mps3: Means.
        latency_s: Mean time from the words to the policy; None for drives nobody planned.
        score: Mean driving score, against the passengers' own way of driving.
    """

    task: str
    level: str
    arm: str
    drives: int
    min_ttc_s: float | None
    speed_variance: float
    mean_abs_acceleration_mps2: float
    mean_abs_jerk_mps3: float
    latency_s: float | None
    score: float


def table_viii(rows: Rows, arms: Sequence[str] = ("without", "with", "keyword")) -> list[Performance]:
    """Driving performance (paper Tab. VIII, Eq. 18 to 20).

    The paper's baseline is the mean of its human drivers. There are none here: the baseline is the drive that the
    simulated passengers would have chosen for themselves (`ideal`), task by task.
    """
    measured = [row for row in rows if row["phase"] == "measured"]
    found: list[Performance] = []
    for task in TASKS:
        own = [row for row in measured if row["task"] == task and row["arm"] == "ideal"]
        if not own:
            continue
        baseline = _mean_statistics(own)
        for arm in arms:
            for level in LEVELS:
                part = [row for row in measured if (row["task"], row["arm"], row["level"]) == (task, arm, level)]
                if part:
                    found.append(_performance(part, baseline, task, level, arm))
        found.append(_performance(own, baseline, task, "-", "ideal"))
    return found


def _performance(part: Rows, baseline: TripStatistics, task: str, level: str, arm: str) -> Performance:
    mean = _mean_statistics(part)
    scores = [driving_score(TripStatistics(**row["statistics"]), baseline).total for row in part]
    latencies = [row["latency_s"] for row in part if "latency_s" in row]
    return Performance(
        task,
        level,
        arm,
        len(part),
        mean.min_ttc_s,
        mean.speed_variance,
        mean.mean_abs_acceleration_mps2,
        mean.mean_abs_jerk_mps3,
        math.fsum(latencies) / len(latencies) if latencies else None,
        math.fsum(scores) / len(scores),
    )


def _mean_statistics(rows: Rows) -> TripStatistics:
    all_of = [TripStatistics(**row["statistics"]) for row in rows]
    closing = [one.min_ttc_s for one in all_of if one.min_ttc_s is not None]
    count = len(all_of)
    return TripStatistics(
        math.fsum(closing) / len(closing) if closing else None,
        math.fsum(one.speed_variance for one in all_of) / count,
        math.fsum(one.mean_abs_acceleration_mps2 for one in all_of) / count,
        math.fsum(one.mean_abs_jerk_mps3 for one in all_of) / count,
    )


def latencies(rows: Rows, arm: str) -> tuple[float, float]:
    """Median and 95th percentile of the time from the words to the policy, s; zeros where nobody planned."""
    found = [row["latency_s"] for row in rows if row["arm"] == arm and "latency_s" in row]
    if not found:
        return 0.0, 0.0
    return float(np.percentile(found, 50)), float(np.percentile(found, 95))


def learning(rows: Rows) -> list[tuple[int, int, float]]:
    """Takeover rate of the trips the memory learnt from: (number of the trip, trips, rate)."""
    by_trip: dict[int, list[float]] = {}
    for row in rows:
        if row["phase"] == "learning":
            by_trip.setdefault(row["trip"], []).append(float(row["takeover"]))
    return [(trip, len(found), math.fsum(found) / len(found)) for trip, found in sorted(by_trip.items())]
