"""The shield of streets: over a road graph, with lights, signs, people and everybody else who crosses.

The same promise as on roads, kept another way: a command is let through if after one period of it the car can brake to
a stand, steering back along a lane, without leaving the ground it may be on (`RoadGraph.ground`), without touching
anybody, and without passing a line it has to stop at. The manoeuvre that was found is kept: where a command, and the
least changes of it, leave none, what was kept is driven. A car that stands is not at fault; so by induction the ego
never is, as long as others do no more than is assumed of them: vehicles keep to their way, go on as fast as now or
brake with up to `others_braking_mps2`; who is on foot goes on as now or stops; who comes from behind in the ego's own
lane minds the ego, and who comes from behind in another lane needs the distance of responsibility-sensitive safety
before the ego enters that lane.

Source: Pek, Althoff, "Fail-safe motion planning for online verification", 2020, with the stop as the plan that is kept.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chauffeur.concept import Command, Intervention, LaneId, Limits, Observation, VehicleState
from chauffeur.control.kinematic_bicycle import LINCOLN_MKZ, KinematicBicycle, curvature_of
from chauffeur.geometry import Polyline, Pose, RoadGraph, Route, joined, wrap_to_pi
from chauffeur.geometry.ground import Ground
from chauffeur.safety.shield import failsafe
from chauffeur.safety.shield.gaps import highest
from chauffeur.safety.shield.shield import NO_NUMBER, UNKNOWN, FilterResult, Shield, is_finite
from chauffeur.safety.shield.table import LAMPILOT_SHIELD, ShieldParameters
from chauffeur.safety.shield.traffic_arrays import TrafficArrays
from chauffeur.safety.words import speed_words
from chauffeur.worlds.town.way import astride_m, most_mps

Array = NDArray[np.float64]
_Line = tuple[tuple[float, float], tuple[float, float]]

_REACH_M: Final = 70.0
_NEAR_M: Final = 60.0
_ALONG_RAD: Final = math.radians(40.0)
_SIDE_M: Final = 0.15
_PERSON_SIDE_M: Final = 0.4
_EDGE_M: Final = 0.1
"""Tolerance of the outline over the edge of its ground: the filter knows the car exactly, and lanes to that."""
_EVERY: Final = 2
"""The ground under the car is looked at every so many periods: 3 m apart at 30 m/s, less than half of any body."""
_FOLLOWS_MPS: Final = 2.5
_FOLLOWS_S: Final = 0.2
"""Speed and period of the walk along a line that measures the road the car takes beside it."""
_AROUND_ROWS: Final = 3
_SWING_SHARE: Final = 1.25
"""A car that enters a bend beside the middle of its lane swings out by this factor more."""
_SKID_RADPS: Final = 0.2
"""Tyres that hold turn a car as its wheel says, to less than this; at 0.4 rad/s a car on snow is on its way round."""
_OVERHANG_M: Final = 0.3
"""Overhang of a bumper over a kerb in a bend that is too tight otherwise: less than to any walking person."""
_LEVEL_M: Final = 1e-6
_OVER_M: Final = 1.0
"""A car farther over a line than this, which cannot wait with its tail before it, clears the junction."""
_SERVED_MPS: Final = 0.1
_AT_SIGN_M: Final = 4.0
_CLEAR_M: Final = 3.5
_HALVINGS: Final = 5
_SLOWING_MPS2: Final = 1.5
_BEND_MPS2: Final = 3.0
"""Lateral acceleration at which a car still keeps to its lane in a town's bends."""
_BRAKING_MPS2: Final = 3.0
_ASTRAY_RAD: Final = 0.7
_ASIDE_M: Final = 2.2
"""A vehicle turned by more against its lane, or farther beside its middle, follows no lane."""
_WAYS: Final = 3
"""Ways on that somebody may take are followed up to so many."""


