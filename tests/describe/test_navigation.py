"""Navigation in words on a small cross of streets: what is said is what the map has."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from chauffeur.concept import Observation, Signal, VehicleState
from chauffeur.describe.navigation import NavigationInstruction, Navigator
from chauffeur.describe.town import describe_town
from chauffeur.geometry import Lane, Polyline, RoadGraph, Route
from chauffeur.worlds.town.pack import Place


def crossing(ways: tuple[str, ...] = ("left", "straight", "right")) -> RoadGraph:
    """Two lanes to the north, a junction at y = 200, and a street on from it to each side."""
    ends = {
        "left": [(0.0, 200.0), (-5.0, 208.0), (-15.0, 210.0)],
        "straight": [(0.0, 200.0), (0.0, 220.0)],
        "right": [(0.0, 200.0), (2.0, 204.0), (10.0, 206.0)],
    }
    beyond = {
        "left": [(-15.0, 210.0), (-115.0, 210.0)],
        "straight": [(0.0, 220.0), (0.0, 320.0)],
        "right": [(10.0, 206.0), (110.0, 206.0)],
    }
    lanes = [
        Lane("a", Polyline.of([(0.0, 0.0), (0.0, 200.0)]), 3.5, 13.9, road="r", index=1, successors=ways),
        Lane("b", Polyline.of([(-3.5, 0.0), (-3.5, 200.0)]), 3.5, 13.9, road="r", index=0),
    ]
    for way in ways:
        lanes.append(Lane(way, Polyline.of(ends[way]), 3.5, 13.9, successors=(f"{way}-on",), junction="j"))
        lanes.append(Lane(f"{way}-on", Polyline.of(beyond[way]), 3.5, 13.9, road=f"{way}-road"))
    return RoadGraph(tuple(lanes))


LIGHT = Signal("tl", "red", ("a",), ((-1.75, 199.0), (1.75, 199.0)))
CHURCH = Place("St. Anne's Church", "church", 5.0, 160.0, "a", 160.0)


def said(
    navigator: Navigator, station: float, count: int = 60, *, misleading: bool = False
) -> list[NavigationInstruction]:
    rng = np.random.default_rng(3)
    return [navigator.instruction(station, rng, misleading) for _ in range(count)]


@pytest.mark.parametrize("turn", ["left", "right"])
def test_a_turn_is_said_by_distance_ordinal_and_landmark(turn: str) -> None:
    navigator = Navigator(crossing(), Route(("a", turn, f"{turn}-on"), 0.0, 90.0), [LIGHT], (), [CHURCH])
    found = said(navigator, 50.0)
    kinds = {one.kind for one in found}
    assert kinds == {f"{turn}/light/{reference}" for reference in ("distance", "ordinal", "landmark")}
    assert len({one.text for one in found}) > 10
    assert all(turn in one.text.lower() for one in found)
    assert all(one.ahead_m == pytest.approx(150.0) and one.safe_to_execute for one in found)
    assert any("150 meters" in one.text for one in found)
    assert any("St. Anne's Church" in one.text for one in found)


@pytest.mark.parametrize(("ways", "kind"), [(("left", "straight", "right"), "crossroads"), (("left", "right"), "tee")])
def test_the_junction_is_called_what_it_is(ways: tuple[str, ...], kind: str) -> None:
    navigator = Navigator(crossing(ways), Route(("a", "left", "left-on"), 0.0, 90.0))
    assert {one.kind.split("/")[1] for one in said(navigator, 100.0)} == {kind}


def test_close_to_the_junction_it_is_now() -> None:
    navigator = Navigator(crossing(), Route(("a", "left", "left-on"), 0.0, 90.0), [LIGHT])
    assert {one.kind for one in said(navigator, 190.0)} == {"left/light/now"}


def test_a_lane_change_is_said_with_the_turn_that_it_is_for() -> None:
    navigator = Navigator(crossing(), Route(("b", "a", "right", "right-on"), 60.0, 90.0), [LIGHT])
    (kind,) = {one.kind for one in said(navigator, -20.0)}
    assert kind == "change right/distance+right/light"


def test_the_end_of_the_way_is_told() -> None:
    navigator = Navigator(crossing(), Route(("a", "straight", "straight-on"), 0.0, 90.0))
    assert {one.kind for one in said(navigator, 250.0)} == {"arrive/distance"}
    assert {one.kind for one in said(navigator, 305.0)} == {"arrive/now"}


def test_what_is_misleading_cannot_be_driven_and_says_so() -> None:
    road = crossing(("left", "straight"))
    navigator = Navigator(road, Route(("a", "left", "left-on"), 0.0, 90.0), [LIGHT])
    found = said(navigator, 100.0, misleading=True)
    assert all(not one.safe_to_execute for one in found)
    assert {one.kind for one in found} == {"misleading/right/light"}


def test_the_same_draw_says_the_same() -> None:
    navigator = Navigator(crossing(), Route(("a", "left", "left-on"), 0.0, 90.0), [LIGHT])
    assert said(navigator, 70.0) == said(navigator, 70.0)


def test_where_the_ego_is_along_the_route() -> None:
    road = crossing()
    navigator = Navigator(road, Route(("a", "left", "left-on"), 20.0, 90.0))
    ego = VehicleState(0, "car", 0.0, 80.0, 1.57, 5.0, 4.9, 2.1, "a")
    seen = Observation(0.0, 0, "town", ego, (), (), road, None, None, False, False)
    assert navigator.station_of(seen) == pytest.approx(60.0)
    assert navigator.station_of(replace(seen, ego=replace(ego, lane="right-on"))) is None


def test_vehicles_are_told_as_in_the_example_of_the_paper() -> None:
    ego = VehicleState(0, "car", 0.0, 0.0, math.pi / 2.0, 0.0, 4.9, 2.1, "a")
    ahead = VehicleState(1, "car", -0.2255, 6.796, math.pi / 2.0, 0.0, 4.6, 1.9, "a")
    behind = replace(ahead, id=2, y_m=-20.0)
    seen = Observation(0.0, 0, "town", ego, (ahead, behind), (), crossing(), None, None, False, False)
    text = describe_town(seen).text
    assert (
        "There is a vehicle at a distance of 6.8 m. It is moving at a speed of 0.0 m/s. It is at an angle of 1.9 "
        "degrees. The angle between the headings is 0.0 degrees." in text
    )
    assert text.count("There is a vehicle") == 1
