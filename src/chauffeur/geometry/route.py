"""Routes over a road graph: the lanes to a goal, the manoeuvres on the way, and the line that is driven."""

from __future__ import annotations

import heapq
import itertools
import math
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

from chauffeur.geometry.polyline import SAME_M, Polyline
from chauffeur.geometry.road_graph import Lane, LaneId, LanePlace, RoadGraph, turn_of

LANE_CHANGE_M: Final = 50.0
"""What a lane change costs a route, as distance: it is worth a detour of so much."""
CRAMPED_COST: Final = 3.0
"""What each metre costs that a lane change is short of room."""
_STRETCH_COST: Final = 0.01
"""What each metre costs that its own stretch is short of that room: of ways alike it is the one that need not share."""
CHANGE_TIME_S: Final = 3.0
"""A lane change takes so long at the speed limit (ISO 21202 asks for 3 to 5 s)..."""
CHANGE_LEAST_M: Final = 25.0
"""... and no less way than this."""
_HASTE_M: Final = 5.0
"""Way in the lane before its change begins, where there is room."""
_STRAY_COST: Final = 10.0
"""What a metre (or rad) costs by which a lane misses a place that a route is to pass, as distance."""

Manoeuvre = Literal["left", "straight", "right", "change left", "change right"]
RoadOption = Literal["left", "straight", "right", "change left", "change right", "follow"]


class Step(NamedTuple):
    """A manoeuvre of a route, and the distance from its start at which it begins, m."""

    manoeuvre: Manoeuvre
    at_m: float
    lane: LaneId


class RoutePoint(NamedTuple):
    """A point of the line that is driven.

    Attributes:
        x_m, y_m, heading_rad: Where, and which way it leads on.
        station_m: Distance along the line.
        lane: The lane it lies in; while changing, the nearer of the two.
        manoeuvre: What is done there.
    """

    x_m: float
    y_m: float
    heading_rad: float
    station_m: float
    lane: LaneId
    manoeuvre: RoadOption


@dataclass(frozen=True, slots=True)
class Route:
    """The way to a goal.

    Attributes:
        lanes: One after the other; a lane abreast of the one before it is changed into.
        start_m: Station on the first lane.
        goal_m: Station on the last one.
        via: Places that it is to pass: (index of the lane, station on it).
    """

    lanes: tuple[LaneId, ...]
    start_m: float
    goal_m: float
    via: tuple[tuple[int, float], ...] = ()

    def length_m(self, road: RoadGraph) -> float:
        """Distance from start to goal along it; lane changes take no distance."""
        return self.steps(road)[1]

    def steps(self, road: RoadGraph) -> tuple[tuple[Step, ...], float]:
        """The manoeuvres, turns only inside junctions and one a junction, and the length of the route, m."""
        found: list[Step] = []
        turns = dict(_turns(road, self.lanes))
        at_m = -self.start_m
        for i, lane in enumerate(self.lanes):
            if i:
                side = _changed(road, self.lanes[i - 1], lane)
                if side:
                    found.append(Step("change left" if side < 0 else "change right", max(at_m, 0.0), lane))
                    if i not in turns:
                        continue
                else:
                    at_m += road[self.lanes[i - 1]].length_m
            if i in turns:
                found.append(Step(turns[i], max(at_m, 0.0), lane))
        return tuple(found), at_m + self.goal_m

    def dense(self, road: RoadGraph, step_m: float = 1.0) -> tuple[RoutePoint, ...]:
        """The line that is driven, every so many metres, its end included; lane changes drawn out over their room.

        Raises ValueError for a route of no length.
        """
        corners = [corner for part in _parts(self, road) for corner in part.corners(road)]
        # Where a piece ends another begins: the place is of the one that begins there.
        kept = [a for a, b in itertools.pairwise(corners) if math.dist(a.at_m, b.at_m) > SAME_M] + corners[-1:]
        line = Polyline.of(corner.at_m for corner in kept)
        stations = line.every(step_m)
        xs, ys, headings = (one.tolist() for one in line.poses(stations))
        owners = _stations(kept)
        points: list[RoutePoint] = []
        for x, y, heading, station in zip(xs, ys, headings, stations.tolist(), strict=True):
            corner = kept[max(0, bisect_right(owners, station + SAME_M) - 1)]
            if not points or station > points[-1].station_m + SAME_M:
                points.append(RoutePoint(x, y, heading, station, corner.lane, corner.manoeuvre))
        return tuple(points)


# Planning -------------------------------------------------------------------------------------------------------------