@dataclass(frozen=True, slots=True, eq=False)
class _Way:
    """A way on from the ego's lane, and the lane before it.

    Attributes:
        lanes: Its lanes.
        starts_m: Where each begins.
        line: Their middles, joined.
        rows: (n, 3): x, y, heading every metre.
        own: Place of the ego's lane among the lanes.
        most_mps: Speed for the bends ahead, every metre.
        edge_m: How far a car may reach beyond its ground, every metre: a little farther than one that follows the line
            at a walk, for in the tightest bends no car's front keeps to the lane.
    """

    lanes: tuple[LaneId, ...]
    starts_m: tuple[float, ...]
    line: Polyline
    rows: Array
    own: int
    most_mps: Array
    edge_m: Array

    def station_m(self, ego: VehicleState) -> float:
        """Station of the ego on the line, m."""
        low = max(0, int(self.starts_m[self.own]) - 6)
        after = self.starts_m[self.own + 1] if self.own + 1 < len(self.starts_m) else self.line.length_m
        own = self.rows[low : int(after) + 7]
        return low + float(failsafe.along(own, ego.x_m, ego.y_m, ego.heading_rad)[0])


@dataclass(frozen=True, slots=True, eq=False)
class _Around:
    """Relevant agents: rows as of `failsafe`, and the vehicles they stand for."""

    who: tuple[VehicleState, ...]
    rows: Array


@dataclass(frozen=True, slots=True, eq=False)
class _Instant:
    """All that a command is judged by in a period."""

    road: RoadGraph
    ego: VehicleState
    state: Array
    ways: Sequence[_Way]
    around: _Around


@dataclass(frozen=True, slots=True, eq=False)
class _Fault:
    """Reason a command leaves no manoeuvre: the vehicle the car would meet, or None where it would leave its ground."""

    other: VehicleState | None = None


