"""Roads over one another, told apart by their heights."""

from __future__ import annotations

import math
from dataclasses import replace

from chauffeur.bench.leaderboard.routes import LeaderboardRoute
from chauffeur.bench.leaderboard.ways import plan_official
from chauffeur.geometry import Pose
from chauffeur.geometry.opendrive import OpenDriveMap, parse_opendrive
from chauffeur.worlds.town.levels import Levels
from chauffeur.worlds.town.library import load

STREET, BRIDGE = "1:0:-1", "2:0:-1"


def _road(name: str, x: float, y: float, heading: float, height: float, grade: float = 0.0) -> str:
    return (
        f'<road id="{name}" length="200" junction="-1"><planView><geometry s="0" x="{x}" y="{y}" hdg="{heading}" '
        'length="200"><line/></geometry></planView>'
        f'<elevationProfile><elevation s="0" a="{height}" b="{grade}" c="0" d="0"/></elevationProfile>'
        '<lanes><laneSection s="0"><right><lane id="-1" type="driving"><width sOffset="0" a="4" b="0" c="0" d="0"/>'
        "</lane></right></laneSection></lanes></road>"
    )


def _map(height: float, grade: float = 0.0, turned: float = math.pi / 2.0) -> OpenDriveMap:
    """A street along x, and another road over its middle."""
    start = 100.0 - 100.0 * math.cos(turned), -100.0 * math.sin(turned)
    return parse_opendrive(
        f"<OpenDRIVE><header/>{_road('1', 0.0, 0.0, 0.0, 0.0)}{_road('2', *start, turned, height, grade)}</OpenDRIVE>"
    )


def test_a_bridge_is_another_level_and_a_crossing_is_none() -> None:
    bridge, crossing = Levels(_map(8.0)), Levels(_map(0.5))
    assert bridge.near(100.0, 0.0)
    assert not bridge.near(900.0, 0.0)
    assert not crossing.near(100.0, 0.0)
    assert bridge.apart(STREET, 100.0, BRIDGE, 100.0, 2.0)
    assert not bridge.apart(BRIDGE, 60.0, BRIDGE, 100.0, 40.0)


def test_who_is_farther_up_the_same_slope_is_seen() -> None:
    ramp = Levels(_map(0.0, grade=0.08))
    assert not ramp.apart(BRIDGE, 20.0, BRIDGE, 90.0, 70.0)


def test_a_route_over_a_bridge_keeps_to_it() -> None:
    """Two roads along each other at two heights: nothing in the plane tells them apart."""
    made = _map(8.0, turned=0.02)
    town = replace(load("Gridford"), road=made.road)  # a copy: packs are read once for everybody
    town.__dict__["opendrive"] = made
    points = tuple(made.road[STREET].centre.at(station) for station in (95.0, 110.0))
    for heights, lane in (((0.0, 0.0), STREET), ((8.0, 8.0), BRIDGE)):
        route = LeaderboardRoute("0", "Two", tuple(Pose(p.x_m, p.y_m, 0.01) for p in points), heights)
        assert plan_official(town, route).route.lanes == (lane,)
