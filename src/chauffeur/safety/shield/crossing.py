"""Right of way where roads cross: the ego goes only if everybody who crosses its way arrives after it has left.

Source: Shalev-Shwartz, Shammah, Shashua 2017, Sec. 3.5 (routes that cross; here the ego never has priority). Others are
taken to go straight on, as fast as they can. Before the place where ways meet, the ego could still stop; past it, it
has to clear the crossing, and may not wait in it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chauffeur.concept import LaneId, LaneView, Snapshot, VehicleState
from chauffeur.safety.shield.frame import CROSSING_RAD

Points = NDArray[np.float64]

_STEP_M: Final = 1.0
"""Distance between two looked-at points of a way."""
_AHEAD_M: Final = 45.0
"""How far ahead a way is looked at: beyond it the car could still stop, and ways come back on themselves."""
_SIDE_M: Final = 1.0
"""Clear distance to the side between two ways that do not meet."""
_SAME_RAD: Final = math.radians(15.0)
"""Cars turned by less against each other are in one stream already."""
_AFTER_S: Final = 1.0
"""Time between the ego's leaving and another's arriving."""
_MERGE_S: Final = 2.0
"""The same where the other's way becomes the ego's own: it has to be up to speed."""
INSIDE_M: Final = 0.6
"""How far the ego's front is where ways meet before it counts as inside: that far it may have slid."""
CLEARING_MPS2: Final = 2.0
"""Acceleration with which the ego leaves a crossing."""
CLEARING_MPS: Final = 8.0
"""Speed up to which it does."""
_FASTEST_MPS: Final = 14.0
"""No crossing car is expected to go faster than this, or than it does already."""


@dataclass(frozen=True, slots=True)
class Crossing:
    """Where the ego's ways meet those of others, m ahead of its centre.

    Attributes:
        hold_m: The ego's front has to stop before this, from its centre; infinite where nothing has to be awaited.
        inside: It is where ways cross already.
    """

    hold_m: float = math.inf
    inside: bool = False


NOTHING_CROSSES: Final = Crossing()


class Junction:
    """Ways of one road network, found when first asked for."""

    def __init__(self, lanes: tuple[LaneView, ...]) -> None:
        self.lanes = lanes
        self._named = {lane.id: lane for lane in lanes}
        self._onward: dict[str, list[LaneView]] = {}
        for lane in lanes:
            self._onward.setdefault(lane.id[0], []).append(lane)
        self._ways: dict[LaneId, list[Points]] = {}

    def look(self, snapshot: Snapshot, acceleration_mps2: float, lanes: Sequence[LaneId | None]) -> Crossing:
        """What the ego has to wait for.

        Args:
            snapshot: The instant.
            acceleration_mps2: With how much others may gain speed.
            lanes: Where the ego is: every way on from one of them counts.
        """
        ego = snapshot.ego
        hold, inside = math.inf, False
        for way in (way for lane in lanes if lane is not None for way in self._ways_from(lane)):
            path, at = _ahead(way, ego)
            for other in snapshot.others:
                met = _meet(path, at, ego, other)
                if met is None:
                    continue
                first, last, arrival_m, merging = met
                leaving = _time_to(last, max(ego.speed_mps, 0.0), CLEARING_MPS, CLEARING_MPS2)
                arriving = _time_to(arrival_m, max(other.speed_mps, 0.0), _FASTEST_MPS, acceleration_mps2)
                if arriving > leaving + (_MERGE_S if merging else _AFTER_S):
                    continue
                if first < ego.length_m / 2.0 - INSIDE_M:
                    inside = True
                else:
                    hold = min(hold, first)
        return Crossing(hold, inside)

    def _ways_from(self, lane: LaneId) -> list[Points]:
        """Every way on from a lane through what follows it: rows of (x, y, heading)."""
        if lane not in self._ways:
            ways: list[Points] = []
            own = self._named[lane]
            for first in self._onward.get(lane[1], []) or [None]:
                parts = [own] if first is None else [own, first]
                after = [] if first is None else self._onward.get(first.id[1], [])
                for second in after or [None]:
                    ways.append(_sampled([*parts, *([] if second is None else [second])]))
            self._ways[lane] = ways
        return self._ways[lane]


