"""Perception and a driver for any world: answered and driven from its observation and road graph alone.

For worlds in the right-handed frame, whose cars are kinematic bicycles with their axles near their ends.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Final

from chauffeur.concept import Command, LaneId, Observation, Setpoints, VehicleState
from chauffeur.control import LAMPILOT_EGO, idm_acceleration
from chauffeur.geometry import LanePlace, RoadGraph, joined, wrap_to_pi
from chauffeur.worlds.base import EGO

_SQUARE_RAD: Final = (math.radians(30.0), math.radians(150.0))
"""Traffic that is turned against the ego by more than the one and less than the other crosses."""
_LOOK_AHEAD_S: Final = 0.8
_LEAST_LOOK_AHEAD_M: Final = 4.0
_SHARPEST_RAD: Final = 0.6
_HARDEST_MPS2: Final = 8.0


class ObservedPerception:
    """The driving APIs' questions, answered from the present observation."""

    def __init__(self, observe: Callable[[], Observation]) -> None:
        """Args: gives the present instant."""
        self._observe = observe

    @property
    def _road(self) -> RoadGraph:
        return self._observe().road

    def vehicle(self, vehicle_id: int) -> VehicleState:
        """State of a vehicle or object. Raises KeyError for one that is not there."""
        now = self._observe()
        for one in (now.ego, *now.others, *now.objects):
            if one.id == vehicle_id:
                return one
        raise KeyError(vehicle_id)

    def has_lane(self, lane: LaneId) -> bool:
        """True if the road has this lane."""
        return lane in self._road

    def lane_of(self, vehicle_id: int) -> LaneId:
        """Closest lane of a vehicle: the one that the observation names, where it does."""
        one = self.vehicle(vehicle_id)
        return one.lane if one.lane is not None else self._place(one).lane

    def adjacent_lane(self, lane: LaneId, offset: int) -> LaneId | None:
        """Lane `offset` places to the right (negative: left); None beyond the edge."""
        return self._road.neighbour(lane, offset) if offset else None

    def speed_limit(self, lane: LaneId) -> float:
        """Speed limit, m/s."""
        return self._road[lane].speed_limit_mps

    def neighbours(self, lane: LaneId) -> tuple[int | None, int | None]:
        """Nearest ahead of and behind the ego in a lane, as (front, rear); signs are nobody."""
        now, centre = self._observe(), self._road[lane].centre
        here = centre.nearest(now.ego.x_m, now.ego.y_m)
        along = [
            (centre.nearest(one.x_m, one.y_m) - here, one.id)
            for one in (*now.others, *now.objects)
            if one.lane == lane and one.kind != "stop_sign"
        ]
        front = min((one for one in along if one[0] >= 0.0), default=None)
        rear = max((one for one in along if one[0] < 0.0), default=None)
        return None if front is None else front[1], None if rear is None else rear[1]

    def distance_along(self, from_id: int, to_id: int) -> float:
        """Signed centre-to-centre distance, m, along lanes where one leads to the other, else along the first's."""
        one, two = self.vehicle(from_id), self.vehicle(to_id)
        ahead = self._road.distance_m(self._place(one), self._place(two))
        if ahead is not None:
            return ahead
        centre = self._road[self.lane_of(from_id)].centre
        return centre.nearest(two.x_m, two.y_m) - centre.nearest(one.x_m, one.y_m)

    def cross_traffic_lanes(self, from_left: bool) -> tuple[LaneId, ...]:
        """Lanes across the next junction on the way straight on, and those that lead there, from one side."""
        road = self._road
        crossed = next((lane for lane in road.ahead(self.lane_of(EGO)) if lane.junction), None)
        if crossed is None:
            return ()
        found: dict[LaneId, None] = {}
        own = crossed.centre.at(0.0).heading_rad
        for name in road.conflicts(crossed.id):
            turned = wrap_to_pi(road[name].centre.at(0.0).heading_rad - own)
            if _SQUARE_RAD[0] < abs(turned) < _SQUARE_RAD[1] and (turned < 0.0) == from_left:
                found |= dict.fromkeys((*(one.id for one in road.predecessors(name)), name))
        return tuple(found)

    def stop_sign_ahead(self, served: frozenset[int]) -> tuple[int, float] | None:
        """(id, distance) of the nearest unserved stop sign ahead in the ego's lane."""
        lane = self.lane_of(EGO)
        ahead = [
            (distance, sign.id)
            for sign in self._observe().objects
            if sign.kind == "stop_sign" and sign.id not in served and sign.lane == lane
            if (distance := self.distance_along(EGO, sign.id)) >= 0.0
        ]
        return None if not ahead else (min(ahead)[1], min(ahead)[0])

    def front_blocker(self, served: frozenset[int]) -> int | None:
        """Nearest vehicle, or unserved stop sign, ahead: the observation's lead, on whatever lane it is."""
        front, sign = self._observe().front, self.stop_sign_ahead(served)
        if front is not None and (sign is None or front.distance_m <= sign[1]):
            return front.vehicle
        return None if sign is None else sign[0]

    def idm_entering(self, follower_id: int, leader_id: int, time_headway_s: float) -> float:
        """IDM acceleration, m/s2, of `follower` at its present speed if `leader` drove right ahead of it."""
        return self.idm(follower_id, leader_id, self.vehicle(follower_id).speed_mps, time_headway_s)

    def idm(self, follower_id: int, leader_id: int | None, target_speed_mps: float, time_headway_s: float) -> float:
        """IDM acceleration, m/s2, of `follower` behind `leader` (None: free road)."""
        follower, parameters = self.vehicle(follower_id), replace(LAMPILOT_EGO, time_headway_s=time_headway_s)
        if leader_id is None:
            return idm_acceleration(follower.speed_mps, target_speed_mps, parameters)
        leader = self.vehicle(leader_id)
        along = leader.speed_mps * math.cos(leader.heading_rad - follower.heading_rad)
        gap = self.distance_along(follower_id, leader_id)
        shorter = parameters.jam_distance_m / 2.0 if leader.kind == "stop_sign" else 0.0
        return idm_acceleration(
            follower.speed_mps, target_speed_mps, parameters, gap, follower.speed_mps - along, shorter
        )

    def _place(self, one: VehicleState) -> LanePlace:
        lane = self._road.get(one.lane)
        if lane is not None:
            return LanePlace(lane.id, *lane.centre.project(one.x_m, one.y_m))
        place = self._road.locate(one.x_m, one.y_m, one.heading_rad)
        if place is None:
            raise KeyError(one.id)
        return place


