"""Answers to the driving APIs' questions on LaMPilot's roads, with LaMPilot's meaning of each.

The core has y and headings to the right, as highway-env; what is given from here on has them to the left. Signs are
changed by taking from 0, which leaves no negative zeros.
"""

from __future__ import annotations

import math

from chauffeur.concept import LaneId, VehicleState
from chauffeur.worlds.base import EGO
from chauffeur.worlds.highway.core import CoreRoad
from chauffeur.worlds.highway.core import layout as at
from chauffeur.worlds.highway.instant import Instant

_KINDS = ("car", "car", "obstacle", "stop_sign")


def _id_or_none(row: int) -> int | None:
    return None if row < 0 else int(row)


class HighwayPerception:
    """Perception of the present instant of a road in motion; stays valid as it is stepped."""

    def __init__(self, core: CoreRoad, kind: str, emergency_lanes: frozenset[LaneId]) -> None:
        self._core = core
        self._kind = kind
        self._emergency_lanes = emergency_lanes
        self._rows = core.road.rows
        self._names = core.road.lane_ids

    @property
    def emergency_lanes(self) -> frozenset[LaneId]:
        """Lanes for cars in distress only."""
        return self._emergency_lanes

    def instant(self) -> Instant:
        """The ego as of the last step."""
        core = self._core
        out, ego = core.out.tolist(), core.floats[0].tolist()
        front = int(out[at.OUT_FRONT])
        return Instant(
            ego[at.SPEED],
            0.0 - ego[at.HEADING],
            ego[at.X],
            0.0 - ego[at.Y],
            self._names[int(out[at.OUT_LANE])],
            None if front < 0 else front,
            out[at.OUT_GAP],
            math.nan if front < 0 else float(core.floats[front, at.SPEED]),
            out[at.OUT_CRASHED] != 0.0,
            out[at.OUT_ON_ROAD] > 0.0,
            out[at.OUT_ON_ROAD] < 0.0,
            out[at.OUT_TTC_ALONG],
            out[at.OUT_TTC_PLANE],
            out[at.OUT_TTC_LANE],
        )

    def _row(self, vehicle_id: int) -> int:
        if not 0 <= vehicle_id < len(self._core.floats):
            raise KeyError(vehicle_id)
        return vehicle_id

    def vehicle(self, vehicle_id: int) -> VehicleState:
        """State of a vehicle or object. Raises KeyError for an unknown id."""
        core, row = self._core, self._row(vehicle_id)
        return self._state(row, core.floats[row].tolist(), core.ints[row].tolist())

    def everybody(self) -> tuple[VehicleState, ...]:
        """States of all: the ego, the other vehicles, the objects; ids are places in it."""
        core = self._core
        rows = zip(core.floats.tolist(), core.ints.tolist(), strict=True)
        return tuple([self._state(i, numbers, traits) for i, (numbers, traits) in enumerate(rows)])

    def _state(self, vehicle_id: int, numbers: list[float], traits: list[int]) -> VehicleState:
        return VehicleState(
            id=vehicle_id,
            kind=_KINDS[traits[at.KIND]],
            x_m=numbers[at.X],
            y_m=0.0 - numbers[at.Y],
            heading_rad=0.0 - numbers[at.HEADING],
            speed_mps=numbers[at.SPEED],
            length_m=numbers[at.LENGTH],
            width_m=numbers[at.WIDTH],
            lane=self._names[traits[at.LANE]],
            crashed=bool(traits[at.CRASHED]),
        )

    def others(self) -> tuple[VehicleState, ...]:
        """Every vehicle and object but the ego."""
        return self.everybody()[1:]

    def has_lane(self, lane: LaneId) -> bool:
        """True if the road has this lane."""
        return lane in self._rows

    def lane_of(self, vehicle_id: int) -> LaneId:
        """Closest lane of a vehicle."""
        return self._names[self._core.ints[self._row(vehicle_id), at.LANE]]

    def adjacent_lane(self, lane: LaneId, offset: int) -> LaneId | None:
        """Lane `offset` places to the right (negative: left); None beyond the edge."""
        road, row = self._core.road, self._rows[lane]
        index, own = int(road.traits[row, at.INDEX]) + offset, road.roads[road.traits[row, at.ROAD]]
        if offset == 0 or not 0 <= index < own[at.COUNT]:
            return None
        return self._names[int(own[at.FIRST]) + index]

    def speed_limit(self, lane: LaneId) -> float:
        """Speed limit, m/s."""
        return float(self._core.road.lanes[self._rows[lane], at.LIMIT])

    def neighbours(self, lane: LaneId) -> tuple[int | None, int | None]:
        """Nearest vehicle or obstacle ahead of and behind the ego on a lane segment."""
        front, rear = self._core.neighbours(EGO, self._rows[lane])
        return _id_or_none(front), _id_or_none(rear)

    def distance_along(self, from_id: int, to_id: int) -> float:
        """Signed centre-to-centre distance, m, along the first one's lane."""
        return self._core.gap(self._row(from_id), self._row(to_id))

    def distance_on(self, lane: LaneId, to_id: int) -> float:
        """Signed distance from the ego to another along a given lane, m."""
        row = self._rows[lane]
        return self._core.along(row, to_id) - self._core.along(row, EGO)

    def lane_heading(self, lane: LaneId) -> float:
        """Heading of a lane where the ego is along it, rad."""
        return 0.0 - self._core.lane_heading(self._rows[lane], EGO)

    def reachable(self, lane: LaneId) -> bool:
        """True if the ego may change to a lane from where it is."""
        return self._core.reachable(self._rows[lane])

    def cross_traffic_lanes(self, from_left: bool) -> tuple[LaneId, ...]:
        """Lanes of the crossing traffic, in LaMPilot's order."""
        if self._kind != "intersection":
            return ()
        if from_left:
            return "o1-ir1:0", "ir1-il3:0", "il3-o3:0"
        return "il1-o1:0", "ir3-il1:0", "o3-ir3:0"

    def stop_sign_ahead(self, served: frozenset[int]) -> tuple[int, float] | None:
        """(id, distance) of the nearest unserved stop sign ahead on the ego's lane."""
        sign = self._core.blocker(self._bits(served), vehicles=False)
        return None if sign < 0 else (sign, self.distance_along(EGO, sign))

    def front_blocker(self, served: frozenset[int]) -> int | None:
        """Nearest vehicle or unserved stop sign ahead on the ego's own lane."""
        return _id_or_none(self._core.blocker(self._bits(served), vehicles=True))

    def _bits(self, served: frozenset[int]) -> int:
        first = self._core.vehicles
        return sum(1 << (sign - first) for sign in served if sign >= first)

    def idm_entering(self, follower_id: int, leader_id: int, time_headway_s: float) -> float:
        """IDM acceleration, m/s2, of `follower` at its present speed if `leader` drove right ahead of it."""
        row = self._row(follower_id)
        return self._core.follow(row, self._row(leader_id), float(self._core.floats[row, at.SPEED]), time_headway_s)

    def idm(self, follower_id: int, leader_id: int | None, target_speed_mps: float, time_headway_s: float) -> float:
        """IDM acceleration, m/s2, of `follower` behind `leader` (None: free road), with LaMPilot's ego parameters."""
        front = -1 if leader_id is None else leader_id
        return self._core.follow(follower_id, front, target_speed_mps, time_headway_s)

    def traffic_idm(self, follower_id: int, leader_id: int | None) -> float | None:
        """Acceleration, m/s2, that a car of the traffic would choose behind another; None if it is no such car."""
        if self._core.ints[follower_id, at.KIND] != at.TRAFFIC:
            return None
        return self._core.traffic_idm(follower_id, -1 if leader_id is None else leader_id)
