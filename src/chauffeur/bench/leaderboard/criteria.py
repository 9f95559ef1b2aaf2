"""The rules of Leaderboard 1.0 as state machines over observations.

Constants and order of checks are those of scenario_runner's branch leaderboard-1.0 (`atomic_criteria.py`). One thing is
corrected: a red light stays known until it has turned green or been left behind, where the original remembers one light
only and counts two that rule one line again and again.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal, Protocol

from chauffeur.bench.leaderboard.track import RouteTrack
from chauffeur.concept import Observation, Sign, Signal, VehicleState
from chauffeur.geometry import Lane, LanePlace, Pose, RoadGraph, overlap, wrap_to_pi

InfractionKind = Literal[
    "collisions_pedestrian",
    "collisions_vehicle",
    "collisions_layout",
    "red_light",
    "stop_infraction",
    "outside_route_lanes",
    "route_dev",
    "route_timeout",
    "vehicle_blocked",
]
"""Names of the official results file."""

ENDING: Final[frozenset[InfractionKind]] = frozenset({"route_dev", "route_timeout", "vehicle_blocked"})
"""These end a route; they carry no coefficient."""

Line = tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True, slots=True)
class Infraction:
    """A rule that was broken.

    Attributes:
        kind: Which.
        time_s: When, since the route began.
        x_m, y_m: Where: the ego, or the light or sign; right-handed frame.
        message: The official words, with CARLA's left-handed coordinates.
        other: Id of the road user, light or sign; empty where there is none.
        share: Of the distance driven, spent outside the route's lanes.
    """

    kind: InfractionKind
    time_s: float
    x_m: float
    y_m: float
    message: str
    other: str = ""
    share: float = 0.0


class Criterion(Protocol):
    """A rule that watches a route."""

    def update(self, observation: Observation) -> Sequence[Infraction]:
        """Infractions at this instant."""
        ...


class RouteCompletion:
    """Progress of the ego: the last point passed, looked for two points ahead."""

    WINDOW: Final = 2
    NEAR_M: Final = 10.0
    ENOUGH: Final = 0.99

    def __init__(self, track: RouteTrack) -> None:
        """Watch a way."""
        self._track = track
        self._index = 0
        self.completed = False

    @property
    def share(self) -> float:
        """Of the way, 0..1."""
        return 1.0 if self.completed else self._track.stations_m[self._index] / self._track.length_m

    def update(self, observation: Observation) -> Sequence[Infraction]:
        if self.completed:
            return ()
        ego, poses = observation.ego, self._track.poses
        for index in range(self._index, min(self._index + self.WINDOW + 1, len(poses))):
            if poses[index].sees(ego.x_m, ego.y_m)[0] > 0.0:
                self._index = index
        goal = self._track.goal
        at_goal = math.hypot(goal.x_m - ego.x_m, goal.y_m - ego.y_m) < self.NEAR_M
        self.completed = self.share > self.ENOUGH and at_goal
        return ()


class RouteDeviation:
    """Farther than 30 m from the next points ends a route, as does 30 % of it driven 15 m to 30 m away."""

    WINDOW: Final = 5
    FAR_M: Final = 30.0
    SAFE_M: Final = 15.0
    SHARE: Final = 0.30

    def __init__(self, track: RouteTrack) -> None:
        """Watch a way."""
        self._track = track
        self._index = 0
        self._away_m = 0.0

    def update(self, observation: Observation) -> Sequence[Infraction]:
        ego, stations = observation.ego, self._track.stations_m
        nearest, closest_m = self._index, math.inf
        for index in range(self._index, min(self._index + self.WINDOW + 1, len(stations))):
            pose = self._track.poses[index]
            distance = math.hypot(pose.x_m - ego.x_m, pose.y_m - ego.y_m)
            if distance <= closest_m:
                nearest, closest_m = index, distance
        off = closest_m >= self.FAR_M
        if closest_m >= self.SAFE_M:
            self._away_m += stations[nearest] - stations[self._index]
            off = off or self._away_m > self.SHARE * stations[-1]
        self._index = nearest
        return (_at_ego("route_dev", observation, "Agent deviated from the route at {place}"),) if off else ()


class Blocked:
    """Slower than 0.1 m/s for more than 180 s ends a route."""

    SLOW_MPS: Final = 0.1
    LONG_S: Final = 180.0

    def __init__(self) -> None:
        """Nothing has happened."""
        self._moved_s: float | None = None
        self._broken = False

    def update(self, observation: Observation) -> Sequence[Infraction]:
        if observation.ego.speed_mps >= self.SLOW_MPS or self._moved_s is None:
            self._moved_s = observation.time_s
        elif not self._broken and observation.time_s - self._moved_s > self.LONG_S:
            self._broken = True
            return (_at_ego("vehicle_blocked", observation, "Agent got blocked at {place}"),)
        return ()


def timeout_s(length_m: float) -> int:
    """Time a route may take: 0.8 s a metre, and 5 s."""
    return int(0.8 * length_m + 5.0)


class Timeout:
    """A route that takes too long ends."""

    def __init__(self, limit_s: float) -> None:
        """Watch the clock."""
        self._limit_s = limit_s

    def update(self, observation: Observation) -> Sequence[Infraction]:
        late = observation.time_s > self._limit_s
        return (_at_ego("route_timeout", observation, "Route timeout."),) if late else ()


_COLLISION: Final[dict[str, InfractionKind]] = {
    "pedestrian": "collisions_pedestrian",
    "car": "collisions_vehicle",
    "truck": "collisions_vehicle",
    "bus": "collisions_vehicle",
    "motorcycle": "collisions_vehicle",
    "bicycle": "collisions_vehicle",
    "static": "collisions_layout",
    "obstacle": "collisions_layout",
}
_TYPES: Final[dict[InfractionKind, str]] = {
    "collisions_pedestrian": "walker",
    "collisions_vehicle": "vehicle",
    "collisions_layout": "static",
}


class Collisions:
    """Overlaps of boxes, told once: not the same road user for 5 s, nor anybody within 3 m of the last place.

    A place is forgotten when the ego is 5 m away from it.
    """

    SAME_M: Final = 3.0
    FORGET_M: Final = 5.0
    SAME_S: Final = 5.0
    _REACH_M: Final = 15.0

    def __init__(self) -> None:
        """Nothing has happened."""
        self._places: list[tuple[float, float]] = []
        self._last: tuple[int, float] | None = None

    def update(self, observation: Observation) -> Sequence[Infraction]:
        ego, now_s = observation.ego, observation.time_s
        here = ego.x_m, ego.y_m
        self._places = [place for place in self._places if math.dist(place, here) <= self.FORGET_M]
        if self._last is not None and now_s - self._last[1] > self.SAME_S:
            self._last = None
        found: list[Infraction] = []
        for other in (*observation.others, *observation.objects):
            if abs(other.x_m - here[0]) > self._REACH_M or abs(other.y_m - here[1]) > self._REACH_M:
                continue
            kind = _COLLISION.get(other.kind)
            if kind is None or not overlap(ego.box, other.box):
                continue
            if self._last is not None and self._last[0] == other.id:
                continue
            if any(math.dist(place, here) <= self.SAME_M for place in self._places):
                continue
            self._places.append(here)
            self._last = other.id, now_s
            text = f"Agent collided against object with type={_TYPES[kind]}.{other.kind} and id={other.id} at {{place}}"
            found.append(_at_ego(kind, observation, text, str(other.id)))
        return found


class RedLights:
    """The tail of the ego crosses the stop line of its own lane while the light is red."""

    NEAR_M: Final = 15.0
    TAIL: Final = 0.8
    """Of half the length: where the tail begins."""
    BEHIND_M: Final = 1.0
    """Distance behind the rear bumper at which it ends."""
    HALF_WIDTH: Final = 0.4
    """Of the lane's width: what counts of a stop line, to either side."""

    def __init__(self) -> None:
        """Nothing has happened."""
        self._known: set[str] = set()
        self._lines: dict[tuple[str, str], tuple[Pose, Line]] = {}

    def update(self, observation: Observation) -> Sequence[Infraction]:
        ego, road = observation.ego, observation.road
        found: list[Infraction] = []
        tail: Line | None = None
        own = ""
        for signal in observation.signals:
            middle = _middle(signal)
            if signal.state != "red" or math.hypot(middle[0] - ego.x_m, middle[1] - ego.y_m) > self.NEAR_M:
                self._known.discard(signal.id)
                continue
            if signal.id in self._known:
                continue
            if tail is None:
                pose = Pose(ego.x_m, ego.y_m, ego.heading_rad)
                half = ego.length_m / 2.0
                tail = pose.place(-self.TAIL * half, 0.0), pose.place(-half - self.BEHIND_M, 0.0)
                place = road.locate(*tail[1], kinds=("driving",))
                own = "" if place is None else place.lane
            for lane in signal.lanes:
                if lane != own or lane not in road:
                    continue
                line_pose, line = self._line(signal, road[lane])
                if math.cos(line_pose.heading_rad - ego.heading_rad) > 0.0 and _crosses(tail, line):
                    self._known.add(signal.id)
                    text = f"Agent ran a red light {signal.id} at {_place(*middle)}"
                    found.append(Infraction("red_light", observation.time_s, *middle, text, signal.id))
                    break
        return found

    def _line(self, signal: Signal, lane: Lane) -> tuple[Pose, Line]:
        known = self._lines.get((signal.id, lane.id))
        if known is None:
            station = max(0.0, min(lane.length_m, lane.centre.nearest(*_middle(signal))))
            pose = lane.centre.at(station)
            half = self.HALF_WIDTH * lane.width_m
            known = self._lines[signal.id, lane.id] = pose, (pose.place(0.0, half), pose.place(0.0, -half))
        return known


