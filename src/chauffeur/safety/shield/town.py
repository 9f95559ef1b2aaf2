"""The shield of a town: over its road graph, with lights, signs, people and everybody else who crosses.

The same promise as on roads, kept another way: a command is let through if after one period of it the car can brake to
a stand along its way without touching anybody, and without passing a line it has to stop at. Where it is not, the
acceleration is lowered as little as is needed. A car that stands is not at fault; so by induction the ego never is, as
long as others do no more than is assumed of them: who goes the ego's way may brake with `others_braking_mps2`, whoever
crosses goes on as now or stops where they are.

Source: Pek, Althoff, "Fail-safe motion planning for online verification", 2020, with the stop as the plan that is kept.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chauffeur.concept import Command, Intervention, LaneId, Limits, Observation, VehicleState
from chauffeur.control.kinematic_bicycle import LINCOLN_MKZ, KinematicBicycle, curvature_of
from chauffeur.geometry import Polyline, RoadGraph, Route, joined, wrap_to_pi
from chauffeur.safety.shield.shield import FilterResult, Shield
from chauffeur.safety.shield.table import LAMPILOT_SHIELD, ShieldParameters
from chauffeur.safety.words import speed_words
from chauffeur.worlds.town.way import astride_m, most_mps

Array = NDArray[np.float64]
_Line = tuple[tuple[float, float], tuple[float, float]]

_STEP_S: Final = 0.1
_REACH_M: Final = 70.0
_NEAR_M: Final = 45.0
_ALONG_RAD: Final = math.radians(40.0)
_SIDE_M: Final = 0.15
_PERSON_SIDE_M: Final = 0.5
_GAP_M: Final = 0.6
_OVER_M: Final = 1.0
"""Who is farther over a line than this, and cannot wait with its tail before it, clears the junction."""
_SERVED_MPS: Final = 0.1
_AT_SIGN_M: Final = 4.0
_CLEAR_M: Final = 3.5
_HALVINGS: Final = 5
_SLOWING_MPS2: Final = 1.5
_ASIDE_M: Final = 0.9
"""Farther than this over the edge of its lane a car is steered back, unless it changes lanes."""
_LOOK_M: Final = 4.0
_BEND_MPS2: Final = 3.0
"""Lateral acceleration at which a car still keeps to its lane in a town's bends."""
_BRAKING_MPS2: Final = 3.0


@dataclass(frozen=True, slots=True, eq=False)
class _Way:
    """The ego's way from its lane on, and the lane before it: its lanes, where each begins, and the line."""

    lanes: tuple[LaneId, ...]
    starts_m: tuple[float, ...]
    line: Polyline
    x: Array
    y: Array
    heading: Array
    own: int
    most_mps: Array

    def station_m(self, ego: VehicleState) -> float:
        """How far along the line the ego is."""
        first = self.starts_m[self.own]
        after = self.starts_m[self.own + 1] if self.own + 1 < len(self.starts_m) else self.line.length_m
        return self.line.nearest(ego.x_m, ego.y_m, first - 6.0, after + 6.0)


@dataclass(frozen=True, slots=True, eq=False)
class _Around:
    """Everybody near: discs that cover them at each step of the look ahead, (people, steps) each, and who they are."""

    who: tuple[VehicleState, ...]
    owner: NDArray[np.int64]
    x: Array
    y: Array
    radius: Array


