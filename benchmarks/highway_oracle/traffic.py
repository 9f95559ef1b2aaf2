"""The highway-env physics under the oracle, made quicker without changing a bit of its results.

Three costs dominate highway-env on LaMPilot's roads: searching neighbours (quadratic in vehicles, repeated for every
query), testing every pair for collision, and deep-copying the ego to predict where it goes. Here positions along a lane
are computed once per instant, far pairs are skipped by a bound that cannot miss a close one, and the prediction copies
only the vehicle. `tests/worlds/test_traffic.py` holds the results equal, bit for bit, to the plain package.
"""

from __future__ import annotations

import copy
import math
from bisect import bisect_left
from typing import Any, ClassVar

import numpy as np
from highway_env.road.lane import CircularLane, SineLane, StraightLane
from highway_env.road.regulation import RegulatedRoad
from highway_env.road.road import Road, RoadNetwork
from highway_env.vehicle.behavior import IDMVehicle
from highway_env.vehicle.dynamics import BicycleVehicle
from highway_env.vehicle.kinematics import Vehicle
from highway_env.vehicle.objects import Landmark, Obstacle
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

__all__ = [
    "AxisLane",
    "CircularLane",
    "DynamicEgo",
    "FastNetwork",
    "FastRegulatedRoad",
    "FastRoad",
    "IDMVehicle",
    "KinematicEgo",
    "Obstacle",
    "SineLane",
    "StopSign",
    "Vehicle",
]

_TWO_PI = 2.0 * math.pi
_END_MARGIN_M = 5.0
"""A lane reaches a car length beyond both ends when highway-env asks what is on it."""


class StopSign(Landmark):
    """A stop sign: seen by the ego's controller, ignored by traffic, not solid."""


class AxisLane(StraightLane):
    """A straight lane along +x; its local coordinates need no dot products (and are equal to theirs to the bit)."""

    def local_coordinates(self, position: FloatArray) -> tuple[float, float]:
        """(longitudinal, lateral), metres, of a world position."""
        return float(position[0]) - float(self.start[0]), float(position[1]) - float(self.start[1])

    def distance_with_heading(self, position: FloatArray, heading: float | None, heading_weight: float = 1.0) -> float:
        """Distance to the lane, metres, plus the weighted heading error, rad."""
        s, r = self.local_coordinates(position)
        distance = abs(r) + max(s - self.length, 0) + max(0 - s, 0)
        if heading is None:
            return distance
        return distance + heading_weight * abs((heading + math.pi) % _TWO_PI - math.pi)


class FastNetwork(RoadNetwork):
    """Road network whose closest-lane search keeps its own flat list of lanes."""

    def __init__(self) -> None:
        super().__init__()
        self._flat: list[tuple[tuple[str, str, int], Any]] = []

    def freeze(self) -> None:
        """Build the flat list; call once the last lane is added."""
        self._flat = list(self.lanes_dict().items())

    def get_closest_lane_index(self, position: FloatArray, heading: float | None = None) -> tuple[str, str, int]:
        """Index of the lane with the smallest distance; the first of equals, in order of insertion."""
        best = self._flat[0][0]
        smallest = math.inf
        for index, lane in self._flat:
            distance = lane.distance_with_heading(position, heading)
            if distance < smallest:
                smallest, best = distance, index
        return best


class _Instant:
    """Positions along lanes at one instant, computed when first asked for."""

    def __init__(self, road: Any) -> None:
        self._entities: list[Any] = [e for e in [*road.vehicles, *road.objects] if not isinstance(e, Landmark)]
        self._on_lane: dict[int, tuple[list[float], list[Any]]] = {}
        self._along: dict[tuple[int, int], float] = {}

    def along(self, lane: Any, entity: Any) -> float:
        """Longitudinal coordinate of an entity on a lane."""
        key = (id(lane), id(entity))
        value = self._along.get(key)
        if value is None:
            value = self._along[key] = lane.local_coordinates(entity.position)[0]
        return value

    def on_lane(self, lane: Any) -> tuple[list[float], list[Any]]:
        """Entities on a lane, sorted by longitudinal coordinate (order of insertion among equals)."""
        found = self._on_lane.get(id(lane))
        if found is None:
            rows: list[tuple[float, int, Any]] = []
            end = lane.length + _END_MARGIN_M
            for i, entity in enumerate(self._entities):
                s, lateral = lane.local_coordinates(entity.position)
                self._along[id(lane), id(entity)] = s
                if abs(lateral) <= lane.width_at(s) / 2 + 1 and -_END_MARGIN_M <= s < end:
                    rows.append((s, i, entity))
            rows.sort(key=lambda row: row[:2])
            found = self._on_lane[id(lane)] = ([row[0] for row in rows], [row[2] for row in rows])
        return found

    def neighbours(self, vehicle: Any, lane: Any) -> tuple[Any, Any]:
        """(front, rear) of a vehicle projected on a lane, with highway-env's choice among equals."""
        coordinates, entities = self.on_lane(lane)
        s = self.along(lane, vehicle)
        split = bisect_left(coordinates, s)
        front = rear = None
        nearest: float | None = None
        for i in range(split, len(entities)):
            if entities[i] is vehicle:
                continue
            if nearest is not None and coordinates[i] > nearest:
                break
            nearest, front = coordinates[i], entities[i]
        nearest = None
        for i in range(split - 1, -1, -1):
            if nearest is not None and coordinates[i] < nearest:
                break
            nearest, rear = coordinates[i], entities[i]
        return front, rear