def plan_route(road: RoadGraph, start: LanePlace, goal: LanePlace) -> Route | None:
    """The shortest way, lane changes counted as `LANE_CHANGE_M`; None where no way leads there (A*)."""
    found = _search(road, start, goal)
    return None if found is None else found[1]


def plan_through(road: RoadGraph, places: Sequence[Sequence[LanePlace]]) -> Route | None:
    """The shortest way past places in their order; None where no way leads past them all.

    Args:
        road: The road.
        places: Of each place, the lanes that may be meant (`RoadGraph.places`): where lanes lie over one another, as
            where ways part in a junction, the one that spares a detour is taken.
    """
    best: list[tuple[float, Route | None]] = [(_stray(one), None) for one in places[0]]
    for before, after in itertools.pairwise(places):
        reached: list[tuple[float, Route | None]] = []
        for goal in after:
            least: tuple[float, Route | None] = (math.inf, None)
            for start, (so_far, way) in zip(before, best, strict=True):
                leg = None if math.isinf(so_far) else _search(road, start, goal)
                if leg is not None and so_far + leg[0] + _stray(goal) < least[0]:
                    least = so_far + leg[0] + _stray(goal), leg[1] if way is None else _appended(way, leg[1])
            reached.append(least)
        best = reached
    cost, found = min(best, key=lambda one: one[0])
    return None if math.isinf(cost) else found


def _stray(place: LanePlace) -> float:
    return _STRAY_COST * abs(place.offset_m)


def _appended(first: Route, then: Route) -> Route:
    """A route and one from its goal on."""
    passed = (len(first.lanes) - 1, first.goal_m)
    return Route(first.lanes + then.lanes[1:], first.start_m, then.goal_m, (*first.via, passed))


def _search(road: RoadGraph, start: LanePlace, goal: LanePlace) -> tuple[float, Route] | None:
    """(cost, way). A lane of the start's own stretch counts as not yet left: its goal may lie behind the start."""
    if start.lane == goal.lane and goal.station_m >= start.station_m:
        return goal.station_m - start.station_m, Route((start.lane,), start.station_m, goal.station_m)
    target = road[goal.lane].centre.at(goal.station_m)
    begun = start.station_m / road[start.lane].length_m
    behind = goal.station_m / road[goal.lane].length_m < begun

    def least(lane: LaneId, fresh: bool) -> float:
        """No way from a lane's start to the goal is shorter."""
        if lane == goal.lane:
            return 0.0 if fresh and behind else goal.station_m
        x, y = road[lane].centre.points_m[-1]
        return road[lane].length_m + math.hypot(target.x_m - x, target.y_m - y)

    first = (start.lane, True)
    costs: dict[tuple[LaneId, bool], float] = {first: -start.station_m}
    came: dict[tuple[LaneId, bool], tuple[LaneId, bool]] = {}
    rim: list[tuple[float, int, tuple[LaneId, bool]]] = [(0.0, 0, first)]
    done: set[tuple[LaneId, bool]] = set()
    count = 0
    while rim:
        _, _, here = heapq.heappop(rim)
        if here in done:
            continue
        done.add(here)
        name, fresh = here
        cost = costs[here]
        if name == goal.lane and not (fresh and behind) and here != first:
            way = [here]
            while way[-1] != first:
                way.append(came[way[-1]])
            lanes = tuple(one for one, _ in reversed(way))
            return cost + goal.station_m, Route(lanes, start.station_m, goal.station_m)
        length = road[name].length_m
        steps = [((one, False), cost + length) for one in road[name].successors]
        steps += [
            ((one, fresh), cost + LANE_CHANGE_M + _cramped(_room_needed(road[one]), room, length))
            for one, room in road.changes(name)
        ]
        for one, so_far in steps:
            if so_far < costs.get(one, math.inf):
                costs[one], came[one] = so_far, here
                count += 1
                heapq.heappush(rim, (so_far + least(*one), count, one))
    return None


def _cramped(needed_m: float, room_m: float, stretch_m: float) -> float:
    """Cost of a change for want of room, in total and in its own stretch of lanes."""
    return CRAMPED_COST * max(0.0, needed_m - room_m) + _STRETCH_COST * max(0.0, needed_m - stretch_m)


def _room_needed(lane: Lane) -> float:
    return max(CHANGE_LEAST_M, CHANGE_TIME_S * lane.speed_limit_mps)


