"""Roads over one another: who is on a bridge is neither seen from the street under it nor touched there.

The road graph is plane. What tells levels apart is the elevation of the OpenDRIVE file.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from chauffeur.geometry import LaneId
from chauffeur.geometry.opendrive import OpenDriveMap

APART_M: Final = 3.0
"""Height difference that makes another level: no car is as high."""
STEEPEST: Final = 0.12
"""Grade up to which a road ahead is still the same level: 12 %, the most of urban design guides."""
_CELL_M: Final = 8.0
_SAMPLE_M: Final = 6.0
_NEAR_M: Final = 130.0
_MARGIN_M: Final = 1e-6


class Levels:
    """Heights of a town's lanes, asked for only where roads lie over one another."""

    def __init__(self, town: OpenDriveMap) -> None:
        self._town = town
        self._known: dict[tuple[LaneId, int], float] = {}
        self._spans: dict[LaneId, tuple[float, float]] = {}
        self._seen_from = (math.inf, math.inf, 0.0, False)
        self._crossings = np.array(sorted(_over_one_another(town)), dtype=np.float64).reshape(-1, 2)

    def near(self, x_m: float, y_m: float) -> bool:
        """True if roads lie over one another within sight."""
        x, y, lasts_m, found = self._seen_from
        if math.hypot(x - x_m, y - y_m) >= lasts_m:
            away = np.hypot(self._crossings[:, 0] - x_m, self._crossings[:, 1] - y_m)
            closest = float(away.min()) if len(away) else math.inf
            found = closest < _NEAR_M
            self._seen_from = x_m, y_m, abs(closest - _NEAR_M) - _MARGIN_M, found
        return found

    def all_level(self, lane: LaneId, station_m: float, other: LaneId) -> bool:
        """True if no place of another lane is on another level than one of a lane, however near."""
        low, high = self._span(other)
        here = self._height_m(lane, station_m)
        return here - low <= APART_M and high - here <= APART_M

    def apart(self, lane: LaneId, station_m: float, other: LaneId, other_station_m: float, away_m: float) -> bool:
        """True if two places so far from each other in the plane are on different levels."""
        rise = abs(self._height_m(lane, station_m) - self._height_m(other, other_station_m))
        return rise > APART_M + STEEPEST * away_m

    def _span(self, lane: LaneId) -> tuple[float, float]:
        """Least and greatest height that `_height_m` says of a lane."""
        found = self._spans.get(lane)
        if found is None:
            last = math.ceil(self._town.road[lane].length_m / 2.0) + 1
            heights = [self._height_m(lane, 2.0 * key) for key in range(last + 1)]
            found = self._spans[lane] = min(heights), max(heights)
        return found

    def _height_m(self, lane: LaneId, station_m: float) -> float:
        key = lane, round(station_m / 2.0)
        found = self._known.get(key)
        if found is None:
            station = min(2.0 * key[1], self._town.road[lane].length_m)
            found = self._known[key] = self._town.elevation(lane, station)
        return found


def _over_one_another(town: OpenDriveMap) -> set[tuple[float, float]]:
    """Places of the plane that lanes pass at heights apart."""
    heights: dict[tuple[int, int], tuple[float, float]] = {}
    for x, y, height in _samples(town):
        cell = math.floor(x / _CELL_M), math.floor(y / _CELL_M)
        low, high = heights.get(cell, (height, height))
        heights[cell] = min(low, height), max(high, height)
    return {
        (_CELL_M * (i + 0.5), _CELL_M * (j + 0.5)) for (i, j), (low, high) in heights.items() if high - low > APART_M
    }


def _samples(town: OpenDriveMap) -> Iterator[tuple[float, float, float]]:
    for lane in town.road.lanes:
        if lane.kind != "driving":
            continue
        for station in np.linspace(0.0, lane.length_m, max(2, math.ceil(lane.length_m / _SAMPLE_M) + 1)).tolist():
            pose = lane.centre.at(station)
            yield pose.x_m, pose.y_m, town.elevation(lane.id, station)