class TownShield(Shield):
    """Judges and mends commands of one trip through a town, one a control period."""

    def __init__(
        self,
        dt_s: float,
        limits: Limits | None = None,
        parameters: ShieldParameters = LAMPILOT_SHIELD,
        chassis: KinematicBicycle = LINCOLN_MKZ,
    ) -> None:
        super().__init__(dt_s, limits, parameters)
        self._period_s, self._most, self._bounds, self._chassis = dt_s, limits or Limits(), parameters, chassis
        self._ways: dict[tuple[LaneId, ...], _Way] = {}
        self._road: RoadGraph | None = None
        self._stopped_at: set[str] = set()
        self._lines: dict[tuple[int, int, _Line], float] = {}
        self._chained: tuple[Route | None, LaneId, int, tuple[LaneId, ...]] | None = None
        self._layer = 0
        """The lane of the route the ego was last seen in: routes may pass a lane twice."""

    def filter(self, observation: Observation, command: Command, aim: LaneId | None = None) -> FilterResult:
        """The command, changed as little as needed; arguments as of `Shield.guard`."""
        ego = observation.ego
        if not _known(ego) or not all(map(_known, observation.others)):
            return _replaced(command, self._halt(ego), "finite", "Where somebody is cannot be told.")
        if not (math.isfinite(command.acceleration_mps2) and math.isfinite(command.steering_rad)):
            return _replaced(command, self._halt(ego), "finite", "A command that is no number was replaced.")
        way = self._way_of(observation, aim)
        if way is None:
            return FilterResult(command)
        said: list[Intervention] = []
        station = way.station_m(ego)
        steered = self._steered(observation, way, station, command)
        if steered is not None:
            said.append(Intervention("lane", "That would leave the road.", command, steered))
            command = steered
        most, rule, reason = self._cap(observation, way, station)
        least = max(-self._bounds.braking_mps2, -max(ego.speed_mps, 0.0) / self._period_s)
        wanted = max(min(command.acceleration_mps2, most), least)
        around = self._around(observation)
        touched = self._touches(ego, way, Command(wanted, command.steering_rad), around)
        if touched is not None:
            rule, reason = _owed_to(touched)
            wanted = self._gentlest(ego, way, Command(wanted, command.steering_rad), least, around)
        if wanted < command.acceleration_mps2 - 1e-6 and (ego.speed_mps > 0.0 or command.acceleration_mps2 > 0.0):
            mended = Command(wanted, command.steering_rad)
            said.append(Intervention(rule, reason, command, mended))
            return FilterResult(mended, tuple(said))
        return FilterResult(Command(max(command.acceleration_mps2, least), command.steering_rad), tuple(said))

    def _halt(self, ego: VehicleState) -> Command:
        speed = ego.speed_mps if math.isfinite(ego.speed_mps) else math.inf
        return Command(max(-self._bounds.braking_mps2, -max(speed, 0.0) / self._period_s), 0.0)

    # The way ----------------------------------------------------------------------------------------------------------

    def _way_of(self, observation: Observation, aim: LaneId | None) -> _Way | None:
        road = observation.road
        if road is not self._road:
            self._road, self._chained = road, None
            self._ways.clear()
            self._lines.clear()
        lane = observation.ego.lane
        if lane is None or lane not in road:
            return None
        if aim is not None and aim != lane and road.get(aim) is not None and road.places_between(lane, aim):
            lane = aim
        chain = self._chain(observation, lane)
        way = self._ways.get(chain)
        if way is None:
            way = self._ways[chain] = _laid(road, chain, chain.index(lane))
        return way

    def _chain(self, observation: Observation, lane: LaneId) -> tuple[LaneId, ...]:
        """The lane before, the lane, and those after it: along the route where it is on it, else straight on."""
        road, route = observation.road, observation.route
        known = self._chained
        if known is not None and known[0] is route and known[1:3] == (lane, self._layer):
            return known[3]
        lanes = () if route is None else route.lanes
        before = road.predecessors(lane)
        chain = [before[0].id, lane] if before else [lane]
        ahead, here = -20.0, lane
        if lane in lanes:
            self._layer = min(
                (i for i, one in enumerate(lanes) if one == lane), key=lambda i: (i < self._layer, abs(i - self._layer))
            )
        at = self._layer
        while ahead < _REACH_M:
            ahead += road[here].length_m
            ways = road[here].successors
            if not ways:
                break
            on_route = [one for one in lanes[at + 1 : at + 5] if one in ways]
            here = on_route[0] if on_route else _like(road, lanes[at + 1 : at + 5], ways)
            if here in lanes[at + 1 : at + 5]:
                at = lanes.index(here, at + 1)
            chain.append(here)
        self._chained = route, lane, self._layer, tuple(chain)
        return self._chained[3]

    # Steering ---------------------------------------------------------------------------------------------------------

    def _steered(self, observation: Observation, way: _Way, station: float, command: Command) -> Command | None:
        """The command with steering that leads back to the way, where it would lead off the road."""
        ego, road = observation.ego, observation.road
        if ego.speed_mps < 0.5:
            return None
        here = way.line.at(station)
        aside = here.sees(ego.x_m, ego.y_m)[1]
        off = wrap_to_pi(ego.heading_rad - here.heading_rad)
        turned = ego.speed_mps * curvature_of(ego.speed_mps, command.steering_rad, self._chassis)
        bend = way.line.curvature(station, _LOOK_M) * ego.speed_mps
        then = aside + ego.speed_mps * 0.6 * math.sin(off + 0.3 * (turned - bend))
        lane = road.get(ego.lane)
        if lane is None:
            return None
        room = lane.width_m / 2.0 + _ASIDE_M - ego.width_m / 2.0
        side = 1 if then < 0.0 else -1
        if abs(then) <= max(room, abs(aside)) or road.neighbour(lane.id, side) is not None:
            return None
        target = way.line.at(station + max(_LOOK_M, 0.7 * ego.speed_mps))
        rear = (
            ego.x_m - self._chassis.rear_to_middle_m * math.cos(ego.heading_rad),
            ego.y_m - (self._chassis.rear_to_middle_m * math.sin(ego.heading_rad)),
        )
        bearing = wrap_to_pi(math.atan2(target.y_m - rear[1], target.x_m - rear[0]) - ego.heading_rad)
        reach = math.dist((target.x_m, target.y_m), rear)
        steering = math.atan(2.0 * self._chassis.wheelbase_m * math.sin(bearing) / reach)
        if abs(steering - command.steering_rad) < 0.02:
            return None
        return Command(command.acceleration_mps2, steering)

    # Lines and limits -------------------------------------------------------------------------------------------------

    def _cap(self, observation: Observation, way: _Way, station: float) -> tuple[float, str, str]:
        """The strictest bound of the acceleration by limits, lights and signs: (m/s2, rule, reason)."""
        ego, speed = observation.ego, max(0.0, observation.ego.speed_mps)
        lane = observation.road.get(ego.lane)
        limit = self._most.most_mps(math.inf if lane is None else lane.speed_limit_mps)
        allowed = max((limit - speed) / self._period_s, -_SLOWING_MPS2)
        strictest = min(allowed, self._bounds.acceleration_mps2), "speed", f"No faster than {speed_words(limit)} here."
        bend = float(way.most_mps[max(0, min(len(way.most_mps) - 1, round(station + speed * self._period_s)))])
        slow = (bend - speed) / self._period_s
        if slow < strictest[0]:
            strictest = max(slow, -_BRAKING_MPS2 - 1.0), "speed", "The bend ahead is too sharp for this speed."
        nose = station + ego.length_m / 2.0
        spans = {lane: i for i, lane in enumerate(way.lanes)}
        for signal in observation.signals:
            at = next((spans[one] for one in signal.lanes if one in spans), None)
            if at is None or signal.state == "off":
                continue
            ahead = self._line_m(way, at, signal.stop_line_m) - nose
            room = ahead
            if ahead < -_OVER_M:  # its front is over it: it may wait so, as long as its tail is not
                room += astride_m(ego.length_m)
                if signal.state == "yellow" or speed * speed > 2.0 * self._bounds.gentle_mps2 * max(0.0, room):
                    continue
            cap = self._stopping(speed, room)
            if cap >= strictest[0] or (signal.state == "yellow" and cap < -self._bounds.gentle_mps2):
                continue
            why = f"The light shows {signal.state}."
            if signal.state == "green":
                if not self._held_up(observation, way, station, ahead):
                    continue
                why = "There is no room for the car behind the junction's stop line."
            strictest = cap, "stop", why
        for sign in observation.signs:
            at = next((spans[one] for one in sign.lanes if one in spans), None)
            if sign.kind != "stop" or at is None:
                continue
            line = sign.stop_line_m or ((sign.x_m, sign.y_m), (sign.x_m, sign.y_m))
            ahead = self._line_m(way, at, line) - nose
            if speed < _SERVED_MPS and -_OVER_M <= ahead < _AT_SIGN_M:
                self._stopped_at.add(sign.id)
            elif ahead < -_AT_SIGN_M or ahead > 30.0:
                self._stopped_at.discard(sign.id)
            if sign.id in self._stopped_at or ahead < -_OVER_M:
                continue
            cap = self._stopping(speed, ahead)
            if cap < strictest[0]:
                strictest = cap, "stop", f"A stop line is {max(ahead, 0.0):.0f} m ahead, not stopped at yet."
        return strictest

    def _stopping(self, speed: float, ahead_m: float) -> float:
        """Hardest acceleration after which the car still stops before a line."""
        if ahead_m < 0.05:
            return -self._bounds.braking_mps2 if speed < 3.0 else math.inf
        return self._stop_lines.most_mps2(speed, ahead_m)

    def _line_m(self, way: _Way, at: int, line: _Line) -> float:
        known = self._lines.get((id(way), at, line))
        if known is not None:
            return known
        (ax, ay), (bx, by) = line
        low = way.starts_m[at]
        high = way.starts_m[at + 1] if at + 1 < len(way.starts_m) else way.line.length_m
        found = self._lines[id(way), at, line] = way.line.nearest((ax + bx) / 2.0, (ay + by) / 2.0, low, high + 6.0)
        return found

    def _held_up(self, observation: Observation, way: _Way, station: float, ahead: float) -> bool:
        """Whether somebody who stands leaves no room behind a line for all of the car."""
        ego = observation.ego
        line = station + ego.length_m / 2.0 + ahead
        for other in observation.others:
            if other.speed_mps > 1.5 or math.dist((other.x_m, other.y_m), (ego.x_m, ego.y_m)) > _NEAR_M:
                continue
            at = way.line.nearest(other.x_m, other.y_m, station, line + 15.0)
            if abs(way.line.at(at).sees(other.x_m, other.y_m)[1]) > (ego.width_m + other.width_m) / 2.0:
                continue
            tail = at - other.length_m / 2.0
            if line - 0.5 < tail < line + ego.length_m + _CLEAR_M:
                return True
        return False

    # Others -----------------------------------------------------------------------------------------------------------

    def _around(self, observation: Observation) -> _Around:
        """Where everybody near may be while the ego brakes to a stand."""
        ego, table = observation.ego, self._bounds
        times = np.arange(0.0, max(ego.speed_mps, 0.0) / table.braking_mps2 + 2.5 * _STEP_S, _STEP_S)
        who: list[VehicleState] = []
        xs: list[Array] = []
        ys: list[Array] = []
        owner: list[int] = []
        radius: list[float] = []
        c, s = math.cos(ego.heading_rad), math.sin(ego.heading_rad)
        until_s = float(times[-1])
        fastest = max(ego.speed_mps, 0.0) + table.acceleration_mps2 * self._period_s
        own = fastest * until_s + (ego.length_m + ego.width_m) / 2.0 + _GAP_M + _PERSON_SIDE_M
        for other in (*observation.others, *observation.objects):
            dx, dy = other.x_m - ego.x_m, other.y_m - ego.y_m
            ahead = c * dx + s * dy
            away = dx * dx + dy * dy
            if other.kind == "stop_sign" or away > _NEAR_M * _NEAR_M:
                continue
            if away > (own + max(other.speed_mps, 0.0) * until_s + other.length_m + other.width_m) ** 2:
                continue  # out of reach until the ego stands
            if ahead < -(ego.length_m + other.length_m) / 2.0:
                continue  # who comes from behind minds the ego
            turned = wrap_to_pi(other.heading_rad - ego.heading_rad)
            speeds = [max(other.speed_mps, 0.0)]
            if abs(turned) < _ALONG_RAD:
                braking = table.others_braking_mps2
                lasts = np.minimum(times, speeds[0] / braking)
                ways = [speeds[0] * lasts - 0.5 * braking * lasts**2]
            else:
                ways = [speeds[0] * times]
                if other.kind == "pedestrian":
                    ways.append(0.0 * times)
            hx, hy = math.cos(other.heading_rad), math.sin(other.heading_rad)
            for far in ways:
                for offset in _offsets(other.length_m, other.width_m):
                    xs.append(other.x_m + hx * (far + offset))
                    ys.append(other.y_m + hy * (far + offset))
                    owner.append(len(who))
                    side = _PERSON_SIDE_M if other.kind == "pedestrian" else _SIDE_M
                    radius.append(other.width_m / 2.0 + side)
            who.append(other)
        empty = np.zeros((0, len(times)))
        return _Around(
            tuple(who),
            np.array(owner, dtype=np.int64),
            np.stack(xs) if xs else empty,
            np.stack(ys) if ys else empty,
            np.array(radius),
        )

    def _touches(self, ego: VehicleState, way: _Way, command: Command, around: _Around) -> VehicleState | None:
        """Whom the ego would touch if it braked to a stand after a period of a command."""
        if not around.who:
            return None
        states = self._rolled(ego, way, command, around.x.shape[1])
        half = ego.length_m / 2.0 - ego.width_m / 2.0
        best: tuple[int, int] | None = None
        offsets = (-half, -half / 3.0, half / 3.0, half, half + _GAP_M)
        for offset in offsets:
            x = states[:, 0] + offset * np.cos(states[:, 2])
            y = states[:, 1] + offset * np.sin(states[:, 2])
            near = (around.x - x) ** 2 + (around.y - y) ** 2 < ((around.radius + ego.width_m / 2.0) ** 2)[:, None]
            if offset < 0.0:
                near[:, :] &= False  # what the tail meets came from the side or from behind
            if near.any():
                row, step = np.unravel_index(int(np.argmax(near)), near.shape)
                if best is None or int(step) < best[1]:
                    best = int(around.owner[int(row)]), int(step)
        return None if best is None else around.who[best[0]]

    def _rolled(self, ego: VehicleState, way: _Way, command: Command, steps: int) -> Array:
        """(x, y, heading) of the ego's middle: a period under a command, then full braking along the way."""
        chassis, braking = self._chassis, self._bounds.braking_mps2
        speed = max(0.0, ego.speed_mps + command.acceleration_mps2 * self._period_s)
        x, y, heading = ego.x_m, ego.y_m, ego.heading_rad
        turn = math.tan(command.steering_rad) / chassis.wheelbase_m
        rows = [(x, y, heading)]
        advance = (max(ego.speed_mps, 0.0) + speed) / 2.0 * self._period_s
        at = way.station_m(ego)
        for step in range(1, steps):
            if step > 1:
                then = max(0.0, speed - braking * _STEP_S)
                advance, speed = (speed + then) / 2.0 * _STEP_S, then
                i = max(0, min(len(way.x) - 1, round(at + _LOOK_M)))
                bearing = math.atan2(way.y[i] - y, way.x[i] - x) - heading
                turn = 2.0 * math.sin(bearing) / _LOOK_M
                turn = max(-0.22, min(0.22, turn))
            heading += advance * turn
            x, y = x + advance * math.cos(heading), y + advance * math.sin(heading)
            at += advance
            rows.append((x, y, heading))
        return np.array(rows)

    def _gentlest(self, ego: VehicleState, way: _Way, command: Command, least: float, around: _Around) -> float:
        """The highest acceleration below what is asked after which the car can still stop; the least if none is."""
        if self._touches(ego, way, Command(least, command.steering_rad), around) is not None:
            return least
        low, high = least, command.acceleration_mps2
        for _ in range(_HALVINGS):
            middle = (low + high) / 2.0
            if self._touches(ego, way, Command(middle, command.steering_rad), around) is None:
                low = middle
            else:
                high = middle
        return low


