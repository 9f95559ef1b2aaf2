"""Answers to questions about the present instant of a lot."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from chauffeur.concept import LaneId, Observation
from chauffeur.control import LAMPILOT_EGO
from chauffeur.control.idm import idm_acceleration
from chauffeur.geometry import Polyline
from chauffeur.worlds.base import EGO
from chauffeur.worlds.over_graph import ObservedPerception
from chauffeur.worlds.parking.lot import Lot


class LaneMap:
    """Maps places of a lot to lanes."""

    def __init__(self, lot: Lot) -> None:
        """Args: the lot."""
        self._spots = tuple(lot.spots.values())
        self._ways: list[tuple[LaneId, Polyline, tuple[float, float, float, float]]] = []
        for lane in lot.road.lanes:
            if lane.id not in lot.spots:
                path = lane.centre
                xs, ys = zip(*path.points_m, strict=True)
                self._ways.append((lane.id, path, (min(xs), min(ys), max(xs), max(ys))))

    def closest(self, x_m: float, y_m: float) -> LaneId:
        """The spot a place is in, or else the drive, corner or aisle whose middle is nearest."""
        for spot in self._spots:
            if abs(spot.box.x_m - x_m) < spot.box.length_m and spot.box.holds(x_m, y_m):
                return spot.lane
        best, found = math.inf, self._ways[0][0]
        for lane, path, (x0, y0, x1, y1) in self._ways:
            if math.hypot(max(x0 - x_m, 0.0, x_m - x1), max(y0 - y_m, 0.0, y_m - y1)) >= best:
                continue
            pose = path.at(path.nearest(x_m, y_m, 0.0, path.length_m))
            distance = math.dist((pose.x_m, pose.y_m), (x_m, y_m))
            if distance < best:
                best, found = distance, lane
        return found


class ParkingPerception(ObservedPerception):
    """Perception of a lot; stays valid as it is stepped."""

    def __init__(self, lot: Lot, lanes: LaneMap, now: Callable[[], Observation]) -> None:
        """Args: the ground; its lanes; the present instant."""
        super().__init__(now)
        self._lot = lot
        self._lanes = lanes

    def lane_of(self, vehicle_id: int) -> LaneId:
        """Closest lane."""
        vehicle = self.vehicle(vehicle_id)
        return vehicle.lane or self._lanes.closest(vehicle.x_m, vehicle.y_m)

    def neighbours(self, lane: LaneId) -> tuple[int | None, int | None]:
        """Nearest ahead of and behind the ego in a lane."""
        path, observation = self._lot.road[lane].centre, self._observe()
        here = path.nearest(observation.ego.x_m, observation.ego.y_m)
        placed = [(path.nearest(o.x_m, o.y_m) - here, o.id) for o in observation.others if o.lane == lane]
        front = min((one for one in placed if one[0] > 0.0), default=None)
        rear = max((one for one in placed if one[0] <= 0.0), default=None)
        return None if front is None else front[1], None if rear is None else rear[1]

    def distance_along(self, from_id: int, to_id: int) -> float:
        """Signed centre-to-centre distance, m, along the first one's lane."""
        one, two = self.vehicle(from_id), self.vehicle(to_id)
        path = self._lot.road[self.lane_of(from_id)].centre
        return path.nearest(two.x_m, two.y_m) - path.nearest(one.x_m, one.y_m)

    def front_blocker(self, served: frozenset[int]) -> int | None:
        """Nearest ahead on the ego's own lane."""
        del served
        return self.neighbours(self.lane_of(EGO))[0]

    def idm_entering(self, follower_id: int, leader_id: int, time_headway_s: float) -> float:
        """IDM acceleration, m/s2, of `follower` at its present speed if `leader` drove right ahead of it."""
        follower, leader = self.vehicle(follower_id), self.vehicle(leader_id)
        gap = math.dist((follower.x_m, follower.y_m), (leader.x_m, leader.y_m))
        speed = follower.speed_mps
        parameters = replace(LAMPILOT_EGO, time_headway_s=time_headway_s)
        return idm_acceleration(speed, speed, parameters, gap, speed - leader.speed_mps)
