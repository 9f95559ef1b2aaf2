"""The paper's Tab. VI: accuracy by subtask, beside what a baseline knows that sees the words of the options alone.

The paper's averages are means of subtasks, its total the mean of the three skills; ours are made the same way. Its rows
were measured by its authors on nuPlan's published evaluation file; ours say which file they are of.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np

from chauffeur.bench.kernel.metrics import AnyRow, Measure, TableSpec, register
from chauffeur.bench.kernel.stats import Array
from chauffeur.bench.nuplanqa.questions import SKILLS, SUBTASKS


def _of(row: AnyRow) -> tuple[float, ...]:
    """Hits and questions of every subtask."""
    hit = float(row["hit"])
    return tuple(value for task in SUBTASKS for value in ((hit, 1.0) if row["subtask"] == task else (0.0, 0.0)))


def _accuracies(totals: Array) -> Array:
    """Of every subtask, in the last axis; nan where none of its questions is there."""
    with np.errstate(invalid="ignore"):
        return totals[..., 0 : 2 * len(SUBTASKS) : 2] / totals[..., 1 : 2 * len(SUBTASKS) : 2]


def _mean(name: str, title: str, tasks: Sequence[str]) -> Measure:
    """Mean of subtasks: nan where one is missing, since an average over fewer is another quantity."""
    places = [SUBTASKS.index(task) for task in tasks]

    def estimate(totals: Array) -> Array:
        return np.asarray(_accuracies(totals)[..., places].mean(axis=-1))

    slug = name.lower().replace("/", "-").replace(" ", "-")
    return register(Measure(f"nuplanqa-table6-{slug}-v1", title, _of, "%", estimate, better="higher"))


def _total(totals: Array) -> Array:
    skills = [[SUBTASKS.index(task) for task in tasks] for tasks in SKILLS.values()]
    means = [_accuracies(totals)[..., places].mean(axis=-1) for places in skills]
    return np.asarray(np.mean(means, axis=0))


def _columns() -> tuple[Measure, ...]:
    found: list[Measure] = []
    for skill, tasks in SKILLS.items():
        found += [_mean(task, task.lower(), (task,)) for task in tasks]
        found.append(_mean(skill, "avg.", tasks))
    return (*found, register(Measure("nuplanqa-table6-total-v1", "total", _of, "%", _total, better="higher")))


def _lines(rows: Sequence[AnyRow]) -> list[AnyRow]:
    """A row once for the model and once for the blind baseline."""
    answered = [row for row in rows if row["correct"] is not None]
    shown = "single" if all(row["frames"] == 1 for row in answered) else "multi"
    found: list[AnyRow] = [{**row, "line": "the model", "hit": row["correct"], "shown": shown} for row in answered]
    if any(row["blind"] is not None for row in answered):
        name = "blind baseline: words of the options alone"
        found += [{**row, "line": name, "hit": bool(row["blind"]), "shown": shown} for row in answered]
    return found


def strict_accuracy(rows: Iterable[AnyRow]) -> tuple[float, int] | None:
    """Share of questions that are right in every circular shift, and how many; None where only one was asked."""
    groups: dict[str, list[bool]] = {}
    for row in rows:
        groups.setdefault(row["question"], []).append(row["correct"] is True)
    whole = [all(found) for found in groups.values() if len(found) == 4]
    return (sum(whole) / len(whole), len(whole)) if whole else None


def _strict_note(rows: Sequence[AnyRow]) -> str:
    strict = strict_accuracy([row for row in rows if row["line"] == "the model"])
    return f"Right in all four circular shifts: {strict[0]:.1%} of {strict[1]} questions." if strict else ""


TABLE_VI: Final = TableSpec(
    "As the paper's Tab. VI", _columns(), "line", cluster="chain", heads=("method", "answers"), total=False,
    over=_lines, published="nuplanqa/table6.json", brackets=False, note=_strict_note,
)  # fmt: skip
