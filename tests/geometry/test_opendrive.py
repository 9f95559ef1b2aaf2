"""The OpenDRIVE reader: shapes by hand-computed cases, and CARLA's own reader as the oracle on CARLA's towns."""

from __future__ import annotations

import math
import random
from pathlib import Path

import pytest

from chauffeur.geometry import RoadGraph
from chauffeur.geometry.opendrive import OpenDriveError, OpenDriveMap, lane_name, parse_opendrive, read_opendrive

TOWNS = ("Town01", "Town02", "Town03", "Town04", "Town05", "Town06")


def _road(shape: str, length: float, *, lanes: str = "", name: str = "1", heading: float = 0.0, extra: str = "") -> str:
    lanes = lanes or (
        '<laneSection s="0"><right><lane id="-1" type="driving">'
        '<width sOffset="0" a="4" b="0" c="0" d="0"/></lane></right></laneSection>'
    )
    return (
        f'<OpenDRIVE><header/><road id="{name}" name="Elm Street" length="{length}" junction="-1">{extra}'
        f'<planView><geometry s="0" x="0" y="0" hdg="{heading}" length="{length}">{shape}</geometry></planView>'
        f"<lanes>{lanes}</lanes></road></OpenDRIVE>"
    )


def _lane(text: str, name: str = "1:0:-1") -> tuple[RoadGraph, list[tuple[float, float]]]:
    road = parse_opendrive(text).road
    return road, list(road[name].centre.points_m)


def test_a_lane_lies_beside_its_line() -> None:
    road, points = _lane(_road("<line/>", 50.0, heading=math.pi / 2))
    assert points == [pytest.approx((2.0, 0.0)), pytest.approx((2.0, 50.0))]
    lane = road["1:0:-1"]
    assert (lane.width_m, lane.street, lane.speed_limit_mps) == (4.0, "Elm Street", pytest.approx(50.0 / 3.6))


def test_an_arc_keeps_within_five_centimetres() -> None:
    road, points = _lane(_road('<arc curvature="0.05"/>', 60.0))
    radius = 22.0  # the lane lies 2 m outside of a left bend of radius 20
    for i in range(200):
        pose = road["1:0:-1"].centre.at(i / 199 * road["1:0:-1"].length_m)
        assert math.hypot(pose.x_m, pose.y_m - 20.0) == pytest.approx(radius, abs=0.05)
    assert len(points) < 60


def test_a_spiral_and_cubics_end_where_they_should() -> None:
    # A clothoid from straight to 1/20 over 40 m turns by half of what an arc would (Fresnel integrals by series).
    turned = 0.05 * 40.0 / 2.0
    series_x = sum((-1) ** n * turned ** (2 * n) / (math.factorial(2 * n) * (4 * n + 1)) for n in range(12)) * 40.0
    series_y = (
        sum((-1) ** n * turned ** (2 * n + 1) / (math.factorial(2 * n + 1) * (4 * n + 3)) for n in range(12)) * 40.0
    )
    _, points = _lane(_road('<spiral curvStart="0" curvEnd="0.05"/>', 40.0))
    end = (series_x + 2.0 * math.sin(turned), series_y - 2.0 * math.cos(turned))
    assert points[-1] == pytest.approx(end, abs=0.01)
    cubic = '<paramPoly3 pRange="normalized" aU="0" bU="30" cU="0" dU="0" aV="0" bV="0" cV="30" dV="-20"/>'
    _, points = _lane(_road(cubic, 32.0))
    assert points[-1] == pytest.approx((30.0, 8.0), abs=0.01)
    _, points = _lane(_road('<poly3 a="0" b="0" c="0.01" d="0"/>', 31.0))
    assert points[-1][1] + 2.0 == pytest.approx(0.01 * points[-1][0] ** 2, abs=1.0)


def test_widths_offsets_and_markings() -> None:
    lanes = (
        '<laneOffset s="0" a="1" b="0" c="0" d="0"/><laneOffset s="20" a="-5" b="0" c="0" d="0"/>'
        '<laneSection s="0"><left><lane id="1" type="driving"><link><predecessor id="1"/></link>'
        '<width sOffset="0" a="3" b="0" c="0" d="0"/></lane></left>'
        '<right><lane id="-1" type="driving"><link><successor id="-1"/></link>'
        '<width sOffset="0" a="3" b="0.05" c="0" d="0"/>'
        '<roadMark sOffset="0" type="solid" laneChange="increase"/></lane>'
        '<lane id="-2" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane>'
        '<lane id="-3" type="none"><width sOffset="0" a="1" b="0" c="0" d="0"/></lane>'
        '<lane id="-4" type="sidewalk"><width sOffset="0" a="2" b="0" c="0" d="0"/></lane></right></laneSection>'
        '<laneSection s="20"><right><lane id="-1" type="driving"><link><predecessor id="-1"/></link>'
        '<width sOffset="0" a="4" b="0" c="0" d="0"/></lane></right></laneSection>'
    )
    road, points = _lane(_road("<line/>", 40.0, lanes=lanes))
    assert points == [pytest.approx((0.0, -0.5)), pytest.approx((20.0, -1.0))], "this section's offset to its end"
    assert road["1:0:-1"].successors == ("1:1:-1",)
    assert (road.neighbour("1:0:-1", 1), road.neighbour("1:0:-2", 1)) == ("1:0:-2", None)
    assert [lane for lane, _ in road.changes("1:0:-2")] == ["1:0:-1"]
    assert road.changes("1:0:-1") == (), "the marking lets one change to the left alone"
    assert road["1:0:1"].centre.points_m[0] == pytest.approx((20.0, 2.5)), "driven against the reference line"
    assert road["1:0:-4"].kind == "sidewalk"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("no xml", "No XML"),
        ("<osm/>", "<osm>"),
        ("<OpenDRIVE/>", "without a road"),
        (_road("<clothoid/>", 5.0), "unknown shape"),
        (_road("<line/>", math.nan), "Road '1'"),
        (_road('<arc curvature="much"/>', 5.0), "curvature='much'"),
    ],
)
def test_what_cannot_be_read_is_said(text: str, says: str) -> None:
    with pytest.raises(OpenDriveError, match=says):
        parse_opendrive(text)


