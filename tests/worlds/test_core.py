"""The compiled core against highway-env: kernels one by one, then whole trips.

Here some 20 development samples are driven for 30 s, each policy on samples of its own; `benchmarks/core_parity.py`
drives all of them with all policies to their end.
"""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import highway_oracle
from chauffeur.concept import Command, Scenario, Setpoints
from chauffeur.control import LAMPILOT_EGO, LAMPILOT_STEERING, idm_acceleration, lane_keeping_steering
from chauffeur.worlds.base import EGO
from chauffeur.worlds.highway import HighwayWorld, MobilBaseline
from chauffeur.worlds.highway.core import CoreRoad
from chauffeur.worlds.highway.core import lanes as geometry
from chauffeur.worlds.highway.core import layout as at
from chauffeur.worlds.highway.dblv1 import load_dataset
from chauffeur.worlds.highway.roads import build_scene, parse_config
from chauffeur.worlds.highway.scenarios import BUILT_IN
from highway_oracle import ReferenceWorld

BY_ID = {s.id: s for s in BUILT_IN}
TOLERANCE = 1e-9
POLICIES = ("idm", "mobil", "restless")


ROADS = ("overtake", "emergency-lane", "intersection")


def _built(build: Any, name: str) -> Any:
    scenario = BY_ID[name]
    return build(parse_config(scenario.config, name), np.random.default_rng(scenario.seed))


NETWORKS = {name: _built(highway_oracle.build_scene, name).road.network for name in ROADS}
CORES = {name: CoreRoad.of(_built(build_scene, name)) for name in ROADS}


@given(
    st.sampled_from(ROADS),
    st.floats(-200, 3000, allow_subnormal=False),
    st.floats(-130, 130, allow_subnormal=False),
    st.floats(-7, 7, allow_subnormal=False),
)
@settings(max_examples=300, deadline=None)
def test_lane_geometry_is_highway_envs(name: str, x: float, y: float, heading: float) -> None:
    network, road = NETWORKS[name], CORES[name].road
    point = np.array([x, y])
    for row, key in enumerate(road.keys):
        lane = network.get_lane(key)
        s, r = geometry.local(road.lanes, road.traits, row, x, y)
        assert (s, r) == pytest.approx(lane.local_coordinates(point), abs=TOLERANCE)
        assert geometry.heading_at(road.lanes, road.traits, row, s) == pytest.approx(lane.heading_at(s), abs=TOLERANCE)
        assert geometry.centre_at(road.lanes, road.traits, row, s) == pytest.approx(
            tuple(lane.position(s, 0)), abs=1e-8
        )
        assert geometry.reachable(road.lanes, road.traits, row, x, y) == lane.is_reachable_from(point)
        assert geometry.after_end(road.lanes, road.traits, row, x, y) == lane.after_end(point)
    distances = [network.get_lane(i).distance_with_heading(point, heading) for i in road.keys]
    chosen = geometry.closest(road.lanes, road.traits, x, y, heading)
    assert distances[chosen] == pytest.approx(min(distances), abs=1e-8)


@given(
    st.floats(-5, 45, allow_subnormal=False),
    st.floats(0, 45, allow_subnormal=False),
    st.floats(-50, 150, allow_subnormal=False),
    st.floats(0.01, 2),
    st.floats(-5, 45, allow_subnormal=False),
    st.floats(-0.4, 0.4),
)
@settings(max_examples=300, deadline=None)
def test_the_egos_driver_is_controls(
    speed: float, other_speed: float, gap: float, headway: float, target: float, heading: float
) -> None:
    core = CORES["overtake"].copy()
    ego, other = core.floats[0], core.floats[1]
    ego[at.X], ego[at.Y], ego[at.SPEED], ego[at.HEADING] = 900.0, 1.3, speed, heading
    other[at.X], other[at.Y], other[at.SPEED], other[at.HEADING] = 900.0 + gap, 0.0, other_speed, 0.0
    core.ints[0, at.LANE] = lane = core.road.rows["c-d:0"]
    closing = (speed * math.cos(heading) - other_speed) * math.cos(heading) + (speed * math.sin(heading)) * math.sin(
        heading
    )
    parameters = dataclasses.replace(LAMPILOT_EGO, time_headway_s=headway)
    expected = idm_acceleration(speed, target, parameters, gap, closing)
    assert core.follow(0, 1, target, headway) == pytest.approx(expected, rel=1e-9, abs=1e-9)
    free = idm_acceleration(speed, target, parameters)
    assert core.follow(0, -1, target, headway) == pytest.approx(free, rel=1e-9, abs=1e-9)
    steering = lane_keeping_steering(speed, heading, 1.3, 0.0, LAMPILOT_STEERING)
    assert core.steer(lane) == pytest.approx(steering, abs=TOLERANCE)


