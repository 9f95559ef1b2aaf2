"""The ways through the next junction, from whichever lane of the street, and what people call them.

A way is called by how far it turns. Where all ways turn alike (a motorway splits, an exit leads off) the leftmost is
called left and the rightmost right.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from chauffeur.geometry.angles import wrap_to_pi
from chauffeur.geometry.road_graph import TURNS, LaneId, RoadGraph, Turn, turn_of

_PIECES: Final = 60
"""Lanes one after the other of which a way through a junction may be made."""
_PATHS: Final = 400


@dataclass(frozen=True, slots=True)
class JunctionWay:
    """A way through a junction.

    Attributes:
        entry: Lane before it.
        lanes: Through it.
        exit: Lane behind it.
        bend_rad: Change of heading on the way, counter-clockwise positive.
    """

    entry: LaneId
    lanes: tuple[LaneId, ...]
    exit: LaneId
    bend_rad: float


def ways_from(road: RoadGraph, lane: LaneId) -> tuple[JunctionWay, ...]:
    """All ways on through the junction at the end of a lane's street; none where no junction follows."""
    found: list[JunctionWay] = []
    for own in road.abreast(lane):
        if own.kind != road[lane].kind:
            continue
        for first in road.successors(own.id):
            if first.junction and first.kind == own.kind:
                for lanes, after in _through(road, first.id):
                    headings = road[lanes[0]].centre.headings[0], road[lanes[-1]].centre.headings[-1]
                    found.append(JunctionWay(own.id, lanes, after, wrap_to_pi(float(headings[1] - headings[0]))))
    return tuple(found)


def _through(road: RoadGraph, first: LaneId) -> Iterator[tuple[tuple[LaneId, ...], LaneId]]:
    junction = road[first].junction
    stack: list[tuple[LaneId, ...]] = [(first,)]
    for _ in range(_PATHS):
        if not stack:
            return
        lanes = stack.pop()
        for one in road.successors(lanes[-1]):
            if one.junction != junction:
                yield lanes, one.id
            elif len(lanes) < _PIECES and one.id not in lanes:
                stack.append((*lanes, one.id))


def named_ways(road: RoadGraph, lane: LaneId) -> Mapping[Turn, tuple[JunctionWay, ...]]:
    """The ways at the end of a lane's street by what they are called, in the order left, straight, right."""
    ways = ways_from(road, lane)
    called = {way: turn_of(way.bend_rad) for way in ways}
    exits = {road[way.exit].road or way.exit for way in ways}
    if len(exits) > 1 and len(set(called.values())) == 1:
        bends = {
            one: max(way.bend_rad for way in ways if (road[way.exit].road or way.exit) == one) for one in sorted(exits)
        }
        order = sorted(bends, key=lambda one: -bends[one])
        names: dict[str, Turn] = dict.fromkeys(order, "straight")
        names[order[0]], names[order[-1]] = "left", "right"
        called = {way: names[road[way.exit].road or way.exit] for way in ways}
    return {turn: tuple(way for way in ways if called[way] == turn) for turn in TURNS if turn in called.values()}


def way_to(road: RoadGraph, lane: LaneId, turn: Turn) -> JunctionWay | None:
    """The way to a side at the end of a lane's street that needs the fewest lane changes; None where none leads there.

    Of several as near, the one that bends least.
    """
    ways = named_ways(road, lane).get(turn, ())
    return min(
        ways,
        key=lambda way: (abs(road.places_between(lane, way.entry) or 0), abs(way.bend_rad), way.exit),
        default=None,
    )


def choice_ahead(
    road: RoadGraph, lanes: Iterable[LaneId], within_m: float = 1000.0
) -> tuple[LaneId, float, Mapping[Turn, tuple[JunctionWay, ...]]] | None:
    """The next junction where a street leads on more ways than one.

    Args:
        road: The road.
        lanes: The ego's way, from its own lane on.
        within_m: Not farther than this.

    Returns:
        (the last lane before it, distance from the start of the first lane to its end, the ways by name); None where
        none is near.
    """
    at_m = 0.0
    for lane in lanes:
        own = road[lane]
        at_m += own.length_m
        if at_m - own.length_m > within_m:
            return None
        if not own.junction:
            ways = named_ways(road, lane)
            if len(ways) > 1:
                return lane, at_m, ways
    return None


def turns_ahead(road: RoadGraph, lane: LaneId, route: Sequence[LaneId] = ()) -> tuple[Turn, ...]:
    """Names of the ways at the next junction with a choice; empty if none is near.

    Args:
        road: The road.
        lane: The ego's.
        route: Lanes of its route; straight on where it is not on it, and where the route ends before any choice.
    """
    here = next((i for i, one in enumerate(route) if one == lane or road.places_between(lane, one)), None)
    lanes = [lane] if here is None else [lane, *route[here + 1 :]]
    lanes += [one.id for one in road.ahead(lanes[-1])][1:]
    found = choice_ahead(road, lanes)
    return () if found is None else tuple(found[2])
