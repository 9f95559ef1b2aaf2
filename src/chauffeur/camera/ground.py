"""The ground of a road graph: lanes with their markings, junctions, sidewalks, crossings and stop lines, as triangles.

Layers lie on one another in the order in which they come; a shader paints the markings from where a point lies across
and along its lane.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Final

import numpy as np

from chauffeur.camera.lane_field import LaneField
from chauffeur.geometry import Lane, RoadGraph

if TYPE_CHECKING:
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]
    RowArray = NDArray[np.float32]

VERTEX: Final = 8
"""Numbers a vertex: x, y, along, across (leftward), half width, left marking, right marking, kind."""


class Paving(IntEnum):
    """Kinds of ground."""

    TERRAIN = 0
    LANE = 1
    JUNCTION = 2
    SIDEWALK = 3
    ZEBRA = 4
    STOP_LINE = 5
    LOT = 6
    BICYCLE = 7
    KERB = 8
    YIELD_LINE = 9


class Marking(IntEnum):
    """Paint along an edge of a lane. Of lines between two lanes each paints its half."""

    NONE = 0
    DASHED = 1
    SOLID = 2
    DOUBLE_YELLOW = 3
    YELLOW_EDGE = 4
    EDGE = 5


_SHOULDER_M: Final = 0.5
_KERB_M: Final = 0.25
_SIDEWALK_M: Final = 2.4
FAST_MPS: Final = 19.5
"""Roads with a higher limit are open country: shoulders and guardrails in place of sidewalks."""
_OUT_M: Final = 0.7


@dataclass(frozen=True)
class Edge:
    """An edge of a lane where the road ends.

    Attributes:
        lane: Row of the lane in the graph.
        side: 1 left, -1 right.
        places: (n, 2), m, in driving direction.
        outward: Headings (n,) away from the road, rad.
        open: (n,) whether there is nothing of the road beside it.
    """

    lane: int
    side: int
    places: FloatArray
    outward: FloatArray
    open: NDArray[np.bool_]


@dataclass(frozen=True)
class PavedMesh:
    """Triangles of the road: vertices (n, 3, 8) in the frame of the road graph, and its open edges."""

    triangles: RowArray
    edges: tuple[Edge, ...]
    middles: FloatArray


def _strip(
    x: FloatArray,
    y: FloatArray,
    heading: FloatArray,
    along: FloatArray,
    low_m: float,
    high_m: float,
    marks: tuple[NDArray[np.int64], NDArray[np.int64]],
    kind: Paving,
) -> RowArray:
    """A band along poses, from one leftward offset to another, (k, 3, 8). `marks` are (left, right), one a pose."""
    n = len(x)
    c, s = np.cos(heading), np.sin(heading)
    half = (high_m - low_m) / 2.0
    rows = np.empty((2, n, VERTEX), np.float32)
    for side, (offset, across) in enumerate(((high_m, half), (low_m, -half))):
        rows[side, :, 0], rows[side, :, 1] = x - s * offset, y + c * offset
        rows[side, :, 2], rows[side, :, 3] = along, across
    rows[:, :, 4] = half
    rows[:, :, 5], rows[:, :, 6], rows[:, :, 7] = marks[0], marks[1], kind
    left, right = rows[0], rows[1]
    # One marking a segment: that of its first pose.
    nexts = []
    for side in (left, right):
        following = side[1:].copy()
        following[:, 5:7] = side[:-1, 5:7]
        nexts.append(following)
    a, b, d, e = left[:-1], right[:-1], nexts[0], nexts[1]
    return np.concatenate([np.stack([a, b, e], axis=1), np.stack([a, e, d], axis=1)])


def _plain(n: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    none = np.zeros(n, np.int64)
    return none, none


def _smooth_headings(heading: FloatArray) -> FloatArray:
    """Headings at points rather than of legs, so that bands have no gaps in bends."""
    if len(heading) < 3:
        return heading
    unwrapped = np.unwrap(heading)
    mean = unwrapped.copy()
    mean[1:-1] = (unwrapped[:-2] + unwrapped[1:-1]) / 2.0
    return mean


def pave(road: RoadGraph, field: LaneField) -> PavedMesh:
    """The ground of a whole road graph."""
    walks = any(lane.kind == "sidewalk" for lane in road.lanes)
    under: list[RowArray] = []
    middle: list[RowArray] = []
    top: list[RowArray] = []
    edges: list[Edge] = []
    for row, lane in enumerate(road.lanes):
        along = lane.centre.every(4.0 if len(lane.centre.points_m) > 2 else 6.0)
        x, y, heading = lane.centre.poses(along)
        heading = _smooth_headings(heading)
        half = lane.width_m / 2.0
        if lane.kind == "sidewalk":
            under.append(_strip(x, y, heading, along, -half, half, _plain(len(x)), Paving.SIDEWALK))
            continue
        if lane.kind == "crossing":
            top.append(_strip(x, y, heading, along, -half, half, _plain(len(x)), Paving.ZEBRA))
            continue
        left = _borders(road, field, lane, 1, x, y, heading)
        right = _borders(road, field, lane, -1, x, y, heading)
        if lane.junction:
            marks = _plain(len(x))
        else:
            marks = _marks(road, lane, left, 1, field), _marks(road, lane, right, -1, field)
        kind = {"bicycle": Paving.BICYCLE, "aisle": Paving.LOT, "parking": Paving.LOT}.get(lane.kind, Paving.LANE)
        if lane.junction:
            kind = Paving.JUNCTION
        (middle if lane.junction else top).append(_strip(x, y, heading, along, -half, half, marks, kind))
        for side, beside in ((1, left), (-1, right)):
            if beside is None:
                continue
            offset = side * half
            places = np.stack([x - np.sin(heading) * offset, y + np.cos(heading) * offset], axis=1)
            open_ = beside < 0
            edges.append(Edge(row, side, places, heading + side * math.pi / 2.0, open_))
            if lane.kind == "parking" or not open_.any():
                continue
            slow = lane.speed_limit_mps < FAST_MPS and not walks and lane.kind != "aisle"
            outer = half + (_SHOULDER_M if slow else 2.2 if lane.kind != "aisle" else 0.3)
            band = (half, outer) if side > 0 else (-outer, -half)
            middle.append(_strip(x, y, heading, along, *band, _plain(len(x)), Paving.JUNCTION))
            if slow:
                far = outer + _KERB_M + _SIDEWALK_M
                band = (outer, far) if side > 0 else (-far, -outer)
                under.append(_strip(x, y, heading, along, *band, _plain(len(x)), Paving.SIDEWALK))
                band = (outer, outer + _KERB_M) if side > 0 else (-outer - _KERB_M, -outer)
                under.append(_strip(x, y, heading, along, *band, _plain(len(x)), Paving.KERB))
    middle += [_hull(lanes, Paving.JUNCTION, 0.0) for lanes in road.junctions.values() if _small(lanes)]
    lot = [lane for lane in road.lanes if lane.kind in ("aisle", "parking")]
    if lot:
        middle.insert(0, _hull(lot, Paving.LOT, 2.5))
    triangles = np.concatenate([*under, *middle, *top]) if under or middle or top else np.zeros((0, 3, VERTEX))
    return PavedMesh(triangles.astype(np.float32), tuple(edges), triangles[:, :, :2].mean(axis=1).astype(np.float64))


def _borders(
    road: RoadGraph, field: LaneField, lane: Lane, side: int, x: FloatArray, y: FloatArray, heading: FloatArray
) -> NDArray[np.int64] | None:
    """Sample of the lane beside each pose, -1 for none; None where a lane of the same road lies there all along."""
    if road.neighbour(lane.id, -side) is not None:
        return None
    offset = side * (lane.width_m / 2.0 + _OUT_M)
    return field.covering(np.stack([x - np.sin(heading) * offset, y + np.cos(heading) * offset], axis=1))


def _marks(
    road: RoadGraph, lane: Lane, beside: NDArray[np.int64] | None, side: int, field: LaneField
) -> NDArray[np.int64]:
    count = len(lane.centre.every(4.0 if len(lane.centre.points_m) > 2 else 6.0))
    if lane.kind == "parking":
        return np.full(count, Marking.SOLID)
    if lane.kind == "aisle":
        return np.zeros(count, np.int64)
    if beside is None:
        other = road[road.neighbour(lane.id, -side) or lane.id]
        apart = other.kind != lane.kind or (other.closed != lane.closed and other.emergency)
        return np.full(count, Marking.SOLID if apart else Marking.DASHED)
    edge = Marking.EDGE if side < 0 or lane.speed_limit_mps < FAST_MPS else Marking.YELLOW_EDGE
    marks = np.full(count, int(edge))
    on = beside >= 0
    if on.any():
        here = lane.centre.poses(lane.centre.every(4.0 if len(lane.centre.points_m) > 2 else 6.0))[2]
        turned = np.cos(field.headings[beside] - here)
        rows = field.lanes[beside]
        crossing = np.array([road.lanes[r].junction != "" or road.lanes[r].kind == "parking" for r in rows])
        marks = np.where(on & (turned < -0.3), int(Marking.DOUBLE_YELLOW), marks)
        marks = np.where(on & (turned >= -0.3), int(Marking.DASHED), marks)
        marks = np.where(on & crossing, int(Marking.NONE), marks)
    return marks


def _small(lanes: Sequence[Lane]) -> bool:
    points = np.concatenate([lane.centre.points for lane in lanes])
    return bool(np.ptp(points, axis=0).max() < 70.0)


def _hull(lanes: Sequence[Lane], kind: Paving, margin_m: float) -> RowArray:
    """The convex hull of lanes with their width as a fan of triangles."""
    corners: list[tuple[float, float]] = []
    for lane in lanes:
        x, y, heading = lane.centre.poses(lane.centre.every(4.0))
        heading = _smooth_headings(heading)
        for offset in (lane.width_m / 2.0 + margin_m, -lane.width_m / 2.0 - margin_m):
            corners += zip(
                (x - np.sin(heading) * offset).tolist(), (y + np.cos(heading) * offset).tolist(), strict=True
            )
    ring = _convex(corners)
    middle = (sum(p[0] for p in ring) / len(ring), sum(p[1] for p in ring) / len(ring))
    triangles = np.zeros((len(ring), 3, VERTEX), np.float32)
    for i, point in enumerate(ring):
        triangles[i, :, :2] = middle, point, ring[(i + 1) % len(ring)]
    triangles[:, :, 2:4] = triangles[:, :, :2]
    triangles[:, :, 4] = 1e3
    triangles[:, :, 7] = kind
    return triangles


def _convex(points: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Convex hull, counter-clockwise (Andrew's monotone chain)."""
    ordered = sorted(set(points))
    halves: list[list[tuple[float, float]]] = []
    for run in (ordered, ordered[::-1]):
        chain: list[tuple[float, float]] = []
        for p in run:
            while len(chain) > 1 and _turn(chain[-2], chain[-1], p) <= 0.0:
                chain.pop()
            chain.append(p)
        halves.append(chain[:-1])
    return halves[0] + halves[1]


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


