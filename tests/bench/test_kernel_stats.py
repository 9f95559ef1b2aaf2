"""Intervals and tests against numbers that can be had another way."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

from chauffeur.bench.kernel.stats import LEAST_CLUSTERS, bootstrap, cluster_totals, exact_bound, sign_test

MEAN = {"mean": lambda totals: totals[..., 1] / totals[..., 0]}


def _totals(values: list[float], clusters: list[str]) -> np.ndarray:
    return cluster_totals(clusters, np.column_stack([np.ones(len(values)), values]))


def test_totals_are_sums_by_cluster_in_order_of_appearance() -> None:
    totals = _totals([1.0, 2.0, 4.0, 8.0], ["b", "a", "b", "c"])
    assert totals.tolist() == [[2.0, 5.0], [1.0, 2.0], [1.0, 8.0]]


def test_the_same_seed_gives_the_same_interval_and_another_seed_another() -> None:
    totals = _totals(list(np.random.default_rng(1).normal(size=60)), [str(i) for i in range(60)])
    first, again, other = (bootstrap(totals, MEAN, seed=seed)["mean"] for seed in (3, 3, 4))
    assert first == again
    assert first.value == other.value
    assert (first.low, first.high) != (other.low, other.high)


def test_the_interval_is_that_of_the_normal_theory_where_that_holds() -> None:
    values = np.random.default_rng(5).normal(10.0, 2.0, size=400)
    found = bootstrap(_totals(list(values), [str(i) for i in range(400)]), MEAN)["mean"]
    half = 1.96 * values.std() / 20.0
    assert found.value == pytest.approx(values.mean())
    assert found.low == pytest.approx(values.mean() - half, abs=0.03)
    assert found.high == pytest.approx(values.mean() + half, abs=0.03)


def test_items_of_one_cluster_are_one_observation() -> None:
    values = np.repeat(np.random.default_rng(2).normal(size=40), 10)
    alone = bootstrap(_totals(list(values), [str(i) for i in range(400)]), MEAN)["mean"]
    together = bootstrap(_totals(list(values), [str(i // 10) for i in range(400)]), MEAN)["mean"]
    assert alone.low is not None and alone.high is not None and together.low is not None and together.high is not None
    assert (together.high - together.low) / (alone.high - alone.low) == pytest.approx(math.sqrt(10), rel=0.1)


def test_the_interval_holds_the_truth_nineteen_times_in_twenty() -> None:
    rng = np.random.default_rng(11)
    held = 0
    for trial in range(200):
        centres = rng.normal(size=60)
        values = (centres[:, None] + rng.normal(size=(60, 4))).ravel()
        found = bootstrap(_totals(list(values), [str(i // 4) for i in range(240)]), MEAN, draws=400, seed=trial)["mean"]
        assert found.low is not None and found.high is not None
        held += found.low <= 0.0 <= found.high
    assert 0.90 <= held / 200 <= 0.98


def test_a_rate_that_never_varies_gets_the_exact_interval() -> None:
    totals = _totals([0.0] * 57, [str(i) for i in range(57)])
    never = bootstrap(totals, MEAN, rates=("mean",))["mean"]
    assert (never.low, never.how) == (0.0, "exact")
    assert never.high == pytest.approx(1 - 0.025 ** (1 / 57))
    assert never.high == exact_bound(57)
    always = bootstrap(_totals([1.0] * 57, [str(i) for i in range(57)]), MEAN, rates=("mean",))["mean"]
    assert (always.low, always.high) == (pytest.approx(1 - never.high), 1.0)


def test_no_interval_is_better_than_a_false_one() -> None:
    few = LEAST_CLUSTERS - 1
    assert bootstrap(_totals([*range(few)], [str(i) for i in range(few)]), MEAN)["mean"].low is None
    assert bootstrap(_totals([1.0, 2.0], ["a", "a"]), MEAN, rates=("mean",))["mean"].low is None
    assert bootstrap(_totals([7.0] * 50, [str(i) for i in range(50)]), MEAN)["mean"].low is None
    # A mean over the two clusters of fifty that have a value at all: often a resample has none.
    sparse = cluster_totals([str(i) for i in range(50)], np.array([[float(i < 2), float(i)] for i in range(50)]))
    with np.errstate(invalid="ignore", divide="ignore"):
        assert bootstrap(sparse, MEAN)["mean"].low is None


def test_an_undefined_estimate_has_no_value() -> None:
    with np.errstate(invalid="ignore"):
        found = bootstrap(np.zeros((20, 2)), MEAN)["mean"]
    assert (found.value, found.low, found.high) == (None, None, None)


@pytest.mark.parametrize(("first", "second"), [(10, 2), (0, 5), (5, 5), (1, 0), (300, 240), (1200, 1000)])
def test_the_sign_test_is_exact(first: int, second: int) -> None:
    count = first + second
    tail = sum(math.comb(count, k) for k in range(min(first, second) + 1))
    assert sign_test(first, second) == pytest.approx(float(min(Fraction(1), Fraction(2 * tail, 2**count))), rel=1e-9)
    assert sign_test(first, second) == sign_test(second, first)


def test_the_sign_test_of_nothing_is_one_and_of_much_is_tiny() -> None:
    assert sign_test(0, 0) == 1.0
    assert 0.0 <= sign_test(0, 4900) < 1e-300
