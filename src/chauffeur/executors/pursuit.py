"""Drives a `Parameters` policy (Talk2Drive, paper Eq. 15): target speed, look-ahead distance, look-ahead ratio, lane.

The same parameters drive on a highway, over an intersection and in a parking lot. The vehicle follows a path with pure
pursuit; what the path is depends on the road: the middle of its lane, that of the wished lane once there is a gap, the
way through the crossing, or the way onto a spot. It stops at stop signs, lets go first who crosses, and stands at the
end of its path. The shield has the last word, and the command passes the one door (`driving/actuate.py`).

The policy's `route` says where to go where ways part: a turn (`left`, `straight`, `right`), or a place in a lot
(`nearest`, `stadium`, `exit`, or the name of a spot).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from chauffeur.concept import (
    Command,
    Lane,
    LaneId,
    Limits,
    Observation,
    Parameters,
    ScenarioError,
    Setpoints,
    Turn,
    VehicleState,
)
from chauffeur.geometry import Polyline, joined, wrap_to_pi
from chauffeur.geometry.road_graph import TURNS
from chauffeur.safety.shield import LAMPILOT_SHIELD
from chauffeur.safety.shield.gaps import braking_gap_m, rss_gap_m
from chauffeur.worlds.base import EGO, World
from chauffeur.worlds.corridor import Body
from chauffeur.worlds.parking.driver import JAM_M
from chauffeur.worlds.parking.lot import Spot
from chauffeur.worlds.parking.places import PLACES
from chauffeur.worlds.parking.routes import Way
from chauffeur.worlds.path_follower import LOT_BEND_MPS2, Chassis, Follower, Look
from chauffeur.worlds.places import ParkingPlaces

HEADWAY_S: Final = 1.5
"""Time headway to who is ahead: Talk2Drive's parameters have none, its adaptive cruise control keeps its own."""

_JAM_M: Final = 2.0
_ACCELERATION_MPS2: Final = 2.5
_CHANGE_S: Final = 4.0
"""Time a lane change takes: 1.5 m/s2 sideways at most for a lane of 4 m."""
_CHANGE_M: Final = 20.0
"""Way it takes at least."""
_BEFORE_M: Final = 10.0
_STEP_M: Final = 1.0
_RESERVE_M: Final = 2.0
"""More than the shield asks for when a lane is entered: it should have nothing to mend."""
_SHORT_M: Final = 0.2
"""Distance before the end of its path at which the front bumper stops."""
_STOP_LINE_M: Final = 0.5
_AT_LINE_M: Final = 3.0
_STANDING_MPS: Final = 0.1
_LOOKS_S: Final = 1.0
"""Time the car stands at a stop sign before it may go."""
_CLEAR_S: Final = 2.0
"""Time by which a crossing agent must be missed when the car leaves a stop sign."""
_SHORTEST_LOOK_M: Final = 2.0
"""Nearer than this a car that creeps winds itself off its path."""


@dataclass(frozen=True, slots=True)
class _Stretch:
    """Lanes one after the other, as one path, and where along it each begins."""

    lanes: tuple[Lane, ...]
    path: Polyline
    starts_m: tuple[float, ...]

    def lane_at(self, station_m: float) -> Lane:
        """The lane a place along the path is in."""
        index = 0
        while index + 1 < len(self.lanes) and self.starts_m[index + 1] <= station_m:
            index += 1
        return self.lanes[index]


