"""The shield where roads cross: its model of the vehicle, its plans, and trips that once ended badly."""

from __future__ import annotations

import importlib.util
import math
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chauffeur.concept import Command, Frame, LaneId, Observation, Scenario, Setpoints, VehicleState
from chauffeur.control import LAMPILOT_STEERING, lane_keeping_steering
from chauffeur.safety.blame import blame
from chauffeur.safety.shield import FilterResult, Shield, rollout
from chauffeur.safety.shield.crossing import Motion
from chauffeur.worlds.base import EGO
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.core.motion import slide

DT = 0.1
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


@settings(max_examples=50, deadline=None)
@given(speed=st.floats(0.0, 15.0), lateral=finite, yaw=finite, steering=finite, acceleration=st.floats(-8.0, 5.0))
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


def test_after_a_jump_the_slide_is_read_from_the_way_covered(road: Observation) -> None:
    motion = Motion(DT)
    first = at(road, 20.0, 5.0)
    motion.commanded(first, motion.observe(first), Command(0.0, 0.0))
    second = at(road, 19.5, 5.0, heading=UPWARDS + 0.05, tick=1)
    assert motion.observe(second)[5] == pytest.approx(0.5)
    assert motion.observe(at(road, 19.5, 5.0, tick=9))[4:].tolist() == [0.0, 0.0]


def test_who_follows_is_trusted_to_respond() -> None:
    assert rollout.reach_m(8.0, 1.0, 3.0) == pytest.approx(9.5)
    assert rollout.reach_m(14.0, 2.0, 3.0) == pytest.approx(28.0)
    assert rollout.reach_m(20.0, 2.0, 3.0) == pytest.approx(40.0)


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
GAS, COAST = Command(5.0, 0.0), Command(0.0, 0.0)


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
    soon = guarded(at(road, 7.0, 0.0), GAS, STRAIGHT)
    assert soon.command == GAS
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


def test_it_does_not_stop_in_others_lanes_though_they_are_empty(road: Observation) -> None:
    """It creeps up to where it stands in nobody's lane; from there only clearing goes on."""
    observation = at(road, 6.11, 0.0, crosser(-15.0, 8.0), lane=STRAIGHT)
    assert guarded(observation, GAS, STRAIGHT).interventions
    empty = at(road, 6.11, 0.0, lane=STRAIGHT)
    assert guarded(empty, GAS, STRAIGHT).command == GAS


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
