"""Routes over a road graph: the lanes to a goal, and the manoeuvres on the way."""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

from chauffeur.geometry.road_graph import LaneId, LanePlace, RoadGraph

LANE_CHANGE_M: Final = 50.0
"""What a lane change costs a route, as distance: it is worth a detour of so much."""

Manoeuvre = Literal["left", "straight", "right", "change left", "change right"]


class Step(NamedTuple):
    """A manoeuvre of a route, and the distance from its start at which it begins, m."""

    manoeuvre: Manoeuvre
    at_m: float
    lane: LaneId


@dataclass(frozen=True, slots=True)
class Route:
    """The way to a goal.

    Attributes:
        lanes: One after the other; a lane abreast of the one before it is changed into.
        start_m: Station on the first lane.
        goal_m: Station on the last one.
    """

    lanes: tuple[LaneId, ...]
    start_m: float
    goal_m: float

    def length_m(self, road: RoadGraph) -> float:
        """Distance from start to goal along it; lane changes take no distance."""
        return self.steps(road)[1]

    def steps(self, road: RoadGraph) -> tuple[tuple[Step, ...], float]:
        """The manoeuvres, turns only inside junctions, and the length of the route, m."""
        found: list[Step] = []
        at_m = -self.start_m
        for before, lane in zip((None, *self.lanes), self.lanes, strict=False):
            if before is not None:
                side = road.places_between(before, lane)
                if side:
                    found.append(Step("change left" if side < 0 else "change right", max(at_m, 0.0), lane))
                    continue
                at_m += road[before].length_m
            if road[lane].junction:
                found.append(Step(road[lane].turn, max(at_m, 0.0), lane))
        return tuple(found), at_m + self.goal_m


def plan_route(road: RoadGraph, start: LanePlace, goal: LanePlace) -> Route | None:
    """The shortest way, lane changes counted as `LANE_CHANGE_M`; None where no way leads there (Dijkstra)."""
    if start.lane == goal.lane and goal.station_m >= start.station_m:
        return Route((start.lane,), start.station_m, goal.station_m)
    rim: list[tuple[float, int, LaneId, tuple[LaneId, ...]]] = [(-start.station_m, 0, start.lane, (start.lane,))]
    done: set[LaneId] = set()
    count = 0
    while rim:
        cost, _, lane, way = heapq.heappop(rim)
        if lane == goal.lane and len(way) > 1:
            return Route(way, start.station_m, goal.station_m)
        if lane in done:
            continue
        if len(way) > 1 or goal.lane != start.lane:
            done.add(lane)
        here = road[lane]
        steps = [(one, cost + here.length_m) for one in here.successors]
        for side in (-1, 1):
            beside = road.neighbour(lane, side)
            if beside is not None and not road[beside].closed and road[beside].kind == here.kind:
                steps.append((beside, cost + LANE_CHANGE_M))
        for one, so_far in steps:
            if one not in done:
                count += 1
                heapq.heappush(rim, (so_far, count, one, (*way, one)))
    return None
