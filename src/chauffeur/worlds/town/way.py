"""The ego's way through a town: which lanes lead on along its route, and the line that it follows from where it is.

A route names one lane at a time. What leads on is wider: every lane abreast of those, as long as the route can still be
driven from it. `Corridor` knows, of each such lane, how many lane changes are still needed; `Stretch` is the line along
one lane and those that follow it, up to where a lane change is needed at the latest, or to the goal.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

from chauffeur.geometry import JunctionWay, Lane, LaneId, Polyline, RoadGraph, Route, joined, named_ways, way_to
from chauffeur.geometry.road_graph import Turn

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

STEP_M: Final = 1.0
"""A stretch is looked at every so many metres."""
BEND_MPS2: Final = 1.6
"""Lateral acceleration in bends."""
SLOWING_MPS2: Final = 1.3
"""Braking towards bends and lower limits."""
_BEND_SPAN_M: Final = 4.0
_CREEP_MPS: Final = 2.0
_TAIL: Final = 0.9
"""Of a car's length, from its front bumper: where its tail begins (Leaderboard 1.0)."""
_CLEAR_OF_M: Final = 0.6
_MOST_SWING_M: Final = 1.5


class RouteCorridor:
    """Lanes from which a route can still be driven, in the layers of the route's lanes."""

    def __init__(self, road: RoadGraph, route: Route) -> None:
        """Raises KeyError for a route over lanes that the road has not."""
        self.road, self.route = road, route
        self.layers, rests = _layers(road, route.lanes)
        self.changes: tuple[Mapping[LaneId, int], ...] = _changes(road, self.layers, rests)

    def layer_of(self, lane: LaneId, near: int) -> int | None:
        """The layer that has a lane, the closest one from a layer on, or else before it."""
        count = len(self.layers)
        for step in range(count):
            for at in (near + step, near - step):
                if 0 <= at < count and lane in self.changes[at]:
                    return at
        return None

    def onward(self, layer: int, lane: LaneId) -> LaneId | None:
        """The lane of the next layer that follows, with the fewest changes from there; None where none does."""
        if layer + 1 >= len(self.layers):
            return None
        ahead = self.changes[layer + 1]
        ways = [one for one in self.road[lane].successors if one in ahead]
        return min(ways, key=lambda one: (ahead[one], abs(self.road[one].bend_rad)), default=None)

    def stretch(self, layer: int, lane: LaneId) -> Stretch:
        """The line from the start of a lane on."""
        lanes, at, here = [self.road[lane]], layer, lane
        while (onward := self.onward(at, here)) is not None:
            at, here = at + 1, onward
            lanes.append(self.road[here])
        complete = at == len(self.layers) - 1 and here == self.route.lanes[-1]
        return Stretch.of(lanes, layer, self.route.goal_m if complete else None)


def _layers(road: RoadGraph, lanes: Sequence[LaneId]) -> tuple[tuple[tuple[LaneId, ...], ...], LaneId]:
    """The lanes abreast of each step of a route, steps to a lane beside left out, and its last lane."""
    main: list[LaneId] = []
    for lane in lanes:
        if main and road.places_between(main[-1], lane) and not road[lane].junction:
            main[-1] = lane
        else:
            main.append(lane)
    layers = [_abreast(road, lane) for lane in main]
    for i, lane in enumerate(main):
        junction = road[lane].junction
        if not junction or not 0 < i < len(main) - 1:
            continue
        after = set(layers[i + 1])
        beside = [
            one
            for before in layers[i - 1]
            for one in road[before].successors
            if road[one].junction == junction and (after & set(road[one].successors))
        ]
        layers[i] = tuple(dict.fromkeys([lane, *beside]))
    return tuple(layers), lanes[-1]


def _abreast(road: RoadGraph, lane: LaneId) -> tuple[LaneId, ...]:
    own = road[lane]
    if own.junction:
        return (lane,)
    return tuple(one.id for one in road.abreast(lane) if one.kind == own.kind and (one is own or not one.closed))


def _changes(road: RoadGraph, layers: Sequence[tuple[LaneId, ...]], last: LaneId) -> tuple[Mapping[LaneId, int], ...]:
    """Lane changes still needed from each lane of each layer; one from which the route cannot be driven is in none."""
    found: list[dict[LaneId, int]] = []
    ahead: dict[LaneId, int] = {}
    for i in reversed(range(len(layers))):
        here: dict[LaneId, int] = {}
        for lane in layers[i]:
            ways = [ahead[one] for one in road[lane].successors if one in ahead]
            if i == len(layers) - 1:
                ways = [0] if lane == last else []
            if ways:
                here[lane] = min(ways)
        for _ in layers[i]:
            for lane in layers[i]:
                if road[lane].junction:
                    continue
                for side in (-1, 1):
                    beside = road.neighbour(lane, side)
                    if beside in here and here[beside] + 1 < here.get(lane, 1_000_000):
                        here[lane] = here[beside] + 1
        ahead = here
        found.append(here)
    return tuple(reversed(found))