class StopSigns:
    """The ego must fall below 0.1 m/s between the sign's look-ahead and the end of its box.

    The box reaches from a little before the stop line into the junction; it is entered with the centre of the ego.
    """

    SLOW_MPS: Final = 0.1
    AHEAD_M: Final = 20.0
    BEFORE_M: Final = 4.0
    BEYOND_M: Final = 2.0
    ONE_LINE_M: Final = 3.0
    """Signs whose lines are no farther apart ask for one stop: Town03 has such pairs."""

    def __init__(self) -> None:
        """Nothing has happened."""
        self._target: Sign | None = None
        self._left: tuple[float, float] | None = None
        self._stopped = False
        self._entered = False

    def update(self, observation: Observation) -> Sequence[Infraction]:
        ego, road = observation.ego, observation.road
        if self._target is None:
            if self._left is not None and math.dist(self._left, (ego.x_m, ego.y_m)) > self.AHEAD_M:
                self._left = None
            self._target = self._ahead(observation, road)
            self._stopped = self._entered = False
            return ()
        sign = self._target
        self._stopped = self._stopped or ego.speed_mps < self.SLOW_MPS
        to_line = _past_line(sign, road, ego)
        self._entered = self._entered or -self.BEFORE_M <= to_line <= self.BEYOND_M
        if -self.AHEAD_M <= to_line <= self.BEYOND_M:
            return ()
        ran = self._entered and not self._stopped and to_line > 0.0
        self._target, self._left = None, _middle(sign)
        if not ran:
            return ()
        text = f"Agent ran a stop with id={sign.id} at {_place(sign.x_m, sign.y_m)}"
        return (Infraction("stop_infraction", observation.time_s, sign.x_m, sign.y_m, text, sign.id),)

    def _ahead(self, observation: Observation, road: RoadGraph) -> Sign | None:
        ego = observation.ego
        signs = [
            sign
            for sign in observation.signs
            if sign.kind == "stop" and math.hypot(sign.x_m - ego.x_m, sign.y_m - ego.y_m) <= 50.0
            if self._left is None or math.dist(_middle(sign), self._left) > self.ONE_LINE_M
        ]
        if not signs:
            return None
        here = road.locate(ego.x_m, ego.y_m, ego.heading_rad, ("driving",))
        if here is None or math.cos(road[here.lane].centre.at(here.station_m).heading_rad - ego.heading_rad) <= 0.0:
            return None
        for sign in signs:
            for lane in sign.lanes:
                if lane not in road:
                    continue
                goal = LanePlace(lane, _station(sign, road[lane]), 0.0)
                if here.lane == lane and abs(goal.station_m - here.station_m) <= self.BEFORE_M:
                    return sign
                distance = road.distance_m(here, goal, self.AHEAD_M)
                if distance is not None and distance <= self.AHEAD_M:
                    return sign
        return None


