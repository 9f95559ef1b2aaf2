"""The shield where roads cross: ways and what is known of them, commands one at a time, and trips that ended badly."""

from __future__ import annotations

import importlib.util
import math
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chauffeur.concept import Command, Frame, Lane, LaneId, Observation, Scenario, Setpoints, VehicleState
from chauffeur.control import LAMPILOT_STEERING, lane_keeping_steering
from chauffeur.safety.blame import blame
from chauffeur.safety.shield import LAMPILOT_SHIELD, FilterResult, Shield, rollout
from chauffeur.safety.shield.crossing import (
    CLEARS,
    DUE,
    KIND,
    LAST,
    STOPS,
    Array,
    CrossingPlan,
    Junction,
    Motion,
    Outlook,
    runs_along,
)
from chauffeur.safety.shield.sweep import recovery_steering
from chauffeur.safety.shield.traffic_arrays import TrafficArrays
from chauffeur.worlds.base import EGO
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.core.motion import slide
from roads import a_lane, a_road

DT = 0.1
COAST, GAS, BRAKE = Command(0.0, 0.0), Command(5.0, 0.0), Command(-5.0, 0.0)
CROSSING = Scenario(
    "crossing", "highway", {"type": "dt-intersection-v0", "num_vehicles_left": 4, "num_vehicles_right": 4}, 3
)
UPWARDS = math.pi / 2.0
"""Heading of the ego's approach: y grows."""

finite = st.floats(-1.0, 1.0)


@pytest.fixture(scope="module")
def road() -> Observation:
    """A crossing of which only the lanes are used."""
    return HighwayWorld().reset(CROSSING)


@settings(max_examples=200, deadline=None)
@given(
    speed=st.floats(0.0, 15.0), lateral=finite, yaw=st.floats(-6.0, 6.0), steering=st.floats(-1.5, 1.5),
    acceleration=st.floats(-8.0, 5.0),
)  # fmt: skip
def test_the_vehicle_is_the_worlds_own(
    speed: float, lateral: float, yaw: float, steering: float, acceleration: float
) -> None:
    mine = np.array([1.0, 2.0, 0.3, speed, lateral, yaw])
    theirs = mine.copy()
    rollout.move(mine, acceleration, steering, DT)
    slide(theirs, steering, acceleration, DT)
    assert mine == pytest.approx(theirs, abs=1e-9)


@settings(max_examples=50, deadline=None)
@given(speed=st.floats(0.5, 15.0), across=finite, heading=st.floats(-0.2, 0.2))
def test_the_light_hand_is_lane_keeping(speed: float, across: float, heading: float) -> None:
    way = np.stack([np.arange(0.0, 50.0, rollout.STEP_M), np.zeros(100), np.zeros(100)], axis=1)
    state = np.array([20.0, across, heading, speed, 0.0, 0.0])
    mine = rollout.wheel(0, state, way, 40, 0.0, DT)
    theirs = lane_keeping_steering(speed, heading, across, 0.0, LAMPILOT_STEERING)
    approach = abs(math.asin(max(-1.0, min(1.0, across / 0.6 / speed))))
    if approach < 0.2 and abs(theirs) < 0.3:  # within the shield's gentler bounds
        assert mine == pytest.approx(theirs)
    assert abs(mine) <= 0.3
    assert rollout.wheel(1, state, way, 40, 0.0, DT) == 0.0


def test_what_an_observation_does_not_show_is_known() -> None:
    world, motion, rng = HighwayWorld(), Motion(DT), np.random.default_rng(5)
    observation = world.reset(CROSSING)
    for _ in range(40):
        state = motion.observe(observation)
        command = Command(float(rng.uniform(-5.0, 5.0)), float(rng.uniform(-0.7, 0.7)))
        motion.commanded(observation, state, command)
        rollout.move(state, command.acceleration_mps2, command.steering_rad, DT)
        world.step(command)
        observation = world.observe()
        ego = observation.ego
        assert state[:4] == pytest.approx([ego.x_m, ego.y_m, ego.heading_rad, ego.speed_mps], abs=1e-9)


# One command at a time ------------------------------------------------------------------------------------------------


def at(
    road: Observation,
    y: float,
    speed: float,
    *others: VehicleState,
    heading: float = UPWARDS,
    lane: LaneId = "o0-ir0:0",
    tick: int = 0,
) -> Observation:
    """The ego on its way straight on, `y` metres before the middle."""
    ego = VehicleState(EGO, "car", 2.0, -y, heading, speed, 5.0, 2.0, lane)
    return Observation(tick * DT, tick, "intersection", ego, others, (), road.road, None, None, False, False)