class _FastRoadMixin:
    """Neighbour search by instant and collision tests for close pairs only."""

    vehicles: list[Any]
    objects: list[Any]
    network: Any
    _instant: _Instant | None = None

    def forget_instant(self) -> None:
        """Drop cached positions; call after vehicles were added, removed or moved from outside."""
        self._instant = None

    @property
    def instant(self) -> _Instant:
        """Positions along lanes, valid until the next step."""
        if self._instant is None:
            self._instant = _Instant(self)
        return self._instant

    def neighbour_vehicles(self, vehicle: Any, lane_index: Any = None) -> tuple[Any, Any]:
        """(front, rear) of a vehicle on a lane, its own by default."""
        lane_index = lane_index or vehicle.lane_index
        if not lane_index:
            return None, None
        return self.instant.neighbours(vehicle, self.network.get_lane(lane_index))

    def move(self, dt: float) -> None:
        """Move every vehicle, then test the pairs that may touch, in highway-env's order."""
        vehicles, objects = self.vehicles, self.objects
        for vehicle in vehicles:
            vehicle.step(dt)
        self.forget_instant()
        entities = [*vehicles, *objects]
        positions = np.array([e.position for e in entities])
        half_diagonals = np.array([e.diagonal for e in entities]) / 2
        reach = np.array([v.speed * dt for v in vehicles])
        n = len(vehicles)
        delta = positions[:n, None, :] - positions[None, :, :]
        # 1 cm on top of highway-env's own bound: rounding here cannot lose a pair that it would test.
        bound = half_diagonals[:n, None] + half_diagonals[None, :] + reach[:, None] + 0.01
        close = (np.einsum("ijk,ijk->ij", delta, delta) <= bound * bound) & (bound > 0)
        rows, columns = np.nonzero(close)
        for i, j in zip(rows.tolist(), columns.tolist(), strict=True):
            if j > i:
                vehicles[i].handle_collisions(entities[j], dt)


class FastRoad(_FastRoadMixin, Road):
    """Road without regulation."""

    def step(self, dt: float) -> None:
        """Advance by `dt` seconds."""
        self.move(dt)


class FastRegulatedRoad(_FastRoadMixin, RegulatedRoad):
    """Road on which traffic yields by lane priority."""

    def step(self, dt: float) -> None:
        """Advance by `dt` seconds."""
        self.steps += 1
        if self.steps % int(1 / dt / self.REGULATION_FREQUENCY) == 0:
            self.enforce_road_rules()
        self.move(dt)


def _predict(vehicle: Any, times: FloatArray) -> tuple[list[FloatArray], list[float]]:
    """Positions and headings at constant steering and speed; the vehicle alone is copied, not the road with it."""
    ghost = copy.copy(vehicle)
    ghost.position = vehicle.position.copy()
    ghost.road = None
    ghost.impact = None if vehicle.impact is None else vehicle.impact.copy()
    ghost.action = {"acceleration": 0.0, "steering": vehicle.action["steering"]}
    positions: list[FloatArray] = []
    headings: list[float] = []
    for dt in np.diff(np.concatenate(([0.0], times))):
        ghost.step(dt)
        positions.append(ghost.position.copy())
        headings.append(ghost.heading)
    return positions, headings


class KinematicEgo(Vehicle):
    """The ego of the highways: kinematic bicycle, explicit Euler."""


class DynamicEgo(BicycleVehicle):
    """The ego of the intersection: dynamic bicycle, RK4, limited to 15 m/s as in LaMPilot."""

    MAX_SPEED: ClassVar[float] = 15.0

    def predict_trajectory_constant_speed(self, times: FloatArray) -> tuple[list[FloatArray], list[float]]:
        """Positions, m, and headings, rad, at the given times, s."""
        return _predict(self, times)
