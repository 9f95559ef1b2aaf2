"""The one answer to "may this body be here?": how far an outline reaches beyond the ground that a car may be on.

A car may be on lanes made for cars that lead its way: driving lanes, and where it comes to a stand shoulders and
parking lanes. It may be on aisles and parking lanes in either direction, and anywhere on a paved lot. Pavements,
bicycle lanes and crossings are nobody's to drive on: a crossing is passed on the driving lane under it. A lane that
leads the other way is none of a car's own, so an outline over the centre line is as far out as one over the kerb.

The answer is a distance, not a yes or no: who asks states what it allows, and a car that is out already can be told
whether it gets farther out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Final, Literal

import numba
import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from chauffeur.geometry.road_graph import Lane, RoadGraph

Array = NDArray[np.float64]

EDGE_M: Final = 0.3
"""What an outline may reach over an edge: lanes are known by their mean width and by points up to 2 m apart, which in
the tightest bends of a town (6 m) are 0.1 m inside the arc; the rest is half a kerbstone."""
FAR_M: Final = 7.0
"""A point farther than this from all ground is that far beyond it."""
OFF_ROAD_M: Final = 1.0
"""A car whose middle is farther than this beyond every lane is off the road: both wheels of a side are, by then, and
tapers, of which the mean width is known, end up to 0.9 m before or after that."""
_ONWARD_M: Final = 100.0
"""Where a map ends its lanes go on: as far as is planned ahead."""
_JOINT_M: Final = 0.3
"""Legs overlap by so much, for there are slits where lines bend and where lanes follow one another."""
_CELL_M: Final = 8.0
_SPACING_M: Final = 1.3
"""Between two points of an outline: less than any kerb's corner sticks out between them."""
_SWEEP_M: Final = 0.5
"""Between two looks at a body on its way."""
_ALONG_COS: Final = math.cos(math.radians(95.0))
"""What is turned by more against a lane does not go its way."""
_JUNCTION_COS: Final = math.cos(math.radians(120.0))
"""In a junction lanes of all directions share the ground: only against the traffic is against a lane."""
_ANY_COS: Final = -2.0
_FOR_CARS: Final = frozenset({"driving", "aisle", "emergency", "parking"})

GroundFaultKind = Literal["off_road", "oncoming", "sidewalk", "bicycle", "emergency", "parking"]


@dataclass(frozen=True, slots=True)
class GroundFault:
    """A place where a body may not be.

    Attributes:
        index: Which of the poses.
        kind: What lies under the outline's farthest point: nothing, an oncoming lane, or a lane that is for others.
        beyond_m: How far that point is beyond the ground the body may be on, `FAR_M` at most.
    """

    index: int
    kind: GroundFaultKind
    beyond_m: float


class Ground:
    """The ground of a road network. Immutable; made by `RoadGraph.ground`."""

    def __init__(self, road: RoadGraph) -> None:
        """Args: the lanes, and what is paved around them."""
        self._road = road
        self._legs = _table(road)
        self._keys, self._starts, self._order = _grid(self._legs)

    def beyond_m(
        self, poses: Array, length_m: float, width_m: float, *, stops: bool = False, either_way: bool = False
    ) -> Array:
        """Distance that a body's outline reaches beyond its permitted ground, m, (n,); 0 if it is all on it.

        Args:
            poses: (n, 3): x and y of the body's middle, m, and heading, rad.
            length_m, width_m: Of the body; 0 for a point.
            stops: Whether it comes to a stand there, or stands: shoulders and parking lanes are then its to use.
            either_way: Whether lanes of the other direction count as well: what is left is where cars cannot drive.
        """
        return self._asked(poses, length_m, width_m, stops=stops, either_way=either_way)[:, 0]

    def fault(
        self, poses: Array, length_m: float, width_m: float, *, stops: bool = False, edge_m: float = EDGE_M
    ) -> GroundFault | None:
        """The first of some poses at which a body is farther than `edge_m` beyond its ground; None without."""
        found = self._asked(poses, length_m, width_m, stops=stops)
        out = np.flatnonzero(found[:, 0] > edge_m)
        if not len(out):
            return None
        index = int(out[0])
        beyond, x, y = found[index].tolist()
        return GroundFault(index, self._kind(x, y), beyond)

    def off_road(self, x_m: float, y_m: float) -> bool:
        """True if a car whose middle is at a place has left all that cars drive or stand on, in whatever direction."""
        return self.off_m(x_m, y_m) > OFF_ROAD_M

    def off_m(self, x_m: float, y_m: float) -> float:
        """Distance of a place from all ground that cars drive or stand on, whatever the direction, m."""
        return float(self.beyond_m(np.array([[x_m, y_m, 0.0]]), 0.0, 0.0, stops=True, either_way=True)[0])

    def _asked(self, poses: Array, length_m: float, width_m: float, *, stops: bool, either_way: bool = False) -> Array:
        """(n, 3): how far, and x and y of the outline's farthest point."""
        rows = np.ascontiguousarray(poses, dtype=np.float64)
        outline = _outline(length_m, width_m)
        return beyond(rows, outline, stops, either_way, self._legs, self._keys, self._starts, self._order)

    def _kind(self, x_m: float, y_m: float) -> GroundFaultKind:
        kinds: tuple[GroundFaultKind, ...] = ("sidewalk", "bicycle", "emergency", "parking")
        for place in self._road.places(x_m, y_m, within_m=FAR_M, within_rad=math.pi):
            lane = self._road[place.lane]
            if abs(lane.centre.project(x_m, y_m)[1]) > lane.width_m / 2.0:
                continue
            if lane.kind in ("driving", "aisle"):
                return "oncoming"
            if lane.kind in kinds:
                return lane.kind
        return "off_road"


