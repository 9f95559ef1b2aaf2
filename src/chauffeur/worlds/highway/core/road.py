"""A scene in motion, as arrays: what the highway world, its perception and its driver work on."""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from chauffeur.concept import DataError, LaneId
from chauffeur.worlds.highway.core import lanes as geometry
from chauffeur.worlds.highway.core import layout as at
from chauffeur.worlds.highway.core import signals, traffic
from chauffeur.worlds.highway.core.build import CoreRoadMap, Floats, Ints, map_network, place_entities
from chauffeur.worlds.highway.roads import HighwayScene, crowded_rows


class CoreRoad:
    """Road and traffic, stepped in compiled code. Rows are entity ids: 0 the ego, then other vehicles, then objects.

    Attributes:
        road: The road as arrays, shared by copies.
        floats, ints, scene, order: The state (layout.py).
        out: What the last step or `report` read off (layout.py, `OUT_*`).
    """

    __slots__ = ("floats", "ints", "order", "out", "road", "scene")

    def __init__(self, road: CoreRoadMap, floats: Floats, ints: Ints, scene: Ints) -> None:
        self.road = road
        self.floats = floats
        self.ints = ints
        self.scene = scene
        self.order: NDArray[np.int64] = np.zeros(0, dtype=np.int64)
        self.out: Floats = np.zeros(at.OUT_FLOATS)
        self._list_solid()

    @classmethod
    def of(cls, scene: HighwayScene) -> Self:
        """Arrays of a scene just built."""
        road = map_network(scene.network)
        return cls(road, *place_entities(scene, road))

    def make_ready(self) -> None:
        """Have every kernel in machine code, on a copy: loading one takes longer than a control period may."""
        twin = self.copy()
        twin.advance(0.0, 0.0)
        twin.neighbours(0, 0)
        twin.lane_heading(0, 0)
        twin.reachable(0)
        twin.blocker(0, vehicles=True)
        twin.follow(0, -1, 10.0, 1.5)
        twin.traffic_idm(0, -1)
        twin.gap(0, 0)
        twin.steer(0)
        x = float(twin.road.lanes[0, at.LANE_LENGTH]) + 1e4
        twin.floats[0, at.X] = twin.floats[0, at.Y] = x
        for lane in range(len(twin.road.lanes)):  # past the end of at least one of them
            twin.next_lane(lane)

    def copy(self) -> Self:
        """The same instant, to be stepped on its own."""
        twin = object.__new__(type(self))
        twin.road = self.road
        twin.floats, twin.ints, twin.scene = self.floats.copy(), self.ints.copy(), self.scene.copy()
        twin.order, twin.out = self.order.copy(), self.out.copy()
        return twin

    def state(self) -> bytes:
        """All that changes from step to step, as bytes: arrays one after the other, of sizes that stay in a trip."""
        return b"".join(array.tobytes() for array in self._arrays())

    def adopt(self, state: bytes) -> None:
        """Take over a state of the same scene. Raises DataError if sizes differ; nothing is changed then."""
        arrays = self._arrays()
        if len(state) != sum(array.nbytes for array in arrays):
            raise DataError("A state of another scene.")
        at_byte = 0
        for array in arrays:
            array[...] = np.frombuffer(state, array.dtype, array.size, at_byte).reshape(array.shape)
            at_byte += array.nbytes

    def _arrays(self) -> tuple[NDArray[Any], ...]:
        return self.floats, self.ints, self.scene, self.order, self.out

    def _list_solid(self) -> None:
        solid = np.flatnonzero(self.ints[:, at.KIND] != at.SIGN)
        self.order = solid[np.argsort(self.floats[solid, at.X], kind="stable")].astype(np.int64)
        self.scene[at.SOLID] = len(self.order)

    def advance(self, acceleration_mps2: float, steering_rad: float, ticks: int = 1) -> None:
        """Step under one ego action and report."""
        signals.advance(
            self.road.lanes,
            self.road.traits,
            self.road.roads,
            self.floats,
            self.ints,
            self.scene,
            self.order,
            self.out,
            float(acceleration_mps2),
            float(steering_rad),
            ticks,
            at.DT_S,
        )

    def report(self) -> None:
        """Read the present instant into `out`."""
        traffic.sort_along(self.floats, self.order, self.scene)
        signals.report(self.road.lanes, self.road.traits, self.floats, self.ints, self.scene, self.order, self.out)

    def admit_ego(self) -> None:
        """Let the ego enter, and take the cars away that are too close to it."""
        vehicles = int(self.scene[at.VEHICLES])
        positions = [(float(x), float(y)) for x, y in self.floats[1:vehicles, : at.Y + 1]]
        removed = crowded_rows(positions, (float(self.floats[0, at.X]), float(self.floats[0, at.Y])))
        keep = np.delete(np.arange(len(self.floats)), [1 + i for i in removed])
        self.floats, self.ints = self.floats[keep].copy(), self.ints[keep].copy()
        self.scene[at.VEHICLES] -= len(removed)
        self.scene[at.ENTITIES] -= len(removed)
        self.scene[at.EGO_PRESENT] = 1
        self._list_solid()

    @property
    def vehicles(self) -> int:
        """Number of vehicles, the ego included."""
        return int(self.scene[at.VEHICLES])

    def lane_name(self, row: int) -> LaneId:
        """Name of a lane."""
        return self.road.lane_ids[row]

    def lane_of(self, i: int) -> int:
        """Row of the closest lane of an entity."""
        return int(self.ints[i, at.LANE])

    def neighbours(self, i: int, lane: int) -> tuple[int, int]:
        """Nearest solid entities ahead of and behind `i` on a lane, -1 for none."""
        return traffic.neighbours(
            self.road.lanes, self.road.traits, self.floats, self.ints, self.scene, self.order, i, lane
        )

    def gap(self, i: int, j: int) -> float:
        """Signed distance from `i` to `j` along the lane of `i`, m."""
        return traffic.gap(self.road.lanes, self.road.traits, self.floats, self.ints, i, j)

    def along(self, lane: int, i: int) -> float:
        """Longitudinal coordinate of an entity on a lane, m."""
        return geometry.along(self.road.lanes, self.road.traits, lane, self.floats[i, at.X], self.floats[i, at.Y])

    def lane_heading(self, lane: int, i: int) -> float:
        """Heading of a lane where an entity is along it, rad."""
        return geometry.heading_at(self.road.lanes, self.road.traits, lane, self.along(lane, i))

    def reachable(self, lane: int) -> bool:
        """True if the ego may change to a lane from where it is."""
        return bool(
            geometry.reachable(self.road.lanes, self.road.traits, lane, self.floats[0, at.X], self.floats[0, at.Y])
        )

    def blocker(self, served: int, *, vehicles: bool) -> int:
        """Nearest stop sign or vehicle ahead on the ego's lane, -1 for none; `served` has a bit for each object."""
        return signals.blocker(self.road.lanes, self.road.traits, self.floats, self.ints, self.scene, served, vehicles)

    def follow(self, i: int, front: int, target_speed_mps: float, headway_s: float) -> float:
        """IDM acceleration with LaMPilot's ego parameters, m/s2."""
        return signals.follow(
            self.road.lanes, self.road.traits, self.floats, self.ints, i, front, target_speed_mps, headway_s
        )

    def traffic_idm(self, i: int, front: int) -> float:
        """IDM acceleration of a car of the traffic, m/s2."""
        exponent = self.floats[i, at.EXPONENT]
        return traffic.idm(self.road.lanes, self.road.traits, self.floats, self.ints, exponent, i, front)

    def steer(self, lane: int) -> float:
        """Steering angle that brings the ego onto a lane's centre, rad."""
        return traffic.steer_to(self.road.lanes, self.road.traits, self.floats, 0, lane)

    def next_lane(self, lane: int) -> int:
        """Lane the ego follows from here: itself, or past its end the next one on its route."""
        road, x, y = self.road, self.floats[0, at.X], self.floats[0, at.Y]
        if not geometry.after_end(road.lanes, road.traits, lane, x, y):
            return lane
        planned = geometry.planned_road(road.traits, road.roads, self.ints, 0, lane)
        return geometry.next_lane(road.lanes, road.traits, road.roads, lane, planned, x, y)

    def plan_route(self, legs: list[int]) -> None:
        """Roads the ego takes from here."""
        legs = legs[: at.ROUTE_LEGS]
        self.ints[0, at.ROUTE_AT], self.ints[0, at.ROUTE_END] = 0, len(legs)
        self.ints[0, at.ROUTE : at.ROUTE + len(legs)] = legs
