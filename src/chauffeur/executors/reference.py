"""A path as controllers read it: evenly sampled, with headings and curvatures, and a speed at every place."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chauffeur.geometry import Polyline, wrap_to_pi

Array = NDArray[np.float64]

STEP_M: Final = 0.5
_SMOOTH_M: Final = 2.0
"""Curvatures are means over so much: a polyline has corners, a road has none."""
_BACK_M: Final = 1.0
_ON_M: Final = 8.0


class ReferencePlace(NamedTuple):
    """Beside a path: station, m; offset to its left, m; its heading there, rad; its curvature, 1/m."""

    station_m: float
    offset_m: float
    heading_rad: float
    curvature_per_m: float


class ReferencePath:
    """A path, and where along it the car is. Beyond its end it goes on straight."""

    def __init__(self, path: Polyline, speeds_mps: Sequence[float] | float) -> None:
        """Args: the path; target speed at each of its points, or everywhere."""
        count = max(2, math.ceil(path.length_m / STEP_M) + 1)
        self.stations = np.arange(count, dtype=np.float64) * STEP_M
        self.x, self.y, _ = path.poses(self.stations)
        legs = np.unwrap(np.arctan2(np.diff(self.y), np.diff(self.x)))
        joints = np.concatenate([[legs[0]], (legs[1:] + legs[:-1]) / 2.0, [legs[-1]]])
        turned = np.concatenate([[0.0], np.diff(legs), [0.0]]) / STEP_M
        width = max(1, round(_SMOOTH_M / STEP_M) | 1)
        padded = np.concatenate([np.zeros(width // 2), turned, np.zeros(width // 2)])
        self.heading = joints
        self.curvature = np.convolve(padded, np.ones(width) / width, mode="valid")
        self.length_m = path.length_m
        if isinstance(speeds_mps, int | float):
            self.speed = np.full(count, float(speeds_mps))
        else:
            self.speed = np.interp(self.stations, path.stations, np.asarray(speeds_mps))
        self._station: float | None = None

    def locate(self, x_m: float, y_m: float) -> ReferencePlace:
        """Locate a point relative to the path, searching near its last place."""
        if self._station is None:
            low, high = 0, len(self.x)
        else:
            low = max(0, int((self._station - _BACK_M) / STEP_M))
            high = min(len(self.x), int((self._station + _ON_M) / STEP_M) + 2)
        nearest = low + int(((self.x[low:high] - x_m) ** 2 + (self.y[low:high] - y_m) ** 2).argmin())
        heading = float(self.heading[nearest])
        dx, dy = x_m - float(self.x[nearest]), y_m - float(self.y[nearest])
        c, s = math.cos(heading), math.sin(heading)
        along, left = c * dx + s * dy, c * dy - s * dx
        bend = float(self.curvature[nearest])
        station = nearest * STEP_M + along
        self._station = min(max(station, 0.0), self.length_m)
        # To second order the path bends away from its tangent by kappa s^2 / 2.
        return ReferencePlace(station, left - 0.5 * bend * along * along, heading + bend * along, bend)

    def curvatures(self, stations_m: Array) -> Array:
        """Curvature, 1/m, at stations; 0 beyond the ends."""
        return np.interp(stations_m, self.stations, self.curvature, left=0.0, right=0.0)

    def speed_at(self, station_m: float) -> float:
        """Target speed, m/s."""
        return float(np.interp(station_m, self.stations, self.speed))

    def acceleration_at(self, station_m: float) -> float:
        """Feed-forward acceleration of the speed profile, v dv/ds, m/s2."""
        before, behind = (self.speed_at(station_m + way) for way in (-STEP_M, STEP_M))
        return (behind * behind - before * before) / (4.0 * STEP_M)

    def heading_error(self, heading_rad: float, place: ReferencePlace) -> float:
        """By how much a heading is turned to the left of the path's, rad."""
        return wrap_to_pi(heading_rad - place.heading_rad)
