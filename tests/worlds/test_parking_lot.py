"""The ground of a parking lot: boxes, spots, ways onto them, and which spot a place means."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chauffeur.concept import ScenarioError
from chauffeur.geometry import Box, Pose, overlap
from chauffeur.worlds.parking.lot import Lot, build_lot, way_id
from chauffeur.worlds.parking.places import PLACES, parked_in, spot_for
from chauffeur.worlds.parking.routes import TURN_M, way_along, way_to_spot
from chauffeur.worlds.parking.world import CHASSIS

ENTRANCE = Pose(-20.0, 0.0, 0.0)
WHEELBASE_M = CHASSIS.wheelbase_m

boxes = st.builds(Box, st.floats(-6, 6), st.floats(-6, 6), st.floats(-7, 7), st.floats(0.5, 6.0), st.floats(0.5, 3.0))


@pytest.fixture(scope="module")
def lot() -> Lot:
    return build_lot(3, 6)


def _body(rear: Pose) -> Box:
    middle, body = rear.ahead(CHASSIS.body.rear_to_middle_m), CHASSIS.body
    return Box(middle.x_m, middle.y_m, middle.heading_rad, body.length_m, body.width_m)


@given(boxes, boxes)
@settings(max_examples=200, deadline=None)
def test_boxes_overlap_where_points_are_shared(a: Box, b: Box) -> None:
    """Against sampling: a point well inside both proves an overlap, and boxes that overlap by a bit share one."""
    assert overlap(a, b) == overlap(b, a)
    places = [i / 12.0 - 0.5 for i in range(13)]
    c, s = math.cos(a.heading_rad), math.sin(a.heading_rad)
    shared = any(
        b.holds(a.x_m + c * u * a.length_m - s * v * a.width_m, a.y_m + s * u * a.length_m + c * v * a.width_m)
        for u in places
        for v in places
    )
    if shared:
        assert overlap(a, b.grown(1e-6))
    if overlap(a.grown(-0.2), b.grown(-0.2)):
        assert overlap(a, b)


def test_boxes_that_touch_do_not_overlap() -> None:
    a = Box(0.0, 0.0, 0.0, 4.0, 2.0)
    assert not overlap(a, Box(4.0, 0.0, 0.0, 4.0, 2.0))
    assert overlap(a, Box(3.99, 0.0, 0.0, 4.0, 2.0))
    # A corner into a side: the axes of either one alone would not part them.
    assert not overlap(a, Box(3.3, 1.7, math.pi / 4.0, 2.0, 2.0))
    assert overlap(a, Box(2.7, 1.2, math.pi / 4.0, 2.0, 2.0))
    assert a.contains(Box(0.5, 0.0, 0.1, 2.0, 1.0))
    assert not a.contains(Box(1.5, 0.0, 0.0, 2.0, 1.0))


def test_spots_stand_side_by_side_within_the_ground(lot: Lot) -> None:
    spots = list(lot.spots.values())
    assert len(spots) == 36
    assert {spot.name for spot in spots} == {f"{row}{n}" for row in "ABCDEF" for n in range(1, 7)}
    for i, one in enumerate(spots):
        assert lot.ground.contains(one.box)
        for other in spots[:i]:
            assert not overlap(one.box.grown(-1e-6), other.box)


def test_lanes_follow_one_another(lot: Lot) -> None:
    ways = [lane for lane in lot.road.lanes if lane.id not in lot.spots]
    for lane in ways:
        for onward in lot.road.successors(lane.id):
            assert math.dist(lane.centre.points_m[-1], onward.centre.points_m[0]) < 1e-9, (lane.id, onward.id)
    assert [lane.id for lane in ways if not lane.successors] == [way_id("s1", "exit")]


@pytest.mark.parametrize("aisles", [1, 3])
def test_every_spot_can_be_driven_onto_in_a_full_lot(aisles: int) -> None:
    """The car's body, moved along the way, keeps half a metre off the largest neighbours; bends are wide enough."""
    lot = build_lot(aisles, 4)
    for name, spot in lot.spots.items():
        way = way_to_spot(lot, spot, ENTRANCE, WHEELBASE_M)
        assert way is not None
        path = way.path
        others = [
            Box(s.box.x_m, s.box.y_m, s.box.heading_rad, 4.9, 1.9) for other, s in lot.spots.items() if other != name
        ]
        poses = [path.at(0.25 * i) for i in range(math.ceil(path.length_m / 0.25) + 1)]
        for pose in poses:
            assert not any(overlap(_body(pose).grown(0.5), other) for other in others), name
        headings = [path.at(2.0 * i).heading_rad for i in range(int(path.length_m / 2.0))]
        sharpest = max(abs(b - a) / 2.0 for a, b in pairwise(headings))
        assert sharpest < 0.9 * math.tan(CHASSIS.steering_rad) / WHEELBASE_M
        assert spot.box.contains(_body(path.at(path.length_m)).grown(-1e-9))
        assert parked_in(lot, _body(path.at(path.length_m)), 0.0) == spot


