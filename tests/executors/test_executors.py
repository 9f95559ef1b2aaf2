"""Executors: what an action matrix and a trajectory do to a car, through the door every policy takes."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial

import pytest

from chauffeur.concept import (
    ActionMatrix,
    Limits,
    Parameters,
    Policy,
    Program,
    Scenario,
    ScenarioError,
    Trajectory,
)
from chauffeur.driving.conformance import check_executor
from chauffeur.driving.episode import drive_policy
from chauffeur.driving.scenarios import find
from chauffeur.executors import executor_for
from chauffeur.executors.reference import ReferencePath
from chauffeur.executors.trajectory import rebased, reference_of
from chauffeur.geometry import Polyline, Pose
from chauffeur.worlds.base import World
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.scenarios import BUILT_IN as ROADS
from chauffeur.worlds.parking import BUILT_IN as LOTS
from chauffeur.worlds.parking import ParkingWorld
from chauffeur.worlds.track import TrackWorld, track_scenario

pytest.importorskip("osqp")
pytest.importorskip("vehiclemodels")

MODERATE = ActionMatrix((0.6, 0.02, 0.05), (10.0, 20.0, 100.0))


def on_track(name: str, weather: str = "sunny") -> tuple[TrackWorld, Scenario]:
    world, scenario = TrackWorld(), track_scenario(name, weather)  # type: ignore[arg-type]
    world.reset(scenario)
    return world, scenario


@pytest.mark.parametrize("weather", ["sunny", "snow"])
@pytest.mark.parametrize("name", ["lane_change", "left_turn"])
def test_an_action_matrix_tracks_the_manoeuvre(name: str, weather: str) -> None:
    world, _ = on_track(name, weather)
    path = world.manoeuvre.path
    episode = drive_policy(world, MODERATE, None, 20.0, Limits())
    assert episode.outcome == "ended"
    assert episode.interventions == 0
    shots = [frame.observation.ego for frame in episode.frames]
    assert max(abs(path.project(ego.x_m, ego.y_m)[1]) for ego in shots) < 0.1
    assert max(ego.speed_mps for ego in shots) < 50 / 3.6 + 0.5
    assert {frame.program for frame in episode.frames} == {"running", "finished"}


def test_higher_gains_accelerate_harder_and_nobody_is_run_into() -> None:
    peaks: list[float] = []
    for kp in (0.14, 0.8):
        world, _ = on_track("acceleration")
        episode = drive_policy(world, replace(MODERATE, pid=(kp, 0.01, 0.05)), None, 30.0, Limits())
        assert episode.outcome == "ended"
        early = [f.observation.ego.speed_mps for f in episode.frames if f.observation.time_s < 3.0]
        peaks.append(max(early))
    assert peaks[1] > peaks[0] + 0.5


def test_limits_bound_what_gains_ask_for() -> None:
    world, _ = on_track("lane_change")
    episode = drive_policy(world, MODERATE, None, 9.0, Limits(max_speed_mps=10.0))
    assert episode.final.ego.speed_mps < 10.5


@pytest.mark.parametrize(("make", "scenario"), [(ParkingWorld, LOTS[0]), (HighwayWorld, ROADS[0])])
def test_a_trajectory_drives_in_other_worlds(make: Callable[[], World], scenario: Scenario) -> None:
    world = make()
    ego = world.reset(scenario).ego
    way = max(ego.speed_mps, 2.0) * 0.5
    episode = drive_policy(world, Trajectory(tuple((way * i, 0.0) for i in range(1, 9)), 0.5), None, 15.0, Limits())
    forward, left = Pose(ego.x_m, ego.y_m, ego.heading_rad).sees(episode.final.ego.x_m, episode.final.ego.y_m)
    assert episode.outcome == "ended"
    assert 0.7 * 8 * way < forward < 8 * way + 8.0
    assert abs(left) < 0.2
    assert episode.final.ego.speed_mps < 0.2, "where a trajectory ends, the car stops"


def test_waypoints_to_the_left_lead_to_the_left_in_either_handedness() -> None:
    world = HighwayWorld()
    scenario = next(one for one in ROADS if one.id == "overtake")
    start = world.reset(scenario)
    way = start.ego.speed_mps * 0.5
    shift = [4.0 * (s := min(1.0, i / 6)) ** 2 * (3.0 - 2.0 * s) for i in range(1, 9)]
    policy = Trajectory(tuple((way * i, y) for i, y in enumerate(shift, start=1)), 0.5)
    final = drive_policy(world, policy, None, 4.0, Limits()).final
    assert start.ego.lane is not None
    assert final.ego.lane is not None
    assert final.road.places_between(start.ego.lane, final.ego.lane) == -1


def test_speeds_of_a_trajectory_are_its_distances() -> None:
    points = ((1.0, 0.0), (3.0, 0.0), (6.0, 0.0), (6.0, 0.0))
    reference = reference_of(Trajectory(points, 0.5), Pose(0.0, 0.0, 0.0), 0.0)
    assert reference.length_m == pytest.approx(6.0)
    assert reference.speed_at(0.0) == 0.0
    assert reference.speed_at(3.0) > 2.0
    assert reference.speed_at(6.0) == 0.0


def test_a_reference_reads_a_circle() -> None:
    circle = Polyline.of((20.0 * math.sin(a / 40), 20.0 * (1.0 - math.cos(a / 40))) for a in range(60))
    reference = ReferencePath(circle, 5.0)
    place = reference.locate(20.0 * math.sin(0.7), 20.0 * (1.0 - math.cos(0.7)))
    assert place.station_m == pytest.approx(14.0, abs=0.1)
    assert place.offset_m == pytest.approx(0.0, abs=0.02)
    assert place.heading_rad == pytest.approx(0.7, abs=0.02)
    assert place.curvature_per_m == pytest.approx(0.05, rel=0.05)
    inside = ReferencePath(circle, 5.0).locate(0.0, 1.0)
    assert inside.offset_m == pytest.approx(1.0, abs=0.05)


def test_a_kind_without_an_executor_is_refused() -> None:
    @dataclass(frozen=True)
    class Telepathy:
        kind: str = "telepathy"

    world, _ = on_track("left_turn")
    with pytest.raises(ScenarioError, match="no executor"):
        executor_for(Telepathy(), world)


EACH_KIND = (
    Program("def go():\n    while True:\n        yield autopilot()\n"),
    Parameters(30.0, 10.0, 1.0),
    Trajectory(tuple((15.6 * i, 0.0) for i in range(1, 41)), 0.5),
    MODERATE,
)


@pytest.mark.parametrize(
    ("place", "policy"),
    [
        *(("cruise", policy) for policy in EACH_KIND),
        ("parking", Trajectory(tuple((1.5 * i, 0.0) for i in range(1, 9)), 0.5)),
        ("parking", Parameters(3.0, 10.0, 1.0)),
        ("track-lane-change", MODERATE),
    ],
    ids=lambda one: getattr(one, "kind", one),
)
def test_every_executor_keeps_the_contract(place: str, policy: Policy) -> None:
    findings = check_executor(partial(executor_for, policy), policy, find(place))
    assert {found.check: found.faults for found in findings if found.faults} == {}


@pytest.mark.parametrize("policy", EACH_KIND, ids=lambda policy: policy.kind)
def test_every_kind_is_driven_by_the_executor_of_its_kind_and_held_back(policy: Policy) -> None:
    """The same period everywhere: ask, bound, command. What is held to a stand brakes, whatever the policy asks for."""
    world = HighwayWorld()
    scenario = next(one for one in ROADS if one.id == "cruise")
    world.reset(scenario)
    with closing(executor_for(policy, world)) as executor:
        executor.start(policy, world.observe(), Limits())
        tick = executor.tick()
        assert tick.setpoints.target_speed_mps is not None
        assert tick.setpoints.target_speed_mps > 10.0
        free = executor.step(world.observe(), tick.setpoints)
        executor.tick()
        held = executor.step(world.observe(), replace(tick.setpoints, target_speed_mps=0.5))
    assert held.acceleration_mps2 < min(free.acceleration_mps2, 0.0)


def test_a_trajectory_is_seen_from_where_the_car_is_by_now() -> None:
    planned = Pose(10.0, 5.0, 0.3)
    policy = Trajectory(((4.0, 0.0), (8.0, 1.0), (12.0, 3.0), (15.0, 5.0)), 0.5)
    half_way = planned.place(6.0, 0.5)
    now = rebased(policy, planned, Pose(*half_way, 0.3))
    assert now.period_s == 0.5
    places = [Pose(*half_way, 0.3).place(x, y) for x, y in now.waypoints_m]
    expected = [(10.0, 2.0), (13.5, 4.0), (15.0, 5.0)]
    for place, (x, y) in zip(places, expected, strict=True):
        assert place == pytest.approx(planned.place(x, y), abs=1e-6)
    with pytest.raises(ScenarioError, match="behind"):
        rebased(policy, planned, Pose(*planned.place(20.0, 7.0), 0.3))
    with pytest.raises(ScenarioError, match="beside"):
        rebased(policy, planned, Pose(*planned.place(6.0, -3.0), 0.3))
