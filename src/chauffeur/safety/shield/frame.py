"""The scene of the shield: the others in the frame of the lane the ego is in, and the lanes beside it.

s runs along the ego's lane, d across it, to the left. A lane that bends is taken to go on as the circle it is where
the ego is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from chauffeur.concept import Lane, LaneId, Observation, RoadGraph, VehicleState
from chauffeur.geometry import Pose, wrap_to_pi
from chauffeur.safety.shield.traffic_arrays import ANYWHERE, Array, TrafficArrays, overlapping, placed

CROSSING_RAD: Final = math.radians(40.0)
"""A vehicle turned by less runs along: a lead, a follower, a car that changes lanes. Any other crosses."""
_CROSSING_SINE: Final = math.sin(CROSSING_RAD)
_LANE_M: Final = 4.0
"""Width that a drifting vehicle claims on that side."""


@dataclass(frozen=True, slots=True)
class Strip:
    """A lane where the ego is: its centre and edges across, m from the ego's own lane centre."""

    lane: LaneId
    centre_m: float
    low_m: float
    high_m: float


@dataclass(frozen=True, slots=True)
class ShieldBody:
    """A vehicle or obstacle in the frame.

    Attributes:
        id: As in the observation.
        s_m, d_m: Centre, from the ego along and from its lane centre across.
        heading_rad: Against the lane.
        along_mps, across_mps: Speeds.
        half_length_m, half_width_m: Half its extent along and across, turned as it is.
    """

    id: int
    s_m: float
    d_m: float
    heading_rad: float
    along_mps: float
    across_mps: float
    half_length_m: float
    half_width_m: float

    @property
    def crosses(self) -> bool:
        """True if it crosses the lane rather than drive along it."""
        return abs(math.sin(self.heading_rad)) > _CROSSING_SINE

    def gap_m(self, other: ShieldBody) -> float:
        """Clear distance along the lane between the ego and another; negative beside each other."""
        return abs(other.s_m) - self.half_length_m - other.half_length_m


@dataclass(frozen=True, slots=True, eq=False)
class ShieldScene:
    """The ego, the others and the lanes, leftmost first, in the ego lane's frame; its curvature in 1/m, to the left."""

    ego: ShieldBody
    strips: tuple[Strip, ...]
    speed_limit_mps: float
    curvature: float
    solid: tuple[VehicleState, ...]
    """The ego and the others as in the observation, and in `rows` their numbers in the frame (`everybody.placed`)."""
    rows: Array

    @property
    def others(self) -> tuple[ShieldBody, ...]:
        """Everybody but the ego."""
        return tuple(_bodies(self.rows[1:], self.solid))

    def within(
        self,
        span: tuple[float, float],
        side_m: float,
        drift_mps: float,
        where: int = ANYWHERE,
        reach_m: float = math.inf,
    ) -> list[ShieldBody]:
        """Those who are, or are on their way, within a span of the road, up to a clear distance to its side.

        Args:
            span: (lowest, highest) place across the road, m from the centre of the ego's lane.
            side_m: That distance.
            drift_mps: Who moves sideways faster and does not cross claims the width of a lane more.
            where: Ahead, behind, or anywhere.
            reach_m: Those farther away along the lane than this, end to end, are left out.
        """
        found = overlapping(self.rows, span[0], span[1], side_m, drift_mps, _LANE_M, where, reach_m)
        return _bodies(found, self.solid)


def _bodies(rows: Array, solid: tuple[VehicleState, ...]) -> list[ShieldBody]:
    return [ShieldBody(solid[int(i)].id, *numbers) for i, *numbers, _ in rows.tolist()]


_EVERY_M: Final = 2.0
"""The lane's frame is found anew every so many metres."""
_PREVIEW_M: Final = 3.0
"""Way over which a lane's bend is measured."""
_STRAIGHT: Final = 1e-3
"""Curvature, 1/m, below which a lane is straight."""


@dataclass(frozen=True, slots=True)
class _Frame:
    """Origin on the ego's lane, its direction, and the strips of the same road there."""

    strips: tuple[Strip, ...]
    limit_mps: float
    curvature: float
    numbers: Array
    """The frame as `everybody.placed` wants it."""


class ShieldLens:
    """Looks at one trip's observations: it keeps the frame from one to the next while the ego has not got far."""

    def __init__(self) -> None:
        self._road: RoadGraph | None = None
        self._place: tuple[LaneId, int, int] | None = None
        self._frame: _Frame | None = None

    def look(
        self, observation: Observation, lane: LaneId | None, around: TrafficArrays | None = None
    ) -> ShieldScene | None:
        """The scene in the frame of a lane, mostly the ego's own; None where there is no such lane.

        Args:
            observation: The instant.
            lane: Whose frame.
            around: Everybody of the observation, where that is known already.
        """
        ego = observation.ego
        if lane is None:
            return None
        place = lane, round(ego.x_m / _EVERY_M), round(ego.y_m / _EVERY_M)
        if place != self._place or observation.road is not self._road:
            self._road, self._place = observation.road, place
            self._frame = _frame_at(observation.road, *place)
        frame = self._frame
        if frame is None:
            return None
        around = TrafficArrays.of(observation) if around is None else around
        rows = placed(around.numbers, frame.numbers)
        return ShieldScene(
            _bodies(rows[:1], around.solid)[0], frame.strips, frame.limit_mps, frame.curvature, around.solid, rows
        )


def _frame_at(road: RoadGraph, lane: LaneId, cell_x: int, cell_y: int) -> _Frame | None:
    own = road.get(lane)
    if own is None:
        return None
    here = _beside(own, cell_x * _EVERY_M, cell_y * _EVERY_M)
    c, s = math.cos(here.heading_rad), math.sin(here.heading_rad)
    strips: list[Strip] = []
    for beside in road.abreast(lane):
        there = _beside(beside, here.x_m, here.y_m)
        centre = -s * (there.x_m - here.x_m) + c * (there.y_m - here.y_m)
        strips.append(Strip(beside.id, centre, centre - beside.width_m / 2.0, centre + beside.width_m / 2.0))
    strips.sort(key=lambda strip: -strip.centre_m)
    ahead = _beside(own, here.x_m + _PREVIEW_M * c, here.y_m + _PREVIEW_M * s)
    curvature = wrap_to_pi(ahead.heading_rad - here.heading_rad) / _PREVIEW_M
    if abs(curvature) < _STRAIGHT:
        curvature = 0.0
    numbers = np.array([here.x_m, here.y_m, here.heading_rad, c, s, curvature, _CROSSING_SINE])
    return _Frame(tuple(strips), own.speed_limit_mps, curvature, numbers)


def _beside(lane: Lane, x_m: float, y_m: float) -> Pose:
    """The point of a lane's middle closest to a place; its ends go on straight, a corner ends the leg before."""
    return lane.centre.at(math.nextafter(lane.centre.nearest(x_m, y_m), -math.inf))
