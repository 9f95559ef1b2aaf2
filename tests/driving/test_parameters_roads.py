"""`Parameters` driven on the highway and over the intersection."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from chauffeur.concept import Parameters, Scenario, ScenarioError
from chauffeur.driving.episode import Episode, drive_executed
from chauffeur.executors.pursuit import ParametersDriver
from chauffeur.safety.shield import shield_for
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.scenarios import BUILT_IN

NAMED = {scenario.id: scenario for scenario in BUILT_IN}
EXITS = {"left": "il1-o1:0", "straight": "il2-o2:0", "right": "il3-o3:0"}


def _world(name: str, seed: int | None = None) -> HighwayWorld:
    world = HighwayWorld()
    world.reset(NAMED[name], seed)
    return world


@cache
def _drive(name: str, policy: Parameters, route: str = "", shielded: bool = True, max_s: float = 20.0) -> Episode:
    world = _world(name)
    shield = shield_for(world) if shielded else None
    return drive_executed(world, replace(policy, route=route), max_s=max_s, shield=shield)


def test_the_target_speed_is_driven_where_the_road_is_free() -> None:
    for target in (18.0, 27.0):
        episode = _drive("cruise", Parameters(target, 12.0, 1.0))
        assert episode.final.ego.speed_mps == pytest.approx(target, abs=0.6)
        assert episode.outcome == "ended"
        assert not episode.causes.policy_failed


def test_it_does_not_drive_faster_than_the_limits_allow() -> None:
    episode = _drive("cruise", Parameters(60.0, 12.0, 1.0))
    fastest = max(frame.observation.ego.speed_mps for frame in episode.frames)
    assert fastest <= 31.2928 + 1.0 + 0.05
    assert episode.interventions == 0


def test_behind_a_slower_car_it_keeps_a_gap() -> None:
    episode = _drive("following", Parameters(31.0, 12.0, 1.0))
    gaps = [frame.observation.front for frame in episode.frames if frame.observation.front is not None]
    assert gaps
    assert min(lead.distance_m for lead in gaps) > 12.0
    assert not episode.final.ego.crashed


@pytest.mark.parametrize("target", [14.0, 5.0, 0.0])
def test_a_far_lower_speed_is_no_emergency_because_somebody_is_ahead(target: float) -> None:
    """What the gap asks for at the present speed is braked, and no more: a lower target is gone down to gently."""

    def hardest(target_mps: float) -> float:
        episode = _drive("overtake", Parameters(target_mps, 12.0, 1.0), max_s=3.0)
        return min(frame.applied.acceleration_mps2 for frame in episode.frames)

    begun = _world("overtake").observe()
    assert begun.front is not None
    assert hardest(target) == pytest.approx(hardest(begun.ego.speed_mps))


@pytest.mark.parametrize(
    ("name", "lane", "index"), [("overtake", -1, 0), ("left-lane", 1, 1), ("emergency-lane", 0, 1)]
)
def test_a_lane_wish_is_carried_out(name: str, lane: int, index: int) -> None:
    episode = _drive(name, Parameters(22.0, 12.0, 1.0, lane))  # type: ignore[arg-type]
    assert episode.final.ego.lane is not None
    assert episode.final.road[episode.final.ego.lane].index == index
    assert episode.final.ego.y_m == pytest.approx(-4.0 * index, abs=0.05)
    assert bool(episode.said) == bool(lane)


def test_a_lane_is_entered_only_when_there_is_room() -> None:
    """A car 11 m ahead in the right lane: the wish waits for it, and says so, once."""
    episode = _drive("emergency-lane", Parameters(22.0, 12.0, 1.0, 1))
    texts = [text for _, text in episode.said]
    assert texts[0].startswith("The lane to the right is not free yet: a car")
    assert texts[1] == "Changing to the right lane."
    assert len(texts) == 2
    begun = episode.said[1][0]
    assert begun > 2.0
    for frame in episode.frames:
        if frame.observation.time_s < begun:
            assert abs(frame.observation.ego.y_m + 4.0) < 0.3


def test_a_lane_that_is_not_there_is_not_wished_into() -> None:
    episode = _drive("left-lane", Parameters(22.0, 12.0, 1.0, -1))
    assert [text for _, text in episode.said] == ["There is no lane to the left; I stay in this one."]
    assert abs(episode.final.ego.y_m) < 0.05


@pytest.mark.parametrize("route", EXITS)
@pytest.mark.parametrize("shielded", [False, True])
def test_it_stops_at_the_sign_and_takes_its_turn(route: str, shielded: bool) -> None:
    episode = _drive("intersection", Parameters(9.0, 6.0, 1.0), route, shielded, 60.0)
    final = episode.final
    assert final.ego.lane is not None
    assert final.ego.lane == EXITS[route]
    assert episode.outcome == "ended"
    sign = next(thing for thing in final.objects if thing.kind == "stop_sign")
    stood = [frame for frame in episode.frames if frame.observation.ego.speed_mps < 0.1]
    assert stood
    short = stood[0].observation.ego.y_m - sign.y_m  # the approach leads to +y: more is nearer
    assert -3.5 < short < -2.5, "the front bumper stands just before the line"
    assert len(stood) * 0.1 >= 1.0
    served = [frame.setpoints.served_stops for frame in episode.frames]
    assert served[0] == frozenset()
    assert served[-1] == {sign.id}


def test_it_lets_crossing_traffic_go_first() -> None:
    episode = _drive("intersection", Parameters(9.0, 6.0, 1.0), "straight", False, 60.0)
    for frame in episode.frames:
        ego = frame.observation.ego
        if ego.lane is not None and ego.lane.startswith("ir0-"):
            near = [math.dist((o.x_m, o.y_m), (ego.x_m, ego.y_m)) for o in frame.observation.others]
            assert min(near, default=9.9) > 5.0


def test_wishes_tell_which_lane_and_turn_are_meant() -> None:
    episode = _drive("intersection", Parameters(9.0, 6.0, 1.0), "left", True, 60.0)
    assert {frame.setpoints.turn for frame in episode.frames} == {"left"}
    lanes = list(dict.fromkeys(frame.setpoints.target_lane for frame in episode.frames))
    assert lanes == ["o0-ir0:0", "ir0-il1:0", "il1-o1:0"]
    assert {frame.setpoints.target_speed_mps for frame in episode.frames} == {9.0}


def test_the_car_stands_at_the_end_of_the_road_whatever_it_looks_ahead_to() -> None:
    """Autoware.AI's own stop is switched off by a least look-ahead of 0 m; here it does not depend on it."""
    short = Scenario(
        "short",
        "highway",
        {
            "type": "dt-highway-v0",
            "num_lanes": 3,
            "vehicles_count": 0,
            "stage_length": [700],
            "ego_vehicle": {"speed": 25, "start_lane_index": ["a", "b", 1], "start_position": [300, 0]},
        },
        3,
    )
    for ahead, ratio in ((0.0, 0.0), (300.0, 10.0), (8.0, 1.0)):
        world = HighwayWorld()
        world.reset(short)
        episode = drive_executed(world, Parameters(30.0, ahead, ratio), max_s=60.0)
        ego = episode.final.ego
        assert ego.speed_mps < 0.05
        assert ego.x_m + ego.length_m / 2.0 == pytest.approx(699.8, abs=0.05)
        assert ego.y_m == pytest.approx(-4.0, abs=0.02)


