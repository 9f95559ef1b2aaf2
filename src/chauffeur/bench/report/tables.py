"""From the rows of runs to the tables of a report."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from chauffeur.bench.kernel.stats import DRAWS, LEAST_CLUSTERS, Interval, bootstrap, cluster_totals
from chauffeur.bench.kernel.store import Row
from chauffeur.bench.lampilot.metrics import ORIGIN
from chauffeur.bench.lampilot.paper import TABLE_IV, items_behind
from chauffeur.bench.lampilot.report import answers_note, families_in, intervals, ruler_of
from chauffeur.bench.report import columns as col
from chauffeur.bench.report.model import NOT_KNOWN, Cell, Column, Group, ReportLine, ReportTable
from chauffeur.bench.report.runs import NOTHING_DRIVEN, Run

LANE_TTC_CLOSE_S = 2.0
LOWEST_POINTS = -100.0
"""Bars end here: a few collisions in a small family bring a driving score to -500."""
_PER_CENT = {"collision", "completion"}


@dataclass(frozen=True, slots=True)
class RowSampling:
    """How intervals are made: `draws` resamples, from `seed`."""

    draws: int = DRAWS
    seed: int = 0


def interval_cell(column: Column, interval: Interval, factor: float = 1.0, note: str = "") -> Cell:
    """A number with its interval, in the column's unit and decimals."""
    if interval.value is None:
        return Cell("n/a", note=note)
    scaled = replace(
        interval,
        value=factor * interval.value,
        low=None if interval.low is None else factor * interval.low,
        high=None if interval.high is None else factor * interval.high,
    )
    return Cell(number(factor * interval.value, column.digits), scaled, note)


def number(value: float, digits: int) -> str:
    """A number as it stands in a table: thousands apart, a true minus, no minus before nothing."""
    text = f"{value:,.{digits}f}"
    if float(text.replace(",", "")) == 0.0:
        text = text.removeprefix("-")
    return text.replace("-", "\N{MINUS SIGN}")


def duration(seconds: float) -> str:
    """A time at a readable size: `1.52 s`, `0.78 ms`, `5.6 µs`."""
    for unit, factor in (("s", 1.0), ("ms", 1e3)):
        if seconds * factor >= 0.1:
            return f"{seconds * factor:.3g} {unit}"
    return f"{seconds * 1e6:.2g} µs"


def score_cells(rows: Sequence[Row], how: RowSampling) -> tuple[Cell, ...]:
    """Items and the columns of Tab. IV over the rows."""
    found = intervals(rows, draws=how.draws, seed=how.seed)
    columns = col.score_columns(ruler_of(rows))
    return (
        Cell(f"{len(rows):,}"),
        *(interval_cell(c, found[c.key], 100.0 if c.key in _PER_CENT else 1.0) for c in columns),
    )


def score_table(runs: Sequence[Run], how: RowSampling, *, published: bool) -> ReportTable:
    """Runs in the columns of Tab. IV; the paper's rows below them where the ruler is the one they were made with."""
    groups = [Group("", tuple(ReportLine(run.name, score_cells(run.rows, how), run.labels) for run in runs))]
    if published:
        groups.append(Group("Printed in the paper (Tab. IV): its authors' own figures and items", published_lines()))
    return ReportTable(
        id="scores",
        title="Scores",
        first="Method",
        columns=with_spans((col.ITEMS, *col.score_columns(ruler_of(runs[0].rows))), groups),
        groups=tuple(groups),
        notes=(*score_notes(groups), *(f"{run.name}: {note}." for run in runs if (note := answers_note(run.rows)))),
    )


def published_table() -> ReportTable:
    """The paper's rows on their own, for reports under another ruler than theirs."""
    groups = [Group("", published_lines())]
    return ReportTable(
        id="published",
        title="Printed in the paper (Tab. IV)",
        first="Method",
        columns=with_spans((col.ITEMS, *col.score_columns(ORIGIN)), groups),
        groups=tuple(groups),
        lead="The authors' own figures on their own items, made by their code, whose ruler is not the one of this "
        "report: compare no number of this table with one above.",
    )


def published_lines() -> tuple[ReportLine, ...]:
    """The rows of the paper's Tab. IV."""
    lines: list[ReportLine] = []
    for method, setting, *values in TABLE_IV:
        columns = col.score_columns(ORIGIN)
        cells = (Cell(number(v, c.digits), Interval(v)) for v, c in zip(values, columns, strict=True))
        name = method if setting == "-" else f"{method}, {setting}"
        lines.append(ReportLine(name, (Cell(str(items_behind(setting))), *cells), published=True))
    return tuple(lines)


