"""Stop lines: which of them the ego has stopped at, and how hard it may still accelerate before one that it has not.

The shield believes nobody who says that a sign is served: it watches. A stop is one near the line (`stops_at_sign`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from chauffeur.concept import Observation, RoadGraph, VehicleState, stops_at_sign
from chauffeur.safety.shield.gaps import greatest_acceleration
from chauffeur.safety.shield.table import ShieldParameters

_ALONG: Final = math.cos(math.radians(60.0))
"""A vehicle turned further against the lane of a line does not approach it."""
_LANES: Final = 1.5
"""A line holds for who passes it this many lane widths beside the middle of its lane: nobody drives around it."""
_OVER_M: Final = 0.5
"""A front bumper farther over a line than this has passed it."""


@dataclass(frozen=True, slots=True)
class _Line:
    """A line across a lane: its middle, the lane's direction there, and how far to either side it holds."""

    x_m: float
    y_m: float
    cos: float
    sin: float
    reach_m: float


class StopLines:
    """The stop lines of one trip, an instant at a time."""

    def __init__(self, table: ShieldParameters, dt_s: float) -> None:
        self._table, self._dt_s = table, dt_s
        self._lines: dict[int, tuple[VehicleState, _Line | None]] = {}
        """By the sign's id, with the sign as it was seen: one that moved has another line."""
        self._served: set[int] = set()

    def ahead_m(self, observation: Observation) -> float:
        """Way from the front bumper to the nearest line ahead that is not served; infinite where there is none.

        Every instant has to be shown: who stops is seen here.
        """
        nearest = math.inf
        ego = observation.ego
        for sign in observation.objects:
            if sign.kind != "stop_sign":
                continue
            seen, line = self._lines.get(sign.id, (None, None))
            if seen != sign:
                line = _line_of(sign, observation.road)
                self._lines[sign.id] = sign, line
            if line is None:
                continue
            dx, dy = line.x_m - ego.x_m, line.y_m - ego.y_m
            ahead = line.cos * dx + line.sin * dy
            aside = abs(line.cos * dy - line.sin * dx) > line.reach_m
            away = line.cos * math.cos(ego.heading_rad) + line.sin * math.sin(ego.heading_rad) < _ALONG
            if aside or away:
                continue
            if stops_at_sign(ego.speed_mps, ahead):
                self._served.add(sign.id)
            front = ahead - ego.length_m / 2.0
            if sign.id not in self._served and front >= -_OVER_M:
                nearest = min(nearest, max(front, 0.0))
        return nearest

    def most_mps2(self, speed_mps: float, ahead_m: float) -> float:
        """Hardest acceleration after which the car still stops before a line, braking gently.

        It brakes harder where that is not enough, and not at all for a line it could only come to a stand behind: in
        the middle of a crossing.
        """
        table = self._table
        if math.isinf(ahead_m):
            return math.inf
        left = ahead_m - 0.5 * speed_mps * self._dt_s
        needed = speed_mps**2 / (2.0 * left) if left > 0.0 else math.inf
        if needed <= table.gentle_mps2:
            return greatest_acceleration(
                speed_mps, ahead_m, 0.0, table.gentle_mps2, table.others_braking_mps2, self._dt_s
            )
        return -needed if needed <= table.braking_mps2 else math.inf


def _line_of(sign: VehicleState, road: RoadGraph) -> _Line | None:
    """The line of a sign; None where its lane is not known."""
    lane = road.get(sign.lane)
    if lane is None:
        return None
    here = lane.centre.at(lane.centre.nearest(sign.x_m, sign.y_m))
    return _Line(here.x_m, here.y_m, math.cos(here.heading_rad), math.sin(here.heading_rad), _LANES * lane.width_m)