Line = tuple[tuple[float, float], tuple[float, float]]


def stop_lines(lines: Sequence[tuple[Line, float, bool, bool]]) -> RowArray:
    """Stop lines, and zebra crossings beyond them.

    Args:
        lines: (ends, heading of who stops there, whether to yield only, whether people cross behind it).
    """
    found: list[RowArray] = []
    for ends, heading, yields, crossing in lines:
        a, b = np.array(ends[0], float), np.array(ends[1], float)
        way = np.array([math.cos(heading), math.sin(heading)])
        found.append(_quad(a, b, -0.4 * way, Paving.YIELD_LINE if yields else Paving.STOP_LINE))
        if crossing:
            across = (b - a) / max(float(np.linalg.norm(b - a)), 1e-6)
            found.append(_quad(a + 1.0 * way - 0.3 * across, b + 1.0 * way + 0.3 * across, 2.6 * way, Paving.ZEBRA))
    return np.concatenate(found) if found else np.zeros((0, 3, VERTEX), np.float32)


def _quad(a: FloatArray, b: FloatArray, deep: FloatArray, kind: Paving) -> RowArray:
    """A rectangle on one side; along it from a to b."""
    length, half = float(np.linalg.norm(b - a)), float(np.linalg.norm(deep)) / 2.0
    corners = np.zeros((4, VERTEX), np.float32)
    for row, (place, along, across) in enumerate(
        ((a, 0.0, -half), (b, length, -half), (b + deep, length, half), (a + deep, 0.0, half))
    ):
        corners[row] = (*place, along, across, half, 0.0, 0.0, kind)
    return np.stack([corners[[0, 1, 2]], corners[[0, 2, 3]]])
