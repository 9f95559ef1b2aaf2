"""What came out, a plain sentence or two a run; how runs compare is for a table to say."""

from __future__ import annotations

from collections.abc import Sequence

from chauffeur.bench.lampilot.metrics import ORIGIN, ruler_named
from chauffeur.bench.lampilot.paper import TABLE_IV, PaperRow, items_behind
from chauffeur.bench.lampilot.report import answers_note
from chauffeur.bench.report.model import SIMULATED, Cell, Headline, ReportLine
from chauffeur.bench.report.runs import Run
from chauffeur.bench.report.tables import name_with_labels, number, said

_RULE_BASED = ("IDM", "MOBIL", "Human driver")


def paper_best() -> tuple[PaperRow, PaperRow]:
    """The paper's best language-model row and its human driver, by driving score."""
    models = [row for row in TABLE_IV if row[0] not in _RULE_BASED]
    return max(models, key=lambda row: row[-1]), next(row for row in TABLE_IV if row[0] == "Human driver")


def ran_words(runs: Sequence[Run]) -> str:
    """What was run."""
    names = "; ".join(name_with_labels(run) for run in runs)
    items = len(runs[0].rows)
    scenes = len({row["sample"] for row in runs[0].rows})
    what = "One method was" if len(runs) == 1 else f"{len(runs)} methods were"
    return (
        f"{what} asked to follow {items:,} driving commands, given in words, in {scenes:,} traffic scenes "
        f"of LaMPilot-Bench: {names}. All are {SIMULATED} (highway-env physics); no real car moved."
    )


def result_words(run: Run, line: ReportLine, families: Sequence[ReportLine]) -> Headline:
    """How one run did. `line` holds the cells of the score table, `families` the same by family."""
    items, collision, completion, *_, score = line.cells
    done = sum(bool(row["success"]) for row in run.rows)
    crashes = sum(bool(row["collision"]) for row in run.rows)
    crashed = "without a collision"
    if crashes:
        what = "crashed or left the road" if ruler_named(run.ruler).off_road_collides else "crashed"
        crashed = f"{what} in {crashes:,} ({collision.text} %)"
    text = (
        f"did as asked in {done:,} of {items.text} items ({completion.text} %{_range(completion)}), {crashed}. "
        f"Driving score {score.text} points{_range(score)}."
    )
    if answers := answers_note(run.rows):
        text += f" {answers[0].upper()}{answers[1:]}; the scores above know completed drives only."
    weakest = min(families, key=lambda f: _value(f.cells[2]), default=None)
    if weakest is not None and len(families) > 1 and _value(weakest.cells[2]) < 100.0:
        text += f" Weakest task: {weakest.name}, done in {weakest.cells[2].text} %."
    return Headline(name_with_labels(run), text)


def _value(cell: Cell) -> float:
    value = None if cell.interval is None else cell.interval.value
    return 0.0 if value is None else value


def _range(cell: Cell) -> str:
    if cell.ends is None:
        return ""
    low, high = (number(end, 1) for end in cell.ends)
    return f", 95 % interval {low} to {high}"


def paper_words(lines: Sequence[ReportLine], ruler: str) -> Headline:
    """The best run beside the paper's best rows; under another ruler than theirs, why they are not compared."""
    model, human = paper_best()
    if ruler != ORIGIN.id:
        return Headline(
            "For scale",
            f"the figures that the paper printed were made by its authors' code, whose ruler is {ORIGIN.id}; these are "
            f"under {ruler}. They stand apart below and compare with nothing here.",
        )
    best = max(lines, key=lambda line: _value(line.cells[-1]))
    score = _value(best.cells[-1])
    name = said(best.name, best.labels)
    return Headline(
        "For scale",
        f"the paper printed a driving score of {model[-1]:.1f} for its best language model ({model[0]} with "
        f"{model[1]}, {items_behind(model[1])} items) and {human[-1]:.1f} for its human driver "
        f"({items_behind(human[1])} items). {name} with {best.cells[-1].text} is {_against(score, model[-1])} the "
        f"first and {_against(score, human[-1])} the second. They were measured by its authors on other items, so "
        "this places the figures and ranks nothing.",
    )


def _against(score: float, other: float) -> str:
    return "above" if score > other else "below" if score < other else "level with"


def machine_words(run: Run) -> str:
    """What is to be said of items that failed through no fault of the planner; empty when there are none."""
    broken = sum(bool(row["infra_failed"]) for row in run.rows) - run.not_asked
    if broken <= 0:
        return ""
    return (
        f"{run.name}: {broken:,} of {len(run.rows):,} items failed because of endpoint, sandbox or machine. They say "
        "nothing about the planner and still count as not completed."
    )
