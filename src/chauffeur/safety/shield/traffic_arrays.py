"""Everybody around the ego as rows of numbers: read from an observation once a period, judged in compiled code.

Most of them do not matter in most periods, and cost next to nothing here; only those that do become `frame.Body`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from operator import attrgetter
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chauffeur.concept import Observation, VehicleState
from chauffeur.safety.shield.compiled import compiled

Array = NDArray[np.float64]

_NUMBERS: Final = "x_m", "y_m", "heading_rad", "speed_mps", "length_m", "width_m"
_read: Final = attrgetter(*_NUMBERS)

AHEAD, BEHIND, ANYWHERE = 1, -1, 0
"""Selects agents whose centre is ahead of the ego's, behind it, or all."""


@dataclass(frozen=True, slots=True, eq=False)
class TrafficArrays:
    """The ego and all that is solid around it at one instant.

    Attributes:
        solid: The ego, then vehicles and obstacles; signs are none.
        numbers: Their x, y, heading, speed, length, width, a row each.
        known: Whether all numbers of everybody, signs included, are numbers.
    """

    solid: tuple[VehicleState, ...]
    numbers: Array
    known: bool

    @classmethod
    def of(cls, observation: Observation) -> TrafficArrays:
        """Those of an observation."""
        seen = (observation.ego, *observation.others, *observation.objects)
        solid = tuple([one for one in seen if one.kind != "stop_sign"])
        numbers = _rows(solid)
        known = _all_finite(numbers)
        if len(solid) < len(seen):
            known = known and _all_finite(_rows([one for one in seen if one.kind == "stop_sign"]))
        return cls(solid, numbers, known)


def _rows(vehicles: Sequence[VehicleState]) -> Array:
    count = len(vehicles) * len(_NUMBERS)
    flat = np.fromiter(chain.from_iterable(map(_read, vehicles)), np.float64, count)
    return flat.reshape(len(vehicles), len(_NUMBERS))


def placed(numbers: Array, frame: Array) -> Array:
    """Everybody in the frame of a lane, s from the ego: rows of (index, s, d, heading against the lane, speed along and
    across it, half the extent along and across it, whether it crosses).

    Args:
        numbers: `TrafficArrays.numbers`.
        frame: Its x, y, heading, cos, sin, curvature, and the sine from which on a body crosses.
    """
    rows = np.empty((len(numbers), 9))
    if frame[5] != 0.0:
        _place(numbers, frame, rows, False)
        # Numba's own hypot differs from Python's in the last bit.
        rows[:, 0] = [math.hypot(along, left) for along, left in rows[:, 1:3].tolist()]
    _place(numbers, frame, rows, True)
    return rows


@compiled
def _all_finite(numbers: Array) -> bool:
    for i in range(len(numbers)):
        total = numbers[i, 0] + numbers[i, 1] + numbers[i, 2] + numbers[i, 3] + numbers[i, 4] + numbers[i, 5]
        if not math.isfinite(total):
            return False
    return True


@compiled
def _place(numbers: Array, frame: Array, rows: Array, measured: bool) -> None:
    """The rows of `placed`; where the lane bends, in two turns.

    What is not yet `measured` are the distances from the middle of the circle that the lane is, which stand in the
    first column then: the first turn leaves (along, what is left of the radius) in the next two. It is one function, so
    that nothing is made into machine code at the first bend of a trip.
    """
    x0, y0, heading0, c0, s0, curvature, crossing = frame
    from_m = 0.0
    for i in range(len(numbers)):
        dx, dy = numbers[i, 0] - x0, numbers[i, 1] - y0
        along, across = c0 * dx + s0 * dy, -s0 * dx + c0 * dy
        turned = 0.0
        if curvature != 0.0:
            radius = 1.0 / curvature
            if not measured:
                rows[i, 1], rows[i, 2] = along, radius - across
                continue
            side = math.copysign(1.0, radius)
            # The lane is a circle about (0, radius), on the side where headings grow if the radius is positive.
            turned = side * math.atan2(along, side * (radius - across))
            along, across = turned * radius, radius - side * rows[i, 0]
        if i == 0:
            from_m = along
        heading = (numbers[i, 2] - heading0 - turned + math.pi) % (2.0 * math.pi) - math.pi
        c, s = math.cos(heading), math.sin(heading)
        half_length, half_width = numbers[i, 4] / 2.0, numbers[i, 5] / 2.0
        rows[i, 0] = i
        rows[i, 1] = along - from_m
        rows[i, 2] = across
        rows[i, 3] = heading
        rows[i, 4] = numbers[i, 3] * c
        rows[i, 5] = numbers[i, 3] * s
        rows[i, 6] = abs(c) * half_length + abs(s) * half_width
        rows[i, 7] = abs(s) * half_length + abs(c) * half_width
        rows[i, 8] = 1.0 if abs(s) > crossing else 0.0


@compiled
def overlapping(
    rows: Array,
    low_m: float,
    high_m: float,
    side_m: float,
    drift_mps: float,
    lane_m: float,
    where: int,
    reach_m: float,
) -> Array:
    """Rows of the agents in, or entering, a lateral interval of the road; never the ego's.

    Args:
        rows: As `placed` gives them.
        low_m, high_m: The span, from the centre of the ego's lane.
        side_m: Room that is left to the side.
        drift_mps, lane_m: Who moves sideways faster than the one claims the other more to that side.
        where: `AHEAD`, `BEHIND` or `ANYWHERE`.
        reach_m: Those farther away along the lane than this, end to end, are left out.
    """
    found = np.empty_like(rows)
    count = 0
    for i in range(1, len(rows)):
        if (where == AHEAD and rows[i, 1] <= 0.0) or (where == BEHIND and rows[i, 1] >= 0.0):
            continue
        if abs(rows[i, 1]) - rows[0, 6] - rows[i, 6] > reach_m:
            continue
        low = rows[i, 2] - rows[i, 7] - side_m
        high = rows[i, 2] + rows[i, 7] + side_m
        if abs(rows[i, 5]) > drift_mps and rows[i, 8] == 0.0:
            if rows[i, 5] > 0.0:
                high += lane_m
            else:
                low -= lane_m
        if low < high_m and high > low_m:
            found[count] = rows[i]
            count += 1
    return found[:count]
