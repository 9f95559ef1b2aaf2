"""Tables of results as the plain values that the page draws: cells as text, intervals on their column's axis."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Any, Final

from chauffeur.bench.kernel.metrics import Measure
from chauffeur.bench.kernel.report import Line, ResultTable, count_text, head, value_text
from chauffeur.bench.kernel.stats import DRAWS, LEAST_CLUSTERS, Interval

Json = dict[str, Any]
Span = tuple[float, float]

INTERVALS: Final = (
    f"Brackets hold 95 % intervals: percentile bootstrap, {DRAWS:,} resamples of whole clusters (e.g. scenes, with all "
    "their commands), because items of one cluster are no independent observations. They speak of other items like "
    "these, not of other traffic models or real roads. A rate of exactly 0 or 100 % never changes under resampling; "
    "its bracket is the exact binomial interval with each cluster as one trial. No bracket stands where fewer than "
    f"{LEAST_CLUSTERS} clusters have a value, or where no resample differs. Every rate is over all items to which it "
    "applies; refusals, failed programs and failures of the machine stay in it."
)
_LOWEST_POINTS: Final = -100.0
"""Bars end here: a few collisions in a small family bring a driving score to -500."""
_PLOTTED: Final = 24
"""Lines of a plot; more are no picture any more."""
_PRINTED_PLOTTED: Final = 3


def table_json(table: ResultTable, *, plotted: bool = False) -> Json:
    """A table with its legend, and for a `plotted` one the plot of its last rate or score with a better direction."""
    measures = table.spec.measures
    spans = [_span([line.found[i] for line in table.lines if not line.form], m) for i, m in enumerate(measures)]
    return {
        "title": table.spec.title,
        "lead": table.spec.lead,
        "heads": list(table.spec.heads),
        "measures": [
            {"title": m.title, "unit": m.unit, "better": m.better, "meaning": m.meaning, "head": head(m)}
            for m in measures
        ],
        "lines": [_line(line, measures, spans) for line in table.lines],
        "notes": list(table.notes),
        "plot": _plot(table) if plotted else None,
    }


def _line(line: Line, measures: tuple[Measure, ...], spans: list[Span | None]) -> Json:
    cells: list[Json] = []
    for place, measure in enumerate(measures):
        value, ends = (part.replace("-", "\N{MINUS SIGN}") for part in value_text(line, place, measure))
        span = spans[place]
        bar = None if line.form or span is None else _on_axis(_scaled(line.found[place], measure), span)
        cells.append({"text": value, "ends": ends, "bar": bar})
    return {
        "name": line.name,
        "labels": list(line.labels),
        "group": line.group,
        "items": count_text(line),
        "form": line.form,
        "published": line.published,
        "cells": cells,
    }


def _plot(table: ResultTable) -> Json | None:
    """A line a run, and of what is printed the best three."""
    columns = [place for place, measure in enumerate(table.spec.measures) if measure.better and not measure.whole]
    if not columns:
        return None
    place = columns[-1]
    measure = table.spec.measures[place]
    own = [line for line in table.lines if not line.published]
    printed = sorted(
        (line for line in table.lines if line.published),
        key=lambda line: _scaled(line.found[place], measure).value or -math.inf,
        reverse=measure.better == "higher",
    )
    shown = [line for line in (*own, *printed[:_PRINTED_PLOTTED]) if line.found[place].value is not None]
    span = _span([line.found[place] for line in shown], measure)
    if span is None or len(shown) > _PLOTTED:
        return None
    caption = f"{head(measure)}; bars are 95 % intervals."
    if printed:
        caption += " Of the printed rows, measured by others on other items, the best three."
    return {
        "caption": caption,
        "marks": [{"at": _place(mark, span), "text": f"{mark:g}"} for mark in _axis_marks(*span)],
        "lines": [
            {
                "name": f"{line.group}: {line.said}" if line.group and not line.published else line.said,
                "published": line.published,
                "text": value_text(line, place, measure)[0].replace("-", "\N{MINUS SIGN}"),
                "bar": _on_axis(_scaled(line.found[place], measure), span),
            }
            for line in shown
        ],
    }


def _scaled(interval: Interval, measure: Measure) -> Interval:
    """An interval in the unit that is shown."""
    if measure.unit != "%" or interval.value is None:
        return interval
    low, high = (None if end is None else 100.0 * end for end in (interval.low, interval.high))
    return replace(interval, value=100.0 * interval.value, low=low, high=high)


def _span(found: Iterable[Interval], measure: Measure) -> Span | None:
    """An axis that holds everything; points far below nothing stand at its end."""
    scaled = [_scaled(interval, measure) for interval in found]
    ends = [end for one in scaled for end in (one.low, one.value, one.high) if end is not None]
    if not ends or all(one.low is None for one in scaled):
        return None
    full = 100.0 if measure.better == "higher" and measure.unit in ("%", "pt", "points") else 0.0
    low, high = max(min(0.0, *ends), _LOWEST_POINTS), max(full, *ends)
    return (low, high) if high > low else None


def _place(value: float, span: Span) -> float:
    """A value on an axis, in % of its length."""
    low, high = span
    return round(100.0 * (min(max(value, low), high) - low) / (high - low), 2)


def _on_axis(interval: Interval, span: Span) -> Json | None:
    if interval.value is None:
        return None
    ends = (interval.low, interval.high)
    low, high = (None if end is None else _place(end, span) for end in ends)
    zero = _place(0.0, span) if span[0] < 0.0 < span[1] else None
    return {"value": _place(interval.value, span), "low": low, "high": high, "zero": zero}


def _axis_marks(low: float, high: float) -> list[float]:
    """Round numbers on an axis, some five of them."""
    rough = (high - low) / 5.0
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(step * power for step in (1.0, 2.0, 2.5, 5.0, 10.0) if step * power >= rough)
    return [step * place for place in range(math.ceil(low / step), math.floor(high / step) + 1)]
