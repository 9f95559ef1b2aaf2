"""The study's tables, for the terminal and as Markdown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

from chauffeur.bench.kernel.report import interval_text
from chauffeur.bench.kernel.report import markdown as grid
from chauffeur.bench.kernel.stats import Interval
from chauffeur.bench.personalization import figures
from chauffeur.bench.personalization.figures import Compared, Performance
from chauffeur.bench.personalization.scenes import TASK_WORDS

Rows = Sequence[Mapping[str, Any]]
Table = tuple[str, Sequence[str], list[list[str]]]
"""Title, head, lines."""

NOTE: Final = (
    "Simulated passengers in simulated drives: nobody was asked and nobody was driven. "
    "95 % intervals in brackets, resampled by person."
)
_NAMES: Final[dict[str, str]] = {**TASK_WORDS}
ARM_WORDS: Final = {
    "keyword": "keyword",
    "keyword-fair": "keyword, fair",
    "without": "Talk2Drive",
    "with": "with memory",
    "ideal": "passenger's own",
}


def tables(rows: Rows) -> list[Table]:
    """All of them."""
    found: list[Table] = [
        _compared(
            "Takeover rate against the keyword baseline (as Tab. IX)",
            figures.table_ix(rows),
            ("keyword", "Talk2Drive"),
        ),
        _compared(
            "The same with memory against the keyword baseline",
            figures.table_ix(rows, after="with"),
            ("keyword", "with memory"),
        ),
        _compared(
            "The same against fair keyword rules",
            figures.table_ix(rows, before="keyword-fair"),
            ("keyword, fair", "Talk2Drive"),
        ),
        _compared("What memory adds (as Tab. X)", figures.table_x(rows), ("without", "with memory")),
        _compared("What memory adds, by task", figures.by_task(rows, "without", "with"), ("without", "with memory")),
        _compared(
            "What is left to a drive by the passenger's own wishes",
            figures.by_task(rows, "with", "ideal"),
            ("with memory", "passenger's own"),
        ),
        ("Trips the memory learnt from", ("trip", "trips", "takeover %"), _learning(rows)),
        ("Why they took over", ("system", "trips", "takeover %", "reasons"), _reasons(rows)),
        _viii(figures.table_viii(rows)),
    ]
    return [table for table in found if table[2]]


def headline(rows: Rows) -> str:
    """The result in two sentences."""
    persons = len({row["passenger"] for row in rows})
    trips = len(rows)
    base = figures.compare(rows, "keyword", "without", lambda row: row["task"] != figures.LOT_PACE)
    memory = figures.compare(rows, "without", "with", lambda row: True)  # noqa: ARG005
    if base is None or memory is None:
        return f"{persons} simulated passengers, {trips} trips; not enough to compare."
    return (
        f"{persons} simulated passengers, {trips} trips. Takeover rate {_rate(base.before)} % with keywords and "
        f"{_rate(base.after)} % with Talk2Drive, a reduction of {_rate(base.reduction)} %; memory takes it from "
        f"{_rate(memory.before)} % to {_rate(memory.after)} %, a further {_rate(memory.reduction)} %."
    )


def markdown(rows: Rows, title: str) -> str:
    """Everything as Markdown."""
    parts = [f"# {title}", NOTE, headline(rows)]
    for name, header, lines in tables(rows):
        parts += [f"## {name}", grid(header, lines)]
    return "\n\n".join(parts) + "\n"


def _compared(title: str, cells: Iterable[Compared], names: tuple[str, str]) -> Table:
    lines = [
        [
            f"{_NAMES.get(cell.ground, cell.ground)} {cell.level}",
            str(cell.persons),
            str(cell.trips),
            _rate(cell.before),
            _rate(cell.after),
            _rate(cell.reduction),
        ]
        for cell in cells
    ]
    return title, ("scenario", "persons", "trips", f"{names[0]} %", f"{names[1]} %", "reduction %"), lines


def _rate(interval: Interval) -> str:
    return interval_text(interval, 100.0, missing="-")


def _learning(rows: Rows) -> list[list[str]]:
    return [[str(trip), str(count), f"{100.0 * rate:.1f}"] for trip, count, rate in figures.learning(rows)]


def _reasons(rows: Rows) -> list[list[str]]:
    lines: list[list[str]] = []
    for arm, words in ARM_WORDS.items():
        part = [row for row in rows if row["arm"] == arm and row["phase"] == "measured"]
        taken = Counter(str(row["topic"]) for row in part if row["takeover"])
        if part:
            reasons = ", ".join(f"{topic.replace('_', ' ')} {count}" for topic, count in taken.most_common(5))
            lines.append([words, str(len(part)), f"{100.0 * sum(taken.values()) / len(part):.1f}", reasons])
    return lines


def _viii(found: Iterable[Performance]) -> Table:
    lines = [
        [
            f"{_NAMES.get(one.task, one.task)} {one.level}",
            ARM_WORDS.get(one.arm, one.arm),
            str(one.drives),
            "-" if one.min_ttc_s is None else f"{one.min_ttc_s:.2f}",
            f"{one.speed_variance:.2f}",
            f"{one.mean_abs_acceleration_mps2:.2f}",
            f"{one.mean_abs_jerk_mps3:.2f}",
            "-" if one.latency_s is None else f"{1000.0 * one.latency_s:.0f}",
            f"{one.score:.1f}",
        ]
        for one in found
    ]
    header = (
        "behaviour", "system", "drives", "TTC s", "variance m2/s2", "|a| m/s2", "|jerk| m/s3", "latency ms", "score",
    )  # fmt: skip
    return "Driving performance (as Tab. VIII, against the passengers' own way)", header, lines