class ParametersDriver:
    """Drives `Parameters` in one world: paths, lane changes, stop lines.

    Nothing in the parameters makes it fail: what is no number is taken for the most careful value.
    """

    def __init__(
        self, world: World, policy: Parameters, *, limits: Limits | None = None, origin: LaneId | None = None
    ) -> None:
        """Bind a policy to a world, wherever its car is.

        Args:
            world: To drive in.
            policy: To drive.
            limits: No speed beyond them.
            origin: Lane the policy's lane wish counts from; the ego's own by default.

        Raises:
            ScenarioError: The road has no such turn or place, the spot is taken, or no way leads there.
        """
        self._world = world
        self._limits = Limits() if limits is None else limits
        self._notes: list[tuple[float, str]] = []
        observation = world.observe()
        self._road = observation.road
        self.route = policy.route
        self._turn: Turn | None = _turn_of(policy.route, observation)
        self.spot: Spot | None = None
        self._stretch: _Stretch | None = None
        self._goal: _Stretch | None = None
        if isinstance(world, ParkingPlaces):
            self._follower = Follower(world.chassis, world.dt_s, jam_m=JAM_M, bend_mps2=LOT_BEND_MPS2)
            way = self._way_in(world, policy.route)
            self._follower.take(way.path, way.room_m)
        else:
            self._follower = Follower(_highway_chassis(observation.ego), world.dt_s, jam_m=_JAM_M)
            self._stretch = self._stretch_from(self._here(observation))
            self._follow(self._stretch.path)
        self._before: _Stretch | None = None
        self._served: frozenset[int] = frozenset()
        self._stood_s = 0.0
        self._target_now = 0.0
        self._tune(policy, origin)

    def retune(self, policy: Parameters, origin: LaneId | None = None) -> bool:
        """Go on along the same way with other numbers; False, and nothing is changed, where the way is another one.

        Args:
            policy: To drive from now on.
            origin: Lane its lane wish counts from; the ego's own by default.
        """
        if policy.route != self.route:
            return False
        self._tune(policy, origin)
        return True

    def _tune(self, policy: Parameters, origin: LaneId | None) -> None:
        self._target = number(policy.target_speed_mps, 0.0)
        self._look = Look(
            max(number(policy.look_ahead_m, _SHORTEST_LOOK_M), _SHORTEST_LOOK_M),
            max(number(policy.look_ahead_ratio, 0.0), 0.0),
        )
        if self._stretch is None or (policy.lane == 0 and self._before is not None):
            self._goal = self._stretch  # a change that has begun is finished
        else:
            self._goal = self._goal_of(policy.lane, origin)

    def _way_in(self, world: ParkingPlaces, route: str) -> Way:
        """The way through a lot: onto the spot that is meant, or on."""
        if not route:
            stands = world.parked()
            if stands is not None:
                raise ScenarioError(f"The car is parked in {stands}, and does not reverse.")
            return world.way_on()
        self.spot = world.spot(route)
        return world.way_to(self.spot) or world.way_on()

    @property
    def notes(self) -> tuple[tuple[float, str], ...]:
        """Messages to the passenger, as (time s, text)."""
        return tuple(self._notes)

    def setpoints(self) -> Setpoints:
        """Set-points of this period."""
        observation = self._world.observe()
        if self._goal is not None and not self._mind_the_lane(observation, _lane_beside(self._goal, observation.ego)):
            self._goal = self._stretch
        least, most = self._limits.min_time_headway_s, self._limits.max_time_headway_s
        return self._driven(observation, self._target, min(max(HEADWAY_S, least), most))

    def held_to(self, safe: Setpoints) -> Setpoints:
        """Set-points of this period with speed, headway and lane given from outside.

        Args:
            safe: Theirs, within the limits: of the fallback levels, for one.
        """
        observation = self._world.observe()
        lane = self._road.get(safe.target_lane)
        if self._stretch is not None and lane is not None:
            self._mind_the_lane(observation, lane)
        return self._driven(observation, number(safe.target_speed_mps, 0.0), safe.time_headway_s)

    def _driven(self, observation: Observation, target_mps: float, headway_s: float) -> Setpoints:
        lane: LaneId | None
        if self._stretch is None:
            lane = self.spot.lane if self.spot is not None else observation.ego.lane
            here = self._road.get(lane)
            limit = 0.0 if here is None else here.speed_limit_mps
        else:
            view = _lane_beside(self._stretch, observation.ego)
            lane, limit = view.id, view.speed_limit_mps
        self._target_now = max(0.0, min(target_mps, self._limits.most_mps(limit)))
        return Setpoints(self._target_now, headway_s, lane, self._turn, self._served)

    def command(self, target_mps: float, headway_s: float) -> Command:
        """Acceleration and steering for this period.

        Args:
            target_mps: Speed to drive.
            headway_s: Time headway to who is ahead.
        """
        self._target_now = target_mps
        observation = self._world.observe()
        others = _solid(observation)
        stop = self._stop_line(observation, others)
        return self._follower.command(observation.ego, others, self._look, target_mps, headway_s, stop)

    # Lanes ------------------------------------------------------------------------------------------------------------

    def _here(self, observation: Observation) -> Lane:
        lane = self._road.get(observation.ego.lane)
        if lane is None:
            raise ScenarioError("The car is on no lane of this road.", hint="Reset the world first.")
        return lane

    def _follow(self, path: Polyline) -> None:
        lane = self._road.lanes[0]
        ego = self._world.observe().ego
        self._follower.take(path, max(0.2, (lane.width_m - ego.width_m) / 2.0))

    def _stretch_from(self, first: Lane) -> _Stretch:
        """A lane and what follows it on the route, up to where the front bumper is to stop."""
        lanes = tuple(self._road.ahead(first.id, self._turn))
        starts, path = [0.0], lanes[0].centre
        for lane in lanes[1:]:
            starts.append(path.length_m)
            path = joined([path, lane.centre])
        return _Stretch(lanes, _ended(path, self._overhang_m + _SHORT_M), tuple(starts))

    @property
    def _overhang_m(self) -> float:
        return _highway_chassis(self._world.observe().ego).body.overhang_m

    def _goal_of(self, side: int, origin: LaneId | None) -> _Stretch | None:
        """Target of a lane wish: the lane beside the one it counts from, and what follows that."""
        assert self._stretch is not None
        ego = self._world.observe().ego
        first = self._road.get(origin)
        from_here = _lane_beside(self._stretch if first is None else self._stretch_from(first), ego)
        goal = self._road.neighbour(from_here.id, side)
        if goal is not None:
            return self._stretch_from(self._road[goal])
        if side:
            self._say(self._world.observe(), f"There is no lane to the {_name_of(side)}; I stay in this one.")
        return self._stretch

    def _mind_the_lane(self, observation: Observation, goal: Lane) -> bool:
        """Begin a lane change towards a lane once it has room; go back while that is still the shorter way.

        Returns:
            False where that lane cannot be had, which is said.
        """
        assert self._stretch is not None
        if self._before is not None:
            self._go_on_or_back(observation)
            return True
        lane = _lane_beside(self._stretch, observation.ego)
        places = self._road.places_between(lane.id, goal.id)
        if not places:
            return True
        step = 1 if places > 0 else -1
        beside = self._road.get(self._road.neighbour(lane.id, step))
        if beside is None:
            return False
        side = _name_of(step)
        if beside.closed and not beside.emergency:
            self._say(observation, f"The lane to the {side} ends; I stay in this one.")
            return False
        there = self._stretch_from(beside)
        hindrance = self._hindrance(observation, there.path, beside.width_m, _RESERVE_M)
        if hindrance:
            self._say(observation, f"The lane to the {side} is not free yet: {hindrance}")
        elif self._change(observation, there):
            self._before, self._stretch = self._stretch, there
            self._say(observation, f"Changing to the {side} lane.")
        return True

    def _go_on_or_back(self, observation: Observation) -> None:
        assert self._stretch is not None
        assert self._before is not None
        ego, there = observation.ego, self._stretch
        station = there.path.nearest(ego.x_m, ego.y_m)
        lane = there.lane_at(station)
        away = abs(there.path.offset(ego.x_m, ego.y_m, station))
        if away < 0.3:
            self._before = None
        elif away > lane.width_m / 2.0 + ego.width_m / 2.0:  # all of the car is in its old lane
            hindrance = self._hindrance(observation, there.path, lane.width_m, 0.0)
            if hindrance and self._change(observation, self._before):
                self._say(observation, f"Back into the lane: {hindrance}")
                self._stretch, self._before = self._before, None

    def _change(self, observation: Observation, there: _Stretch) -> bool:
        """Follow a smooth way from where the car is to another lane; False where the lanes end too soon."""
        ego, path = observation.ego, self._follower.path
        assert path is not None
        station = self._follower.locate(ego)
        way = max(_CHANGE_M, ego.speed_mps * _CHANGE_S)
        if station + way > path.length_m:
            return False
        points: list[tuple[float, float]] = []
        for i in range(-round(_BEFORE_M / _STEP_M), math.ceil(way / _STEP_M)):
            share = max(0.0, i * _STEP_M / way)
            here = path.at(station + i * _STEP_M)
            goal = there.path.at(there.path.nearest(here.x_m, here.y_m))
            blend = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
            points.append((here.x_m + blend * (goal.x_m - here.x_m), here.y_m + blend * (goal.y_m - here.y_m)))
        last = path.at(station + way)
        begin = there.path.nearest(last.x_m, last.y_m)
        rest = zip(there.path.points_m, there.path.stations_m, strict=True)
        points.extend([point for point, at in rest if at > begin])
        self._follow(Polyline.of(points))
        return True

    def _hindrance(self, observation: Observation, path: Polyline, width_m: float, reserve_m: float) -> str:
        """Obstacle to entering a lane, in words; empty where the gap allows it, with a reserve."""
        ego, table = observation.ego, LAMPILOT_SHIELD
        here = path.nearest(ego.x_m, ego.y_m)
        for other in _solid(observation):
            there = path.nearest(other.x_m, other.y_m)
            pose = path.at(there)
            sideways = other.speed_mps * math.sin(wrap_to_pi(other.heading_rad - pose.heading_rad))
            reach = width_m / 2.0 + other.width_m / 2.0
            across = pose.sees(other.x_m, other.y_m)[1]
            if min(abs(across), abs(across + sideways)) > reach:
                continue
            gap = abs(there - here) - (ego.length_m + other.length_m) / 2.0 - table.margin_m - reserve_m
            if gap < 0.0:
                return "a car is beside."
            if there > here:
                lead = max(other.speed_mps, 0.0)
                needed = braking_gap_m(
                    ego.speed_mps, lead, table.gentle_mps2, table.others_braking_mps2, self._world.dt_s
                )
                needed = max(min(needed, ego.speed_mps * HEADWAY_S), _least_ahead(ego.speed_mps, lead))
                if gap < needed:
                    return f"a car {gap:.0f} m ahead in it is too close."
            else:
                needed = rss_gap_m(
                    other.speed_mps,
                    ego.speed_mps,
                    table.others_response_s,
                    table.others_acceleration_mps2,
                    table.others_sure_braking_mps2,
                    table.gentle_mps2,
                )
                if gap < needed:
                    return f"a car {gap:.0f} m behind in it needs {needed:.0f} m."
        return ""

    # Stop signs -------------------------------------------------------------------------------------------------------

    def _stop_line(self, observation: Observation, others: Sequence[VehicleState]) -> float:
        """Way along the path at which the rear axle has to stop for a sign; infinite where none is left to serve."""
        path, ego = self._follower.path, observation.ego
        if self._stretch is None or path is None:
            return math.inf
        nearest = math.inf
        for sign in observation.objects:
            if sign.kind != "stop_sign" or sign.id in self._served:
                continue
            at = path.nearest(sign.x_m, sign.y_m)
            here = path.at(at)
            if math.dist((here.x_m, here.y_m), (sign.x_m, sign.y_m)) > 1.0:
                continue  # of another lane
            line = at - self._overhang_m - _STOP_LINE_M
            station = self._follower.locate(ego)
            if station > line + _AT_LINE_M:
                self._served |= {sign.id}
                continue
            if ego.speed_mps < _STANDING_MPS and abs(station - line) < _AT_LINE_M:
                self._stood_s += self._world.dt_s
                clear = not self._follower.crossing(ego, others, self._target_now, _CLEAR_S)
                if self._stood_s >= _LOOKS_S and clear:
                    self._served |= {sign.id}
                    continue
            nearest = min(nearest, line)
        return nearest

    def _say(self, observation: Observation, text: str) -> None:
        """A note, once while it stays the same in substance."""
        if not self._notes or self._notes[-1][1].partition(":")[0] != text.partition(":")[0]:
            self._notes.append((observation.time_s, text))