def _sampled(lanes: list[LaneView]) -> Points:
    line = np.array([point for lane in lanes for point in lane.centre_m])
    keep = np.r_[True, np.hypot(*np.diff(line, axis=0).T) > 1e-6]
    line = line[keep]
    lengths = np.r_[0.0, np.cumsum(np.hypot(*np.diff(line, axis=0).T))]
    at = np.arange(0.0, lengths[-1], _STEP_M)
    x, y = np.interp(at, lengths, line[:, 0]), np.interp(at, lengths, line[:, 1])
    heading = np.arctan2(np.gradient(y), np.gradient(x))
    return np.stack([x, y, heading], axis=1).astype(np.float64)


def _ahead(way: Points, ego: VehicleState) -> tuple[Points, Points]:
    """The part of a way from the ego on, and its distances from the ego, m."""
    nearest = int(np.argmin((way[:, 0] - ego.x_m) ** 2 + (way[:, 1] - ego.y_m) ** 2))
    x, y, heading = way[nearest].tolist()
    passed = nearest * _STEP_M + (ego.x_m - x) * math.cos(heading) + (ego.y_m - y) * math.sin(heading)
    behind = max(0, nearest - math.ceil(ego.length_m / 2.0 / _STEP_M))
    beyond = min(len(way), nearest + round(_AHEAD_M / _STEP_M))
    return way[behind:beyond], np.arange(behind, beyond) * _STEP_M - passed


def _meet(path: Points, at: Points, ego: VehicleState, other: VehicleState) -> tuple[float, float, float, bool] | None:
    """(first, last) place of a way that another will cross, m from the ego; its way there, m; whether it joins.

    None where they do not meet: it is past, or on its way elsewhere.
    """
    c, s = math.cos(other.heading_rad), math.sin(other.heading_rad)
    dx, dy = path[:, 0] - other.x_m, path[:, 1] - other.y_m
    along, across = c * dx + s * dy, np.abs(-s * dx + c * dy)
    turn = np.abs((path[:, 2] - other.heading_rad + math.pi) % (2.0 * math.pi) - math.pi)
    # The ego's length counts along its way, before `first` and behind `last`; its width where the ways are oblique.
    near = across < other.width_m / 2.0 + _SIDE_M + np.abs(np.cos(turn)) * ego.width_m / 2.0
    ahead = near & (along > -(other.length_m + ego.width_m) / 2.0)
    crossing = ahead & (turn > CROSSING_RAD)
    if not ahead.any() or turn[0] <= _SAME_RAD:
        return None
    begin = int(np.argmax(ahead))
    # Where a way bends into the other's at a flat angle they meet all the same, where it does.
    stop = begin + max(1, int(np.argmin(np.r_[crossing[begin:], False])))
    merging = bool(stop < len(near) and ahead[stop])
    arrival = float(along[begin:stop].min()) - (other.length_m + ego.width_m) / 2.0
    return float(at[begin]), float(at[stop - 1]) + ego.length_m / 2.0, max(arrival, 0.0), merging


def _time_to(distance_m: float, speed_mps: float, top_mps: float, acceleration_mps2: float) -> float:
    """Time to get so far while gaining speed up to a top, which a faster car keeps."""
    if distance_m <= 0.0:
        return 0.0
    top = max(top_mps, speed_mps)
    gaining_s = (top - speed_mps) / acceleration_mps2
    gained_m = (speed_mps + top) / 2.0 * gaining_s
    if gained_m < distance_m:
        return gaining_s + (distance_m - gained_m) / top
    return (-speed_mps + math.sqrt(speed_mps**2 + 2.0 * acceleration_mps2 * distance_m)) / acceleration_mps2