def _changed(road: RoadGraph, before: LaneId, lane: LaneId) -> int:
    """Places to the right that a route changes from one lane to the next; 0 where it drives on."""
    if lane in road[before].successors:
        return 0
    return road.places_between(before, lane) or 0


def _turns(road: RoadGraph, lanes: Sequence[LaneId]) -> Iterator[tuple[int, Literal["left", "straight", "right"]]]:
    """(index of its first lane, way it turns) of every junction that a route crosses."""
    i = 0
    while i < len(lanes):
        junction, first = road[lanes[i]].junction, i
        while i < len(lanes) and road[lanes[i]].junction == junction:
            i += 1
        if junction:
            enters, leaves = road[lanes[first]].centre, road[lanes[i - 1]].centre
            yield first, turn_of(float(leaves.headings[-1] - enters.headings[0]))


# The line -------------------------------------------------------------------------------------------------------------


class _Corner(NamedTuple):
    at_m: tuple[float, float]
    lane: LaneId
    manoeuvre: RoadOption


@dataclass
class _Part:
    """A piece of a stretch of lanes abreast: it drives on in one of them, or changes from the first to the last.

    Attributes:
        lanes: From the one it comes in to the one it leaves in, neighbours.
        low, high: Shares of their length between which it lies.
        turn: Manoeuvre where no lane is changed.
        stretch: Number of the stretch that it is of.
        pinned: Whether the route is to pass a place at its start.
        side: 1 where it changes to the right, -1 to the left, 0 where it does not.
        blends: Shares of the lanes' length at which each change begins and ends; both may lie outside of the piece.
    """

    lanes: list[LaneId]
    low: float
    high: float
    turn: RoadOption
    stretch: int
    pinned: bool = False
    side: int = 0
    blends: tuple[tuple[float, float], ...] = ()

    def length_m(self, road: RoadGraph) -> float:
        return road[self.lanes[0]].length_m * (self.high - self.low)

    def corners(self, road: RoadGraph) -> Iterator[_Corner]:
        lines = [road[lane].centre for lane in self.lanes]
        if len(lines) == 1:
            line = lines[0]
            for x, y in _piece(line, self.low * line.length_m, self.high * line.length_m):
                yield _Corner((x, y), self.lanes[0], self.turn)
            return
        count = max(2, math.ceil(self.length_m(road)) + 1)
        for i in range(count):
            share = self.low + (self.high - self.low) * i / (count - 1)
            done = sum(_eased((share - begin) / (end - begin)) for begin, end in self.blends)
            own = min(int(done), len(lines) - 2)
            a, b = (line.at(share * line.length_m) for line in lines[own : own + 2])
            part = done - own
            changing = any(begin < share < end for begin, end in self.blends)
            yield _Corner(
                (a.x_m + part * (b.x_m - a.x_m), a.y_m + part * (b.y_m - a.y_m)),
                self.lanes[own + round(part)],
                ("change left" if self.side < 0 else "change right") if changing else self.turn,
            )


def _piece(line: Polyline, low_m: float, high_m: float) -> tuple[tuple[float, float], ...]:
    """Points of a part of a line; the one point of a part of no length."""
    if high_m - low_m > SAME_M:
        return line.between(low_m, high_m).points_m
    at = line.at(low_m)
    return ((at.x_m, at.y_m),)


def _eased(share: float) -> float:
    """From 0 to 1 without a jerk of heading at either end (smoothstep)."""
    share = min(max(share, 0.0), 1.0)
    return share * share * (3.0 - 2.0 * share)


def _stations(corners: Sequence[_Corner]) -> list[float]:
    found = [0.0]
    for a, b in itertools.pairwise(corners):
        found.append(found[-1] + math.dist(a.at_m, b.at_m))
    return found


def _parts(route: Route, road: RoadGraph) -> list[_Part]:
    """The pieces of a route, its lane changes drawn out over their own and those where the lanes run on as well."""
    turns: dict[int, RoadOption] = {}
    for first, turn in _turns(road, route.lanes):
        junction = road[route.lanes[first]].junction
        for i in range(first, len(route.lanes)):
            if road[route.lanes[i]].junction != junction:
                break
            turns[i] = turn
    stretches: list[list[int]] = []
    for i, lane in enumerate(route.lanes):
        if i and _changed(road, route.lanes[i - 1], lane):
            stretches[-1].append(i)
        else:
            stretches.append([i])
    via: dict[int, list[float]] = {}
    for i, station in route.via:
        via.setdefault(i, []).append(station / road[route.lanes[i]].length_m)
    parts: list[_Part] = []
    for number, rows in enumerate(stretches):
        low = min(1.0, route.start_m / road[route.lanes[0]].length_m) if number == 0 else 0.0
        high = min(1.0, route.goal_m / road[route.lanes[-1]].length_m) if number == len(stretches) - 1 else 1.0
        parts += _pieces(route, road, rows, via, (low, max(low, high)), (turns.get(rows[0], "follow"), number))
    for k in [k for k, part in enumerate(parts) if part.side]:
        _draw_out(parts, k, road)
    return parts