class OutsideLanes:
    """Share of the distance driven outside of driving lanes, or in one of the wrong direction."""

    ALLOWED_M: Final = 1.3
    TURNED_RAD: Final = math.radians(150.0)
    AGAINST_RAD: Final = math.radians(120.0)
    WINDOW: Final = 3

    def __init__(self, track: RouteTrack) -> None:
        """Watch a way."""
        self._track = track
        self._index = 0
        self._driven_m = 0.0
        self._wrong_m = 0.0
        self._wrong_lane = False
        self._before: tuple[Lane, float] | None = None
        self._parking: bool | None = None

    @property
    def share(self) -> float:
        """Of the distance driven, so far."""
        return self._wrong_m / self._driven_m if self._driven_m > 0.0 else 0.0

    def update(self, observation: Observation) -> Sequence[Infraction]:
        ego, road = observation.ego, observation.road
        place = road.locate(ego.x_m, ego.y_m, kinds=("driving",))
        wrong = place is None or self._outside(ego, road, place) or self._against(ego, road, place)
        poses = self._track.poses
        for index in range(self._index + 1, min(self._index + self.WINDOW + 1, len(poses))):
            if poses[index].sees(ego.x_m, ego.y_m)[0] > 0.0:
                here = poses[self._index]
                step = math.hypot(poses[index].x_m - here.x_m, poses[index].y_m - here.y_m)
                self._index = index
                self._driven_m += step
                if wrong:
                    self._wrong_m += step
        return ()

    def finish(self, observation: Observation) -> Sequence[Infraction]:
        """Findings at the end of the route."""
        if self._wrong_m <= 0.0:
            return ()
        text = (
            f"Agent went outside its route lanes for about {self._wrong_m:.3f} meters "
            f"({100.0 * self.share:.2f}% of the completed route)"
        )
        ego = observation.ego
        return (Infraction("outside_route_lanes", observation.time_s, ego.x_m, ego.y_m, text, share=self.share),)

    def _outside(self, ego: VehicleState, road: RoadGraph, place: LanePlace) -> bool:
        lane = road[place.lane]
        distance, width = _away(ego, lane, place), lane.width_m
        if distance <= width / 2.0 + self.ALLOWED_M:
            return False
        if self._parking is None:
            self._parking = any(lane.kind == "parking" for lane in road.lanes)
        beside = road.locate(ego.x_m, ego.y_m, kinds=("parking",)) if self._parking else None
        if beside is not None and _away(ego, road[beside.lane], beside) <= distance:
            lane = road[beside.lane]
            distance, width = _away(ego, lane, beside), lane.width_m
        return distance > width / 2.0 + self.ALLOWED_M

    def _against(self, ego: VehicleState, road: RoadGraph, place: LanePlace) -> bool:
        lane = road[place.lane]
        heading = lane.centre.at(place.station_m).heading_rad
        before, self._before = self._before, (lane, heading)
        if lane.junction:
            self._wrong_lane = False
        elif before is not None and before[0].id != lane.id:
            if before[0].junction:
                self._wrong_lane = abs(wrap_to_pi(heading - ego.heading_rad)) >= self.AGAINST_RAD
            elif abs(wrap_to_pi(heading - before[1])) >= self.TURNED_RAD:
                self._wrong_lane = not self._wrong_lane
            else:
                self._wrong_lane = False
        return self._wrong_lane