def swept(poses: Array) -> tuple[Array, Array]:
    """Poses with others between them, so that no part of a car leaps over a kerb or a car.

    Args:
        poses: (n, 3): x, y, heading.

    Returns:
        (m, 3) poses, and (m,) where each lies between the given ones, 0 to n - 1.
    """
    turned = np.diff(np.unwrap(poses[:, 2]))
    moved = np.hypot(np.diff(poses[:, 0]), np.diff(poses[:, 1])) + 2.5 * np.abs(turned)
    counts = np.maximum(1, np.ceil(moved / _SWEEP_M)).astype(np.int64)
    at = np.concatenate([[0.0], *(i + np.arange(1, n + 1) / n for i, n in enumerate(counts.tolist()))])
    rows = np.arange(len(poses), dtype=np.float64)
    heading = np.concatenate([poses[:1, 2], poses[0, 2] + np.cumsum(turned)])
    return np.stack([np.interp(at, rows, one) for one in (poses[:, 0], poses[:, 1], heading)], axis=1), at


@lru_cache(maxsize=64)
def _outline(length_m: float, width_m: float) -> Array:
    """Points round a body, (k, 2): ahead of its middle and left of it, m."""
    a, b = length_m / 2.0, width_m / 2.0
    if a == b == 0.0:
        return np.zeros((1, 2))
    long = np.linspace(-a, a, math.ceil(length_m / _SPACING_M) + 1)
    wide = np.linspace(-b, b, math.ceil(width_m / _SPACING_M) + 1)[1:-1]
    sides = [(u, v) for v in (b, -b) for u in long[::-1].tolist()]  # front corners first: they are out soonest
    return np.array([*sides, *((u, v) for u in (a, -a) for v in wide.tolist())])


_RECENT = 6
"""Legs that a point was found on last are tried first: a body and its way are on few of them."""
_MOVING, _STOPPING = 0.0, 1.0


def _table(road: RoadGraph) -> Array:
    """Legs of all lanes for cars, a row each: x, y, ux, uy, least and most way along it, how far the lane reaches to
    its left and to its right, least cosine of the angle to it, and whether it is only for who stops. What is paved is
    a leg in either direction, and holds the lanes that lie in it.
    """
    rows: list[tuple[float, ...]] = []
    for box in road.paved:
        long, wide = box.length_m / 2.0, box.width_m / 2.0
        c, s = math.cos(box.heading_rad), math.sin(box.heading_rad)
        rows.append((box.x_m, box.y_m, c, s, -long, long, wide, wide, _ANY_COS, _MOVING))
    led = {one for lane in road.lanes for one in lane.successors}
    for lane in road.lanes:
        if lane.kind not in _FOR_CARS or _held(road, lane):
            continue
        either = lane.kind in ("aisle", "parking")
        cosine = _ANY_COS if either else _JUNCTION_COS if lane.junction else _ALONG_COS
        when = _STOPPING if lane.kind in ("emergency", "parking") else _MOVING
        points = lane.centre.points_m
        beside = [road.get(road.neighbour(lane.id, side)) for side in (-1, 1)]
        for i, ((ax, ay), (bx, by)) in enumerate(pairwise(points)):
            length = math.dist((ax, ay), (bx, by))
            low = -_ONWARD_M if i == 0 and lane.id not in led else -_JOINT_M
            high = length + (_ONWARD_M if i == len(points) - 2 and not lane.successors else _JOINT_M)
            middle = (ax + bx) / 2.0, (ay + by) / 2.0
            left, right = (_half_m(lane, one, *middle) for one in beside)
            rows.append((ax, ay, (bx - ax) / length, (by - ay) / length, low, high, left, right, cosine, when))
    return np.array(rows, dtype=np.float64).reshape(len(rows), 10)


