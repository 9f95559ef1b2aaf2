"""Routes: past places, around what has no way, and as the line that is driven."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.geometry import Lane, LanePlace, Polyline, RoadGraph, Route, plan_route, plan_through
from chauffeur.geometry.opendrive import OpenDriveMap, read_opendrive


def _lane(name: str, *points: tuple[float, float], **more: object) -> Lane:
    return Lane(name, Polyline.of(points), 3.5, 13.9, **more)  # type: ignore[arg-type]


def _motorway(*lengths: float, lanes: int = 3) -> RoadGraph:
    """Stretches of a straight road eastwards, lane 0 leftmost."""
    found: list[Lane] = []
    at = 0.0
    for number, length in enumerate(lengths):
        for i in range(lanes):
            onward = (f"{number + 1}.{i}",) if number + 1 < len(lengths) else ()
            ends = ((at, -3.5 * i), (at + length, -3.5 * i))
            found.append(_lane(f"{number}.{i}", *ends, road=str(number), index=i, successors=onward))
        at += length
    return RoadGraph(tuple(found))


@given(
    st.lists(st.floats(2.0, 150.0), min_size=1, max_size=5),
    st.integers(0, 2),
    st.integers(0, 2),
    st.floats(0.0, 0.9),
    st.floats(0.1, 1.0),
)
def test_the_driven_line_has_no_jumps(lengths: list[float], first: int, last: int, begin: float, end: float) -> None:
    road = _motorway(*lengths)
    start = LanePlace(f"0.{first}", begin * lengths[0], 0.0)
    goal = LanePlace(f"{len(lengths) - 1}.{last}", end * lengths[-1], 0.0)
    route = plan_route(road, start, goal)
    if route is None:
        assert len(lengths) == 1, "only a goal behind the start is out of reach"
        return
    length = route.length_m(road)
    if length < 1.0:
        return
    points = route.dense(road)
    assert all(math.dist(a[:2], b[:2]) <= 1.0 + 1e-6 for a, b in pairwise(points))
    assert points[0][:2] == pytest.approx((start.station_m, -3.5 * first))
    assert points[-1][:2] == pytest.approx((sum(lengths[:-1]) + goal.station_m, -3.5 * last))
    assert all(b.x_m >= a.x_m - 1e-9 for a, b in pairwise(points)), "never back"
    if length > 60.0 * (abs(last - first) + 1):
        assert all(abs(point.heading_rad) < 0.2 for point in points), "gentle where there is room"
    side = {"change left"} if last < first else {"change right"}
    assert {point.manoeuvre for point in points} <= {"follow", *side}


def test_a_change_may_begin_before_its_stretch_where_that_is_short() -> None:
    road = _motorway(200.0, 4.0, 200.0)
    points = Route(("0.1", "1.1", "1.0", "2.0"), 0.0, 200.0).dense(road)
    changing = [point for point in points if point.manoeuvre == "change left"]
    assert changing[-1].x_m - changing[0].x_m == pytest.approx(3.0 * 13.9, abs=2.0)
    assert changing[0].x_m > 5.0


def test_no_change_over_a_solid_line_or_in_a_junction() -> None:
    for more in ({"change_right": False}, {"junction": "j"}):
        road = RoadGraph(
            (
                _lane("a", (0.0, 0.0), (100.0, 0.0), road="r", index=0, **more),
                _lane("b", (0.0, -3.5), (100.0, -3.5), road="r", index=1),
            )
        )
        assert plan_route(road, LanePlace("a", 0.0, 0.0), LanePlace("b", 90.0, 0.0)) is None
        assert plan_route(road, LanePlace("b", 0.0, 0.0), LanePlace("a", 90.0, 0.0)) is not None


def test_a_goal_behind_is_reached_around_the_block() -> None:
    road = RoadGraph(
        (
            _lane("north", (0.0, 0.0), (0.0, 50.0), successors=("back",)),
            _lane("back", (0.0, 50.0), (-20.0, 50.0), (-20.0, 0.0), (0.0, 0.0), successors=("north",)),
        )
    )
    route = plan_route(road, LanePlace("north", 30.0, 0.0), LanePlace("north", 10.0, 0.0))
    assert route == Route(("north", "back", "north"), 30.0, 10.0)
    assert route.length_m(road) == pytest.approx(20.0 + 90.0 + 10.0)
    assert len(route.dense(road)) == 121


def test_the_lane_is_taken_that_spares_a_detour() -> None:
    """Where ways part, two lanes pass the same place; only one of them leads on to the next."""
    road = RoadGraph(
        (
            _lane("in", (0.0, -50.0), (0.0, 0.0), successors=("left", "on")),
            _lane("left", (0.0, 0.0), (0.0, 5.0), (-10.0, 10.0), junction="j"),
            _lane("on", (0.0, 0.0), (0.0, 20.0), junction="j", successors=("out",)),
            _lane("out", (0.0, 20.0), (0.0, 80.0)),
        )
    )
    between = road.places(0.0, 2.0, math.pi / 2.0)
    assert {place.lane for place in between} == {"left", "on"}
    route = plan_through(road, [road.places(0.0, -40.0), between, road.places(0.0, 70.0)])
    assert route is not None
    assert (route.lanes, route.length_m(road)) == (("in", "on", "out"), pytest.approx(110.0))
    steps, _ = route.steps(road)
    assert [step.manoeuvre for step in steps] == ["straight"]
    assert plan_through(road, [road.places(0.0, 70.0), road.places(0.0, -40.0)]) is None


def test_places_to_pass_say_where_lanes_change() -> None:
    road = _motorway(400.0)
    places = [LanePlace("0.0", 10.0, 0.0), LanePlace("0.0", 200.0, 0.0), LanePlace("0.1", 300.0, 0.0)]
    route = plan_through(road, [(place,) for place in [*places, LanePlace("0.0", 390.0, 0.0)]])
    assert route is not None
    points = route.dense(road)
    for place in places:
        assert min(math.dist(point[:2], (place.station_m, -3.5 * int(place.lane[-1]))) for point in points) < 0.6
    assert [m for i, m in enumerate(p.manoeuvre for p in points) if i == 0 or points[i - 1].manoeuvre != m] == [
        "follow", "change right", "follow", "change left", "follow",
    ]  # fmt: skip


def test_one_turn_a_junction_however_many_lanes_lead_through() -> None:
    road = RoadGraph(
        (
            _lane("in", (0.0, -50.0), (0.0, 0.0), successors=("j1",)),
            _lane("j1", (0.0, 0.0), (1.0, 5.0), junction="j", successors=("j2",)),
            _lane("j2", (1.0, 5.0), (5.0, 10.0), junction="j", successors=("j3",)),
            _lane("j3", (5.0, 10.0), (10.0, 10.5), junction="j", successors=("out",)),
            _lane("out", (10.0, 10.5), (60.0, 10.5)),
        )
    )
    route = Route(("in", "j1", "j2", "j3", "out"), 0.0, 50.0)
    assert [step.manoeuvre for step in route.steps(road)[0]] == ["right"]
    points = route.dense(road)
    assert {point.manoeuvre for point in points if road[point.lane].junction} == {"right"}
    assert {(point.lane, point.manoeuvre) for point in points if point.x_m > 10.0} == {("out", "follow")}
    assert {(point.lane, point.manoeuvre) for point in points if point.y_m < -1e-6} == {("in", "follow")}


def test_the_official_routes_are_planned_without_jumps(carla_data: Path) -> None:
    """The 26 testing routes of Leaderboard 1.0, past every place that their file names."""
    towns: dict[str, OpenDriveMap] = {}
    total = 0.0
    for told in ET.parse(carla_data / "routes" / "routes_testing.xml").getroot().findall("route"):
        name = told.get("town", "")
        if name not in towns:
            towns[name] = read_opendrive(carla_data / "maps" / f"{name}.xodr")
        places = [
            towns[name].places(
                float(at.get("x", "")), -float(at.get("y", "")), float(at.get("z", "")),
                -math.radians(float(at.get("yaw", ""))), ("driving",),
            )
            for at in told.findall("waypoint")
        ]  # fmt: skip
        route = plan_through(towns[name].road, places)
        assert route is not None, told.get("id")
        total += route.length_m(towns[name].road)
        points = route.dense(towns[name].road)
        assert max(math.dist(a[:2], b[:2]) for a, b in pairwise(points)) < 1.01
        turned = [abs(math.remainder(b.heading_rad - a.heading_rad, 2.0 * math.pi)) for a, b in pairwise(points)]
        assert max(turned) < 1.0, "no way back and no step aside"
    assert 41_000.0 < total < 45_000.0
