"""Hand-made roads: a lane's name says its road, and its place among those abreast, as in the highway worlds."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from functools import cache

from chauffeur.geometry import Lane, Polyline, RoadGraph
from chauffeur.geometry.road_graph import turn_of


def a_lane(
    name: str,
    centre: Iterable[tuple[float, float]] = ((0.0, 0.0), (1000.0, 0.0)),
    *,
    width: float = 4.0,
    limit: float = 30.0,
    closed: bool = False,
    emergency: bool = False,
) -> Lane:
    """A lane `from-to:index`, index 0 leftmost; its turn is how it bends."""
    road, _, index = name.partition(":")
    lane = Lane(
        name,
        Polyline.of(centre),
        width,
        limit,
        kind="emergency" if emergency else "driving",
        road=road,
        index=int(index or 0),
        closed=closed,
        junction="crossing" if road.startswith(("ir", "middle")) else "",
    )
    return replace(lane, turn=turn_of(lane.bend_rad))


def a_road(lanes: Iterable[Lane]) -> RoadGraph:
    """The graph of lanes: one leads into those that begin at the node where it ends, and where its last point is."""
    return _graph(tuple(lanes))


@cache
def _graph(lanes: tuple[Lane, ...]) -> RoadGraph:
    return RoadGraph(
        tuple(
            replace(
                lane,
                successors=tuple(other.id for other in lanes if _leads_into(lane, other)),
            )
            for lane in lanes
        )
    )


def _leads_into(lane: Lane, other: Lane) -> bool:
    joined = math.dist(lane.centre.points_m[-1], other.centre.points_m[0]) < 0.5
    return joined and other.road.partition("-")[0] == lane.road.partition("-")[2]
