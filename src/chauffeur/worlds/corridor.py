"""The ground a car will cover along a path, and who stands, drives or walks into it.

The corridor is the car's own rectangle at every quarter metre of the path. Somebody who is in it is ahead at the way
that is left until they would be touched. Somebody who is not yet in it, but will be when the car gets there if both go
on as they do, crosses; the car then has to stop before the place.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chauffeur.concept import VehicleState
from chauffeur.geometry import Polyline, wrap_to_pi

_Array = NDArray[np.float64]

STEP_M: Final = 0.25
_CROSSING_RAD: Final = math.radians(40.0)
"""Angle to the path beyond which an agent crosses it."""
_STILL_MPS: Final = 0.1
_DRIFT_MPS: Final = 0.3
_DRIFT_S: Final = 1.5
"""A car that moves sideways that fast is taken to be where that leads in this time."""
_LOOK_S: Final = 7.0
_EVERY_S: Final = 0.5
_CROSSES_WITHIN_M: Final = 45.0
_PICKING_UP_MPS2: Final = 1.5
"""Acceleration assumed of the car when it is asked which agents cross ahead of it."""


@dataclass(frozen=True, slots=True)
class Body:
    """The car that drives: its size, and how far its middle is ahead of its rear axle."""

    length_m: float
    width_m: float
    rear_to_middle_m: float

    @property
    def overhang_m(self) -> float:
        """From the rear axle to the front bumper."""
        return self.rear_to_middle_m + self.length_m / 2.0


class Ahead(NamedTuple):
    """An agent in the way.

    Attributes:
        id: Who.
        gap_m: Way left until they are touched.
        speed_mps: Their speed along the path; 0 for one that crosses, who goes first.
        crosses: Whether they are not in the way yet.
    """

    id: int
    gap_m: float
    speed_mps: float
    crosses: bool


class Corridor:
    """The ground along one path, for one body."""

    def __init__(self, path: Polyline, body: Body, side_m: float) -> None:
        """Args: path of the rear axle; the body; clear distance to be left at its sides."""
        self.path = path
        self._body = body
        x, y, heading = path.poses(path.every(STEP_M))
        self._cos, self._sin, self._heading = np.cos(heading), np.sin(heading), heading
        self._x = x + self._cos * body.rear_to_middle_m
        self._y = y + self._sin * body.rear_to_middle_m
        self._half_length, self._half_width = body.length_m / 2.0, body.width_m / 2.0 + side_m
        self._reach = math.hypot(self._half_length, self._half_width)

    def ahead(
        self,
        station_m: float,
        speed_mps: float,
        others: Sequence[VehicleState],
        *,
        within_m: float,
        target_mps: float,
        margin_s: float = 1.0,
    ) -> list[Ahead]:
        """Find the agents in the way from a station on.

        Args:
            station_m: Where the rear axle is along the path.
            speed_mps: The car's speed.
            others: Everybody else.
            within_m: How far ahead is looked.
            target_mps: Speed the car is going to pick up to.
            margin_s: Time by which a crossing agent must be missed.
        """
        first = max(0, min(int(station_m / STEP_M), len(self._x) - 1))
        last = min(len(self._x), first + math.ceil(within_m / STEP_M) + 1)
        found: list[Ahead] = []
        x, y = self._x[first], self._y[first]
        for other in others:
            travelled = max(other.speed_mps, 0.0) * _LOOK_S
            if math.hypot(other.x_m - x, other.y_m - y) > within_m + travelled + 2.0 * self._reach:
                continue
            one = self._meets(other, first, last, station_m)
            if one is None and abs(other.speed_mps) > _STILL_MPS:
                one = self._crosses(other, first, last, station_m, speed_mps, target_mps, margin_s)
            if one is not None:
                found.append(one)
        return found

    def _meets(self, other: VehicleState, first: int, last: int, station_m: float) -> Ahead | None:
        """Find an agent that is in the corridor, or drifts into it from the side."""
        index = self._first_touch(other, other.x_m, other.y_m, first, last)
        if index is None:
            if abs(other.speed_mps) < _DRIFT_MPS:
                return None
            near = self._nearest(other.x_m, other.y_m, first, last)
            c, s = float(self._cos[near]), float(self._sin[near])
            turned = wrap_to_pi(other.heading_rad - float(self._heading[near]))
            sideways = other.speed_mps * math.sin(turned)
            if abs(turned) > _CROSSING_RAD or abs(sideways) < _DRIFT_MPS:
                return None
            x, y = other.x_m - s * sideways * _DRIFT_S, other.y_m + c * sideways * _DRIFT_S
            index = self._first_touch(other, x, y, first, last)
            ahead = self._cos[first] * (other.x_m - self._x[first]) + self._sin[first] * (other.y_m - self._y[first])
            if index is None or ahead < 0.0:  # who comes in from behind has the car ahead of them
                return None
        turned = wrap_to_pi(other.heading_rad - float(self._heading[index]))
        crosses = _CROSSING_RAD < abs(turned) < math.pi - _CROSSING_RAD
        along = 0.0 if crosses else other.speed_mps * math.cos(turned)
        return Ahead(other.id, max((index - 1) * STEP_M - station_m, 0.0), min(along, max(other.speed_mps, 0.0)), False)

    def _crosses(
        self,
        other: VehicleState,
        first: int,
        last: int,
        station_m: float,
        speed_mps: float,
        target_mps: float,
        margin_s: float,
    ) -> Ahead | None:
        """Find an agent that will be in the corridor when the car gets there."""
        last = min(last, first + math.ceil(_CROSSES_WITHIN_M / STEP_M))
        near = self._nearest(other.x_m, other.y_m, first, last)
        if abs(wrap_to_pi(other.heading_rad - float(self._heading[near]))) < _CROSSING_RAD:
            end = min(near + math.ceil(self._body.length_m / STEP_M), last - 1)
            if abs(wrap_to_pi(other.heading_rad - float(self._heading[end]))) < _CROSSING_RAD:
                return None
        c, s = math.cos(other.heading_rad), math.sin(other.heading_rad)
        soonest: float | None = None
        meets = False
        for i in range(1, round(_LOOK_S / _EVERY_S) + 1):
            at_s = i * _EVERY_S
            way = other.speed_mps * at_s
            touched = self._touches(other, other.x_m + c * way, other.y_m + s * way, first, last)
            if touched is None:
                continue
            low, high = touched[0] * STEP_M, touched[1] * STEP_M
            soonest = low if soonest is None else min(soonest, low)
            earliest = station_m + _way(speed_mps, target_mps, max(at_s - margin_s, 0.0))
            latest = station_m + _way(speed_mps, target_mps, at_s + margin_s)
            meets = meets or (earliest <= high and latest >= low)
        if not meets or soonest is None:
            return None
        return Ahead(other.id, max(soonest - STEP_M - station_m, 0.0), 0.0, True)

    def _nearest(self, x: float, y: float, first: int, last: int) -> int:
        square = (self._x[first:last] - x) ** 2 + (self._y[first:last] - y) ** 2
        return first + int(square.argmin())

    def _first_touch(self, other: VehicleState, x: float, y: float, first: int, last: int) -> int | None:
        touched = self._touches(other, x, y, first, last)
        return None if touched is None else touched[0]

    def _touches(self, other: VehicleState, x: float, y: float, first: int, last: int) -> tuple[int, int] | None:
        """First and last place of the path at which the car, widened, would overlap an agent at (x, y)."""
        dx, dy = x - self._x[first:last], y - self._y[first:last]
        long, wide = other.length_m / 2.0, other.width_m / 2.0
        near = np.flatnonzero(dx * dx + dy * dy < (self._reach + math.hypot(long, wide)) ** 2)
        if not len(near):
            return None
        dx, dy = dx[near], dy[near]
        c, s = self._cos[first:last][near], self._sin[first:last][near]
        oc, os = math.cos(other.heading_rad), math.sin(other.heading_rad)
        cos, sin = np.abs(c * oc + s * os), np.abs(c * os - s * oc)
        apart = (
            (np.abs(c * dx + s * dy) >= self._half_length + long * cos + wide * sin)
            | (np.abs(c * dy - s * dx) >= self._half_width + long * sin + wide * cos)
            | (np.abs(oc * dx + os * dy) >= long + self._half_length * cos + self._half_width * sin)
            | (np.abs(oc * dy - os * dx) >= wide + self._half_length * sin + self._half_width * cos)
        )
        touched = near[~apart]
        return None if not len(touched) else (first + int(touched[0]), first + int(touched[-1]))


def _way(speed_mps: float, target_mps: float, seconds: float) -> float:
    """Way in a time, picking up to a speed."""
    if speed_mps >= target_mps:
        return speed_mps * seconds
    rise_s = min(seconds, (target_mps - speed_mps) / _PICKING_UP_MPS2)
    return speed_mps * seconds + _PICKING_UP_MPS2 * rise_s * (seconds - rise_s / 2.0)
