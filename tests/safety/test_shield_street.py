"""The shield of towns on a street of our own: full throttle towards lights, signs, people and cars."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from chauffeur.concept import Command, Observation, Sign, Signal, SignalState, VehicleState
from chauffeur.control.kinematic_bicycle import LINCOLN_MKZ, BicycleState, advanced
from chauffeur.geometry import Lane, Polyline, Pose, RoadGraph
from chauffeur.safety.shield import StreetShield

DT = 0.05
LINE = ((80.0, -2.0), (80.0, 2.0))
ROAD = RoadGraph(
    (
        Lane("a", Polyline.of([(0.0, 0.0), (80.0, 0.0)]), 4.0, 14.0, road="a", successors=("b",)),
        Lane("b", Polyline.of([(80.0, 0.0), (200.0, 0.0)]), 4.0, 14.0, road="b"),
    )
)


def instant(state: BicycleState, tick: int, *others: VehicleState, **more: object) -> Observation:
    middle = state.middle(LINCOLN_MKZ)
    lane = "a" if middle.x_m < 80.0 else "b"
    size = LINCOLN_MKZ.length_m, LINCOLN_MKZ.width_m
    ego = VehicleState(0, "car", middle.x_m, middle.y_m, middle.heading_rad, state.speed_mps, *size, lane)
    seen = Observation(tick * DT, tick, "town", ego, others, (), ROAD, None, None, False, False)
    return replace(seen, **more)  # type: ignore[arg-type]


def floored(periods: int, speed: float = 10.0, others: object = None, **more: object) -> list[Observation]:
    """Full throttle under the shield; `others` gives everybody else at a time."""
    shield, state = StreetShield(DT), BicycleState(Pose(10.0, 0.0, 0.0), speed)
    seen: list[Observation] = []
    for tick in range(periods):
        around = () if others is None else others(tick * DT)  # type: ignore[operator]
        seen.append(instant(state, tick, *around, **more))
        command = shield.filter(seen[-1], Command(5.0, 0.0)).command
        state = advanced(state, command.acceleration_mps2, command.steering_rad, DT, LINCOLN_MKZ)
    return seen


def nose(seen: Observation) -> float:
    return seen.ego.x_m + seen.ego.length_m / 2.0


@pytest.mark.parametrize(("state", "over"), [("red", False), ("green", True), ("off", True)])
def test_lights(state: SignalState, over: bool) -> None:
    seen = floored(300, signals=(Signal("s", state, ("a",), LINE),))
    assert (max(map(nose, seen)) > 80.0) is over
    assert (seen[-1].ego.speed_mps < 0.1) is not over


@pytest.mark.parametrize(("front_over_m", "goes_on"), [(0.5, False), (2.5, False), (5.5, True)])
def test_who_stands_astride_a_line_waits_for_green_with_its_tail_before_it(front_over_m: float, goes_on: bool) -> None:
    shield = StreetShield(DT)
    rear = 80.0 + front_over_m - LINCOLN_MKZ.rear_to_middle_m - LINCOLN_MKZ.length_m / 2.0
    state, red = BicycleState(Pose(rear, 0.0, 0.0), 0.0), (Signal("s", "red", ("a",), LINE),)
    for tick in range(100):
        command = shield.filter(instant(state, tick, signals=red), Command(1.5, 0.0)).command
        state = advanced(state, command.acceleration_mps2, command.steering_rad, DT, LINCOLN_MKZ)
    tail = state.middle(LINCOLN_MKZ).x_m - 0.8 * LINCOLN_MKZ.length_m / 2.0
    assert (tail > 80.0) is goes_on


def test_a_stop_sign_is_stopped_at_and_then_driven_on() -> None:
    seen = floored(500, signs=(Sign("s", "stop", ("a",), 80.0, -3.0, LINE),))
    stopped = [one for one in seen if one.ego.speed_mps < 0.1]
    assert stopped
    assert 76.0 < nose(stopped[0]) <= 80.0
    assert nose(seen[-1]) > 85.0


@pytest.mark.parametrize("seed", range(12))
def test_nobody_on_foot_is_struck(seed: int) -> None:
    pace, sets_out_s = 0.8 + 0.12 * seed, 0.25 * seed

    def crossing(now_s: float) -> tuple[VehicleState, ...]:
        y = -5.0 + pace * max(0.0, now_s - sets_out_s)
        return (VehicleState(7, "pedestrian", 55.0, y, math.pi / 2.0, pace, 0.6, 0.6, None),)

    for seen in floored(400, 9.0, crossing):
        one = seen.others[0]
        touched = abs(one.x_m - seen.ego.x_m) < 2.75 and abs(one.y_m) < 1.36
        assert not touched or seen.ego.speed_mps == 0.0


def test_it_stops_behind_a_car_that_brakes_to_a_stand() -> None:
    def lead(now_s: float) -> tuple[VehicleState, ...]:
        lasts = min(now_s, 10.0 / 6.0)
        x, speed = 26.0 + 10.0 * lasts - 3.0 * lasts**2, max(0.0, 10.0 - 6.0 * now_s)
        return (VehicleState(7, "car", x, 0.0, 0.0, speed, 4.6, 1.85, "a"),)

    for seen in floored(200, 10.0, lead):
        assert seen.others[0].x_m - 2.3 > nose(seen)


def test_no_number_stops_the_car() -> None:
    seen = instant(BicycleState(Pose(10.0, 0.0, 0.0), 5.0), 0)
    guarded = StreetShield(DT).filter(seen, Command(math.nan, 0.0))
    assert guarded.command.acceleration_mps2 < 0.0
    assert guarded.interventions[0].rule == "finite"