class LaneDriver:
    """IDM along the lane, pure pursuit across it (Coulter 1992), on over junctions by the wished turn."""

    def __init__(self, observe: Callable[[], Observation], perception: ObservedPerception) -> None:
        """Args: gives the present instant; answers questions about it."""
        self._observe = observe
        self._perception = perception

    def initial_setpoints(self) -> Setpoints:
        """Keep the present speed and lane."""
        ego = self._observe().ego
        return Setpoints(target_speed_mps=ego.speed_mps, target_lane=self._perception.lane_of(EGO))

    def settle(self, setpoints: Setpoints) -> Setpoints:
        """Wishes with defaults filled in and the lane moved on to the next one where it ends."""
        now, start = self._observe(), self.initial_setpoints()
        lane = setpoints.target_lane if setpoints.target_lane in now.road else start.target_lane
        assert lane is not None
        if now.road[lane].centre.nearest(now.ego.x_m, now.ego.y_m) >= now.road[lane].length_m:
            onward = now.road.onward(lane, setpoints.turn)
            lane = lane if onward is None else onward.id
        speed = start.target_speed_mps if setpoints.target_speed_mps is None else setpoints.target_speed_mps
        return replace(setpoints, target_speed_mps=speed, target_lane=lane)

    def command(self, setpoints: Setpoints) -> Command:
        """Acceleration and steering for settled set-points."""
        now, settled = self._observe(), self.settle(setpoints)
        assert settled.target_lane is not None
        assert settled.target_speed_mps is not None
        blocker = self._perception.front_blocker(settled.served_stops)
        wanted = self._perception.idm(EGO, blocker, settled.target_speed_mps, settled.time_headway_s)
        return Command(max(-_HARDEST_MPS2, wanted), self._steering(now, settled))

    def _steering(self, now: Observation, setpoints: Setpoints) -> float:
        ego, reach = now.ego, max(_LEAST_LOOK_AHEAD_M, now.ego.speed_mps * _LOOK_AHEAD_S)
        assert setpoints.target_lane is not None
        lanes = [lane.centre for lane in now.road.ahead(setpoints.target_lane, setpoints.turn)]
        path = joined(lanes[:3])
        aim = path.at(path.nearest(ego.x_m, ego.y_m, high_m=lanes[0].length_m) + reach)
        bearing = wrap_to_pi(math.atan2(aim.y_m - ego.y_m, aim.x_m - ego.x_m) - ego.heading_rad)
        away = max(math.dist((aim.x_m, aim.y_m), (ego.x_m, ego.y_m)), 1e-3)
        steering = math.atan2(2.0 * ego.length_m * math.sin(bearing), away)
        return max(-_SHARPEST_RAD, min(_SHARPEST_RAD, steering))