def score_notes(groups: Sequence[Group]) -> tuple[str, ...]:
    """What the brackets are, as far as these rows have any."""
    own = [cell for group in groups for line in group.lines if not line.published for cell in line.cells]
    measured = [(cell, cell.interval) for cell in own if cell.interval is not None]
    notes: list[str] = []
    if any(cell.ends for cell, _ in measured):
        published = any(line.published for group in groups for line in group.lines)
        notes.append("Brackets hold 95 % intervals." + (" The paper printed none." if published else ""))
    if any(interval.how == "exact" for _, interval in measured):
        notes.append(
            "A rate of exactly 0 or 100 % never changes under resampling; its bracket is the exact binomial interval "
            "with each scene as one trial."
        )
    if any(cell.ends is None for cell, _ in measured):
        notes.append(
            f"No bracket stands where fewer than {LEAST_CLUSTERS} scenes have a value, or where no resample differs."
        )
    return tuple(notes)


def family_table(runs: Sequence[Run], how: RowSampling) -> ReportTable:
    """The same columns by task family; of several runs, side by side within each family."""
    shape = (col.ITEMS, *col.score_columns(ruler_of(runs[0].rows)))
    groups: list[Group] = []
    for family in families_in(row for run in runs for row in run.rows):
        lines: list[ReportLine] = []
        for run in runs:
            rows = [row for row in run.rows if row["family"] == family]
            if rows:
                name = run.name if len(runs) > 1 else family
                lines.append(ReportLine(name, score_cells(rows, how), run.labels if len(runs) > 1 else ()))
        groups.append(Group(family if len(runs) > 1 else "", tuple(lines)))
    if len(runs) == 1:
        groups = [Group("", tuple(line for group in groups for line in group.lines))]
    title = "By task family" if len(runs) > 1 else f"By task family: {name_with_labels(runs[0])}"
    first = "Family and method" if len(runs) > 1 else "Family"
    columns = with_spans(shape, groups)
    return ReportTable("families", title, first, columns, tuple(groups), notes=score_notes(groups))


def beside_table(runs: Sequence[Run], how: RowSampling) -> ReportTable:
    """What the benchmark does not score: conflicts in the own lane, stop signs, who was at fault."""
    groups = (Group("", tuple(ReportLine(run.name, _beside_cells(run, how), run.labels) for run in runs)),)
    known = any(cell.text != "n/a" for line in groups[0].lines for cell in line.cells)
    notes = () if known else ("These runs did not record it; a run made anew does.",)
    return ReportTable(
        "beside",
        "Beside the scores",
        "Method",
        with_spans(col.BESIDE, groups),
        groups,
        lead="What the benchmark's own measures leave out. Nothing here enters a score.",
        notes=notes,
    )


def _beside_cells(run: Run, how: RowSampling) -> tuple[Cell, ...]:
    driven = [row for row in run.rows if row["outcome"] not in NOTHING_DRIVEN]
    return (*_lane_ttc_cells(driven, how), _stop_cell(driven, how), *_fault_cells(run.rows))


def _lane_ttc_cells(driven: Sequence[Row], how: RowSampling) -> tuple[Cell, Cell]:
    recorded = [row for row in driven if "lane_ttc_s" in row]
    if not recorded:
        return NOT_KNOWN, NOT_KNOWN
    times = [float(row["lane_ttc_s"]) for row in recorded if row["lane_ttc_s"] is not None]
    note = f"{len(times):,} of {len(recorded):,} drives had a conflict"
    median = Cell(number(float(np.median(times)), col.LANE_TTC.digits), note=note) if times else Cell("n/a", note=note)

    def close(row: Row) -> bool:
        return row["lane_ttc_s"] is not None and float(row["lane_ttc_s"]) < LANE_TTC_CLOSE_S

    return median, rate_cell(col.LANE_TTC_CLOSE, recorded, close, how)


def _stop_cell(driven: Sequence[Row], how: RowSampling) -> Cell:
    if not any("stop" in row for row in driven):
        return NOT_KNOWN
    passed = [row for row in driven if row.get("stop")]
    if not passed:
        return Cell("n/a", note="no sign passed")
    return rate_cell(col.STOP, passed, lambda row: row["stop"] == "stopped", how)


def _fault_cells(rows: Sequence[Row]) -> tuple[Cell, ...]:
    kinds = (col.FAULT_EGO, col.FAULT_STRUCK, col.FAULT_ROAD_END)
    if not any("fault" in row for row in rows):
        return (NOT_KNOWN,) * len(kinds)
    return tuple(Cell(f"{sum(row.get('fault') == kind.key for row in rows):,}") for kind in kinds)


