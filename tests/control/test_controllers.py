from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.control import (
    LAMPILOT_EGO,
    LAMPILOT_STEERING,
    LaneChangeOutlook,
    MobilParameters,
    desired_gap_m,
    full_scale,
    guard_zero,
    idm_acceleration,
    lane_keeping_steering,
    should_change,
)

speeds = st.floats(0.0, 40.0)


def test_idm_holds_target_speed_on_a_free_road() -> None:
    assert idm_acceleration(30.0, 30.0, LAMPILOT_EGO) == 0.0
    assert idm_acceleration(0.0, 30.0, LAMPILOT_EGO) == LAMPILOT_EGO.acceleration_mps2


@given(speeds, st.floats(5.0, 40.0))
def test_idm_equilibrium_gap_is_the_published_one(speed: float, target: float) -> None:
    # Treiber et al. 2000: at dv = 0 and zero acceleration, s = s* / sqrt(1 - (v/v0)^delta).
    ratio = speed / target
    if ratio > 0.95:
        return
    gap = desired_gap_m(speed, 0.0, LAMPILOT_EGO) / math.sqrt(1 - ratio**4)
    assert idm_acceleration(speed, target, LAMPILOT_EGO, gap) == pytest.approx(0.0, abs=1e-9)


@given(speeds, st.floats(6.0, 200.0), st.floats(-20, 20), st.floats(0.01, 5.0))
def test_idm_brakes_more_when_closer_faster_or_warier(speed: float, gap: float, dv: float, headway: float) -> None:
    parameters = replace(LAMPILOT_EGO, time_headway_s=headway)
    here = idm_acceleration(speed, 30.0, parameters, gap, dv)
    if desired_gap_m(speed, dv, parameters) > 0:
        assert idm_acceleration(speed, 30.0, parameters, gap * 0.9, dv) <= here
        assert idm_acceleration(speed, 30.0, parameters, gap, dv + 1.0) <= here
        warier = replace(parameters, time_headway_s=headway + 0.5)
        assert idm_acceleration(speed, 30.0, warier, gap, dv) <= here


def test_idm_stops_closer_to_a_sign_than_to_a_car() -> None:
    assert idm_acceleration(5.0, 10.0, LAMPILOT_EGO, 20.0, 5.0, 3.0) > idm_acceleration(
        5.0, 10.0, LAMPILOT_EGO, 20.0, 5.0
    )


@pytest.mark.parametrize(("value", "guarded"), [(0.0, 0.01), (1e-3, 0.01), (-1e-3, -0.01), (2.0, 2.0), (-2.0, -2.0)])
def test_guard_zero(value: float, guarded: float) -> None:
    assert guard_zero(value) == guarded


@given(speeds, st.floats(-3, 3), st.floats(-10, 10), st.floats(-3, 3))
def test_steering_is_bounded_and_odd(speed: float, heading: float, offset: float, lane: float) -> None:
    steering = lane_keeping_steering(speed, heading, offset, lane, LAMPILOT_STEERING)
    assert abs(steering) <= LAMPILOT_STEERING.max_steering_rad
    mirrored = lane_keeping_steering(speed, -heading, -offset, -lane, LAMPILOT_STEERING)
    assert mirrored == pytest.approx(-steering, abs=1e-9)


def test_steering_turns_towards_the_lane() -> None:
    assert lane_keeping_steering(20.0, 0.0, 1.0, 0.0, LAMPILOT_STEERING) < 0
    assert lane_keeping_steering(20.0, 0.0, 0.0, 0.0, LAMPILOT_STEERING) == 0.0


@pytest.mark.parametrize(
    ("value", "expected"), [(0.0, 0.0), (1.0, 5.0), (-1.0, -5.0), (6.0, 5.0), (-6.0, -5.0), (0.5, 2.5)]
)
def test_full_scale_is_clipped_and_linear(value: float, expected: float) -> None:
    assert full_scale(value, 5.0) == expected


def _outlook(gain: float, follower_now: float | None, follower_after: float | None) -> LaneChangeOutlook:
    return LaneChangeOutlook(0.0, gain, follower_now, follower_after)


@pytest.mark.parametrize(
    ("outlook", "expected"),
    [
        (_outlook(0.11, None, None), True),
        (_outlook(0.09, None, None), False),
        (_outlook(5.0, 0.0, -10.0), False),  # b_safe itself is already unsafe
        (_outlook(5.0, 0.0, -9.99), True),
        (_outlook(0.2, 0.0, -1.0), False),  # politeness weighs the follower's loss
        (_outlook(0.31, 0.0, -1.0), True),
    ],
)
def test_mobil_criteria(outlook: LaneChangeOutlook, expected: bool) -> None:
    assert should_change(outlook, MobilParameters()) is expected