def crosser(x: float, speed: float) -> VehicleState:
    """A car that comes from the left of the picture, along y = -2."""
    lane = "o1-ir1:0" if x < -11.0 else "ir1-il3:0"
    return VehicleState(1, "car", x, -2.0, 0.0, speed, 5.0, 2.0, lane)


def guarded(observation: Observation, command: Command, aim: LaneId | None = None) -> FilterResult:
    return Shield(DT).filter(observation, command, aim)


STRAIGHT: LaneId = "ir0-il2:0"
TO_LEFT: LaneId = "ir0-il1:0"
ACROSS_THE_ROAD: LaneId = "ir1-il3:0"


@pytest.mark.parametrize(
    ("x", "y", "heading", "speed", "wheel"),
    [(3.4, 28.7, 0.99, 7.4, 0.0), (3.7, 13.4, 1.11, 8.1, -0.59), (0.7, 37.6, 2.05, 7.8, 0.26)],
)
def test_a_car_that_is_going_to_leave_its_lane_brakes_before_anything(
    road: Observation, x: float, y: float, heading: float, speed: float, wheel: float
) -> None:
    """It was steered back, but at the acceleration that was asked for: some ran out of road on the way."""
    observation = at(road, y, speed, heading=heading)
    strayed = replace(observation, ego=replace(observation.ego, x_m=x))
    found = guarded(strayed, Command(2.0, wheel))
    assert found.command.acceleration_mps2 == -8.0
    assert [change.rule for change in found.interventions] == ["lane"]


def test_with_nobody_there_nothing_is_changed(road: Observation) -> None:
    for command in (GAS, COAST, Command(-2.0, 0.0)):
        assert guarded(at(road, 16.0, 6.0), command, STRAIGHT) == FilterResult(command)


def test_it_waits_for_who_crosses_and_not_longer(road: Observation) -> None:
    assert guarded(at(road, 7.0, 0.0), GAS, STRAIGHT).command == GAS
    assert guarded(at(road, 6.11, 0.0, lane=STRAIGHT), GAS, STRAIGHT).command == GAS, "empty, and cleared at once"
    waits = guarded(at(road, 6.11, 0.0, crosser(-15.0, 8.0), lane=STRAIGHT), GAS, STRAIGHT)
    assert 0.0 <= waits.command.acceleration_mps2 < 1.0
    assert [change.rule for change in waits.interventions] == ["yield"]
    assert guarded(at(road, 6.2, 0.0, crosser(12.0, 8.0), lane=STRAIGHT), GAS, STRAIGHT).command == GAS
    assert guarded(at(road, 6.2, 0.0, crosser(-80.0, 8.0), lane=STRAIGHT), GAS, STRAIGHT).command == GAS


def test_inside_it_goes_on(road: Observation) -> None:
    inside = at(road, 2.0, 1.0, crosser(-25.0, 8.0), lane=STRAIGHT)
    clears = guarded(inside, Command(-5.0, 0.0), STRAIGHT)
    assert clears.command.acceleration_mps2 > 0.0
    assert [change.rule for change in clears.interventions] == ["clear"]


def test_a_wild_wheel_is_turned_back(road: Observation) -> None:
    wild = guarded(at(road, 60.0, 10.0, heading=UPWARDS + 0.4), Command(0.0, math.pi / 4))
    assert wild.command.steering_rad < 0.1
    assert [change.rule for change in wild.interventions] == ["lane"]


@pytest.mark.parametrize("command", [COAST, GAS])
@pytest.mark.parametrize(("y", "speed"), [(7.0, 8.0), (5.0, 4.0), (0.0, 8.0)])
def test_where_ways_part_the_lane_that_is_steered_for_counts_not_the_nearest(
    road: Observation, command: Command, y: float, speed: float
) -> None:
    """A car on its way straight on may be nearest to the lane that turns left."""
    as_it_is = guarded(at(road, y, speed, lane=STRAIGHT), command, STRAIGHT)
    assert as_it_is == FilterResult(command)
    nearest = at(road, y, speed, lane=TO_LEFT)
    assert guarded(nearest, command, STRAIGHT) == as_it_is
    turned = guarded(nearest, command)
    assert turned.command.steering_rad > 0.1, "without an aim it is turned to the left"


def test_an_aim_that_is_no_lane_changes_nothing(road: Observation) -> None:
    observation = at(road, 5.0, 4.0, lane=TO_LEFT)
    assert guarded(observation, COAST, "ir0-nowhere:0") == guarded(observation, COAST)


def test_over_the_lane_of_others_the_way_that_was_promised_counts(road: Observation) -> None:
    """In the middle of a crossing the nearest lane may be one that is driven across."""
    shield = Shield(DT)
    first, second = at(road, 4.0, 8.0, lane=STRAIGHT), at(road, 3.2, 8.0, lane=ACROSS_THE_ROAD, tick=1)
    assert shield.filter(first, COAST, STRAIGHT) == FilterResult(COAST)
    assert shield.filter(second, COAST) == FilterResult(COAST)
    lost = guarded(second, COAST)
    assert lost.interventions, "without that promise it is steered into the lane it is over"


