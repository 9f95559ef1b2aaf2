"""Lanes as a graph: beside, ahead, across, where, and the way to a goal. The roads are drawn by hand."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.geometry import Lane, LanePlace, Polyline, RoadGraph, plan_route
from chauffeur.geometry.road_graph import turn_of


def _lane(name: str, *points: tuple[float, float], **more: object) -> Lane:
    return Lane(name, Polyline.of(points), 3.5, 13.9, **more)  # type: ignore[arg-type]


def _crossroads() -> RoadGraph:
    """A road of two lanes northwards, a crossing at (0, 0) with ways left, on and right, and a road that crosses."""
    return RoadGraph(
        (
            _lane("in.0", (0.0, -100.0), (0.0, -10.0), road="in", index=0, successors=("left", "on")),
            _lane("in.1", (3.5, -100.0), (3.5, -10.0), road="in", index=1, successors=("right",)),
            _lane("left", (0.0, -10.0), (-1.0, -2.0), (-10.0, 3.5), junction="j", turn="left", successors=("west",)),
            _lane("on", (0.0, -10.0), (0.0, 10.0), junction="j", successors=("north",)),
            _lane("right", (3.5, -10.0), (5.0, -4.0), (10.0, -1.75), junction="j", turn="right", successors=("east",)),
            _lane("across", (-10.0, -1.75), (10.0, -1.75), junction="j", successors=("east",)),
            _lane("from-west", (-100.0, -1.75), (-10.0, -1.75), successors=("across",)),
            _lane("west", (-10.0, 3.5), (-100.0, 3.5)),
            _lane("north", (0.0, 10.0), (0.0, 100.0)),
            _lane("east", (10.0, -1.75), (100.0, -1.75)),
        )
    )


def test_what_lies_beside() -> None:
    road = _crossroads()
    assert [lane.id for lane in road.abreast("in.1")] == ["in.0", "in.1"]
    assert [lane.id for lane in road.abreast("on")] == ["on"]
    assert (road.neighbour("in.0", 1), road.neighbour("in.0", -1)) == ("in.1", None)
    assert (road.places_between("in.0", "in.1"), road.places_between("in.0", "on")) == (1, None)
    assert road.places_between("on", "on") == 0
    assert road.get("nowhere") is None
    assert road.get(None) is None
    with pytest.raises(KeyError):
        road["nowhere"]


def test_which_way_goes_on() -> None:
    road = _crossroads()
    assert (road.turns("in.0"), road.turns("in.1")) == (("left", "straight"), ())
    assert [turn_of(road[lane].bend_rad) for lane in ("left", "on", "right")] == ["left", "straight", "right"]
    assert turn_of(math.radians(-170.0)) == "left", "who turns back, turns left where traffic drives on the right"
    following = {turn: road.onward("in.0", turn) for turn in ("left", "straight", None)}
    assert {turn: lane and lane.id for turn, lane in following.items()} == {
        "left": "left",
        "straight": "on",
        None: "on",
    }
    assert road.onward("north") is None
    assert [lane.id for lane in road.ahead("in.0", "left")] == ["in.0", "left", "west"]
    assert [lane.id for lane in road.predecessors("east")] == ["right", "across"]


def test_a_ring_is_followed_once() -> None:
    ring = RoadGraph(
        (_lane("a", (0.0, 0.0), (10.0, 0.0), successors=("b",)), _lane("b", (10.0, 0.0), (0.0, 1.0), successors=("a",)))
    )
    assert [lane.id for lane in ring.ahead("a")] == ["a", "b"]
    assert ring.distance_m(LanePlace("a", 5.0, 0.0), LanePlace("a", 4.0, 0.0)) == pytest.approx(
        5.0 + math.hypot(10, 1) + 4.0
    )


def test_who_conflicts_at_a_junction() -> None:
    road = _crossroads()
    assert set(road.conflicts("on")) == {"across"}, "the ways that fork off with it are no conflict"
    assert set(road.conflicts("across")) == {"on", "left", "right"}, "crossed, crossed, and merged with"
    assert road.conflicts("north") == ()
    assert {lane.id for lane in road.junctions["j"]} == {"left", "on", "right", "across"}


def test_distances_along_the_road() -> None:
    road = _crossroads()
    here = LanePlace("in.0", 50.0, 0.0)
    assert road.distance_m(here, LanePlace("in.0", 70.0, 1.0)) == pytest.approx(20.0)
    assert road.distance_m(here, LanePlace("north", 5.0, 0.0)) == pytest.approx(40.0 + 20.0 + 5.0)
    assert road.distance_m(here, LanePlace("in.0", 40.0, 0.0)) is None
    assert road.distance_m(here, LanePlace("north", 5.0, 0.0), within_m=60.0) is None


@given(st.floats(-99.0, -11.0), st.floats(-1.7, 1.7))
def test_a_place_is_found_in_lane_coordinates(y: float, across: float) -> None:
    road = _crossroads()
    for lane, x in (("in.0", 0.0), ("in.1", 3.5)):
        found = road.locate(x + across, y, math.pi / 2)
        assert found is not None
        assert found.lane == lane
        assert found.station_m == pytest.approx(y + 100.0)
        assert found.offset_m == pytest.approx(-across), "leftward is positive"


@given(st.floats(-500.0, 500.0), st.floats(-500.0, 500.0))
def test_the_grid_finds_what_a_full_search_finds(x: float, y: float) -> None:
    road = _crossroads()
    found = road.locate(x, y)
    assert found is not None
    nearest = min(math.dist((x, y), _point(road, LanePlace(lane.id, _on(lane, x, y), 0.0))) for lane in road.lanes)
    assert math.dist((x, y), _point(road, found)) == pytest.approx(nearest)


def _on(lane: Lane, x: float, y: float) -> float:
    return min(max(lane.centre.nearest(x, y), 0.0), lane.length_m)


def _point(road: RoadGraph, place: LanePlace) -> tuple[float, float]:
    pose = road[place.lane].centre.at(place.station_m)
    return pose.x_m, pose.y_m


def test_heading_and_kind_decide_between_lanes() -> None:
    road = RoadGraph(
        (
            _lane("up", (0.0, 0.0), (0.0, 50.0)),
            _lane("down", (-0.5, 50.0), (-0.5, 0.0)),
            _lane("walk", (0.2, 0.0), (0.2, 50.0), kind="sidewalk"),
        )
    )
    assert [road.locate(-0.3, 20.0, heading).lane for heading in (math.pi / 2, -math.pi / 2)] == ["up", "down"]  # type: ignore[union-attr]
    assert road.locate(0.2, 20.0, math.pi / 2, ("driving",)).lane == "up"  # type: ignore[union-attr]
    assert road.locate(0.2, 20.0).lane == "walk"  # type: ignore[union-attr]
    assert road.locate(0.2, 20.0, kinds=("bicycle",)) is None
    assert RoadGraph(()).locate(0.0, 0.0) is None if RoadGraph(()).lanes else True


def test_the_way_to_a_goal() -> None:
    road = _crossroads()
    route = plan_route(road, LanePlace("in.0", 50.0, 0.0), LanePlace("east", 30.0, 0.0))
    assert route is not None
    assert route.lanes == ("in.0", "in.1", "right", "east")
    steps, length = route.steps(road)
    assert [step.manoeuvre for step in steps] == ["change right", "right"]
    assert steps[1].at_m == pytest.approx(40.0)
    assert length == pytest.approx(40.0 + road["right"].length_m + 30.0)
    assert plan_route(road, LanePlace("north", 0.0, 0.0), LanePlace("east", 1.0, 0.0)) is None
    same = plan_route(road, LanePlace("in.0", 10.0, 0.0), LanePlace("in.0", 60.0, 0.0))
    assert same is not None
    assert same.length_m(road) == pytest.approx(50.0)


def test_a_goal_behind_on_the_same_lane_is_reached_round_the_block() -> None:
    ring = RoadGraph(
        (_lane("a", (0.0, 0.0), (10.0, 0.0), successors=("b",)), _lane("b", (10.0, 0.0), (0.0, 1.0), successors=("a",)))
    )
    route = plan_route(ring, LanePlace("a", 5.0, 0.0), LanePlace("a", 2.0, 0.0))
    assert route is not None
    assert route.lanes == ("a", "b", "a")
    assert route.length_m(ring) == pytest.approx(5.0 + math.hypot(10.0, 1.0) + 2.0)
