"""Answers to the driving APIs' questions on LaMPilot's roads, with LaMPilot's meaning of each, from highway-env.

highway-env has y and headings to the right; what is given from here on has them to the left.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from chauffeur.concept import LaneId, VehicleState
from chauffeur.control import LAMPILOT_EGO, idm_acceleration
from chauffeur.worlds.base import EGO
from chauffeur.worlds.highway.instant import Instant
from highway_oracle.conflicts import ttc_along, ttc_lane, ttc_plane
from highway_oracle.scenes import Scene, key_of, name_of
from highway_oracle.traffic import IDMVehicle, StopSign, Vehicle


class ReferencePerception:
    """Perception of the present instant of a scene; stays valid as the scene is stepped."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._road = scene.road
        self._network = scene.road.network
        others = [v for v in scene.road.vehicles if v is not scene.ego]
        entities = [scene.ego, *others, *scene.road.objects]
        self._by_id: dict[int, Any] = dict(enumerate(entities))
        self._ids: dict[int, int] = {id(entity): i for i, entity in self._by_id.items()}

    @property
    def ego(self) -> Any:
        """highway-env's ego vehicle."""
        return self._scene.ego

    def entity(self, vehicle_id: int) -> Any:
        """highway-env's vehicle or object. Raises KeyError for an unknown id."""
        return self._by_id[vehicle_id]

    def id_of(self, entity: Any) -> int:
        """Id of one of highway-env's vehicles or objects."""
        return self._ids[id(entity)]

    @property
    def emergency_lanes(self) -> frozenset[LaneId]:
        """Lanes nobody but a car in distress may use."""
        return self._scene.emergency_lanes

    def instant(self) -> Instant:
        """The ego now."""
        ego, vehicles = self.ego, self._road.vehicles
        front = self._road.neighbour_vehicles(ego, ego.lane_index)[0]
        s, r = ego.lane.local_coordinates(ego.position)
        return Instant(
            float(ego.speed),
            0.0 - float(ego.heading),
            float(ego.position[0]),
            0.0 - float(ego.position[1]),
            name_of(ego.lane_index),
            None if front is None else self.id_of(front),
            math.nan if front is None else float(ego.lane_distance_to(front)),
            math.nan if front is None else float(front.speed),
            bool(ego.crashed),
            bool(ego.on_road),
            bool(s >= ego.lane.length + ego.lane.VEHICLE_LENGTH and abs(r) <= ego.lane.width_at(s) / 2),
            ttc_along(ego, vehicles),
            ttc_plane(ego, vehicles),
            ttc_lane(ego, [*vehicles, *self._road.objects]),
        )

    def reachable(self, lane: LaneId) -> bool:
        """Whether the ego may change to a lane from where it is."""
        return bool(self._network.get_lane(key_of(lane)).is_reachable_from(self.ego.position))

    def distance_on(self, lane: LaneId, to_id: int) -> float:
        """Signed distance from the ego to another along a given lane, m."""
        return float(self.ego.lane_distance_to(self._by_id[to_id], self._network.get_lane(key_of(lane))))

    def lane_heading(self, lane: LaneId) -> float:
        """Heading of a lane where the ego is along it, rad."""
        geometry = self._network.get_lane(key_of(lane))
        return 0.0 - float(geometry.heading_at(geometry.local_coordinates(self.ego.position)[0]))

    def traffic_idm(self, follower_id: int, leader_id: int | None) -> float | None:
        """Acceleration, m/s2, that a car of the traffic would choose behind another; None if it is no such car."""
        follower = self._by_id[follower_id]
        if not isinstance(follower, IDMVehicle):
            return None
        front = None if leader_id is None else self._by_id[leader_id]
        return float(follower.acceleration(ego_vehicle=follower, front_vehicle=front))

    def vehicle(self, vehicle_id: int) -> VehicleState:
        """State of a vehicle or object. Raises KeyError for an unknown id."""
        return vehicle_state(vehicle_id, self._by_id[vehicle_id])

    def others(self) -> tuple[VehicleState, ...]:
        """Every vehicle and object but the ego."""
        return tuple(self.vehicle(i) for i in self._by_id if i != EGO)

    def has_lane(self, lane: LaneId) -> bool:
        """Whether the road has this lane."""
        return any(name_of(index) == lane for index in self._network.lanes_dict())

    def lane_of(self, vehicle_id: int) -> LaneId:
        """Closest lane of a vehicle."""
        return name_of(self._by_id[vehicle_id].lane_index)

    def adjacent_lane(self, lane: LaneId, offset: int) -> LaneId | None:
        """Lane `offset` places to the right (negative: left); None beyond the edge."""
        start, end, own = key_of(lane)
        index = own + offset
        if offset == 0 or not 0 <= index < len(self._network.graph[start][end]):
            return None
        return name_of((start, end, index))

    def speed_limit(self, lane: LaneId) -> float:
        """Speed limit, m/s."""
        return float(self._network.get_lane(key_of(lane)).speed_limit)

    def neighbours(self, lane: LaneId) -> tuple[int | None, int | None]:
        """Nearest vehicle or obstacle ahead of and behind the ego on a lane segment."""
        front, rear = self._road.neighbour_vehicles(self.ego, key_of(lane))
        return (
            None if front is None else self.id_of(front),
            None if rear is None else self.id_of(rear),
        )

    def distance_along(self, from_id: int, to_id: int) -> float:
        """Signed centre-to-centre distance, m, along the first one's lane."""
        origin, target = self._by_id[from_id], self._by_id[to_id]
        return float(origin.lane_distance_to(target))

    def cross_traffic_lanes(self, from_left: bool) -> tuple[LaneId, ...]:
        """Lanes of the crossing traffic, in LaMPilot's order."""
        if self._scene.kind != "intersection":
            return ()
        if from_left:
            return "o1-ir1:0", "ir1-il3:0", "il3-o3:0"
        return "il1-o1:0", "ir3-il1:0", "o3-ir3:0"

    def stop_sign_ahead(self, served: frozenset[int]) -> tuple[int, float] | None:
        """(id, distance) of the nearest unserved stop sign ahead on the ego's lane."""
        sign = self._nearest_ahead(served, vehicles=False)
        return None if sign is None else (sign, self.distance_along(EGO, sign))

    def front_blocker(self, served: frozenset[int]) -> int | None:
        """Nearest vehicle or unserved stop sign ahead on the ego's lane."""
        return self._nearest_ahead(served, vehicles=True)

    def _nearest_ahead(self, served: frozenset[int], *, vehicles: bool) -> int | None:
        """Objects come before vehicles and a later equal wins: LaMPilot's order."""
        ego = self.ego
        lane = self._network.get_lane(ego.lane_index)
        s = lane.local_coordinates(ego.position)[0]
        nearest: float | None = None
        found: Any = None
        candidates: list[Any] = [
            o for o in self._road.objects if isinstance(o, StopSign) and self.id_of(o) not in served
        ]
        if vehicles:
            candidates += [v for v in self._road.vehicles if v is not ego and isinstance(v, Vehicle)]
        for candidate in candidates:
            s_other, lateral = lane.local_coordinates(candidate.position)
            if s_other < s or (nearest is not None and s_other > nearest):
                continue
            if lane.on_lane(candidate.position, s_other, lateral):
                nearest, found = s_other, candidate
        return None if found is None else self.id_of(found)

    def idm_entering(self, follower_id: int, leader_id: int, time_headway_s: float) -> float:
        """IDM acceleration, m/s2, of `follower` at its present speed if `leader` drove right ahead of it."""
        return self.idm(follower_id, leader_id, float(self._by_id[follower_id].speed), time_headway_s)

    def idm(self, follower_id: int, leader_id: int | None, target_speed_mps: float, time_headway_s: float) -> float:
        """IDM acceleration, m/s2, of `follower` behind `leader` (None: free road), with LaMPilot's ego parameters."""
        follower = self._by_id[follower_id]
        parameters = replace(LAMPILOT_EGO, time_headway_s=time_headway_s)
        if leader_id is None:
            return idm_acceleration(float(follower.speed), target_speed_mps, parameters)
        leader = self._by_id[leader_id]
        return idm_acceleration(
            float(follower.speed),
            target_speed_mps,
            parameters,
            self.distance_along(follower_id, leader_id),
            float(np.dot(follower.velocity - leader.velocity, follower.direction)),
            # A sign has no length: LaMPilot lets the car stop half the jam distance closer to it.
            parameters.jam_distance_m / 2 if isinstance(leader, StopSign) else 0.0,
        )


def vehicle_state(vehicle_id: int, entity: Any) -> VehicleState:
    """Frozen state of one of highway-env's vehicles or objects."""
    kind = "car" if isinstance(entity, Vehicle) else "stop_sign" if isinstance(entity, StopSign) else "obstacle"
    return VehicleState(
        id=vehicle_id,
        kind=kind,
        x_m=float(entity.position[0]),
        y_m=0.0 - float(entity.position[1]),
        heading_rad=0.0 - float(entity.heading),
        speed_mps=float(entity.speed),
        length_m=float(entity.LENGTH),
        width_m=float(entity.WIDTH),
        lane=None if entity.lane_index is None else name_of(entity.lane_index),
        crashed=bool(entity.crashed),
    )