def turning(x: float, speed: float, lane: LaneId | None) -> VehicleState:
    """A car that comes from the left of the picture, along y = -2."""
    return VehicleState(1, "car", x, -2.0, 0.0, speed, 5.0, 2.0, lane)


def test_one_whose_way_is_not_known_is_minded_near_and_not_far(road: Observation) -> None:
    def waits(x: float, speed: float, lane: LaneId | None) -> bool:
        found = guarded(at(road, 6.11, 0.0, turning(x, speed, lane), lane=STRAIGHT), GAS, STRAIGHT)
        return [change.rule for change in found.interventions] == ["yield"]

    assert waits(-15.0, 8.0, "o1-ir1:0")
    assert waits(-15.0, 8.0, None)
    assert waits(-15.0, 8.0, "ir1-il0:0"), "a lane that bends tells no more"
    assert waits(-39.0, 30.0, "o1-ir1:0")
    assert not waits(-39.0, 30.0, None), "it is further away than 40 m"
    assert waits(-37.0, 30.0, None)


# Ways over a crossing of our own --------------------------------------------------------------------------------------

Points = tuple[tuple[float, float], ...]

IN: LaneId = "south-middle:0"
ON: LaneId = "middle-north:0"
LEFT: LaneId = "middle-west:0"
OUT: LaneId = "north-far:0"
ACROSS: LaneId = "one side-other side:0"
SLANTED: LaneId = "corner-north:0"


def lane(name: LaneId, *points: tuple[float, float]) -> Lane:
    return a_lane(name, points, limit=15.0)


BEND: Points = tuple(
    (-10.0 + 10.0 * math.cos(at), 10.0 * math.sin(at)) for at in (math.radians(3.0 * n) for n in range(31))
)  # fmt: skip
NETWORK = (
    lane(LEFT, *BEND),
    lane(IN, (0.0, -60.0), (0.0, -30.0), (0.0, 0.0)),
    lane(ON, (0.0, 0.0), (0.0, 40.0)),
    lane("middle-north:1", (4.0, 0.0), (4.0, 40.0)),
    lane(OUT, (0.0, 40.0), (0.0, 60.0), (0.0, 80.0)),
    lane(ACROSS, (-50.0, 20.0), (50.0, 20.0)),
    lane(SLANTED, (-50.0, -50.0), (-10.0, -20.0), (30.0, 10.0)),
    lane("bent-much:0", (-100.0, 0.0), (-110.0, 0.11), (-120.0, 0.0)),
    lane("bent-little:0", (-100.0, 9.0), (-110.0, 9.09), (-120.0, 9.0)),
)
"""From the south a lane leads on to the north and one bends to the west; another crosses, and some have no part."""


def car(number: int, x: float, y: float, heading: float, speed: float, on: LaneId | None = None) -> VehicleState:
    return VehicleState(number, "car", x, y, heading, speed, 5.0, 2.0, on)


def instant(ego: VehicleState, *others: VehicleState, lanes: tuple[Lane, ...] = NETWORK) -> Observation:
    return Observation(0.0, 0, "intersection", ego, others, (), a_road(lanes), None, None, False, False)


def looked(ego: VehicleState, *others: VehicleState) -> Outlook:
    observation = instant(ego, *others)
    assert ego.lane is not None
    return Junction(a_road(NETWORK), LAMPILOT_SHIELD, DT).outlook(observation, TrafficArrays.of(observation), ego.lane)


def ways(start: LaneId, onto: LaneId | None = None) -> list[Array]:
    return Junction(a_road(NETWORK), LAMPILOT_SHIELD, DT).ways_from(start, onto)


def test_ways_lead_over_all_that_follows_and_the_straightest_is_first() -> None:
    on, left = ways(IN)
    assert on[:, 0] == pytest.approx(np.zeros(280))
    assert on[:, 1] == pytest.approx(np.arange(-60.0, 80.0, 0.5)), "a point every half metre, to the very end"
    assert on[:, 2] == pytest.approx(np.full(280, UPWARDS))
    assert left[:120] == pytest.approx(on[:120], abs=1e-2)
    bent = left[121:]
    assert np.hypot(bent[:, 0] + 10.0, bent[:, 1]) == pytest.approx(np.full(len(bent), 10.0), abs=0.02)
    assert bent[-1] == pytest.approx([-10.0, 10.0, math.pi], abs=0.4)
    assert [way.tolist() for way in ways(IN, LEFT)] == [left.tolist()]