@pytest.fixture(scope="module", params=TOWNS)
def town(request: pytest.FixtureRequest, carla_data: Path) -> tuple[OpenDriveMap, object]:
    carla = pytest.importorskip("carla")
    path = carla_data / "maps" / f"{request.param}.xodr"
    return read_opendrive(path), carla.Map(request.param, path.read_text())


def test_every_lane_lies_where_carla_has_it(town: tuple[OpenDriveMap, object]) -> None:
    """The lane by name within 0.15 m, and the lane found in the place the same one, or one that lies over it there."""
    ours, theirs = town
    waypoints = theirs.generate_waypoints(6.0)  # type: ignore[attr-defined]
    right = seen = 0
    for waypoint in random.Random(1).sample(waypoints, min(len(waypoints), 300)):
        at = waypoint.transform.location
        x, y, heading = at.x, -at.y, -math.radians(waypoint.transform.rotation.yaw)
        name = lane_name(str(waypoint.road_id), waypoint.section_id, waypoint.lane_id)
        if name not in ours.road:
            assert waypoint.next(0.01), "only a lane shorter than a millimetre is passed over"
            continue
        seen += 1
        assert _away(ours.road, name, x, y) < 0.15
        found = ours.road.locate(x, y, heading, ("driving",))
        assert found is not None
        right += _whole(found.lane) == name or _away(ours.road, found.lane, x, y) < 0.03
    assert right / seen >= 0.99


def _away(road: RoadGraph, lane: str, x: float, y: float) -> float:
    """Distance from a lane as CARLA names it, which knows no pieces of lane sections."""
    centres = [one.centre for one in road.lanes if _whole(one.id) == _whole(lane)]
    poses = [centre.at(min(max(centre.nearest(x, y), 0.0), centre.length_m)) for centre in centres]
    return min(math.hypot(pose.x_m - x, pose.y_m - y) for pose in poses)


def _whole(lane: str) -> str:
    """The lane that a piece belongs to."""
    road, section, number = lane.split(":")
    return f"{road}:{section.partition('.')[0]}:{number}"


def test_lanes_lead_where_carla_says(town: tuple[OpenDriveMap, object]) -> None:
    ours, theirs = town
    told: dict[str, set[str]] = {}
    for start, goal in theirs.get_topology():  # type: ignore[attr-defined]
        names = [lane_name(str(one.road_id), one.section_id, one.lane_id) for one in (start, goal)]
        if names[0] != names[1]:  # CARLA lets a dead end lead to its own end
            told.setdefault(names[0], set()).add(names[1])

    def drawn(lane: str, seen: frozenset[str] = frozenset()) -> set[str]:
        """What a lane leads to, those passed over that are shorter than a millimetre."""
        if lane in ours.road:
            return {lane}
        return {one for onward in told.get(lane, ()) - seen for one in drawn(onward, seen | {lane})}

    expected = {(a, c) for a, goals in told.items() if a in ours.road for b in goals for c in drawn(b)}
    pairs = {(lane.id, one) for lane in ours.road.lanes if lane.kind == "driving" for one in lane.successors}
    found = {(_whole(one), _whole(other)) for one, other in pairs if _whole(one) != _whole(other)}
    assert found == expected


def test_the_height_tells_roads_apart_that_cross(carla_data: Path) -> None:
    """Where a road of Town04 passes over another."""
    town = read_opendrive(carla_data / "maps" / "Town04.xodr")
    below = town.road["47:0:-4"].centre.at(28.0)
    found = town.road.places(below.x_m, below.y_m, None, ("driving",))
    assert {place.lane for place in found} == {"47:0:-4", "39:0:6"}
    for height, lane in ((0.0, "47:0:-4"), (11.0, "39:0:6")):
        assert [place.lane for place in town.places(below.x_m, below.y_m, height, None, ("driving",))] == [lane]
    facing = town.road.locate(below.x_m, below.y_m, below.heading_rad, ("driving",))
    assert facing is not None
    assert facing.lane == "47:0:-4", "so does the heading"