def _state(world: HighwayWorld | ReferenceWorld) -> np.ndarray:
    observation = world.observe()
    entities = (observation.ego, *observation.others, *observation.objects)
    return np.array([(v.x_m, v.y_m, v.heading_rad, v.speed_mps, v.crashed) for v in entities])


class _Policy:
    """What the ego wishes: nothing, MOBIL's lane, or something else every second."""

    def __init__(self, name: str, world: HighwayWorld | ReferenceWorld, seed: int) -> None:
        self._name, self._road = name, world.perception()
        self._mobil = MobilBaseline(self._road)
        self._rng = np.random.default_rng(seed)
        self._seed, self._tick = seed, 0

    def adjust(self, setpoints: Setpoints) -> Setpoints:
        self._tick += 1
        if self._tick == 1 and self._road.lane_of(EGO)[0].startswith("o"):
            setpoints = dataclasses.replace(setpoints, turn=("left", "straight", "right")[self._seed % 3])
        if self._name == "mobil":
            return self._mobil.choose(setpoints)
        if self._name == "restless" and self._tick % 10 == 1:
            return self._change(setpoints)
        return setpoints

    def _change(self, setpoints: Setpoints) -> Setpoints:
        assert setpoints.target_lane is not None
        beside = self._road.adjacent_lane(setpoints.target_lane, int(self._rng.choice((-1, 1))))
        blocker = self._road.front_blocker(setpoints.served_stops)
        served = setpoints.served_stops
        if blocker is not None and self._road.vehicle(blocker).kind == "stop_sign" and self._rng.random() < 0.3:
            served |= {blocker}
        return dataclasses.replace(
            setpoints,
            target_speed_mps=float(self._rng.uniform(0, 40)),
            time_headway_s=float(self._rng.uniform(0.01, 2)),
            target_lane=beside or setpoints.target_lane,
            served_stops=served,
        )


def _assert_same_trip(scenario: Scenario, policy: str, steps: int) -> None:
    worlds = (ReferenceWorld(), HighwayWorld())
    starts = [world.reset(scenario) for world in worlds]
    assert starts[0].road == starts[1].road
    policies = [_Policy(policy, world, scenario.seed % 1000) for world in worlds]
    held = [world.driver().initial_setpoints() for world in worlds]
    for step in range(steps):
        for k, world in enumerate(worlds):
            held[k] = policies[k].adjust(world.driver().settle(held[k]))
            world.step(world.driver().command(held[k]))
        plain, quick = (world.perception().instant() for world in worlds)
        assert np.abs(_state(worlds[0]) - _state(worlds[1])).max() <= TOLERANCE, (scenario.id, policy, step)
        assert (plain.lane, plain.front, plain.crashed, plain.on_road, plain.past_end) == (
            quick.lane,
            quick.front,
            quick.crashed,
            quick.on_road,
            quick.past_end,
        )
        for name in ("gap_m", "front_speed_mps", "ttc_along_s", "ttc_plane_s", "ttc_lane_s"):
            expected = getattr(plain, name)
            assert getattr(quick, name) == pytest.approx(expected, rel=1e-7, abs=1e-7, nan_ok=True), (name, step)
        assert [world.ended for world in worlds] in ([False, False], [True, True])
        if worlds[0].ended:
            return


@pytest.mark.parametrize("policy", POLICIES)
@pytest.mark.parametrize("scenario", BUILT_IN, ids=lambda s: s.id)
def test_built_in_trips_are_the_references(scenario: Scenario, policy: str) -> None:
    as_drawn = scenario.config | {"redraw_unfit": False}  # the reference knows no second draw
    _assert_same_trip(dataclasses.replace(scenario, config=as_drawn), policy, 60)


@pytest.mark.slow
@pytest.mark.parametrize("policy", POLICIES)
def test_development_samples_are_the_references(lampilot_data: Path, policy: str) -> None:
    samples = [s for task in load_dataset(lampilot_data / "DbLv1-dev").tasks for s in task.samples]
    for scenario in samples[POLICIES.index(policy) * 18 :: 56]:
        _assert_same_trip(scenario, policy, 300)


def test_a_copy_goes_its_own_way() -> None:
    world = HighwayWorld()
    world.reset(BY_ID["overtake"])
    setpoints = world.driver().settle(world.driver().initial_setpoints())
    for _ in range(5):
        world.step(world.driver().command(setpoints))
    twin = world.copy()
    before = world.observe()
    assert twin.observe() == before
    twin.step(Command(-5.0, 0.0))
    assert world.observe() == before
    world.step(Command(-5.0, 0.0))
    assert twin.observe() == world.observe()


def test_starts_are_shared_but_not_touched() -> None:
    world, other = HighwayWorld(), HighwayWorld()
    first = world.reset(BY_ID["following"])
    for _ in range(20):
        world.step(Command(3.0, 0.1))
    assert other.reset(BY_ID["following"]) == first
