"""The study's tables (paper Tab. VIII, IX, X), from rows of trips, of simulated passengers or of people.

Trips of one person hang together, so intervals resample whole persons; a rate that is 0 or 1 throughout gets exact
binomial bounds over the persons. All systems of a table are compared over the same trips: same person, scene, words and
mood.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from functools import cache
from typing import Any, Final

import numpy as np

from chauffeur.bench.kernel.headline import CardPart, Headline
from chauffeur.bench.kernel.metrics import AnyRow, Measure, TableSpec, mean, register, share, whole
from chauffeur.bench.kernel.report import interval_text
from chauffeur.bench.kernel.stats import Array
from chauffeur.bench.personalization.sayings import LEVELS
from chauffeur.bench.personalization.scenes import TASK_WORDS, TASKS
from chauffeur.bench.personalization.scoring import TripStatistics, driving_score

Rows = Sequence[AnyRow]

GROUNDS: Final = ("highway", "intersection", "parking")
LOT_PACE: Final = "pace"
"""The task of Tab. X; the published rules know nothing of it, so it is no part of Tab. IX."""
ARM_WORDS: Final = {
    "keyword": "keyword",
    "keyword-fair": "keyword, fair",
    "without": "Talk2Drive",
    "with": "with memory",
    "ideal": "passenger's own",
}
JUDGE: Final = (
    "Simulated passengers of our own, drawn from ranges of the literature before any planner is asked: nobody was "
    "asked and nobody was driven. Shared: what a remark can say is what the memory can learn."
)
_REASONS: Final = 5
"""Reasons that are named of each system."""


@cache
def _rate(arm: str) -> Measure:
    """Takeover rate of a system, of pairs or of trips."""
    return share(f"personalization-takeover-{arm}-v1", ARM_WORDS[arm], lambda row: row[arm], better="lower")


@cache
def _reduction(before: str, after: str) -> Measure:
    """1 - after / before; undefined where nobody took over before."""

    def estimate(totals: Array) -> Array:
        with np.errstate(invalid="ignore", divide="ignore"):
            rest = 1.0 - totals[..., 1] / np.maximum(totals[..., 0], 1e-12)
            return np.asarray(np.where(totals[..., 0] > 0.0, rest, np.nan))

    def of(row: AnyRow) -> tuple[float, float]:
        return float(row[before]), float(row[after])

    id = f"personalization-reduction-{before}-{after}-v1"
    return register(Measure(id, "reduction", of, "%", estimate, better="higher", exact=False))


_PERSONS: Final = whole(
    "personalization-persons-v1", "persons", "", lambda rows: len({row["passenger"] for row in rows}), 0
)


def pairs(rows: Rows, before: str, after: str) -> list[dict[str, Any]]:
    """The measured trips that both systems made, with the takeovers of either."""
    found: dict[tuple[str, ...], dict[str, Any]] = {}
    for row in rows:
        if row["phase"] == "measured" and row["arm"] in (before, after):
            about = {name: row[name] for name in ("passenger", "task", "ground", "level", "trip")}
            key = tuple(map(str, about.values()))
            found.setdefault(key, {"item": " ".join(key), **about})[str(row["arm"])] = bool(row["takeover"])
    return [pair for pair in found.values() if before in pair and after in pair]


def _by_ground(title: str, before: str, after: str, *, pace: bool, published: str = "") -> TableSpec:
    """Takeover rates by scenario and level."""

    def over(rows: Rows) -> list[AnyRow]:
        mine = [pair for pair in pairs(rows, before, after) if pace or pair["task"] != LOT_PACE]
        return [{**pair, "cell": f"{pair['ground']} {level}"} for pair in mine for level in (pair["level"], "all")]

    order = tuple(f"{ground} {level}" for ground in GROUNDS for level in (*LEVELS, "all"))
    return _compared(title, before, after, "scenario", order, over, published)


def _by_task(title: str, before: str, after: str) -> TableSpec:
    """The same task by task, all levels together."""

    def over(rows: Rows) -> list[AnyRow]:
        return [{**pair, "cell": TASK_WORDS[pair["task"]]} for pair in pairs(rows, before, after)]

    return _compared(title, before, after, "task", tuple(TASK_WORDS[task] for task in TASKS), over)


def _compared(
    title: str, before: str, after: str, head: str, order: tuple[str, ...], over: Any, published: str = ""
) -> TableSpec:
    measures = (_PERSONS, _rate(before), _rate(after), _reduction(before, after))
    return TableSpec(
        title, measures, "cell", order, "passenger", heads=(head, "trips"), total=False, over=over, published=published
    )


_TAKEOVER: Final = share("personalization-takeover-v1", "takeover", lambda row: row["takeover"], better="lower")


def _systems(rows: Rows) -> list[AnyRow]:
    return [{**row, "system": ARM_WORDS[row["arm"]]} for row in rows if row["phase"] == "measured"]


def _why(rows: Rows) -> str:
    """The most frequent reasons, by system."""
    taken: dict[str, Counter[str]] = {}
    for row in rows:
        if row["takeover"]:
            taken.setdefault(row["system"], Counter())[str(row["topic"]).replace("_", " ")] += 1
    said = (
        f"{name}: " + ", ".join(f"{topic} {count}" for topic, count in topics.most_common(_REASONS))
        for name, topics in taken.items()
    )
    return "Why they took over. " + "; ".join(said) + "." if taken else ""


def _learnt(rows: Rows) -> list[AnyRow]:
    return sorted((row for row in rows if row["phase"] == "learning"), key=lambda row: row["trip"])


def _performed(rows: Rows) -> list[AnyRow]:
    """Measured trips with their driving score.

    The paper's baseline is the mean of its human drivers. There are none here: the baseline is the drive that the
    simulated passengers would have chosen for themselves (`ideal`), task by task.
    """
    measured = [row for row in rows if row["phase"] == "measured"]
    found: list[AnyRow] = []
    for task in TASKS:
        mine = [row for row in measured if row["task"] == task]
        own = [row for row in mine if row["arm"] == "ideal"]
        if not own:
            continue
        baseline = _mean_statistics(own)
        parts = [(arm, level) for arm in ("without", "with", "keyword") for level in LEVELS]
        for arm, level in (*parts, ("ideal", "")):
            name = f"{TASK_WORDS[task]}{level and f' {level}'}, {ARM_WORDS[arm]}"
            for row in mine:
                if row["arm"] == arm and level in ("", row["level"]):
                    score = driving_score(TripStatistics(**row["statistics"]), baseline).total
                    found.append({**row, **row["statistics"], "line": name, "score": score})
    return found


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


def _performance(name: str, title: str, unit: str, digits: int = 2, scale: float = 1.0) -> Measure:
    def of(row: AnyRow) -> float | None:
        return None if row.get(name) is None else scale * float(row[name])

    return mean(f"personalization-{name.replace('_', '-')}-v1", title, unit, of, digits)


_BASELINE: Final = _by_ground(
    "Takeover rate against the keyword baseline (as Tab. IX)", "keyword", "without", pace=False,
    published="personalization/table9.json",
)  # fmt: skip
_MEMORY: Final = _by_ground(
    "What memory adds (as Tab. X)", "without", "with", pace=True, published="personalization/table10.json"
)
CARD: Final = CardPart(
    (
        Headline(
            "takeovers, highway", _BASELINE, _rate("without"), "highway all",
            paper=tuple(f"Highway {level}" for level in LEVELS),
        ),
        Headline(
            "takeovers, lot, with memory", _MEMORY, _rate("with"), "parking all",
            paper=("driver A", "driver B", "driver C"),
        ),
    ),
    evidence="simulated passengers in simulated drives",
    quick={"passengers": 3},
    drives={"cruise": ("parameters", "program"), "parking-exit": ("parameters",)},
)  # fmt: skip
TABLES: Final = (
    _BASELINE,
    _by_ground("The same with memory against the keyword baseline", "keyword", "with", pace=False),
    _by_ground("The same against fair keyword rules", "keyword-fair", "without", pace=False),
    _MEMORY,
    _by_task("What memory adds, by task", "without", "with"),
    _by_task("What is left to a drive by the passenger's own wishes", "with", "ideal"),
    TableSpec(
        "Trips the memory learnt from", (_TAKEOVER,), "trip", cluster="passenger", heads=("trip", "trips"), total=False,
        over=_learnt,
    ),
    TableSpec(
        "Takeovers of the measured trips", (_TAKEOVER,), "system", tuple(ARM_WORDS.values()), "passenger",
        heads=("system", "trips"), total=False, over=_systems, note=_why,
    ),
    TableSpec(
        "Driving performance (as Tab. VIII, against the passengers' own way)",
        (
            _performance("min_ttc_s", "TTC", "s"),
            _performance("speed_variance", "variance", "m2/s2"),
            _performance("mean_abs_acceleration_mps2", "|a|", "m/s2"),
            _performance("mean_abs_jerk_mps3", "|jerk|", "m/s3"),
            _performance("latency_s", "latency", "ms", 0, 1000.0),
            _performance("score", "score", "", 1),
        ),
        "line", cluster="passenger", heads=("behaviour", "drives"), total=False, over=_performed,
        brackets=False,
    ),
)  # fmt: skip


def headline(rows: Rows) -> str:
    """The result in two sentences."""
    said = f"{len({row['passenger'] for row in rows})} simulated passengers, {len(rows)} trips"
    base = [pair for pair in pairs(rows, "keyword", "without") if pair["task"] != LOT_PACE]
    memory = pairs(rows, "without", "with")
    if not base or not memory:
        return f"{said}; not enough to compare."

    def told(measure: Measure, found: Rows) -> str:
        return interval_text(measure.aggregate(found, "passenger"), 100.0)

    keyword, without, with_memory = map(_rate, ("keyword", "without", "with"))
    return (
        f"{said}. Takeover rate {told(keyword, base)} % with keywords and {told(without, base)} % with Talk2Drive, a "
        f"reduction of {told(_reduction('keyword', 'without'), base)} %; memory takes it from {told(without, memory)} "
        f"% to {told(with_memory, memory)} %, a further {told(_reduction('without', 'with'), memory)} %."
    )


def latencies(rows: Rows, arm: str) -> tuple[float, float]:
    """Median and 95th percentile of the time from the words to the policy, s; zeros where nobody planned."""
    found = [row["latency_s"] for row in rows if row["arm"] == arm and "latency_s" in row]
    if not found:
        return 0.0, 0.0
    return float(np.percentile(found, 50)), float(np.percentile(found, 95))