class RouteReferee:
    """All rules of a route together."""

    def __init__(self, track: RouteTrack, limit_s: float | None = None) -> None:
        """Watch a way; `limit_s` is the time-out, the rules' own by default."""
        self.completion = RouteCompletion(track)
        self.outside = OutsideLanes(track)
        self.limit_s = timeout_s(track.length_m) if limit_s is None else limit_s
        self._criteria: tuple[Criterion, ...] = (
            self.completion,
            RouteDeviation(track),
            Blocked(),
            Timeout(self.limit_s),
            Collisions(),
            RedLights(),
            StopSigns(),
            self.outside,
        )
        self.infractions: list[Infraction] = []
        self.done = False

    def update(self, observation: Observation) -> list[Infraction]:
        """Infractions at this instant, none after the end; `done` is set where the route has ended."""
        if self.done:
            return []
        found = [one for criterion in self._criteria for one in criterion.update(observation)]
        self.infractions += found
        self.done = self.completion.completed or any(one.kind in ENDING for one in found)
        return found

    def finish(self, observation: Observation) -> None:
        """The route is over."""
        self.infractions += self.outside.finish(observation)


def _at_ego(kind: InfractionKind, observation: Observation, text: str, other: str = "") -> Infraction:
    ego = observation.ego
    place = _place(ego.x_m, ego.y_m)
    return Infraction(kind, observation.time_s, ego.x_m, ego.y_m, text.format(place=place), other)


def _place(x_m: float, y_m: float) -> str:
    return f"(x={x_m:.3f}, y={-y_m:.3f}, z=0.0)"


def _middle(ruling: Signal | Sign) -> tuple[float, float]:
    """Of the stop line of a light or sign; where the sign itself stands, if it has none."""
    if ruling.stop_line_m is None:
        return ruling.x_m, ruling.y_m
    (ax, ay), (bx, by) = ruling.stop_line_m
    return (ax + bx) / 2.0, (ay + by) / 2.0


def _station(sign: Sign, lane: Lane) -> float:
    return max(0.0, min(lane.length_m, lane.centre.nearest(*_middle(sign))))


def _past_line(sign: Sign, road: RoadGraph, ego: VehicleState) -> float:
    """Distance of the ego's centre beyond the line of a sign, along the sign's own lane, m."""
    lane = min(
        (road[name] for name in sign.lanes if name in road),
        key=lambda one: abs(one.centre.project(ego.x_m, ego.y_m)[1]),
    )
    return lane.centre.at(_station(sign, lane)).sees(ego.x_m, ego.y_m)[0]


def _away(ego: VehicleState, lane: Lane, place: LanePlace) -> float:
    at = lane.centre.at(place.station_m)
    return math.hypot(at.x_m - ego.x_m, at.y_m - ego.y_m)


def _crosses(one: Line, other: Line) -> bool:
    """True if two legs cross or touch."""

    def side(line: Line, point: tuple[float, float]) -> float:
        (ax, ay), (bx, by) = line
        return (bx - ax) * (point[1] - ay) - (by - ay) * (point[0] - ax)

    return side(one, other[0]) * side(one, other[1]) <= 0.0 and side(other, one[0]) * side(other, one[1]) <= 0.0
