"""The paper's Tab. VI with our rows beside its own.

The paper's averages are means of subtasks, its total the mean of the three skills; ours are made the same way. Its rows
were measured by its authors on the published evaluation file; ours say which file they are of.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

from chauffeur.bench.nuplanqa.questions import SKILLS, SUBTASKS
from chauffeur.concept.data import read_data

HEADER: Final = (
    "method",
    "traffic light",
    "weather",
    "road type",
    "avg.",
    "surr. objects",
    "traffic flow",
    "key objects",
    "avg.",
    "ego manoeuvre",
    "situation",
    "action",
    "avg.",
    "total",
)


def paper_lines(frames: str) -> list[tuple[str, ...]]:
    """The paper's rows, `multi` or `single` frame. Raises DataError: the data folder is not here."""
    table: Mapping[str, Any] = json.loads(read_data("nuplanqa", "table6.json"))
    rows: Mapping[str, Sequence[float]] = table[frames]
    return [(f"{name} (paper)", *(f"{value:.1f}" for value in values)) for name, values in rows.items()]


def our_lines(name: str, rows: Iterable[Mapping[str, Any]]) -> list[tuple[str, ...]]:
    """Our accuracy and, below it, the blind baseline's on the same questions, in the columns of the table, in %."""
    answered = [row for row in rows if row["correct"] is not None]
    lines = [(name, *_cells(answered, "correct"))]
    if any(row["blind"] is not None for row in answered):
        lines.append(("blind baseline: words of the options alone", *_cells(answered, "blind")))
    return lines


def strict_accuracy(rows: Iterable[Mapping[str, Any]]) -> tuple[float, int] | None:
    """Share of questions that are right in every circular shift, and how many; None where only one was asked."""
    groups: dict[str, list[bool]] = {}
    for row in rows:
        groups.setdefault(row["question"], []).append(row["correct"] is True)
    whole = [all(found) for found in groups.values() if len(found) == 4]
    return (sum(whole) / len(whole), len(whole)) if whole else None


def _cells(rows: Sequence[Mapping[str, Any]], column: str) -> list[str]:
    means: dict[str, float | None] = {}
    for task in SUBTASKS:
        found = [bool(row[column]) for row in rows if row["subtask"] == task]
        means[task] = 100.0 * sum(found) / len(found) if found else None
    cells: list[str] = []
    averages: list[float | None] = []
    for tasks in SKILLS.values():
        mine = [means[task] for task in tasks]
        averages.append(_mean(mine))
        cells += [_text(value) for value in (*mine, averages[-1])]
    return [*cells, _text(_mean(averages))]


def _mean(values: Sequence[float | None]) -> float | None:
    """None where one is missing: an average over fewer subtasks is another quantity."""
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if len(known) == len(values) else None


def _text(value: float | None) -> str:
    return "n/a" if value is None else f"{value:.1f}"