def test_turns_onto_spots_are_wider_than_the_cars() -> None:
    assert 1.2 * WHEELBASE_M / math.tan(CHASSIS.steering_rad) < TURN_M


def test_places_mean_the_nearest_of_the_free_spots(lot: Lot) -> None:
    everywhere = frozenset(lot.spots)
    ways = {name: way_to_spot(lot, spot, ENTRANCE, WHEELBASE_M) for name, spot in lot.spots.items()}
    shortest = min(ways, key=lambda name: ways[name].path.length_m)  # type: ignore[union-attr]
    assert spot_for(lot, everywhere, "nearest", ENTRANCE, WHEELBASE_M).name == shortest
    assert spot_for(lot, everywhere, "Stadium", ENTRANCE, WHEELBASE_M).name[0] == "F"
    assert spot_for(lot, everywhere, "exit", ENTRANCE, WHEELBASE_M).name == "A6"
    assert spot_for(lot, everywhere, " b4 ", ENTRANCE, WHEELBASE_M).name == "B4"
    assert spot_for(lot, {"C3", "D5"}, "nearest", ENTRANCE, WHEELBASE_M).name in {"C3", "D5"}


@pytest.mark.parametrize(
    ("place", "says"), [("moon", "no place 'moon'"), ("A1", "A1 is taken"), ("", "no place ''"), ("Z9", "no place")]
)
def test_a_place_that_cannot_be_had_is_refused_in_words(lot: Lot, place: str, says: str) -> None:
    with pytest.raises(ScenarioError, match=says) as refused:
        spot_for(lot, {"C3"}, place, ENTRANCE, WHEELBASE_M)
    assert refused.value.hint


def test_there_is_no_way_back(lot: Lot) -> None:
    past = Pose(60.0, 0.0, 0.0)
    assert way_to_spot(lot, lot.spots["A1"], past, WHEELBASE_M) is None
    in_aisle = Pose(lot.aisle_x_m(2), -9.0, -math.pi / 2.0)
    assert way_to_spot(lot, lot.spots["C6"], in_aisle, WHEELBASE_M) is not None
    assert way_to_spot(lot, lot.spots["C1"], Pose(in_aisle.x_m, -30.0, -math.pi / 2.0), WHEELBASE_M) is None
    for place in PLACES:
        with pytest.raises(ScenarioError, match=r"No way leads|no place"):
            spot_for(lot, lot.spots, place, Pose(20.0, lot.exit_m[1], math.pi), WHEELBASE_M)


def test_the_way_on_leads_to_the_exit_and_ends_half_a_metre_before(lot: Lot) -> None:
    way = way_along(lot, way_id("a2", "b2"), CHASSIS.body.overhang_m)
    end = way.path.at(way.path.length_m).ahead(CHASSIS.body.overhang_m + 0.5)
    assert (end.x_m, end.y_m) == pytest.approx(lot.exit_m, abs=1e-6)


def test_parked_means_between_the_lines_straight_and_standing(lot: Lot) -> None:
    spot = lot.spots["D3"]
    box = Box(spot.box.x_m, spot.box.y_m, spot.box.heading_rad, 4.89, 1.895)
    assert parked_in(lot, box, 0.0) == spot
    assert parked_in(lot, box, 0.3) is None
    across = spot.box.heading_rad + math.pi / 2.0
    aside = Box(box.x_m + 0.5 * math.cos(across), box.y_m + 0.5 * math.sin(across), box.heading_rad, 4.89, 1.895)
    assert parked_in(lot, aside, 0.0) is None
    assert parked_in(lot, Box(box.x_m, box.y_m, box.heading_rad + 0.1, 4.0, 1.6), 0.0) is None
    assert parked_in(lot, Box(0.0, 0.0, 0.0, 4.89, 1.895), 0.0) is None