def test_a_way_ends_where_nothing_follows() -> None:
    (out,) = ways(OUT)
    assert out[:, 1] == pytest.approx(np.arange(40.0, 80.0, 0.5))
    (on,) = ways(ON)
    assert on[-1] == pytest.approx([0.0, 79.5, UPWARDS])


def test_the_lane_that_is_steered_for_is_the_only_way_where_it_follows() -> None:
    junction = Junction(a_road(NETWORK), LAMPILOT_SHIELD, DT)
    state = np.array([0.0, -30.0, UPWARDS, 5.0, 0.0, 0.0])
    count = {aim: len(junction.candidates(IN, aim, state)) for aim in (ON, LEFT, None, IN, OUT, ("middle", "no", 0))}
    assert count == {ON: 1, LEFT: 1, None: 2, IN: 2, OUT: 2, ("middle", "no", 0): 2}


def test_nobody_may_stand_in_straight_lanes_but_the_own_and_those_of_its_fork() -> None:
    straight = {
        IN: (0.0, -60.0, 0.0, 1.0, 60.0),
        ON: (0.0, 0.0, 0.0, 1.0, 40.0),
        "middle-north:1": (4.0, 0.0, 0.0, 1.0, 40.0),
        OUT: (0.0, 40.0, 0.0, 1.0, 40.0),
        ACROSS: (-50.0, 20.0, 1.0, 0.0, 100.0),
        SLANTED: (-50.0, -50.0, 0.8, 0.6, 100.0),
        "bent-little:0": (-100.0, 9.0, -1.0, 0.0, 20.0),
    }
    junction = Junction(a_road(NETWORK), LAMPILOT_SHIELD, DT)
    for own, free in ((IN, {IN}), (ON, {IN, ON}), (LEFT, {IN, ON}), (OUT, {ON, OUT}), (ACROSS, {ACROSS})):
        for _ in range(2):
            rows = junction.keep_clear(own)
            wanted = [row for name, row in straight.items() if name not in free]
            assert rows == pytest.approx(np.array(wanted), abs=1e-3), own


def test_a_car_drives_along_a_way_whose_direction_it_has_where_it_is() -> None:
    (way,) = ways(IN, LEFT)

    def along(x: float, y: float, degrees: float) -> bool:
        return runs_along(way, np.array([x, y, math.radians(degrees), 1.5, 0.0, 0.0]))

    assert along(0.5, -40.0, 90.0)
    assert along(0.5, -40.0, 31.0)
    assert not along(0.5, -40.0, 29.0)
    assert not along(0.5, -40.0, 180.0)
    assert along(-9.5, 9.5, 180.0)
    assert not along(-9.5, 9.5, 90.0)
    assert not along(-9.5, 9.5, 0.0)


def test_where_a_way_comes_back_beside_itself_the_nearest_part_counts() -> None:
    up = [(0.0, n * 0.5, UPWARDS) for n in range(40)]
    down = [(8.0, 20.0 - n * 0.5, -UPWARDS) for n in range(40)]
    way = np.array([*up, *down])
    assert runs_along(way, np.array([7.5, 5.0, -UPWARDS, 5.0, 0.0, 0.0]))
    assert not runs_along(way, np.array([7.5, 5.0, UPWARDS, 5.0, 0.0, 0.0]))
    assert looked(car(EGO, 7.5, 5.0, -UPWARDS, 5.0, ON)).way(way).at == 70


# What is to be known of a way -----------------------------------------------------------------------------------------


def test_a_way_is_cleared_half_a_length_beyond_the_last_place_where_somebody_may_be_met() -> None:
    (on,) = ways(IN, ON)
    way = looked(car(EGO, 0.0, -10.0, UPWARDS, 5.0, IN), car(1, -30.0, 20.0, 0.0, 8.0, ACROSS)).way(on)
    assert way.at == 100
    assert way.beyond * 0.5 - 60.0 == pytest.approx(24.5 + 2.5), "5 m beside the middle of it, and half of the car"
    assert way.hold_m == math.inf


@pytest.mark.parametrize("speed", [0.0, 6.0])
def test_behind_a_lead_the_margin_is_left_to_where_it_may_stop(speed: float) -> None:
    (on,) = ways(IN, ON)
    way = looked(car(EGO, 0.0, -10.0, UPWARDS, 5.0, IN), car(1, 0.0, 5.0, UPWARDS, speed, ON)).way(on)
    assert way.hold_m == pytest.approx(65.0 - 2.5 + speed**2 / 12.0 - LAMPILOT_SHIELD.margin_m)