def test_a_lane_that_ends_is_not_wished_into() -> None:
    """Beside the merging lane of a ramp, which ends in an obstacle."""
    world = HighwayWorld()
    ego = {"speed": 25, "start_lane_index": ["b", "c", 1], "start_position": [5, 0]}
    config = {"type": "ramp-merge-v0", "stage_length": [500, 80, 300, 2000], "vehicles_count": 0, "ego_vehicle": ego}
    world.reset(Scenario("merge", "highway", config, 3))
    lane = world.observe().ego.lane
    assert lane is not None
    assert lane == "b-c:1"
    episode = drive_executed(world, Parameters(22.0, 12.0, 1.0, 1), max_s=20.0)
    assert episode.final.ego.y_m == pytest.approx(-4.0, abs=0.05)
    assert episode.said[0][1] == "The lane to the right ends; I stay in this one."


numbers = st.one_of(st.floats(), st.floats(0.0, 80.0), st.sampled_from([0.0, -1.0, 1e9, math.nan, math.inf, -math.inf]))


@given(numbers, numbers, numbers, st.sampled_from([-1, 0, 1]), st.sampled_from([*NAMED]))
@example(0.5, 0.0, 0.0, -1, "intersection")
@settings(max_examples=10, deadline=None)
def test_no_parameters_are_a_danger(speed: float, ahead: float, ratio: float, lane: int, name: str) -> None:
    episode = drive_executed(
        _world(name),
        Parameters(speed, ahead, ratio, lane),
        max_s=10.0,
        record=False,  # type: ignore[arg-type]
    )
    assert episode.outcome == "ended"
    assert not episode.final.ego.crashed
    assert not episode.final.off_road


@pytest.mark.parametrize(
    ("name", "route", "says"),
    [
        ("cruise", "left", "no intersection"),
        ("intersection", "around", "no route"),
        ("cruise", "stadium", "parking lots"),
    ],
)
def test_a_route_that_leads_nowhere_is_refused(name: str, route: str, says: str) -> None:
    with pytest.raises(ScenarioError, match=says):
        ParametersDriver(_world(name), Parameters(9.0, 6.0, 1.0, route=route))


def test_the_same_trip_twice() -> None:
    first, second = (drive_executed(_world("overtake"), Parameters(28.0, 12.0, 1.0, -1), max_s=8.0) for _ in range(2))
    assert first == second