def _pieces(
    route: Route,
    road: RoadGraph,
    rows: Sequence[int],
    via: dict[int, list[float]],
    span: tuple[float, float],
    named: tuple[RoadOption, int],
) -> Iterator[_Part]:
    """The pieces of one stretch: a change lies between the last place to pass in a lane and the first in the next."""
    (at, high), (turn, number) = span, named
    i, pinned = 0, False
    while i < len(rows) - 1:
        begins = min(max([at, *via.get(rows[i], ())]), high)
        if begins > at:
            yield _Part([route.lanes[rows[i]]], at, begins, turn, number, pinned)
            pinned = True
        side = _changed(road, route.lanes[rows[i]], route.lanes[rows[i + 1]])
        step, j = (1 if side > 0 else -1), i + 1
        while j < len(rows) - 1 and rows[j] not in via:
            if _changed(road, route.lanes[rows[j]], route.lanes[rows[j + 1]]) * step < 0:
                break
            j += 1
        if rows[j] in via:
            ends = min(max(begins, min(via[rows[j]])), high)
        else:
            ends = high if j == len(rows) - 1 else (begins + high) / 2.0
        count = road.places_between(route.lanes[rows[i]], route.lanes[rows[j]]) or 0
        chain = [road.neighbour(route.lanes[rows[i]], step * k) for k in range(abs(count) + 1)]
        yield _Part([one for one in chain if one is not None], begins, ends, turn, number, pinned, step)
        at, i, pinned = ends, j, rows[j] in via
    if high > at or len(rows) == 1:
        yield _Part([route.lanes[rows[-1]]], at, high, turn, number, pinned)


def _draw_out(parts: list[_Part], k: int, road: RoadGraph) -> None:
    """Give the changes of a piece the room they need, of the pieces beside which their lanes run as well.

    Over a place that the route is to pass they reach only where they would be cramped without.
    """
    part = parts[k]
    count = len(part.lanes) - 1
    need, least = count * max(_room_needed(road[lane]) for lane in part.lanes), count * CHANGE_LEAST_M
    low = high = k
    room = part.length_m(road)
    while low > 0 and room < (least if parts[low].pinned else need + _HASTE_M):
        chain = _alongside(parts[low - 1], parts[low], road, ahead=False)
        if chain is None:
            break
        low -= 1
        parts[low].lanes, parts[low].side = chain, part.side
        room += parts[low].length_m(road)
    while high + 1 < len(parts) and room < (least if parts[high + 1].pinned else need):
        chain = _alongside(parts[high + 1], parts[high], road, ahead=True)
        if chain is None:
            break
        high += 1
        parts[high].lanes, parts[high].side = chain, part.side
        room += parts[high].length_m(road)
    begins = min(_HASTE_M, max(0.0, room - need))
    each = max(min(need, room - begins) / count, SAME_M)
    at_m = 0.0
    for one in parts[low : high + 1]:
        scale = 1.0 / road[one.lanes[0]].length_m
        one.blends = tuple(
            (one.low + (begins + i * each - at_m) * scale, one.low + (begins + (i + 1) * each - at_m) * scale)
            for i in range(count)
        )
        at_m += one.length_m(road)


def _alongside(part: _Part, beside: _Part, road: RoadGraph, *, ahead: bool) -> list[LaneId] | None:
    """Lanes of a piece that run on from lanes of the next (or the one before), None where one of them does not."""
    if part.side:
        return None
    own, lanes = part.lanes[0], beside.lanes
    anchor = len(lanes) - 1 if ahead else 0
    if part.stretch == beside.stretch:
        return list(lanes) if own == lanes[anchor] else None
    step = road.places_between(lanes[0], lanes[1])
    if step is None:
        return None
    found: list[LaneId] = []
    for i, lane in enumerate(lanes):
        one = road.neighbour(own, (i - anchor) * step)
        if one is None or road[one].kind != road[own].kind:
            return None
        if (one not in road[lane].successors) if ahead else (lane not in road[one].successors):
            return None
        found.append(one)
    return found