def test_who_is_on_no_lane_goes_on_as_it_is_turned() -> None:
    for heading in (0.0, UPWARDS, math.pi, -UPWARDS, math.atan2(0.6, 0.8)):
        others = looked(car(EGO, 0.0, -10.0, UPWARDS, 5.0, IN), car(1, 3.0, 5.0, heading, 4.0)).others
        assert others.tolist() == [[3.0, 5.0, math.cos(heading), math.sin(heading), 4.0, 2.5, 1.0]]


# Plans ----------------------------------------------------------------------------------------------------------------


def test_each_way_plan_and_care_is_judged_by_itself() -> None:
    """Who comes along the crossing road meets the way on, not the bend; who follows counts for the kinder care."""
    ego = car(EGO, 0.0, -1.0, UPWARDS, 8.0, IN)
    others = car(1, -14.0, 20.0, 0.0, 8.0, ACROSS), car(2, 0.0, -9.0, UPWARDS, 12.0, IN)
    on, left = ways(IN)
    together = looked(ego, *others)
    for way in (on, left):
        for plan in (*STOPS, *CLEARS):
            for care in (KIND, DUE, LAST):
                trouble = together.trouble_s(GAS, way, plan, care)
                assert trouble == looked(ego, *others).trouble_s(GAS, way, plan, care)
    clear = CrossingPlan(5.0, 3)
    assert together.trouble_s(GAS, on, clear, DUE) < math.inf
    assert together.trouble_s(GAS, left, clear, DUE) == math.inf
    stop = CrossingPlan(-8.0, 0)
    assert together.trouble_s(COAST, left, stop, KIND) < together.trouble_s(COAST, left, stop, DUE)


def test_the_crossing_may_take_longer_to_clear_than_a_stop_takes() -> None:
    (on,) = ways(IN, ON)
    outlook = looked(car(EGO, 0.0, 0.0, UPWARDS, 0.0, ON), car(1, -49.0, 20.0, 0.0, 2.0, ACROSS))
    assert outlook.trouble_s(COAST, on, CrossingPlan(5.0, 0), DUE) == math.inf


# How the vehicle moves ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("x", "y", "heading"),
    [(0.2, 0.5, UPWARDS), (0.0, 0.9, UPWARDS), (0.0, 0.5, UPWARDS + 0.1), (-0.3, 0.2, UPWARDS - 0.2)],
)
def test_what_was_not_foreseen_is_read_from_the_way_covered(x: float, y: float, heading: float) -> None:
    """Sideways against the heading half way, and how far it has turned, both in a period of 0.1 s."""

    def seen(motion: Motion, x: float, y: float, heading: float, tick: int) -> list[float]:
        observation = replace(instant(car(EGO, 3.0 + x, -10.0 + y, heading, 5.0, IN)), tick=tick)
        state = motion.observe(observation)
        motion.commanded(observation, state, COAST)
        return state.tolist()

    motion = Motion(DT)
    assert seen(motion, 0.0, 0.0, UPWARDS, 0) == [3.0, -10.0, UPWARDS, 5.0, 0.0, 0.0]
    half = (UPWARDS + heading) / 2.0
    sliding, turning = (math.cos(half) * y - math.sin(half) * x) / DT, (heading - UPWARDS) / DT
    assert seen(motion, x, y, heading, 1)[4:] == pytest.approx([sliding, turning])
    assert seen(motion, x + 1.0, y + 1.0, heading + 0.1, 3)[4:] == [0.0, 0.0], "nothing is known after a gap"
    motion = Motion(DT)
    seen(motion, 0.0, 0.0, UPWARDS, 0)
    assert seen(motion, 0.0, 0.5, UPWARDS, 1)[4:] == pytest.approx([0.0, 0.0], abs=1e-9), "as it was foreseen"
    motion = Motion(DT)
    seen(motion, 0.0, 0.0, 0.0, 0)
    assert seen(motion, 0.5, 0.3, 0.0, 1)[4:] == pytest.approx([3.0, 0.0]), "across it only"


# Commands -------------------------------------------------------------------------------------------------------------

APPROACH: LaneId = "o0-ir0:0"
TO_RIGHT: LaneId = "ir0-il3:0"
STRAYS = "The car would leave its way, or get into that of somebody who crosses."
YIELDS = "Somebody crosses ahead, and goes first."
Told = tuple[float, float, str, str]
Judged = Callable[..., Told]


@pytest.fixture(scope="module")
def judged(road: Observation) -> Judged:
    """What a command becomes on the simulated crossing: acceleration, steering, and the rule and reason of the last
    change, if any."""
    lanes = road.road.lanes

    def judge(
        ego: VehicleState, *others: VehicleState, asks: Command, aim: LaneId | None, shield: Shield | None = None
    ) -> Told:
        found: FilterResult = (shield or Shield(DT)).filter(instant(ego, *others, lanes=lanes), asks, aim)
        last = found.interventions[-1] if found.interventions else None
        rule, reason = ("", "") if last is None else (last.rule, last.reason)
        return found.command.acceleration_mps2, found.command.steering_rad, rule, reason

    return judge