@dataclass(frozen=True, eq=False)
class Stretch:
    """A line to follow.

    Attributes:
        lanes: Along it.
        starts_m: Where each begins.
        layer: Of the first one.
        line: The line itself.
        end_m: Where to be at the latest: the goal, or the place up to which a lane change is needed.
        goal: Whether that is the goal.
        x, y, heading: Every metre.
        most_mps: Speed there for the bends and limits ahead.
        limit_mps: What the sign says there.
        led: What is driven in place of the start of its first lanes; None where nothing is.
        sweeps: What `swept` has found already.
    """

    lanes: tuple[Lane, ...]
    starts_m: tuple[float, ...]
    layer: int
    line: Polyline
    end_m: float
    goal: bool
    x: Array
    y: Array
    heading: Array
    most_mps: Array
    limit_mps: Array
    led: Polyline | None = None
    sweeps: dict[float, tuple[Array, Array, Array]] = field(default_factory=dict[float, "tuple[Array, Array, Array]"])

    @classmethod
    def of(cls, lanes: Sequence[Lane], layer: int, goal_m: float | None, first: Polyline | None = None) -> Stretch:
        """Along lanes; `first` is driven in place of the start of the first ones, whose rest it ends on."""
        starts, at = [], 0.0
        for lane in lanes:
            starts.append(at)
            at += lane.length_m
        line = joined([lane.centre for lane in lanes])
        scale = line.length_m / at  # seams between lanes are no place at all, or a few millimetres
        starts = [start * scale for start in starts]
        end = line.length_m if goal_m is None else starts[-1] + goal_m
        if first is not None:
            line, starts, end = _led_in(line, first, starts, end)
        stations = np.arange(0.0, line.length_m + STEP_M, STEP_M)
        x, y, heading = line.poses(np.minimum(stations, line.length_m))
        which = np.clip(np.searchsorted(np.array(starts), stations, side="right") - 1, 0, len(lanes) - 1)
        limits = np.array([lane.speed_limit_mps for lane in lanes])[which]
        return cls(
            tuple(lanes),
            tuple(starts),
            layer,
            line,
            end,
            goal_m is not None,
            x,
            y,
            heading,
            most_mps(heading, limits),
            limits,
            first,
        )

    def swept(self, overhang_m: float) -> tuple[Array, Array, Array]:
        """Swept path of a car whose rear axle follows the line: (x, y) of its middle, and the extra half width.

        In a bend of radius R its front corner swings out by d * d / (2 R), d ahead of the rear axle.

        Args:
            overhang_m: From the rear axle to the front bumper.
        """
        known = self.sweeps.get(overhang_m)
        if known is None:
            span = max(1, round(overhang_m / STEP_M))
            turned = np.angle(np.exp(1j * (self.heading - np.roll(self.heading, span))))
            turned[:span] = 0.0
            swing = np.clip(overhang_m * turned / 2.0, -_MOST_SWING_M, _MOST_SWING_M)
            # To the right of a bend to the left.
            x, y = self.x + np.sin(self.heading) * swing / 2.0, self.y - np.cos(self.heading) * swing / 2.0
            known = self.sweeps[overhang_m] = x, y, np.abs(swing) / 2.0
        return known

    def index(self, station_m: float) -> int:
        """Row of a station in the tables."""
        return max(0, min(len(self.x) - 1, round(station_m / STEP_M)))

    def lane_at(self, station_m: float) -> tuple[int, Lane]:
        """(its place along the stretch, lane) at a station."""
        at = 0
        while at + 1 < len(self.lanes) and self.starts_m[at + 1] <= station_m:
            at += 1
        return at, self.lanes[at]

    def span(self, at: int) -> tuple[float, float]:
        """Stations where one of its lanes begins and ends, m."""
        end = self.starts_m[at + 1] if at + 1 < len(self.lanes) else self.line.length_m
        return self.starts_m[at], end


def first_m(stretch: Stretch) -> float:
    """Station where the first lane of a stretch ends, m."""
    return stretch.span(0)[1]


def astride_m(length_m: float) -> float:
    """Distance beyond a stop line at which a front bumper may wait with the tail not over the line yet, m.

    Who has its tail over the line while the light is red has run it, whether it drives or stands.
    """
    return _TAIL * length_m - _CLEAR_OF_M


