"""The kinematic bicycle: circles, stops and bounds."""

from __future__ import annotations

import math

import pytest

from chauffeur.control.kinematic_bicycle import LINCOLN_MKZ, BicycleState, advanced, curvature_of
from chauffeur.geometry import Pose

CAR = LINCOLN_MKZ


def driven(state: BicycleState, acceleration: float, steering: float, periods: int, dt: float = 0.05) -> BicycleState:
    for _ in range(periods):
        state = advanced(state, acceleration, steering, dt, CAR)
    return state


def test_a_full_circle_ends_where_it_began() -> None:
    steering = math.atan(CAR.wheelbase_m / 20.0)
    start = BicycleState(Pose(0.0, 0.0, 0.0), 5.0, steering)
    periods = 1000
    end = driven(start, 0.0, steering, periods, 2.0 * math.pi * 20.0 / 5.0 / periods)
    assert math.hypot(end.rear.x_m, end.rear.y_m) < 1e-6
    assert end.rear.heading_rad == pytest.approx(2.0 * math.pi)


def test_it_brakes_to_a_stand_and_not_backwards() -> None:
    end = driven(BicycleState(Pose(0.0, 0.0, 0.0), 10.0), -8.0, 0.0, 60)
    assert end.speed_mps == 0.0
    assert end.rear.x_m == pytest.approx(10.0**2 / 16.0, abs=1e-6)


@pytest.mark.parametrize(("asked", "done"), [(50.0, CAR.most_acceleration_mps2), (-50.0, -CAR.most_braking_mps2)])
def test_pedals_have_ends(asked: float, done: float) -> None:
    state = advanced(BicycleState(Pose(0.0, 0.0, 0.0), 10.0), asked, 0.0, 0.05, CAR)
    assert state.acceleration_mps2 == pytest.approx(done)


def test_the_wheel_turns_no_faster_and_no_further_than_it_can() -> None:
    state = advanced(BicycleState(Pose(0.0, 0.0, 0.0), 1.0), 0.0, 9.0, 0.05, CAR)
    assert state.steering_rad == pytest.approx(CAR.steering_rate_radps * 0.05)
    assert driven(state, 0.0, 9.0, 100).steering_rad == pytest.approx(CAR.most_steering_rad)


def test_tyres_hold_so_much_and_no_more() -> None:
    assert 20.0**2 * curvature_of(20.0, 0.5, CAR) == pytest.approx(CAR.grip_mps2)
    assert curvature_of(2.0, 0.5, CAR) == pytest.approx(math.tan(0.5) / CAR.wheelbase_m)
