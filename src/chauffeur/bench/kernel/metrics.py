"""Metrics over rows: one registry of versioned ids, each with its unit, the rows it applies to, and its aggregate.

A metric turns a row into a few numbers that add up (hits and misses, a value) and estimates its aggregate from their
totals, so that every metric, F1 as well as a mean, gets its interval from the same cluster bootstrap (`stats.py`).
Rows to which it does not apply are left out: not applicable is not zero.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np

from chauffeur.bench.kernel.stats import Array, Estimator, Interval, bootstrap, cluster_totals
from chauffeur.concept import ConfigError

AnyRow = Mapping[str, Any]
Better = Literal["higher", "lower", ""]
"""Which direction of a metric is better; empty where neither is."""


def mean_of_totals(totals: Array) -> Array:
    """The first column over the last, which counts rows."""
    with np.errstate(invalid="ignore"):  # no row: 0 / 0, undefined
        return totals[..., 0] / totals[..., -1]


def sum_of_totals(totals: Array) -> Array:
    """The first column."""
    return totals[..., 0]


@dataclass(frozen=True, slots=True)
class Measure:
    """A metric of rows.

    Attributes:
        id: Versioned, e.g. `hostile-collision-v1`; changes whenever the same row could give another number.
        title: Head of its column.
        of: What a row adds to the totals; None where the metric does not apply.
        unit: SI unit, `points`, `%` for rates (kept in 0..1, shown times 100), empty for counts.
        estimate: The aggregate, from totals of those numbers and, last, of the rows, shape (..., columns).
        digits: Decimals shown.
        varies: Whether it has an interval; a count has none.
        better: Which direction is better. A rate with one says of every row whether it is as it should be (`missed`).
        meaning: What it says, for a reader who knows nothing of the benchmark.
        exact: Whether a % that is 0 or 100 has exact binomial bounds: a rate has, a reduction has not.
        whole: The aggregate where no totals tell it (a median, how many persons), without an interval.
    """

    id: str
    title: str
    of: Callable[[AnyRow], tuple[float, ...] | None]
    unit: str = ""
    estimate: Estimator = mean_of_totals
    digits: int = 1
    varies: bool = True
    better: Better = ""
    meaning: str = ""
    exact: bool = True
    whole: Callable[[Sequence[AnyRow]], float | None] | None = None

    def aggregate(self, rows: Sequence[AnyRow], cluster: str = "item") -> Interval:
        """The aggregate with its 95 % interval.

        Args:
            rows: Any; those to which it does not apply are left out.
            cluster: Column by which rows hang together, e.g. the scene: whole clusters are resampled.
        """
        if self.whole is not None:
            return Interval(self.whole(rows))
        found = [(str(row[cluster]), values) for row in rows if (values := self.of(row)) is not None]
        if not found:
            return Interval(None)
        values = np.array([(*values, 1.0) for _, values in found])
        if not self.varies:
            value = float(self.estimate(values.sum(axis=0)))
            return Interval(value if math.isfinite(value) else None)
        totals = cluster_totals([name for name, _ in found], values)
        rates = ("it",) if self.unit == "%" and self.exact else ()
        return bootstrap(totals, {"it": self.estimate}, rates=rates)["it"]

    def difference(self, first: Sequence[AnyRow], second: Sequence[AnyRow], cluster: str = "item") -> Interval:
        """The second rows' aggregate less the first's, on the same resamples of clusters.

        Args:
            first, second: Of the same items, in the same order.
            cluster: See aggregate.
        """
        found = [[self.of(row) for row in rows] for rows in (first, second)]
        wide = next((len(values) for rows in found for values in rows if values is not None), 0)
        if not wide or self.whole is not None:
            return Interval(None)
        none = (0.0,) * (wide + 1)
        table = [[none if values is None else (*values, 1.0) for values in rows] for rows in found]
        totals = cluster_totals([str(row[cluster]) for row in first], np.hstack([np.array(rows) for rows in table]))

        def difference(totals: Array) -> Array:
            return self.estimate(totals[..., wide + 1 :]) - self.estimate(totals[..., : wide + 1])

        if not self.varies:
            return Interval(float(difference(totals.sum(axis=0))))
        return bootstrap(totals, {"it": difference})["it"]

    def holds(self, row: AnyRow) -> bool | None:
        """True if a rate counts a row; None where it does not apply, or is no rate."""
        values = self.of(row) if self.unit == "%" and self.whole is None else None
        return None if values is None or values[0] not in (0.0, 1.0) else bool(values[0])


def missed(measures: Sequence[Measure], row: AnyRow) -> bool:
    """True if a row is not as it should be by some rate that has a better direction."""
    return any(measure.better and measure.holds(row) is (measure.better == "lower") for measure in measures)


_REGISTRY: Final[dict[str, Measure]] = {}


def register(measure: Measure) -> Measure:
    """Enter a metric in the registry. Raises ConfigError: another one has its id."""
    if (known := _REGISTRY.setdefault(measure.id, measure)) is not measure:
        raise ConfigError(
            f"There are two metrics {measure.id!r}: {known.title!r} and {measure.title!r}.",
            hint="Raise the version in the id of the one that changed.",
        )
    return measure


def registered() -> tuple[Measure, ...]:
    """The metrics of all benchmarks that were imported, by id."""
    return tuple(_REGISTRY[name] for name in sorted(_REGISTRY))


def share(
    id: str, title: str, of: Callable[[AnyRow], bool | None], digits: int = 1, better: Better = "", meaning: str = ""
) -> Measure:
    """Register the share of rows that are `of`; None where that cannot be said."""
    return register(Measure(id, title, lambda row: _one(of(row)), "%", digits=digits, better=better, meaning=meaning))


def mean(
    id: str,
    title: str,
    unit: str,
    of: Callable[[AnyRow], float | None],
    digits: int = 1,
    better: Better = "",
    meaning: str = "",
) -> Measure:
    """Register the mean of a value over the rows that have it."""
    return register(Measure(id, title, lambda row: _one(of(row)), unit, digits=digits, better=better, meaning=meaning))


def count(id: str, title: str, of: Callable[[AnyRow], bool | None], better: Better = "", meaning: str = "") -> Measure:
    """Register the number of rows that are `of`."""
    return register(
        Measure(
            id, title, lambda row: _one(of(row)), "", sum_of_totals, 0, varies=False, better=better, meaning=meaning
        )
    )


def whole(
    id: str,
    title: str,
    unit: str,
    of: Callable[[Sequence[AnyRow]], float | None],
    digits: int = 1,
    better: Better = "",
    meaning: str = "",
) -> Measure:
    """Register what only all rows together tell: a median, a sum, how many persons."""
    return register(Measure(id, title, lambda _: None, unit, digits=digits, better=better, meaning=meaning, whole=of))


def _one(value: float | None) -> tuple[float, ...] | None:
    return None if value is None else (float(value),)


@dataclass(frozen=True, slots=True)
class TableSpec:
    """A table of a benchmark: metrics by the values of a column.

    Attributes:
        title: What it says.
        measures: Its columns, after the number of items.
        group: Column that makes the lines; empty for one line over all.
        order: Values of it that come first, in this order.
        cluster: Column by which rows hang together (`Measure.aggregate`).
        rows: Which rows it is about.
        heads: Heads of the first two columns.
        total: Whether a line over all closes it.
        over: Makes its rows of those of a run, where they are others: pairs, or one row once a line it stands in.
        published: File of printed rows, e.g. `openloop/table12.json` under `data`, to stand below (`published_lines`).
        brackets: Whether text shows the ends of intervals; the page and the JSON always do.
        note: A sentence on its rows to stand below; empty for none.
        lead: What must be said before it.
    """

    title: str
    measures: tuple[Measure, ...]
    group: str = ""
    order: tuple[str, ...] = ()
    cluster: str = "item"
    rows: Callable[[AnyRow], bool] = bool
    heads: tuple[str, str] = ("", "items")
    total: bool = True
    over: Callable[[Sequence[AnyRow]], Sequence[AnyRow]] | None = None
    published: str = ""
    brackets: bool = True
    note: Callable[[Sequence[AnyRow]], str] | None = None
    lead: str = ""

    def about(self, rows: Sequence[AnyRow]) -> list[AnyRow]:
        """The table's rows, of those of a run."""
        return [row for row in (rows if self.over is None else self.over(rows)) if self.rows(row)]