def _lane_beside(stretch: _Stretch, ego: VehicleState) -> Lane:
    """The lane of a stretch that is beside the car, or that the car is in."""
    return stretch.lane_at(stretch.path.nearest(ego.x_m, ego.y_m))


def _name_of(side: int) -> str:
    return "left" if side < 0 else "right"


def _highway_chassis(ego: VehicleState) -> Chassis:
    """A car of the highway worlds: its axles are at its ends (control/lane_keeping.py)."""
    body = Body(ego.length_m, ego.width_m, ego.length_m / 2.0)
    return Chassis(body, ego.length_m, math.pi / 4.0, _ACCELERATION_MPS2)


def _turn_of(route: str, observation: Observation) -> Turn | None:
    """The turn that is meant; None in a lot, where routes are places, and where nothing is said."""
    if not route or observation.road.has_parking:
        return None
    if route not in TURNS:
        places = " Places are for parking lots." if route in PLACES else ""
        raise ScenarioError(f"There is no route {route!r} on this road.{places}", hint=f"Say {', '.join(TURNS)}.")
    if route != "straight" and not observation.road.junctions:
        raise ScenarioError(f"There is no intersection ahead to turn {route} at.", hint="Leave out the route.")
    return next(turn for turn in TURNS if turn == route)


def _solid(observation: Observation) -> list[VehicleState]:
    """Everybody and everything that can be touched."""
    return [one for one in (*observation.others, *observation.objects) if one.kind != "stop_sign" and one.id != EGO]


def _ended(path: Polyline, short_m: float) -> Polyline:
    """A path that ends a way earlier."""
    end = max(path.length_m - short_m, path.length_m / 2.0)
    last = path.at(end)
    kept: Iterable[tuple[float, float]] = (
        point for point, at in zip(path.points_m, path.stations_m, strict=True) if at < end
    )
    return Polyline.of([*kept, (last.x_m, last.y_m)])


def _least_ahead(speed_mps: float, lead_mps: float) -> float:
    """Gap at which a slower car ahead in the new lane can be braked for with 3 m/s2."""
    closing = max(0.0, speed_mps - lead_mps)
    return 0.5 * speed_mps + closing**2 / (2.0 * LAMPILOT_SHIELD.gentle_mps2)


def number(value: object, otherwise: float) -> float:
    """A finite number, or what stands in for one that is none."""
    if isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value):
        return float(value)
    return otherwise