def _known(one: VehicleState) -> bool:
    return math.isfinite(one.x_m + one.y_m + one.heading_rad + one.speed_mps + one.length_m + one.width_m)


def _replaced(command: Command, safe: Command, rule: str, reason: str) -> FilterResult:
    return FilterResult(safe, (Intervention(rule, reason, command, safe),))


def _owed_to(other: VehicleState) -> tuple[str, str]:
    if other.kind == "pedestrian":
        return "yield", "Somebody on foot is, or comes, in the way."
    return "gap", f"There is too little room to the {other.kind} ahead to ask for more."


def _offsets(length_m: float, width_m: float) -> list[float]:
    """Where discs of half the width cover a body, along it."""
    half = max(0.0, (length_m - width_m) / 2.0)
    count = max(1, math.ceil(2.0 * half / max(width_m, 0.3)) + 1)
    return [0.0] if count == 1 else [-half + 2.0 * half * i / (count - 1) for i in range(count)]


def _like(road: RoadGraph, route: tuple[LaneId, ...], ways: tuple[LaneId, ...]) -> LaneId:
    """Of the lanes that follow one beside the route, the one that goes the route's way; else the straightest."""
    for lane in ways:
        for one in road[lane].successors:
            if any(one == other or road.places_between(one, other) is not None for other in route):
                return lane
    return min(ways, key=lambda one: abs(road[one].bend_rad))


def _laid(road: RoadGraph, chain: tuple[LaneId, ...], own: int) -> _Way:
    starts, at = [], 0.0
    for lane in chain:
        starts.append(at)
        at += road[lane].length_m
    line = joined([road[lane].centre for lane in chain])
    x, y, heading = line.poses(np.arange(0.0, line.length_m + 1.0, 1.0))
    free = np.full(len(heading), math.inf)
    return _Way(chain, tuple(starts), line, x, y, heading, own, most_mps(heading, free, _BEND_MPS2, _BRAKING_MPS2))
