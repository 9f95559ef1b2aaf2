"""Intervals and tests for items that come in clusters: pure functions of arrays.

Paraphrases of one command are driven in one and the same scene, so their outcomes hang together: ten items of a scene
are nearer to one observation than to ten. Intervals therefore resample whole scenes (the cluster bootstrap; Cameron,
Gelbach and Miller 2008, "Bootstrap-based improvements for inference with clustered errors"), never single items.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Estimator = Callable[[Array], Array]
"""From column totals, shape (..., columns), to an estimate, shape (...); nan where it is undefined."""

DRAWS = 2000
LEVEL = 0.95
_CELLS_A_CHUNK = 4_000_000
LEAST_CLUSTERS = 10
"""With fewer clusters a bootstrap interval is far too narrow to be shown."""
_LEAST_DEFINED = 0.975
"""Share of the resamples in which an estimate must be defined for its interval to be given."""


@dataclass(frozen=True, slots=True)
class Interval:
    """An estimate with its 95 % interval.

    Attributes:
        value: The estimate; None when it is undefined (a mean over nothing).
        low, high: Ends of the interval; None when it cannot be given.
        how: `bootstrap`, `exact` (binomial bounds over the scenes, for a rate of 0 or 1 that never varies), or empty.
    """

    value: float | None
    low: float | None = None
    high: float | None = None
    how: Literal["bootstrap", "exact", ""] = ""


def cluster_totals(clusters: Sequence[str], values: Array) -> Array:
    """Sum of every column over the items of each cluster.

    Args:
        clusters: Cluster of each item, length n.
        values: Shape (n, columns).

    Returns:
        Shape (clusters, columns); clusters in order of their first item.
    """
    place: dict[str, int] = {}
    index = np.array([place.setdefault(name, len(place)) for name in clusters], dtype=np.intp)
    totals = np.zeros((len(place), values.shape[1]))
    np.add.at(totals, index, values)
    return totals


def bootstrap(
    totals: Array,
    estimators: Mapping[str, Estimator],
    *,
    draws: int = DRAWS,
    seed: int = 0,
    rates: Sequence[str] = (),
) -> dict[str, Interval]:
    """Percentile intervals of estimates under resampling of clusters.

    The same seed and number of clusters give the same resamples, so differences between runs are taken pair by pair.

    Args:
        totals: Column totals a cluster, shape (clusters, columns).
        estimators: What to estimate from column totals.
        draws: Resamples.
        seed: Of the resampling.
        rates: Names of estimates that are rates in 0..1. Where such a rate is 0 or 1 no resample ever differs, and
            its interval would be a point; the exact binomial bounds over the clusters are given instead.

    Returns:
        One interval an estimate; without ends where there are too few clusters, where the estimate is undefined in
        too many resamples, or where no resample differs.
    """
    whole = totals.sum(axis=0)
    values = {name: float(estimate(whole)) for name, estimate in estimators.items()}
    count = len(totals)
    found: dict[str, Interval] = {}
    samples: dict[str, list[Array]] = {name: [] for name in estimators}
    if count >= LEAST_CLUSTERS:
        for resampled in _resamples(totals, draws, seed):
            for name, estimate in estimators.items():
                samples[name].append(estimate(resampled))
    for name, value in values.items():
        if not math.isfinite(value):
            found[name] = Interval(None)
        elif name in rates and value in (0.0, 1.0) and count > 1:
            bound = exact_bound(count)
            low, high = (0.0, bound) if value == 0.0 else (1.0 - bound, 1.0)
            found[name] = Interval(value, low, high, "exact")
        elif count < LEAST_CLUSTERS:
            found[name] = Interval(value)
        else:
            found[name] = _percentiles(value, np.concatenate(samples[name]))
    return found


def _resamples(totals: Array, draws: int, seed: int) -> Iterator[Array]:
    """Column totals of resampled clusters, in pieces of shape (some draws, columns) that fit the cache."""
    rng = np.random.default_rng(seed)
    count = len(totals)
    chunk = max(1, _CELLS_A_CHUNK // count)
    for start in range(0, draws, chunk):
        rows = min(chunk, draws - start)
        drawn = rng.integers(count, size=(rows, count)) + count * np.arange(rows)[:, None]
        weights = np.bincount(drawn.ravel(), minlength=rows * count).reshape(rows, count)
        yield weights @ totals


def _percentiles(value: float, drawn: Array) -> Interval:
    defined = drawn[np.isfinite(drawn)]
    if len(defined) < _LEAST_DEFINED * len(drawn):
        return Interval(value)
    tail = 50.0 * (1.0 - LEVEL)
    low, high = np.percentile(defined, [tail, 100.0 - tail])
    if low == high:
        return Interval(value)
    return Interval(value, float(low), float(high), "bootstrap")


def exact_bound(count: int) -> float:
    """Upper end of the two-sided 95 % binomial interval (Clopper and Pearson) for 0 of `count`."""
    return 1.0 - ((1.0 - LEVEL) / 2.0) ** (1.0 / count)


def sign_test(first: int, second: int) -> float:
    """Exact two-sided p that `first` against `second` is a fair coin's; 1 when both are 0.

    Over items that flipped between two runs this is McNemar's exact test.
    """
    count = first + second
    if count == 0:
        return 1.0
    logs = np.array([_log_choose(count, k) for k in range(min(first, second) + 1)]) - count * math.log(2.0)
    top = float(logs.max())
    return min(1.0, 2.0 * math.exp(top) * float(np.exp(logs - top).sum()))


def _log_choose(n: int, k: int) -> float:
    return math.lgamma(n + 1) - math.lgamma(k + 1) - math.lgamma(n - k + 1)