def _led_in(
    line: Polyline, first: Polyline, starts: Sequence[float], end_m: float
) -> tuple[Polyline, list[float], float]:
    """A line whose beginning is another one, which ends on it."""
    x, y = first.points_m[-1]
    joint = line.nearest(x, y, 0.0, starts[1] + 50.0 if len(starts) > 1 else line.length_m)
    rest = [point for point, at in zip(line.points_m, line.stations_m, strict=True) if at > joint + 0.1]
    moved = first.length_m - joint
    led = Polyline.of([*first.points_m, *rest]) if rest else first
    return led, [0.0, *(max(0.0, start + moved) for start in starts[1:])], end_m + moved


def most_mps(
    heading: Array, limits: Array, lateral_mps2: float = BEND_MPS2, slowing_mps2: float = SLOWING_MPS2
) -> Array:
    """Speed for bends and limits, braking ahead of them gently: of a line's headings every metre, and its limits.

    Args:
        heading: Every `STEP_M`.
        limits: There.
        lateral_mps2: Most lateral acceleration.
        slowing_mps2: Braking.
    """
    span = round(_BEND_SPAN_M / STEP_M)
    turned = np.abs(np.angle(np.exp(1j * (np.roll(heading, -span) - heading))))
    turned[-span:] = 0.0
    curvature = turned / _BEND_SPAN_M
    bends = np.sqrt(lateral_mps2 / np.maximum(curvature, 1e-4))
    bends = np.minimum(bends, np.roll(bends, span))  # as slow to the end of a bend as at its start
    most = np.minimum(limits, np.maximum(bends, _CREEP_MPS))
    slowing = 2.0 * slowing_mps2 * STEP_M
    squares = most * most
    for i in range(len(squares) - 2, -1, -1):
        squares[i] = min(squares[i], squares[i + 1] + slowing)
    return np.sqrt(squares)


def _bend(way: JunctionWay) -> float:
    return abs(way.bend_rad)


def free_route(
    road: RoadGraph, lane: LaneId, station_m: float, turn: Turn | None, reach_m: float, beside: LaneId | None = None
) -> Route:
    """A way on for who has no goal: straight on where ways part, or with a turn at the first junction with a choice.

    Args:
        road: The road.
        lane, station_m: Where it begins.
        turn: Which way at the first junction where there is a choice; straight on where no such way is.
        reach_m: How long it is.
        beside: Lane beside the first one, to be changed into at once.
    """
    lanes: list[LaneId] = [lane] if beside is None else [lane, beside]
    here, so_far = lanes[-1], road[lane].length_m - station_m
    while so_far < reach_m:
        ways = {} if road[here].junction else named_ways(road, here)
        way: JunctionWay | None = None
        if turn is not None and len(ways) > 1:
            way, turn = way_to(road, here, turn), None
        if way is None:  # the straightest from this lane; how a way begins says little of where it leads
            own = [one for those in ways.values() for one in those if one.entry == here]
            way = min(own, key=_bend, default=None)
        if way is not None:
            step = road.places_between(here, way.entry) or 0
            over = [road.neighbour(here, side * (1 if step > 0 else -1)) for side in range(1, abs(step) + 1)]
            lanes += [*(one for one in over if one is not None), *way.lanes, way.exit]
            so_far += sum(road[one].length_m for one in (*way.lanes, way.exit))
            here = way.exit
            continue
        following = road.onward(here)
        if following is None:
            break
        here = following.id
        lanes.append(here)
        so_far += following.length_m
    return Route(tuple(lanes), station_m, max(0.0, road[lanes[-1]].length_m - 0.5))


def blended(
    line: Polyline, pose_m: tuple[float, float], goal: Polyline, start_m: float, way_m: float, end_m: float
) -> Polyline:
    """A smooth way from a place beside a line, station `start_m`, over to another one within a distance.

    The other one is met before its station `end_m`: a long way may come by the same place twice.
    """
    x, y = pose_m
    off = line.offset(x, y, start_m)
    first = line.at(start_m)
    at = goal.nearest(first.x_m, first.y_m, 0.0, end_m)
    points: list[tuple[float, float]] = []
    for i in range(-3, math.ceil(way_m) + 1):
        share = max(0.0, min(1.0, i / way_m))
        here = line.at(start_m + i)
        hx, hy = here.place(0.0, off)
        at = goal.nearest(here.x_m, here.y_m, at - 1.0, at + 6.0)
        there = goal.at(at)
        blend = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
        points.append((hx + blend * (there.x_m - hx), hy + blend * (there.y_m - hy)))
    return Polyline.of(points)
