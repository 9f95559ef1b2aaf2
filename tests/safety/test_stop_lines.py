"""Stop lines under the shield: nobody passes one without a stop near it, and nobody else is held up by it."""

from __future__ import annotations

import math

import pytest

from chauffeur.concept import Command, Observation, VehicleState
from chauffeur.safety.shield import LAMPILOT_SHIELD, Shield
from chauffeur.safety.shield.stop_lines import StopLines
from chauffeur.worlds.base import EGO
from roads import a_lane, a_road

DT = 0.1
GAS = Command(5.0, 0.0)
LANES = tuple(a_lane(f"a-b:{i}", ((0.0, -4.0 * i), (2000.0, -4.0 * i))) for i in range(2))
SIGN = VehicleState(9, "stop_sign", 500.0, 0.0, 0.0, 0.0, 2.0, 2.0, "a-b:0")


def instant(x: float, speed: float, y: float = 0.0, heading: float = 0.0, sign: VehicleState = SIGN) -> Observation:
    ego = VehicleState(EGO, "car", x, y, heading, speed, 5.0, 2.0, f"a-b:{round(-y / 4.0)}")
    return Observation(0.0, 0, "highway", ego, (), (sign,), a_road(LANES), None, None, False, False)


def lines() -> StopLines:
    return StopLines(LAMPILOT_SHIELD, DT)


@pytest.mark.parametrize("speed", [5.0, 13.0, 28.0])
def test_a_driver_that_never_brakes_is_stopped_gently_before_the_line_and_may_then_go_on(speed: float) -> None:
    shield, x, stood = Shield(DT), 300.0, False
    hardest = 0.0
    for _ in range(1000):
        guarded = shield.filter(instant(x, speed), GAS)
        if not stood:
            assert all(change.rule in ("stop", "speed") for change in guarded.interventions)
            hardest = min(hardest, guarded.command.acceleration_mps2)
            assert x + 2.5 <= 500.0 + 1e-6, "over the line without a stop"
            stood = speed < 1.0
        x += speed * DT
        speed = max(0.0, speed + guarded.command.acceleration_mps2 * DT)
        if x > 520.0:
            break
    assert stood
    assert x > 520.0
    assert hardest >= -LAMPILOT_SHIELD.gentle_mps2 - 1e-6


def test_a_stop_serves_only_near_the_line() -> None:
    watched = lines()
    assert watched.ahead_m(instant(420.0, 0.0)) == pytest.approx(77.5)
    assert watched.ahead_m(instant(491.9, 0.5)) == pytest.approx(5.6)
    assert watched.ahead_m(instant(495.0, 1.0)) == pytest.approx(2.5)  # rolling
    assert watched.ahead_m(instant(495.0, 0.9)) == math.inf
    assert watched.ahead_m(instant(495.1, 5.0)) == math.inf  # served, and remembered


def test_a_line_that_is_passed_or_is_not_driven_up_to_is_none() -> None:
    assert lines().ahead_m(instant(498.1, 5.0)) == math.inf
    assert lines().ahead_m(instant(490.0, 5.0, heading=math.pi)) == math.inf
    assert lines().ahead_m(instant(490.0, 5.0, sign=VehicleState(9, "stop_sign", 500.0, 0.0, 0, 0, 2, 2, None))) == (
        math.inf
    )


def test_a_line_cannot_be_driven_around_in_the_lane_beside() -> None:
    assert lines().ahead_m(instant(490.0, 5.0, y=4.0)) == pytest.approx(7.5)


def test_a_sign_that_is_seen_elsewhere_has_its_line_there() -> None:
    watched = lines()
    assert watched.ahead_m(instant(490.0, 5.0)) == pytest.approx(7.5)
    moved = VehicleState(9, "stop_sign", 540.0, 0.0, 0.0, 0.0, 2.0, 2.0, "a-b:0")
    assert watched.ahead_m(instant(490.0, 5.0, sign=moved)) == pytest.approx(47.5)


def test_it_brakes_harder_where_it_must_and_not_at_all_where_it_would_stand_behind_the_line() -> None:
    assert lines().most_mps2(10.0, 10.5) == pytest.approx(-5.0)
    assert lines().most_mps2(10.0, 6.0) == math.inf
    assert lines().most_mps2(10.0, math.inf) == math.inf
