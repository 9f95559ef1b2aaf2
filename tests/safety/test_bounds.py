"""Wishes within limits, whoever wished them: whatever number comes in, what goes on is one the car may be told."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.concept import Limits, Setpoints
from chauffeur.safety.bounds import bounded

SIGN = 30.0
LIMITS = Limits(max_over_limit_mps=1.0, min_time_headway_s=0.5, max_time_headway_s=10.0)

anything = st.floats(allow_nan=True, allow_infinity=True)
limits = st.builds(
    Limits,
    max_over_limit_mps=st.floats(-5.0, 10.0),
    min_time_headway_s=st.floats(0.01, 2.0),
    max_time_headway_s=st.floats(2.0, 10.0),
    max_speed_mps=st.none() | st.floats(0.0, 40.0),
)


@pytest.mark.parametrize(("asked", "driven"), [(0.0, 16.0), (-3.0, 16.0), (15.9, 16.0), (16.0, 16.0), (20.0, 20.0)])
def test_a_policy_is_brought_up_to_the_least_speed(asked: float, driven: float) -> None:
    setpoints, changed = bounded(Setpoints(asked, 1.5), LIMITS, SIGN, 16.0)
    assert setpoints.target_speed_mps == driven
    assert changed == (() if asked == driven else ("target_speed",))
    assert bounded(Setpoints(asked, 1.5), replace(LIMITS, max_speed_mps=10.0), SIGN, 16.0)[0].target_speed_mps == 10.0
    assert bounded(Setpoints(math.nan, 1.5), LIMITS, SIGN, 16.0)[0].target_speed_mps == 0.0  # no number: the car stops


@given(speed=st.none() | anything, headway=anything, limits=limits, sign=st.floats(0.0, 40.0) | st.just(math.nan))
def test_what_comes_out_is_within_the_limits_and_bounding_it_again_changes_nothing(
    speed: float | None, headway: float, limits: Limits, sign: float
) -> None:
    setpoints, changed = bounded(Setpoints(speed, headway), limits, sign)
    most = limits.most_mps(sign)
    if speed is None:
        assert setpoints.target_speed_mps is None
    else:
        assert setpoints.target_speed_mps is not None
        assert 0.0 <= setpoints.target_speed_mps <= (most if most > 0.0 else 0.0)
    assert limits.min_time_headway_s <= setpoints.time_headway_s <= limits.max_time_headway_s
    assert bounded(setpoints, limits, sign) == (setpoints, ())
    assert ("target_speed" in changed) == (speed is not None and setpoints.target_speed_mps != speed)
    assert ("time_headway" in changed) == (setpoints.time_headway_s != headway)


@given(speed=st.none() | st.floats(0.0, SIGN + 1.0), headway=st.floats(0.5, 10.0))
def test_what_is_within_the_limits_goes_on_as_it_is(speed: float | None, headway: float) -> None:
    setpoints = Setpoints(speed, headway, "a-b:1", "left", frozenset({3}))
    same, changed = bounded(setpoints, LIMITS, SIGN)
    assert same is setpoints
    assert changed == ()


@pytest.mark.parametrize(
    ("speed", "goes_on"),
    [(0.0, 0.0), (31.0, 31.0), (31.01, 31.0), (math.inf, 31.0), (-0.01, 0.0), (-math.inf, 0.0), (math.nan, 0.0)],
)
def test_a_speed_above_the_cap_becomes_the_cap_and_any_other_stops_the_car(speed: float, goes_on: float) -> None:
    setpoints, changed = bounded(Setpoints(speed), LIMITS, SIGN)
    assert setpoints.target_speed_mps == goes_on
    assert changed == (() if speed == goes_on else ("target_speed",))


@pytest.mark.parametrize(
    ("headway", "goes_on"),
    [(0.5, 0.5), (0.49, 0.5), (-3.0, 0.5), (-math.inf, 0.5), (10.0, 10.0), (10.1, 10.0), (math.inf, 10.0),
     (math.nan, 10.0)],
)  # fmt: skip
def test_a_headway_too_short_becomes_the_shortest_and_any_other_the_longest(headway: float, goes_on: float) -> None:
    setpoints, changed = bounded(Setpoints(20.0, headway), LIMITS, SIGN)
    assert (setpoints.target_speed_mps, setpoints.time_headway_s) == (20.0, goes_on)
    assert changed == (() if headway == goes_on else ("time_headway",))


def test_both_changes_are_named_and_the_rest_is_kept() -> None:
    setpoints = Setpoints(99.0, 99.0, "a-b:1", "left", frozenset({3}))
    mended, changed = bounded(setpoints, LIMITS, SIGN)
    assert changed == ("target_speed", "time_headway")
    assert mended == replace(setpoints, target_speed_mps=31.0, time_headway_s=10.0)


def test_the_persons_cap_counts_where_it_is_below_the_sign() -> None:
    slow = replace(LIMITS, max_speed_mps=12.0)
    assert bounded(Setpoints(20.0), slow, SIGN)[0].target_speed_mps == 12.0
    assert bounded(Setpoints(20.0), slow, 5.0)[0].target_speed_mps == 6.0


def test_a_cap_below_zero_or_none_at_all_stops_the_car() -> None:
    """A limit that is read wrongly must not make it reverse, or drive at will."""
    for over, sign in ((-10.0, 5.0), (1.0, math.nan)):
        setpoints, changed = bounded(Setpoints(20.0), replace(LIMITS, max_over_limit_mps=over), sign)
        assert (setpoints.target_speed_mps, changed) == (0.0, ("target_speed",))