class StreetShield(Shield):
    """Judges and mends commands of one trip through streets, one a control period."""

    def __init__(
        self,
        dt_s: float,
        limits: Limits | None = None,
        parameters: ShieldParameters = LAMPILOT_SHIELD,
        car: KinematicBicycle = LINCOLN_MKZ,
    ) -> None:
        super().__init__(dt_s, limits, parameters)
        self._car = car
        self._numbers = failsafe.numbers(car)
        self._ways: dict[tuple[LaneId, ...], _Way] = {}
        self._road: RoadGraph | None = None
        self._stopped_at: set[str] = set()
        self._lines: dict[tuple[int, int, _Line], float] = {}
        self._chained: tuple[Route | None, LaneId, int, tuple[LaneId, ...]] | None = None
        self._paths: dict[LaneId, tuple[tuple[int, int], ...]] = {}
        self._points: Array = np.zeros((0, 3))
        """(x, y, heading) of the ways of others, every metre, one after the other."""
        self._kept: tuple[_Way, int] | None = None
        """The manoeuvre that the last command left: the way it leads back to, and how it steers."""
        self._wheel_rad = 0.0
        self._layer = 0
        """The lane of the route the ego was last seen in: routes may pass a lane twice."""

    def filter(self, observation: Observation, command: Command, aim: LaneId | None = None) -> FilterResult:
        """The command, changed as little as needed; arguments as of `Shield.guard`."""
        ego = observation.ego
        if not TrafficArrays.of(observation).known:
            return FilterResult.replaced(command, self._halt(ego), UNKNOWN)
        if not is_finite(command):
            return FilterResult.replaced(command, self._halt(ego), NO_NUMBER)
        way = self._way_of(observation, aim)
        if way is None:
            return FilterResult(command)
        station = way.station_m(ego)
        self._numbers = failsafe.numbers(self._car, max(ego.speed_mps, 0.0))
        most, rule, reason = self._cap(observation, way, station)
        least = self._least(ego)
        capped = max(min(command.acceleration_mps2, most), least)
        now = _Instant(observation.road, ego, self._state(ego), [way], self._around(observation))
        held = self._held_rad(ego.speed_mps)
        steering = max(-held, min(held, command.steering_rad))
        done, fault = self._driven(now, Command(capped, steering), least, observation)
        said: list[Intervention] = []
        if done.steering_rad != command.steering_rad:
            mended = Command(command.acceleration_mps2, done.steering_rad)
            rule = "skid" if fault is None else "lane"
            said.append(Intervention(rule, _why_steered(fault), command, mended))
        if done.acceleration_mps2 < command.acceleration_mps2 - 1e-6 and (
            ego.speed_mps > 0.0 or command.acceleration_mps2 > 0.0
        ):
            if fault is not None and done.acceleration_mps2 < capped - 1e-6:
                rule, reason = _owed_to(fault)
            said.append(Intervention(rule, reason, command, done))
        return FilterResult(done, tuple(said))

    def _halt(self, ego: VehicleState) -> Command:
        speed = ego.speed_mps if math.isfinite(ego.speed_mps) else math.inf
        return Command(max(-self._table.braking_mps2, -max(speed, 0.0) / self._dt_s), 0.0)

    def _least(self, ego: VehicleState) -> float:
        """Hardest braking that does not ask for more than a stand."""
        return max(-self._car.most_braking_mps2, -max(ego.speed_mps, 0.0) / self._dt_s)

    def _state(self, ego: VehicleState) -> Array:
        rear = Pose(ego.x_m, ego.y_m, ego.heading_rad).ahead(-self._car.rear_to_middle_m)
        speed = max(ego.speed_mps, 0.0)
        return np.array([rear.x_m, rear.y_m, ego.heading_rad, speed, ego.steering_rad, ego.acceleration_mps2])

    # What is left after a command -------------------------------------------------------------------------------------

    def _driven(
        self, now: _Instant, asked: Command, least: float, observation: Observation
    ) -> tuple[Command, _Fault | None]:
        """The command, or the least change of it that leaves a manoeuvre, and what was wrong with it."""
        fault = self._leaves(now, asked)
        if fault is None:
            return asked, None
        now = replace(now, ways=[*now.ways, *self._others_on(observation, now.ways[0])])
        fault = self._leaves(now, asked)
        if fault is None:
            return asked, None
        way, law = (now.ways[0], failsafe.PURSUE) if self._kept is None else self._kept
        back = self._steering(now, way, law)
        if asked.steering_rad != back and self._leaves(now, Command(asked.acceleration_mps2, back)) is None:
            return Command(asked.acceleration_mps2, back), fault
        for steering in dict.fromkeys((asked.steering_rad, back)):
            if self._leaves(now, Command(least, steering)) is None:
                return Command(self._hardest(now, asked.acceleration_mps2, steering, least), steering), fault
        return Command(least, back), fault

    def _hardest(self, now: _Instant, asked: float, steering: float, least: float) -> float:
        """The highest acceleration below what is asked that leaves a manoeuvre."""
        found = highest(least, asked, lambda one: self._leaves(now, Command(one, steering)) is None, _HALVINGS)
        self._leaves(now, Command(found, steering))  # the manoeuvre of this one is kept
        return found

    def _steering(self, now: _Instant, way: _Way, law: int) -> float:
        """Wheel angle of a steering law now, rad."""
        if law == failsafe.HELD:
            return now.ego.steering_rad
        if law == failsafe.STRAIGHT:
            return 0.0
        at = failsafe.nearest(way.rows, now.state[0], now.state[1], -1, 0)
        return float(failsafe.pursuing(now.state, way.rows, at, self._numbers))

    def _leaves(self, now: _Instant, command: Command) -> _Fault | None:
        """None if a command leaves a manoeuvre that ends well, which is then kept; else the first one's fault."""
        wrong: _Fault | None = None
        for way in now.ways:
            at = failsafe.nearest(way.rows, now.state[0], now.state[1], -1, 0)
            for law in failsafe.LAWS:
                if law != failsafe.PURSUE and way is not now.ways[0]:
                    continue
                poses = failsafe.stopped(
                    now.state, command.acceleration_mps2, command.steering_rad, self._numbers, self._dt_s,
                    way.rows, at, law,
                )  # fmt: skip
                fault = self._fault(now, way, poses)
                if fault is None:
                    self._kept = way, law
                    return None
                wrong = wrong or fault
        return wrong

    def _fault(self, now: _Instant, way: _Way, poses: Array) -> _Fault | None:
        if self._strays(now.road.ground, way, poses):
            return _Fault()
        around = now.around
        if len(around.rows):
            row = failsafe.met(
                poses, self._dt_s, self._numbers, around.rows, self._points, self._table.others_braking_mps2
            )
            if row >= 0:
                return _Fault(around.who[row])
        return None

    def _strays(self, ground: Ground, way: _Way, poses: Array) -> bool:
        """True if the outline leaves its ground on a way, or gets farther out where it is out already."""
        poses = np.concatenate([poses[:2], poses[2:-1:_EVERY], poses[-1:]])
        car, places = self._car, poses[:, :3]
        beyond = ground.beyond_m(places, car.length_m, car.width_m, stops=True)
        edge = way.edge_m[poses[:, 4].astype(np.int64)]
        if (beyond[1:] > np.maximum(edge[1:], beyond[0]) + _LEVEL_M).any():
            return True
        length, width = (float(one) for one in self._numbers[2:4])
        stray = width - car.width_m
        exact = stray == 0.0
        if exact and not (edge[1:] > _EDGE_M + _LEVEL_M).any():
            return False
        # Where a front swings out, or a stop ends beside where it was foreseen, it does so over lanes and kerbs, and
        # the wheels stay on the road.
        beyond = ground.beyond_m(places, length, width, stops=True, either_way=True)
        if (beyond[1:] > np.maximum(_OVERHANG_M, beyond[0]) + _LEVEL_M).any():
            return True
        wheels = ground.beyond_m(places, car.wheelbase_m + stray, width, stops=True, either_way=True)
        return bool((wheels[1:] > np.maximum(_EDGE_M if exact else 0.0, wheels[0]) + _LEVEL_M).any())

    # The way ----------------------------------------------------------------------------------------------------------

    def _way_of(self, observation: Observation, aim: LaneId | None) -> _Way | None:
        road = observation.road
        if road is not self._road:
            self._road, self._chained = road, None
            self._ways.clear()
            self._lines.clear()
            self._paths.clear()
            self._points, self._kept = np.zeros((0, 3)), None
        lane = observation.ego.lane
        if lane is None or lane not in road:
            return None
        if aim is not None and aim != lane and road.get(aim) is not None and road.places_between(lane, aim):
            lane = aim
        chain = self._chain(observation, lane)
        way = self._ways.get(chain)
        if way is None:
            way = self._ways[chain] = _laid(road, chain, chain.index(lane), self._car)
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

    def _others_on(self, observation: Observation, first: _Way) -> Iterator[_Way]:
        """Ways on from every lane that passes the ego, those that part from the first one included."""
        road, ego = observation.road, observation.ego
        own = first.lanes[first.own]
        lanes = (own, *(one.lane for one in road.places(ego.x_m, ego.y_m, ego.heading_rad, ("driving", "aisle"))))
        for lane in dict.fromkeys(lanes):
            for chain in _chains(road, lane):
                if chain == first.lanes[first.own : first.own + len(chain)]:
                    continue
                if chain not in self._ways:
                    self._ways[chain] = _laid(road, chain, 0, self._car)
                yield self._ways[chain]

    # Lines and limits -------------------------------------------------------------------------------------------------

    def _cap(self, observation: Observation, way: _Way, station: float) -> tuple[float, str, str]:
        """The strictest bound of the acceleration by limits, lights and signs: (m/s2, rule, reason)."""
        ego, speed = observation.ego, max(0.0, observation.ego.speed_mps)
        lane = observation.road.get(ego.lane)
        limit = self._limits.most_mps(math.inf if lane is None else lane.speed_limit_mps)
        allowed = max((limit - speed) / self._dt_s, -_SLOWING_MPS2)
        strictest = min(allowed, self._table.acceleration_mps2), "speed", f"No faster than {speed_words(limit)} here."
        if self._skids(ego) and strictest[0] > 0.0:
            strictest = 0.0, "skid", "The tyres slide: no throttle until they hold."
        bend = float(way.most_mps[max(0, min(len(way.most_mps) - 1, round(station + speed * self._dt_s)))])
        slow = (bend - speed) / self._dt_s
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
                if signal.state == "yellow" or speed * speed > 2.0 * self._table.gentle_mps2 * max(0.0, room):
                    continue
            cap = self._stopping(speed, room)
            if cap >= strictest[0] or (signal.state == "yellow" and cap < -self._table.gentle_mps2):
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

    def _skids(self, ego: VehicleState) -> bool:
        """True if a car that is more than a bicycle turns otherwise than its wheel says: throttle would spin it."""
        wheel = ego.speed_mps * curvature_of(ego.speed_mps, ego.steering_rad, self._car)
        return self._car.stray_s > 0.0 and abs(ego.yaw_rate_radps - wheel) > _SKID_RADPS

    def _held_rad(self, speed_mps: float) -> float:
        """Wheel angle up to which the tyres of a car that is more than a bicycle hold."""
        if self._car.stray_s == 0.0:
            return math.inf
        return math.atan(self._car.wheelbase_m * self._car.grip_mps2 / max(speed_mps * speed_mps, 1e-6))

    def _stopping(self, speed: float, ahead_m: float) -> float:
        """Hardest acceleration after which the car still stops before a line."""
        if ahead_m < 0.05:
            return -self._table.braking_mps2 if speed < 3.0 else math.inf
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
        """True if a standing vehicle leaves no room behind a line for all of the car."""
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
        """Everybody who may come near while the ego brakes to a stand."""
        ego, table, road = observation.ego, self._table, observation.road
        until_s = max(ego.speed_mps, 0.0) / self._car.most_braking_mps2 + 2.0 * self._dt_s + self._car.lag_s
        own = (max(ego.speed_mps, 0.0) + table.acceleration_mps2 * self._dt_s) * until_s + ego.length_m + 1.0
        here = Pose(ego.x_m, ego.y_m, ego.heading_rad)
        who: list[VehicleState] = []
        rows: list[tuple[float, ...]] = []
        for other in (*observation.others, *observation.objects):
            if other.kind == "stop_sign" or max(abs(other.x_m - ego.x_m), abs(other.y_m - ego.y_m)) > _NEAR_M:
                continue
            speed, person = max(other.speed_mps, 0.0), other.kind == "pedestrian"
            ahead, aside = here.sees(other.x_m, other.y_m)
            after = entry = 0.0
            if not person and speed > _SERVED_MPS:
                response = table.others_response_s
                after = speed * response + speed * speed / (2.0 * table.others_sure_braking_mps2)
                along = abs(wrap_to_pi(other.heading_rad - ego.heading_rad)) < _ALONG_RAD
                if along and ahead < -(ego.length_m + other.length_m) / 2.0:
                    line = Pose(other.x_m, other.y_m, other.heading_rad)
                    if abs(line.sees(ego.x_m, ego.y_m)[1]) < (ego.width_m + other.width_m) / 2.0:
                        continue  # who comes from behind minds the ego
                if along and ahead < 0.0:
                    entry = table.entry_gap_m(speed, ego.speed_mps, response)
            if math.hypot(ahead, aside) > own + max(speed * until_s, after, entry) + other.length_m:
                continue  # out of reach until the ego stands
            side = _PERSON_SIDE_M if person else _SIDE_M
            body = other.x_m, other.y_m, other.heading_rad, speed, other.length_m, other.width_m, side
            for path in self._paths_of(road, other, speed):
                who.append(other)
                rows.append((*body, float(not person), *path, after, entry))
        return _Around(tuple(who), np.array(rows, dtype=np.float64).reshape(len(rows), 14))

    def _paths_of(
        self, road: RoadGraph, other: VehicleState, speed: float
    ) -> Sequence[tuple[float, float, float, float]]:
        """Ways that somebody may follow: first row and rows of its line, where on it they are, how far left of it."""
        straight = ((0.0, 0.0, 0.0, 0.0),)
        lane = road.get(other.lane)
        if speed < _SERVED_MPS or other.kind == "pedestrian" or lane is None or lane.kind not in ("driving", "bicycle"):
            return straight
        paths = self._paths.get(lane.id)
        if paths is None:
            lines = [_sampled(joined([road[one].centre for one in chain])) for chain in _chains(road, lane.id)]
            starts = np.cumsum([len(self._points), *map(len, lines)]).tolist()
            paths = self._paths[lane.id] = tuple((start, len(line)) for start, line in zip(starts, lines, strict=False))
            self._points = np.concatenate([self._points, *lines])
        own = self._points[paths[0][0] : paths[0][0] + round(lane.length_m) + 1]
        station, aside, turned = failsafe.along(own, other.x_m, other.y_m, other.heading_rad)
        if abs(aside) > _ASIDE_M or abs(turned) > _ASTRAY_RAD:
            return straight
        return [(float(start), float(count), station, aside) for start, count in paths]


