"""The ways through a junction, by what they are called."""

from __future__ import annotations

import pytest

from chauffeur.geometry import Lane, Polyline, RoadGraph, choice_ahead, named_ways, turns_ahead, way_to


def street(ends: dict[str, list[tuple[float, float]]]) -> RoadGraph:
    """Two lanes to the north, b left of a, that lead into a junction at y = 100; a way leads off from one of them."""
    lanes = [
        Lane("b", Polyline.of([(-3.5, 0.0), (-3.5, 100.0)]), 3.5, 13.9, road="r", index=0, successors=("left",)),
        Lane(
            "a", Polyline.of([(0.0, 0.0), (0.0, 100.0)]), 3.5, 13.9, road="r", index=1,
            successors=tuple(one for one in ends if one != "left"),
        ),
    ]  # fmt: skip
    for name, points in ends.items():
        x, y = points[-1]
        dx, dy = x - points[-2][0], y - points[-2][1]
        lanes.append(Lane(name, Polyline.of(points), 3.5, 13.9, successors=(f"{name}-on",), junction="j"))
        beyond = Polyline.of([(x, y), (x + 20.0 * dx, y + 20.0 * dy)])
        lanes.append(Lane(f"{name}-on", beyond, 3.5, 13.9, road=f"{name}-road"))
    return RoadGraph(tuple(lanes))


CROSS = street(
    {
        "left": [(-3.5, 100.0), (-5.0, 108.0), (-15.0, 110.0)],
        "straight": [(0.0, 100.0), (0.0, 120.0)],
        "right": [(0.0, 100.0), (2.0, 104.0), (10.0, 106.0)],
    }
)
FORK = street({"left": [(-3.5, 100.0), (-4.0, 120.0)], "straight": [(0.0, 100.0), (2.0, 120.0)]})


def test_ways_are_those_of_the_whole_street() -> None:
    for lane in ("a", "b"):
        assert tuple(named_ways(CROSS, lane)) == ("left", "straight", "right")
        assert turns_ahead(CROSS, lane) == ("left", "straight", "right")


def test_where_the_road_only_splits_the_sides_are_named() -> None:
    ways = named_ways(FORK, "a")
    assert {turn: {way.exit for way in those} for turn, those in ways.items()} == {
        "left": {"left-on"},
        "right": {"straight-on"},
    }


@pytest.mark.parametrize(("turn", "entry"), [("left", "b"), ("straight", "a"), ("right", "a")])
def test_the_way_to_a_side_begins_in_the_lane_that_leads_there(turn: str, entry: str) -> None:
    way = way_to(CROSS, "a", turn)  # type: ignore[arg-type]
    assert way is not None
    assert (way.entry, way.exit) == (entry, f"{turn}-on")
    assert way_to(FORK, "a", "straight") is None


def test_a_junction_is_only_told_where_there_is_a_choice() -> None:
    found = choice_ahead(CROSS, ["a", "straight", "straight-on"])
    assert found is not None
    assert found[:2] == ("a", pytest.approx(100.0))
    assert choice_ahead(CROSS, ["straight-on"]) is None
    single = street({"straight": [(0.0, 100.0), (0.0, 120.0)], "left": [(-3.5, 100.0), (-3.5, 120.0)]})
    alone = RoadGraph(tuple(lane for lane in single.lanes if not lane.id.startswith("left") and lane.id != "b"))
    assert choice_ahead(alone, ["a", "straight", "straight-on"]) is None


def test_a_way_that_the_map_cuts_to_pieces_is_one_way() -> None:
    pieces = [f"piece-{i}" for i in range(12)]
    cut = [
        Lane(
            name,
            Polyline.of([(0.0, 100.0 + 2.0 * i), (0.0, 102.0 + 2.0 * i)]),
            3.5,
            13.9,
            successors=(pieces[i + 1] if i < 11 else "straight-on",),
            junction="j",
        )
        for i, name in enumerate(pieces)
    ]
    lanes = [lane for lane in CROSS.lanes if lane.id not in ("straight", "a")]
    before = CROSS["a"]
    entry = Lane("a", before.centre, 3.5, 13.9, road="r", index=1, successors=("piece-0", "right"))
    (way,) = named_ways(RoadGraph((*lanes, entry, *cut)), "b")["straight"]
    assert way.lanes == tuple(pieces)


def test_who_wants_no_way_goes_straight_on_however_the_pieces_begin() -> None:
    from chauffeur.worlds.town.way import free_route

    begins = Lane("left", Polyline.of([(0.0, 100.0), (0.0, 100.4)]), 3.5, 13.9, successors=("bends",), junction="j")
    bends = Lane(
        "bends", Polyline.of([(0.0, 100.4), (-5.0, 108.0), (-15.0, 110.0)]), 3.5, 13.9, successors=("left-on",),
        junction="j",
    )  # fmt: skip
    straight = Lane(
        "straight", Polyline.of([(0.0, 100.0), (0.2, 110.0), (0.0, 120.0)]), 3.5, 13.9, successors=("straight-on",),
        junction="j",
    )  # fmt: skip
    entry = Lane("a", CROSS["a"].centre, 3.5, 13.9, road="r", index=1, successors=("left", "straight"))
    road = RoadGraph((entry, begins, bends, straight, CROSS["left-on"], CROSS["straight-on"]))
    assert free_route(road, "a", 5.0, None, 300.0).lanes == ("a", "straight", "straight-on")
    assert free_route(road, "a", 5.0, "left", 300.0).lanes == ("a", "left", "bends", "left-on")
