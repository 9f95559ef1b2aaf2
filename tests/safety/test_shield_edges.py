"""Edges of the shield: which lane counts where ways part, whose way is known, and numbers that are none."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import pytest

from chauffeur.concept import Command, Lane, LaneId, Limits, Observation, Scenario, VehicleState
from chauffeur.safety.shield import LAMPILOT_SHIELD, FilterResult, Shield
from chauffeur.worlds.base import EGO
from chauffeur.worlds.highway import HighwayWorld
from roads import a_lane, a_road

DT = 0.1
COAST, GAS = Command(0.0, 0.0), Command(5.0, 0.0)
APPROACH: LaneId = "o0-ir0:0"
STRAIGHT: LaneId = "ir0-il2:0"
TO_THE_LEFT: LaneId = "ir0-il1:0"
ACROSS: LaneId = "ir1-il3:0"
Cross = Callable[..., Observation]


@pytest.fixture(scope="module")
def cross() -> Cross:
    """The ego `y` metres before the middle of a crossing, on its way straight on."""
    config = {"type": "dt-intersection-v0", "num_vehicles_left": 4, "num_vehicles_right": 4}
    road = HighwayWorld().reset(Scenario("crossing", "highway", config, 3)).road

    def make(y: float, speed: float, *others: VehicleState, lane: LaneId = STRAIGHT, tick: int = 0) -> Observation:
        ego = VehicleState(EGO, "car", 2.0, -y, math.pi / 2.0, speed, 5.0, 2.0, lane)
        return Observation(tick * DT, tick, "intersection", ego, others, (), road, None, None, False, False)

    return make


def guarded(observation: Observation, command: Command, aim: LaneId | None = None) -> FilterResult:
    return Shield(DT).filter(observation, command, aim)


# Where roads cross ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("command", [COAST, GAS])
@pytest.mark.parametrize(("y", "speed"), [(7.0, 8.0), (5.0, 4.0), (0.0, 8.0)])
def test_where_ways_part_the_lane_that_is_steered_for_counts_not_the_nearest(
    cross: Cross, command: Command, y: float, speed: float
) -> None:
    """A car on its way straight on may be nearest to the lane that turns left."""
    as_it_is = guarded(cross(y, speed), command, STRAIGHT)
    assert as_it_is == FilterResult(command)
    nearest = cross(y, speed, lane=TO_THE_LEFT)
    assert guarded(nearest, command, STRAIGHT) == as_it_is
    turned = guarded(nearest, command)
    assert turned.command.steering_rad > 0.1, "without an aim it is turned to the left"


def test_an_aim_that_is_no_lane_changes_nothing(cross: Cross) -> None:
    observation = cross(5.0, 4.0, lane=TO_THE_LEFT)
    assert guarded(observation, COAST, "ir0-nowhere:0") == guarded(observation, COAST)


def test_over_the_lane_of_others_the_way_that_was_promised_counts(cross: Cross) -> None:
    """In the middle of a crossing the nearest lane may be one that is driven across."""
    shield = Shield(DT)
    first, second = cross(4.0, 8.0), cross(3.2, 8.0, lane=ACROSS, tick=1)
    assert shield.filter(first, COAST, STRAIGHT) == FilterResult(COAST)
    assert shield.filter(second, COAST) == FilterResult(COAST)
    lost = guarded(second, COAST)
    assert lost.interventions, "without that promise it is steered into the lane it is over"


def turning(x: float, speed: float, lane: LaneId | None) -> VehicleState:
    """A car that comes from the left of the picture, along y = -2."""
    return VehicleState(1, "car", x, -2.0, 0.0, speed, 5.0, 2.0, lane)


def test_one_whose_way_is_not_known_is_minded_near_and_not_far(cross: Cross) -> None:
    def waits(x: float, speed: float, lane: LaneId | None) -> bool:
        found = guarded(cross(6.11, 0.0, turning(x, speed, lane)), GAS, STRAIGHT)
        return [change.rule for change in found.interventions] == ["yield"]

    assert waits(-15.0, 8.0, "o1-ir1:0")
    assert waits(-15.0, 8.0, None)
    assert waits(-15.0, 8.0, "ir1-il0:0"), "a lane that bends tells no more"
    assert waits(-39.0, 30.0, "o1-ir1:0")
    assert not waits(-39.0, 30.0, None), "it is further away than 40 m"
    assert waits(-37.0, 30.0, None)


# Numbers that are none ------------------------------------------------------------------------------------------------

LANES = tuple(a_lane(f"a-b:{i}", ((0.0, -4.0 * i), (2000.0, -4.0 * i))) for i in range(2))


def car(number: int, x: float, speed: float, y: float = 0.0, heading: float = 0.0) -> VehicleState:
    return VehicleState(number, "car", x, y, heading, speed, 5.0, 2.0, "a-b:0")


def instant(*others: VehicleState, lanes: tuple[Lane, ...] = LANES, speed: float = 20.0) -> Observation:
    return Observation(0.0, 0, "highway", car(EGO, 500.0, speed), others, (), a_road(lanes), None, None, False, False)


@pytest.mark.parametrize("limit", [math.nan, -3.0])
def test_a_limit_that_is_none_lets_nobody_gain_speed_and_no_gap_be_forgotten(limit: float) -> None:
    lanes = tuple(replace(lane, speed_limit_mps=limit) for lane in LANES)
    free = guarded(instant(lanes=lanes), GAS)
    assert free.command.acceleration_mps2 == pytest.approx(-1.0)
    assert "No faster than 0" in free.interventions[0].reason
    blocked = guarded(instant(car(1, 515.0, 0.0), lanes=lanes), GAS)
    assert blocked.command.acceleration_mps2 == -LAMPILOT_SHIELD.braking_mps2
    assert blocked.interventions[0].rule == "gap"


def test_a_cap_that_is_no_number_does_not_switch_the_gap_off() -> None:
    blocked = Shield(DT, Limits(max_over_limit_mps=math.nan)).filter(instant(car(1, 515.0, 0.0)), GAS)
    assert blocked.command.acceleration_mps2 == -LAMPILOT_SHIELD.braking_mps2


NUMBERS = ("x_m", "y_m", "heading_rad", "speed_mps", "length_m", "width_m")


@pytest.mark.parametrize("wrong", [math.nan, math.inf])
@pytest.mark.parametrize("name", NUMBERS)
def test_where_somebody_is_cannot_be_told_the_car_stops(name: str, wrong: float) -> None:
    """No comparison with such a number holds, and what is not found too close would be let through."""
    observation = instant(car(1, 515.0, 0.0))
    post = replace(car(2, 900.0, 0.0), kind="obstacle")
    for lost in (
        replace(observation, ego=replace(observation.ego, **{name: wrong})),
        replace(observation, others=(replace(observation.others[0], **{name: wrong}),)),
        replace(observation, objects=(replace(post, **{name: wrong}),)),
    ):
        found = guarded(lost, GAS)
        assert found.command == Command(-LAMPILOT_SHIELD.braking_mps2, 0.0)
        assert [change.rule for change in found.interventions] == ["finite"]
        assert found.interventions[0].reason == "Where somebody is cannot be told."


def test_while_another_cannot_be_told_the_car_is_kept_in_its_lane_and_does_not_reverse() -> None:
    lost = replace(car(1, 515.0, 0.0), x_m=math.nan)
    observation = instant(lost)
    aside = replace(observation, ego=car(EGO, 500.0, 0.4, 0.5))
    found = guarded(aside, COAST).command
    assert found.acceleration_mps2 == pytest.approx(-4.0)
    assert found.steering_rad < 0.0


def test_as_soon_as_all_is_told_again_commands_go_through() -> None:
    shield = Shield(DT)
    observation = instant()
    assert shield.filter(replace(observation, ego=replace(observation.ego, x_m=math.nan)), COAST).interventions
    assert shield.filter(observation, COAST) == FilterResult(COAST)
