"""What the shield sees: the others in the frame of the lane the ego is in, and the lanes beside it.

s runs along the ego's lane, d across it, towards where headings grow: on highway roads, whose y grows to the right of
travel, the side with the higher lane index. A lane that bends is taken to go on as the circle it is where the ego is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from chauffeur.concept import LaneId, LaneView, Snapshot, VehicleState
from chauffeur.geometry import wrap_to_pi
from chauffeur.safety.shield.everybody import ANYWHERE, Array, Everybody, overlapping, placed

CROSSING_RAD: Final = math.radians(40.0)
"""What is turned by less runs along: a lead, a follower, a car that changes lanes. What is turned further crosses."""
_CROSSING_SINE: Final = math.sin(CROSSING_RAD)
_LANE_M: Final = 4.0
"""Who drifts claims so much more to that side."""


@dataclass(frozen=True, slots=True)
class Strip:
    """A lane where the ego is: its centre and edges across, m from the ego's own lane centre."""

    lane: LaneId
    centre_m: float
    low_m: float
    high_m: float


@dataclass(frozen=True, slots=True)
class Body:
    """A vehicle or obstacle in the frame.

    Attributes:
        id: As in the snapshot.
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
        """Whether it crosses the lane rather than drive along it."""
        return abs(math.sin(self.heading_rad)) > _CROSSING_SINE

    def gap_m(self, other: Body) -> float:
        """Clear distance along the lane between the ego and another; negative beside each other."""
        return abs(other.s_m) - self.half_length_m - other.half_length_m


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """The ego, the others and the lanes, in the ego lane's frame; its curvature in 1/m grows with headings."""

    ego: Body
    strips: tuple[Strip, ...]
    speed_limit_mps: float
    curvature: float
    solid: tuple[VehicleState, ...]
    """The ego and the others as in the snapshot, and in `rows` their numbers in the frame (`everybody.placed`)."""
    rows: Array

    @property
    def others(self) -> tuple[Body, ...]:
        """Everybody but the ego."""
        return tuple(_bodies(self.rows[1:], self.solid))

    def within(
        self,
        span: tuple[float, float],
        side_m: float,
        drift_mps: float,
        where: int = ANYWHERE,
        reach_m: float = math.inf,
    ) -> list[Body]:
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


def _bodies(rows: Array, solid: tuple[VehicleState, ...]) -> list[Body]:
    return [Body(solid[int(i)].id, *numbers) for i, *numbers, _ in rows.tolist()]


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


class Lens:
    """Looks at one trip's snapshots: it keeps the frame from one to the next while the ego has not got far."""

    def __init__(self) -> None:
        self._lanes: tuple[LaneView, ...] = ()
        self._place: tuple[LaneId, int, int] | None = None
        self._frame: _Frame | None = None

    def look(self, snapshot: Snapshot, lane: LaneId | None, around: Everybody | None = None) -> Scene | None:
        """The scene in the frame of a lane, mostly the ego's own; None where there is no such lane.

        Args:
            snapshot: The instant.
            lane: Whose frame.
            around: Everybody of the snapshot, where that is known already.
        """
        ego = snapshot.ego
        if lane is None:
            return None
        place = lane, round(ego.x_m / _EVERY_M), round(ego.y_m / _EVERY_M)
        if place != self._place or snapshot.lanes is not self._lanes:
            self._lanes, self._place = snapshot.lanes, place
            self._frame = _frame_at(snapshot.lanes, *place)
        frame = self._frame
        if frame is None:
            return None
        around = Everybody.of(snapshot) if around is None else around
        rows = placed(around.numbers, frame.numbers)
        return Scene(
            _bodies(rows[:1], around.solid)[0], frame.strips, frame.limit_mps, frame.curvature, around.solid, rows
        )


def _frame_at(lanes: tuple[LaneView, ...], own: LaneId, cell_x: int, cell_y: int) -> _Frame | None:
    beside = {lane.id: lane for lane in lanes if lane.id[:2] == own[:2]}
    if own not in beside:
        return None
    x, y, heading = nearest_on(beside[own], cell_x * _EVERY_M, cell_y * _EVERY_M)
    c, s = math.cos(heading), math.sin(heading)
    strips: list[Strip] = []
    for lane in beside.values():
        lane_x, lane_y, _ = nearest_on(lane, x, y)
        centre = -s * (lane_x - x) + c * (lane_y - y)
        strips.append(Strip(lane.id, centre, centre - lane.width_m / 2.0, centre + lane.width_m / 2.0))
    strips.sort(key=lambda strip: strip.centre_m)
    ahead = nearest_on(beside[own], x + _PREVIEW_M * c, y + _PREVIEW_M * s)[2]
    curvature = wrap_to_pi(ahead - heading) / _PREVIEW_M
    if abs(curvature) < _STRAIGHT:
        curvature = 0.0
    numbers = np.array([x, y, heading, c, s, curvature, _CROSSING_SINE])
    return _Frame(tuple(strips), beside[own].speed_limit_mps, curvature, numbers)


def nearest_on(lane: LaneView, x: float, y: float) -> tuple[float, float, float]:
    """(x, y, heading) of the point of a lane's centre line that is closest; its ends go on straight."""
    best = (math.inf, 0.0, 0.0, 0.0)
    points = lane.centre_m
    for i, ((ax, ay), (bx, by)) in enumerate(pairwise(points)):
        length = math.hypot(bx - ax, by - ay)
        if length == 0.0:
            continue
        ux, uy = (bx - ax) / length, (by - ay) / length
        along = (x - ax) * ux + (y - ay) * uy
        low = -math.inf if i == 0 else 0.0
        high = math.inf if i == len(points) - 2 else length
        along = max(low, min(high, along))
        px, py = ax + along * ux, ay + along * uy
        distance = math.hypot(x - px, y - py)
        if distance < best[0]:
            best = (distance, px, py, math.atan2(uy, ux))
    return best[1], best[2], best[3]