def _owed_to(fault: _Fault) -> tuple[str, str]:
    if fault.other is None:
        return "lane", "That would leave the road."
    if fault.other.kind == "pedestrian":
        return "yield", "Somebody on foot is, or comes, in the way."
    return "gap", f"There is too little room to the {fault.other.kind} to ask for more."


def _why_steered(fault: _Fault | None) -> str:
    if fault is None:
        return "Turned so far, the tyres would slide."
    if fault.other is None:
        return "That would leave the road."
    who = "somebody on foot" if fault.other.kind == "pedestrian" else f"a {fault.other.kind}"
    return f"That way would touch {who}."


def _chains(road: RoadGraph, lane: LaneId) -> list[tuple[LaneId, ...]]:
    """A lane and what may follow it, as far as is looked."""
    done: list[tuple[LaneId, ...]] = []
    rim: list[tuple[tuple[LaneId, ...], float]] = [((lane,), 0.0)]
    while rim and len(done) < _WAYS:
        chain, beyond = rim.pop(0)
        onward = road[chain[-1]].successors
        if beyond > _NEAR_M or not onward:
            done.append(chain)
            continue
        rim.extend(((*chain, one), beyond + road[one].length_m) for one in onward)
    return done


def _sampled(line: Polyline) -> Array:
    """(x, y, heading) of a line every metre."""
    return np.stack(line.poses(np.arange(0.0, line.length_m + 1.0, 1.0)), axis=1)


