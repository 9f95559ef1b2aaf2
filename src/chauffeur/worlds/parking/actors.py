"""Moving agents of a lot: a car on its way out, and people on foot. They mind the ego as people do."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from chauffeur.concept import LaneId, VehicleState
from chauffeur.geometry import Box, overlap
from chauffeur.worlds.corridor import Body
from chauffeur.worlds.parking.routes import Way
from chauffeur.worlds.path_follower import Chassis, Follower, Look

CAR: Final = Chassis(Body(4.5, 1.85, 1.3), 2.6, 0.6, 1.2)
WALKER_M: Final = 0.6
_LOOK: Final = Look(3.0, 1.0)
_WALKS_MPS: Final = 1.2
_SHY_M: Final = 0.7
"""Distance that pedestrians keep from a moving car."""
_PASSING_M: Final = 0.2
"""The same from a standing one."""
_TOUCH_M: Final = 0.02
_STANDS_MPS: Final = 0.1
_PREVIEW_S: Final = 0.5
_PATIENCE_S: Final = 3.0
"""After this time in front of a car they turn round."""


class CarMoved(NamedTuple):
    """Mutable state of a car that leaves: way driven, speed, whether it has crashed, where its follower has it."""

    station_m: float
    speed_mps: float
    crashed: bool
    located_m: float | None


@dataclass(slots=True)
class LeavingCar:
    """A car that drives to the exit. It keeps exactly to its path, and is gone at the end of it."""

    id: int
    way: Way
    station_m: float
    target_mps: float
    lane: LaneId
    speed_mps: float = 0.0
    crashed: bool = False
    _follower: Follower = field(init=False)

    def __post_init__(self) -> None:
        """Take up the path."""
        self._follower = Follower(CAR, 0.1, jam_m=1.5)
        self._follower.take(self.way.path, self.way.room_m)

    @property
    def gone(self) -> bool:
        """True if it has left the lot."""
        return self.station_m > self.way.path.length_m - 1.5

    def state(self) -> VehicleState:
        """As others see it."""
        pose = self.way.path.at(self.station_m)
        middle = pose.ahead(CAR.body.rear_to_middle_m)
        return VehicleState(
            self.id,
            "car",
            middle.x_m,
            middle.y_m,
            pose.heading_rad,
            self.speed_mps,
            CAR.body.length_m,
            CAR.body.width_m,
            self.lane,
            self.crashed,
        )

    def decide(self, others: Sequence[VehicleState]) -> float:
        """Acceleration for the next period, m/s2."""
        if self.crashed:
            return -8.0
        return self._follower.command(self.state(), others, _LOOK, self.target_mps, 1.5).acceleration_mps2

    def move(self, acceleration: float, dt_s: float) -> None:
        """Go on for a moment."""
        speed = max(0.0, self.speed_mps + acceleration * dt_s)
        self.station_m += (self.speed_mps + speed) / 2.0 * dt_s
        self.speed_mps = speed

    def copy(self) -> LeavingCar:
        """The same car, to be moved on its own."""
        return self.moved_to(self.moved())

    def moved(self) -> CarMoved:
        """All of it that changes from step to step."""
        return CarMoved(self.station_m, self.speed_mps, self.crashed, self._follower.located_m)

    def moved_to(self, moved: CarMoved) -> LeavingCar:
        """The same car at another instant."""
        twin = LeavingCar(
            self.id, self.way, moved.station_m, self.target_mps, self.lane, moved.speed_mps, moved.crashed
        )
        twin._follower.located_m = moved.located_m
        return twin


@dataclass(slots=True)
class LotWalker:
    """Somebody who walks to and fro between two places, and lets cars that are close go first.

    Attributes:
        id: As in the observation.
        from_m, to_m: The two places.
        pause_s: How long they stay at each.
        way_m: How far they are from `from_m`.
        outward: Whether they walk, or will next, towards `to_m`.
        waits_s: How long they still stay.
        walks: Whether they walked in the last period.
        kept_s: How long a car has been in their way.
    """

    id: int
    from_m: tuple[float, float]
    to_m: tuple[float, float]
    pause_s: float
    way_m: float = 0.0
    outward: bool = True
    waits_s: float = 0.0
    walks: bool = False
    kept_s: float = 0.0
    crashed: bool = False

    @property
    def _heading(self) -> float:
        (ax, ay), (bx, by) = self.from_m, self.to_m
        return math.atan2(by - ay, bx - ax) if self.outward else math.atan2(ay - by, ax - bx)

    def _place(self, way_m: float) -> tuple[float, float]:
        (ax, ay), (bx, by) = self.from_m, self.to_m
        share = way_m / math.dist(self.from_m, self.to_m)
        return ax + share * (bx - ax), ay + share * (by - ay)

    def state(self) -> VehicleState:
        """As others see them."""
        x, y = self._place(self.way_m)
        speed = _WALKS_MPS if self.walks else 0.0
        return VehicleState(self.id, "obstacle", x, y, self._heading, speed, WALKER_M, WALKER_M, None, self.crashed)

    def decide(self, cars: Sequence[VehicleState], dt_s: float) -> None:
        """Decide whether to walk in the next period."""
        if self.waits_s > 0.0:
            self.waits_s, self.walks = self.waits_s - dt_s, False
            return
        step = _WALKS_MPS * _PREVIEW_S * (1.0 if self.outward else -1.0)
        here, there = self._place(self.way_m), self._place(self.way_m + step)
        at_once = _WALKS_MPS * dt_s * (1.0 if self.outward else -1.0)
        next_ground = Box(*self._place(self.way_m + at_once), self._heading, WALKER_M, WALKER_M)
        self.walks = not self.crashed
        for car in cars:
            c, s = math.cos(car.heading_rad), math.sin(car.heading_rad)
            shy = _SHY_M if abs(car.speed_mps) > _STANDS_MPS else _PASSING_M + WALKER_M / 2.0
            rolls = max(car.speed_mps, 0.0) * _PREVIEW_S
            ground = Box(
                car.x_m + c * rolls / 2.0,
                car.y_m + s * rolls / 2.0,
                car.heading_rad,
                car.length_m + rolls + 2.0 * shy,
                car.width_m + 2.0 * shy,
            )
            nearer = math.dist(there, (car.x_m, car.y_m)) < math.dist(here, (car.x_m, car.y_m))
            if (nearer and ground.holds(*there)) or overlap(next_ground, car.box.grown(_TOUCH_M)):
                self.walks = False
        self.kept_s = 0.0 if self.walks else self.kept_s + dt_s
        if self.kept_s > _PATIENCE_S:
            self.outward, self.kept_s = not self.outward, 0.0

    def move(self, dt_s: float) -> None:
        """Go on for a moment; turn round at either place."""
        if not self.walks:
            return
        step = _WALKS_MPS * dt_s
        length = math.dist(self.from_m, self.to_m)
        self.way_m += step if self.outward else -step
        if self.way_m >= length or self.way_m <= 0.0:
            self.way_m = max(0.0, min(length, self.way_m))
            self.outward, self.waits_s, self.walks = self.way_m <= 0.0, self.pause_s, False