def me(x: float, y: float, heading: float, speed: float, on: LaneId) -> VehicleState:
    return car(EGO, x, y, heading, speed, on)


Scene = tuple[VehicleState, tuple[VehicleState, ...], Command, LaneId | None, Told]
SCENES: dict[str, Scene] = {
    "who can still stop need not be able to be through": (
        me(2.0, -17.0, 1.571, 8.0, APPROACH),
        (car(1, -2.0, 108.0, -1.571, 0.0, "o2-ir2:0"), car(2, -4.18, 2.0, -3.142, 8.0, "ir3-il1:0")),
        GAS, TO_LEFT, (5.0, 0.0, "", ""),
    ),
    "where braking ends in the middle the crossing is cleared": (
        me(-0.52, -3.39, 2.182, 8.0, TO_LEFT),
        (car(1, 1.89, -9.78, 1.658, 2.0, TO_LEFT),),
        Command(-5.0, -0.2), TO_LEFT, (2.0, 0.233, "clear", STRAYS),
    ),
    "off the way behind a lead it brakes with all it has": (
        me(0.5, 6.6, 1.371, 6.0, STRAIGHT),
        (car(1, -5.4, -4.01, -0.687, 0.0, "ir1-il0:0"), car(2, 2.0, 4.4, 1.571, 8.0, STRAIGHT)),
        BRAKE, STRAIGHT, (-8.0, -0.001, "yield", STRAYS),
    ),
    "off the way with room to stop it is steered back as it brakes": (
        me(4.9, -6.68, 0.384, 8.0, TO_RIGHT),
        (car(1, 5.18, 4.19, 2.454, 0.0, "ir3-il2:0"), car(2, 106.0, -2.0, 0.0, 8.0, "il3-o3:0")),
        BRAKE, TO_RIGHT, (-5.0, 0.3, "lane", STRAYS),
    ),
    "who stands off the way stands on": (
        me(0.5, -17.0, 1.571, 0.0, APPROACH),
        (car(1, -8.14, -2.0, 0.0, 0.0, "ir1-il3:0"), car(2, 7.26, 2.0, -3.142, 0.0, "ir3-il1:0")),
        BRAKE, TO_RIGHT, (0.0, -0.3, "yield", STRAYS),
    ),
    "who is in the middle goes on rather than brake there": (
        me(2.0, -5.5, 1.571, 10.0, STRAIGHT),
        (car(1, -0.19, 8.94, 1.484, 8.0, "ir1-il2:0"), car(2, 2.0, 81.0, 1.571, 2.0, "il2-o2:0")),
        Command(0.0, -0.2), "il2-o2:0", (2.0, -0.001, "clear", STRAYS),
    ),
    "nobody promises to be through behind a lead that stands": (
        me(1.2, -10.92, 1.473, 10.0, TO_RIGHT),
        (car(1, 11.0, -2.0, 0.098, 0.0, TO_RIGHT), car(2, -2.0, 76.0, -1.571, 8.0, "o2-ir2:0")),
        Command(-2.0, 0.2), "il3-o3:0", (-8.0, -0.3, "lane", STRAYS),
    ),
    "who follows closely is spared a stop in front of it": (
        me(2.0, -8.8, 1.571, 1.0, STRAIGHT),
        (car(1, 2.0, -16.0, 1.571, 8.0, APPROACH),),
        COAST, "il2-o2:0", (-2.0, 0.0, "yield", YIELDS),
    ),
    "a plan that ends well is better than to stand beside somebody's way": (
        me(1.03, -9.04, 1.858, 6.0, TO_LEFT),
        (car(1, -2.88, -7.18, -1.08, 8.0, "ir1-il0:0"), car(2, -31.0, -2.0, 0.0, 0.0, "o1-ir1:0")),
        GAS, "il1-o1:0", (-8.0, 0.0, "yield", STRAYS),
    ),
    "to stand beside somebody's way is better than to drive into it": (
        me(1.2, -10.92, 0.973, 2.0, TO_RIGHT),
        (car(1, 2.08, -10.16, 1.473, 4.0, TO_RIGHT),),
        GAS, "il3-o3:0", (-8.0, 0.3, "yield", STRAYS),
    ),
    "to stand beside somebody's way the wheel that fits is taken": (
        me(0.5, -17.0, 1.371, 2.0, APPROACH),
        (car(1, -3.74, -4.0, 0.0, 8.0, "ir1-il3:0"), car(2, 2.0, 11.0, 1.571, 4.0, STRAIGHT)),
        GAS, STRAIGHT, (-8.0, 0.0, "yield", STRAYS),
    ),
    "far off its way it brakes first, harder than was asked, and is steered back": (
        me(0.5, -8.8, 1.771, 6.0, STRAIGHT),
        (car(1, -1.0, -41.0, 1.571, 4.0, APPROACH),),
        BRAKE, "il2-o2:0", (-8.0, -0.3, "lane", STRAYS),
    ),
    "inside, with somebody coming, the crossing is cleared": (
        me(2.0, -2.0, 1.571, 1.0, STRAIGHT),
        (car(1, -25.0, -2.0, 0.0, 8.0, "o1-ir1:0"),),
        BRAKE, STRAIGHT, (2.0, 0.0, "clear", "Somebody is coming: the crossing has to be cleared."),
    ),
    "only the way that is steered for has to be open": (
        me(0.5, -21.0, 1.071, 2.0, APPROACH),
        (car(1, -2.0, 4.4, -1.571, 2.0, "ir2-il0:0"),),
        Command(-2.0, 0.0), TO_RIGHT, (-2.0, 0.0, "", ""),
    ),
    "off the approach it is steered onto the way that is steered for": (
        me(2.0, -11.0, 1.571, 8.0, APPROACH),
        (car(1, 2.32, -8.77, 1.276, 8.0, TO_RIGHT),),
        GAS, TO_RIGHT, (-8.0, -0.3, "yield", STRAYS),
    ),
    "a lane further on is looked at in its turn": (
        me(2.0, -19.0, 1.571, 4.0, APPROACH),
        (car(1, -1.44, 7.4, -1.309, 8.0, "ir2-il3:0"),),
        COAST, TO_RIGHT, (-4.25, 0.0, "yield", YIELDS),
    ),
    "whoever crosses right ahead is no lead": (
        me(2.0, -10.58, 1.571, 2.0, STRAIGHT),
        (car(1, 1.64, -5.84, 3.06, 0.0, TO_LEFT),),
        Command(1.0, 0.0), TO_RIGHT, (1.0, 0.0, "", ""),
    ),
    "a lead is minded on the approach": (
        me(2.0, -40.0, 1.571, 8.0, APPROACH),
        (car(1, 2.0, -31.0, 1.571, 0.0, APPROACH),),
        COAST, STRAIGHT, (-8.0, 0.0, "gap", "Too close to the car 4 m ahead to ask for more."),
    ),
    "a lead is minded behind somebody who crosses": (
        me(1.71, -10.16, 1.571, 4.0, STRAIGHT),
        (
            car(1, 2.16, -2.0, 0.0, 8.0, "ir1-il3:0"), car(2, 3.26, 1.97, 1.571, 8.0, STRAIGHT),
            car(3, 3.02, -7.68, 1.08, 8.0, TO_RIGHT),
        ),
        Command(-2.0, 0.0), TO_RIGHT, (-8.0, 0.0, "gap", "Too close to the car 0 m ahead to ask for more."),
    ),
    "behind a lead it is close to, it stays behind": (
        me(5.73, -3.74, 0.687, 2.0, TO_RIGHT),
        (car(1, 9.6, -2.14, 0.098, 8.0, TO_RIGHT),),
        GAS, "il3-o3:0", (-8.0, -0.3, "lane", STRAYS),
    ),
    "a car too fast may still promise to be through": (
        me(2.0, -11.0, 1.571, 13.0, STRAIGHT),
        (car(1, -11.0, 2.0, -3.142, 4.0, "ir3-il1:0"),),
        COAST, STRAIGHT, (-1.0, 0.0, "speed", "No faster than 11 m/s (40 km/h) here."),
    ),
    "whom the body sweeps over on its way back is a lead": (
        me(2.0, 1.28, 1.571, 8.0, STRAIGHT),
        (car(1, -6.79, 0.31, 2.705, 0.0, TO_LEFT), car(2, 31.99, -1.94, -0.342, 0.0, "il3-o3:0")),
        Command(0.0, 0.137), TO_LEFT, (-8.0, 0.3, "yield", STRAYS),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SCENES)
def test_on_the_crossing(judged: Judged, name: str) -> None:
    ego, others, asks, aim, told = SCENES[name]
    found = judged(ego, *others, asks=asks, aim=aim)
    assert found[:2] == pytest.approx(told[:2], abs=2e-3)
    assert found[2:] == told[2:]


def test_off_its_way_a_car_is_steered_back_to_the_way_that_was_promised(judged: Judged) -> None:
    """Nearest to the lane straight on, with none steered for any more."""
    shield = Shield(DT)
    begun = me(1.9, -10.5, 1.6, 6.0, TO_LEFT)
    assert judged(begun, asks=COAST, aim=TO_LEFT, shield=shield)[2] == ""
    over, wild = me(1.1, -6.9, 1.8, 6.0, STRAIGHT), Command(0.0, 0.7)
    _, promised, *_ = judged(over, asks=wild, aim=None, shield=shield)
    _, nearest, *_ = judged(over, asks=wild, aim=None)
    assert nearest < 0.0 < promised


# What the shield tells the guard of the crossing ----------------------------------------------------------------------


def test_only_who_has_to_brake_for_a_lead_is_held_up(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[tuple[float, bool]] = []
    mend = Junction.mend

    def listened(self: Junction, *what: Any, held_up: bool) -> Any:
        told.append((what[-1], held_up))
        return mend(self, *what, held_up=held_up)

    monkeypatch.setattr(Junction, "mend", listened)
    ego = me(0.0, -50.0, UPWARDS, 8.0, IN)
    for ahead in np.arange(6.4, 6.9, 0.01):
        Shield(DT).filter(instant(ego, car(1, 0.0, -50.0 + ahead, UPWARDS, 8.0, IN)), GAS, None)
    assert {held for most, held in told if most < 0.0} == {True}
    assert {held for most, held in told if 0.0 < most <= 1.0} == {False}
    assert {held for most, held in told if most > 1.0} == {False}


def test_where_a_lane_bends_the_way_back_to_it_does(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[float] = []

    def listened(ego: Any, centre_m: float, speed: float, most_rad: float, curvature: float = 0.0) -> float:
        told.append(curvature)
        return recovery_steering(ego, centre_m, speed, most_rad, curvature)

    monkeypatch.setattr("chauffeur.safety.shield.shield.recovery_steering", listened)
    at = math.radians(45.0)
    ego = me(-10.0 + 10.0 * math.cos(at), 10.0 * math.sin(at), at + UPWARDS, 5.0, LEFT)
    Shield(DT).filter(instant(ego), COAST, LEFT)
    assert [abs(bend) for bend in told] == [pytest.approx(0.1, rel=0.05)], "a circle of 10 m, looked at once"


# Whole trips ----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def episodes() -> ModuleType:
    """The benchmark of hostile policies."""
    path = Path(__file__).parents[2] / "benchmarks" / "shield_episodes.py"
    spec = importlib.util.spec_from_file_location("shield_episodes", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("kind", "seed"),
    [
        ("saboteur", 20019),  # cleared one stream into the next
        ("throttle", 20113),  # stopped between two streams
        ("tailgater", 20039),  # rolled on after it stood, by the tyres
        ("saboteur", 20123),  # was made to clear what it was not in
        ("saboteur", 20002),  # stood in a lane that was empty, until a car came
        ("never-yield", 20283),  # stood with its nose in the way
        ("saboteur", 22718),  # left the place it might have stood in, for a lane of its own fork
        ("saboteur", 22771),  # braked in the middle because it could still have cleared the crossing a period later
        ("saboteur", 22903),  # braked for its lead while it promised to be through
        ("throttle", 22033),  # stands close by somebody's way rather than drive into it
        ("saboteur", 22266),  # off the road: of two ways to clear the crossing took the one with too light a hand
        ("saboteur", 71375),  # off the road: crept farther and farther out of its lane
        ("saboteur", 90049),  # off the road: cleared the crossing on the side of its way that is farther off
        ("drifter", 90052),  # off the road: was no farther off its way than before, and drove on
        ("throttle", 90142),  # braked where it had better have driven on, and stood in somebody's way
        ("throttle", 90166),
    ],
)
def test_what_once_ended_badly_does_not(episodes: ModuleType, kind: str, seed: int) -> None:
    assert episodes.drive(episodes.Job(kind, "crossing", seed, True))["outcome"] == "ended"


def test_to_stand_in_somebodys_way_is_no_excuse(road: Observation) -> None:
    """A car that came to a stop across the lane of the oncoming traffic."""
    setpoints, coast = Setpoints(0.0), Command(0.0, 0.0)

    def instant(tick: int, lane_y: float, crashed: bool) -> Observation:
        ego = VehicleState(EGO, "car", 39.4, lane_y, 1.08, 0.0, 5.0, 2.0, "il3-o3:0", crashed)
        other = VehicleState(
            7, "car", 45.0 - 0.8 * tick, 2.0, math.pi, 8.0, 5.0, 2.0, "o3-ir3:0", crashed
        )  # fmt: skip
        return Observation(tick * DT, tick, "intersection", ego, (other,), (), road.road, None, None, False, False)

    for lane_y, who in ((-1.1, "ego"), (-6.0, "other")):
        frames = [
            Frame(instant(tick, lane_y, False), setpoints, coast, coast, "none", None, (), (), ()) for tick in range(5)
        ]
        assert blame(frames, instant(5, lane_y, True), DT).who == who