def _like(road: RoadGraph, route: tuple[LaneId, ...], ways: tuple[LaneId, ...]) -> LaneId:
    """Of the lanes that follow one beside the route, the one that goes the route's way; else the straightest."""
    for lane in ways:
        for one in road[lane].successors:
            if any(one == other or road.places_between(one, other) is not None for other in route):
                return lane
    return min(ways, key=lambda one: abs(road[one].bend_rad))


def _laid(road: RoadGraph, chain: tuple[LaneId, ...], own: int, car: KinematicBicycle) -> _Way:
    starts, at = [], 0.0
    for lane in chain:
        starts.append(at)
        at += road[lane].length_m
    line = joined([road[lane].centre for lane in chain])
    rows = _sampled(line)
    heading = rows[:, 2]
    most = most_mps(heading, np.full(len(heading), math.inf), _BEND_MPS2, _BRAKING_MPS2)
    poses = failsafe.followed(rows, failsafe.numbers(car), _FOLLOWS_MPS, _FOLLOWS_S)
    beyond = road.ground.beyond_m(poses[:, :3], car.length_m, car.width_m, stops=True)
    swing = np.zeros(len(rows) + 2 * _AROUND_ROWS)
    np.maximum.at(swing, poses[:, 4].astype(np.int64) + _AROUND_ROWS, beyond)
    widest = np.max([swing[i : i + len(rows)] for i in range(2 * _AROUND_ROWS + 1)], axis=0)
    return _Way(chain, tuple(starts), line, rows, own, most, _SWING_SHARE * widest + _EDGE_M)