def rate_cell(column: Column, rows: Sequence[Row], holds: Callable[[Row], bool], how: RowSampling) -> Cell:
    """Share of rows for which something holds, in per cent, with its interval and `k of n`."""
    flags = np.array([[1.0, float(holds(row))] for row in rows])
    totals = cluster_totals([str(row["sample"]) for row in rows], flags)
    found = bootstrap(
        totals, {"rate": lambda t: t[..., 1] / t[..., 0]}, draws=how.draws, seed=how.seed, rates=("rate",)
    )
    return interval_cell(column, found["rate"], 100.0, f"{int(flags[:, 1].sum()):,} of {len(rows):,}")


def outcome_table(runs: Sequence[Run]) -> ReportTable:
    """How many items ended how, and the causes that are counted beside the outcome."""
    known = {column.key for column in col.OUTCOMES}
    others = sorted({str(row["outcome"]) for run in runs for row in run.rows} - known)
    shape = (col.ITEMS, *col.OUTCOMES, *(Column(name, name.replace("_", " ").capitalize()) for name in others))

    def cells(run: Run) -> tuple[Cell, ...]:
        outcomes = [str(row["outcome"]) for row in run.rows]
        ended = (Cell(f"{outcomes.count(column.key):,}") for column in shape[1:])
        causes = (Cell(f"{sum(bool(row[cause.key]) for row in run.rows):,}") for cause in col.CAUSES)
        return (Cell(f"{len(run.rows):,}"), *ended, *causes)

    return ReportTable(
        "outcomes",
        "How the drives ended, and why",
        "Method",
        (*shape, *col.CAUSES),
        (Group("", tuple(ReportLine(run.name, cells(run), run.labels) for run in runs)),),
        lead="Every planned item ends in one way. The last three columns are causes, counted beside the ending.",
    )


def cost_table(runs: Sequence[Run]) -> ReportTable:
    """Latency, tokens and money."""
    groups = (Group("", tuple(ReportLine(run.name, _cost_cells(run.rows), run.labels) for run in runs)),)
    return ReportTable(
        "cost",
        "Latency and cost",
        "Method",
        col.LATENCY,
        groups,
        lead="What it took to turn words into a plan. Latencies are of the machine and endpoint of each run; n/a means "
        "that no language model was asked, or that its price is not known.",
        simulated=False,
    )


def _cost_cells(rows: Sequence[Row]) -> tuple[Cell, ...]:
    def known(name: str) -> list[float]:
        return [float(row[name]) for row in rows if row.get(name) is not None and math.isfinite(float(row[name]))]

    def note(values: Sequence[float]) -> str:
        return "" if len(values) == len(rows) else f"over {len(values):,} items"

    latencies = known("latency_s")
    prompt, completion, usd, usd_k = col.LATENCY[2:]
    cells = [
        Cell(duration(float(np.percentile(latencies, share))), note=note(latencies)) if latencies else NOT_KNOWN
        for share in (50, 95)
    ]
    for column, name in ((prompt, "prompt_tokens"), (completion, "completion_tokens")):
        tokens = known(name)
        # A planner without a language model counts no tokens; an endpoint that does not report them gives 0.
        cells.append(
            Cell(number(float(np.mean(tokens)), column.digits), note=note(tokens)) if any(tokens) else NOT_KNOWN
        )
    prices = known("cost_usd")
    if not prices:
        return (*cells, NOT_KNOWN, NOT_KNOWN)
    total = Cell(number(sum(prices), usd.digits), note=note(prices))
    return (*cells, total, Cell(number(1000.0 * sum(prices) / len(prices), usd_k.digits)))


def with_spans(columns: Sequence[Column], groups: Sequence[Group]) -> tuple[Column, ...]:
    """Columns whose bar axes hold everything that stands in them; points far below nothing stand at the axis' end."""
    spanned: list[Column] = []
    for place, column in enumerate(columns):
        if column.span is None:
            spanned.append(column)
            continue
        low, high = column.span
        for group in groups:
            for line in group.lines:
                interval = line.cells[place].interval
                ends = () if interval is None else (interval.low, interval.value, interval.high)
                for end in ends:
                    if end is not None:
                        low, high = min(low, end), max(high, end)
        low = max(low, LOWEST_POINTS) if column.unit == "points" else low
        spanned.append(replace(column, span=(low, high) if high > low else None))
    return tuple(spanned)


def name_with_labels(run: Run) -> str:
    """A run's name with what must be said of it."""
    return said(run.name, run.labels)


def said(name: str, labels: Sequence[str]) -> str:
    """A name with its labels: `onboard [critic: evaluator]`."""
    return f"{name} [{'; '.join(labels)}]" if labels else name