def _held(road: RoadGraph, lane: Lane) -> bool:
    return any(all(box.holds(x, y) for x, y in lane.centre.points_m) for box in road.paved)


def _half_m(lane: Lane, beside: Lane | None, x_m: float, y_m: float) -> float:
    """Reach of a lane to one side, m: to the edge of the lane beside, where mean widths leave a slit between."""
    half = lane.width_m / 2.0
    if beside is None or beside.kind not in _FOR_CARS:
        return half
    apart = abs(beside.centre.project(x_m, y_m)[1])
    return max(half, min(apart - beside.width_m / 2.0, half + 1.0))


def _grid(legs: Array) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """(cells, where the legs of each begin, legs): those within `FAR_M` of a square of the plane, sorted by square."""
    if not len(legs):
        empty = np.zeros(0, dtype=np.int64)
        return empty, np.zeros(1, dtype=np.int64), empty
    low, high = legs[:, 4], legs[:, 5]
    counts = np.ceil((high - low) / (_CELL_M / 2.0)).astype(np.int64) + 1
    row = np.repeat(np.arange(len(legs)), counts)
    step = np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)
    at = np.minimum(low[row] + step * (_CELL_M / 2.0), high[row])
    cx = np.floor((legs[row, 0] + at * legs[row, 2]) / _CELL_M).astype(np.int64)
    cy = np.floor((legs[row, 1] + at * legs[row, 3]) / _CELL_M).astype(np.int64)
    reach = np.arange(-(most := math.ceil((FAR_M + float(legs[:, 6:8].max())) / _CELL_M)), most + 1)
    keys = _key(cx[:, None, None] + reach[None, :, None], cy[:, None, None] + reach[None, None, :])
    table = np.unique(np.stack([keys.ravel(), np.repeat(row, len(reach) ** 2)], axis=1), axis=0)
    found, starts = np.unique(table[:, 0], return_index=True)
    return found, np.append(starts, len(table)).astype(np.int64), np.ascontiguousarray(table[:, 1])


@numba.njit(cache=True, error_model="numpy")
def _key(cx, cy):  # type: ignore[no-untyped-def]
    """One number for a square of the plane."""
    return cx * 4_294_967_296 + cy


@numba.njit(cache=True, error_model="numpy")
def beyond(poses, outline, stops, free, legs, keys, starts, order):  # type: ignore[no-untyped-def]
    """See `Ground._asked`."""
    n = poses.shape[0]
    out = np.zeros((n, 3))
    recent = np.full(_RECENT, -1, dtype=np.int64)
    newest = 0
    for i in range(n):
        x, y, heading = poses[i, 0], poses[i, 1], poses[i, 2]
        c, s = math.cos(heading), math.sin(heading)
        out[i, 1], out[i, 2] = x, y
        for j in range(outline.shape[0]):
            px = x + c * outline[j, 0] - s * outline[j, 1]
            py = y + s * outline[j, 0] + c * outline[j, 1]
            on = False
            for k in range(_RECENT):
                if recent[k] >= 0 and _off(legs[recent[k]], px, py, c, s, stops, free) <= 0.0:
                    on = True
                    break
            if on:
                continue
            best = FAR_M
            key = _key(math.floor(px / _CELL_M), math.floor(py / _CELL_M))
            cell = np.searchsorted(keys, key)
            if cell < len(keys) and keys[cell] == key:
                for k in range(starts[cell], starts[cell + 1]):
                    off = _off(legs[order[k]], px, py, c, s, stops, free)
                    if off < best:
                        best = off
                        if off <= 0.0:
                            newest = (newest + 1) % _RECENT
                            recent[newest] = order[k]
                            break
            if best > out[i, 0]:
                out[i, 0], out[i, 1], out[i, 2] = best, px, py
    return out


@numba.njit(cache=True, error_model="numpy")
def _off(leg, px, py, c, s, stops, free):  # type: ignore[no-untyped-def]
    """Distance of a place from a leg's lane; far where a body that is turned so may not be on it."""
    if leg[9] > 0.0 and not stops:
        return FAR_M
    if not free and c * leg[2] + s * leg[3] < leg[8]:
        return FAR_M
    dx, dy = px - leg[0], py - leg[1]
    along, left = dx * leg[2] + dy * leg[3], dy * leg[2] - dx * leg[3]
    across = max(left - leg[6], -left - leg[7])
    past = max(leg[4] - along, along - leg[5])
    if past <= 0.0:
        return across
    return math.hypot(past, max(across, 0.0))
