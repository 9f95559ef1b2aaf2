"""A road as it looks from above: surfaces, painted lines and signs, worked out from lane geometry.

Worlds give centrelines only; here they are in the frame of pictures (`view`), with y downwards. A line between two
lanes of one road is dashed, towards an emergency lane or the verge solid, between opposite directions a centre line. An
edge that lies on another lane's surface is not painted: that is how the inside of an intersection stays clear. A lane
on which people cross is painted as the bars of a crosswalk.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from chauffeur.concept import Lane, LaneId, RoadGraph, VehicleState

Points = tuple[tuple[float, float], ...]
LineStyle = Literal["solid", "dashed", "centre"]
_Array = NDArray[np.float64]

_SAMPLE_M = 1.0
_LAP_M = 0.6
"""Ends of curves are straightened within centimetres: over a lane's width that opens some decimetres."""
_SHORTEST_LINE_M = 3.0
"""Shorter runs are leftovers where lanes fan out."""
_BESIDE_M = 12.0
"""Lanes farther apart than this, from middle to middle, share no line."""
_ON_EDGE_M = 0.35
_STRAIGHT_M = 0.02
BAR_M = 0.5
"""Width of a crosswalk's bar, and of the gap between two."""
_SIGN_OFFSET_M = 4.2
"""From the middle of the lane to the post: half a lane and a step into the verge."""


@dataclass(frozen=True, slots=True)
class Surface:
    """One lane's asphalt. `centre_m` is cut to the part that can be seen."""

    lane: LaneId
    centre_m: Points
    width_m: float
    emergency: bool


@dataclass(frozen=True, slots=True)
class PaintedLine:
    """One painted line."""

    points_m: Points
    style: LineStyle


@dataclass(frozen=True, slots=True)
class StopSign:
    """A stop sign beside its lane, and the stop line across it."""

    post_m: tuple[float, float]
    line_m: tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True, slots=True)
class PaintedRoad:
    """Everything to be drawn that does not move."""

    surfaces: tuple[Surface, ...]
    lines: tuple[PaintedLine, ...]
    stop_signs: tuple[StopSign, ...]
    bars_m: tuple[Points, ...] = ()
    """The middle lines of the bars of crosswalks, each `BAR_M` wide."""


@dataclass(frozen=True, slots=True)
class Bounds:
    """An axis-aligned rectangle in world metres."""

    x0: float
    y0: float
    x1: float
    y1: float

    @property
    def edges(self) -> tuple[float, float, float, float]:
        """(x0, y0, x1, y1)."""
        return self.x0, self.y0, self.x1, self.y1

    def grown(self, margin_m: float) -> Bounds:
        """The box, larger by a margin on every side."""
        return Bounds(self.x0 - margin_m, self.y0 - margin_m, self.x1 + margin_m, self.y1 + margin_m)

    def holds(self, points: _Array) -> NDArray[np.bool_]:
        """Which of the points lie inside."""
        x, y = points[:, 0], points[:, 1]
        return (x >= self.x0) & (x <= self.x1) & (y >= self.y0) & (y <= self.y1)


def track_box(track: Points) -> Bounds:
    """Bounding box of a path."""
    xs, ys = [x for x, _ in track], [y for _, y in track]
    return Bounds(min(xs), min(ys), max(xs), max(ys))


def draw_road(road: RoadGraph, objects: tuple[VehicleState, ...], visible: Bounds) -> PaintedRoad:
    """Work out what to draw of a road.

    Args:
        road: The lanes.
        objects: Signs and obstacles; only signs are drawn here.
        visible: Part of the world that can be seen, in m.
    """
    lanes = tuple(lane for lane in road.lanes if lane.kind not in ("sidewalk", "crossing"))
    centres = [_resample(lane.centre.points_m) for lane in lanes]
    surfaces = tuple(
        Surface(lane.id, _lapped(_simplify(centre[part])), lane.width_m, lane.emergency)
        for lane, centre in zip(lanes, centres, strict=True)
        for part in _runs(visible.holds(centre))
    )
    near = [index for index, centre in enumerate(centres) if bool(visible.holds(centre).any())]
    bounds = np.array([[*centre.min(axis=0), *centre.max(axis=0)] for centre in centres]).reshape(-1, 4)
    lines: list[PaintedLine] = []
    for index in near:
        x0, y0, x1, y1 = bounds[index] + np.array([-_BESIDE_M, -_BESIDE_M, _BESIDE_M, _BESIDE_M])
        meets = (bounds[:, 0] <= x1) & (bounds[:, 2] >= x0) & (bounds[:, 1] <= y1) & (bounds[:, 3] >= y0)
        lines.extend(_lines_of(index, lanes, centres, [other for other in near if meets[other]], visible))
    signs = tuple(_stop_sign(o, lanes, centres, near) for o in objects if o.kind == "stop_sign" and near)
    crossings = [lane for lane in road.lanes if lane.kind == "crossing"]
    bars = tuple(bar for lane in crossings for bar in _bars(lane) if bool(visible.holds(np.array(bar)).any()))
    return PaintedRoad(surfaces, tuple(lines), signs, bars)


def _lines_of(
    index: int, lanes: tuple[Lane, ...], centres: list[_Array], near: list[int], visible: Bounds
) -> list[PaintedLine]:
    lane, centre = lanes[index], centres[index]
    places = {(lanes[i].road, lanes[i].index): lanes[i] for i in near if lanes[i].road}
    lines: list[PaintedLine] = []
    for side in (-1, 1):
        edge = centre + _right_normal(centre) * (side * lane.width_m / 2.0)
        beside = places.get((lane.road, lane.index + side))
        if beside is not None:
            if side < 0:
                continue  # the lane to the left paints it
            style: LineStyle = "solid" if beside.emergency or lane.emergency else "dashed"
            shown = visible.holds(edge)
            lines.extend(PaintedLine(_simplify(edge[part]), style) for part in _runs(shown))
            continue
        shown, centre_line = visible.holds(edge), np.zeros(len(edge), dtype=np.bool_)
        for other in near:
            if other == index:
                continue
            distance, along = _distance(edge, centres[other])
            half = lanes[other].width_m / 2.0
            shown &= distance > half - _ON_EDGE_M
            opposite = (along * _direction(centre)).sum(axis=1) < -0.9
            touching = opposite & (np.abs(distance - half) <= _ON_EDGE_M)
            centre_line |= touching
            if other < index:
                shown &= ~touching  # painted once, by the first of the two
        for mask, name in ((shown & ~centre_line, "solid"), (shown & centre_line, "centre")):
            for part in _runs(mask):
                points = edge[part]
                if np.hypot(*(points[-1] - points[0])) >= _SHORTEST_LINE_M:
                    lines.append(PaintedLine(_simplify(points), name))  # type: ignore[arg-type]
    return lines


def _lapped(points: Points) -> Points:
    """A line that is longer by `_LAP_M` at both ends: two surfaces that meet at a slight angle leave no wedge open."""
    (x0, y0), (x1, y1), (x2, y2), (x3, y3) = points[0], points[1], points[-2], points[-1]
    first, last = math.hypot(x0 - x1, y0 - y1), math.hypot(x3 - x2, y3 - y2)
    if not first or not last:
        return points
    before, behind = _LAP_M / first, _LAP_M / last
    start = (x0 + (x0 - x1) * before, y0 + (y0 - y1) * before)
    return (start, *points[1:-1], (x3 + (x3 - x2) * behind, y3 + (y3 - y2) * behind))


def _bars(lane: Lane) -> list[Points]:
    """Across the way of those who cross, one a metre."""
    line, half = lane.centre, lane.width_m / 2.0
    many = int(line.length_m // (2.0 * BAR_M))
    first = (line.length_m - (2 * many - 1) * BAR_M) / 2.0 + BAR_M / 2.0
    found: list[Points] = []
    for i in range(many):
        pose = line.at(first + 2.0 * BAR_M * i)
        ux, uy = -math.sin(pose.heading_rad) * half, math.cos(pose.heading_rad) * half
        found.append(((pose.x_m - ux, pose.y_m - uy), (pose.x_m + ux, pose.y_m + uy)))
    return found


def _stop_sign(sign: VehicleState, lanes: tuple[Lane, ...], centres: list[_Array], near: list[int]) -> StopSign:
    point = np.array([[sign.x_m, sign.y_m]])
    candidates = [i for i in near if lanes[i].id == sign.lane] or near
    _, index = min((float(_distance(point, centres[i])[0][0]), i) for i in candidates)
    _, along = _distance(point, centres[index])
    right = np.array([-along[0][1], along[0][0]])
    post = point[0] + right * _SIGN_OFFSET_M
    half = right * (lanes[index].width_m / 2.0 - 0.2)
    return StopSign(_pair(post), (_pair(point[0] - half), _pair(point[0] + half)))


def _pair(point: _Array) -> tuple[float, float]:
    return float(point[0]), float(point[1])


def _resample(centre: Points) -> _Array:
    points = np.asarray(centre, dtype=np.float64)
    steps = np.hypot(*np.diff(points, axis=0).T)
    at = np.concatenate([[0.0], np.cumsum(steps)])
    count = max(2, int(np.ceil(at[-1] / _SAMPLE_M)) + 1)
    wanted = np.linspace(0.0, at[-1], count)
    return np.column_stack([np.interp(wanted, at, points[:, 0]), np.interp(wanted, at, points[:, 1])])


def _direction(centre: _Array) -> _Array:
    tangent = np.gradient(centre, axis=0)
    return tangent / np.maximum(np.hypot(tangent[:, 0], tangent[:, 1]), 1e-9)[:, None]


def _right_normal(centre: _Array) -> _Array:
    """Unit vector to the right of travel, in the frame of pictures: y grows to the right of +x."""
    direction = _direction(centre)
    return np.column_stack([-direction[:, 1], direction[:, 0]])


def _distance(points: _Array, polyline: _Array) -> tuple[_Array, _Array]:
    """Distance of each point to a polyline, and the polyline's direction there."""
    slim = np.asarray(_simplify(polyline))
    start, vector = slim[:-1], np.diff(slim, axis=0)
    length = np.maximum((vector**2).sum(axis=1), 1e-12)
    offset = points[:, None, :] - start[None, :, :]
    share = np.clip((offset * vector[None, :, :]).sum(axis=2) / length, 0.0, 1.0)
    apart = offset - share[:, :, None] * vector[None, :, :]
    distance = np.hypot(apart[:, :, 0], apart[:, :, 1])
    nearest = distance.argmin(axis=1)
    unit = vector / np.sqrt(length)[:, None]
    return distance[np.arange(len(points)), nearest], unit[nearest]


def _runs(mask: NDArray[np.bool_]) -> list[slice]:
    """Stretches of at least two neighbouring samples that are set."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a >= 2]


def _simplify(points: _Array) -> Points:
    """Keep the points that a straight line between kept neighbours would miss (Douglas and Peucker)."""
    kept = {0, len(points) - 1}
    spans = [(0, len(points) - 1)]
    while spans:
        first, last = spans.pop()
        if last - first < 2:
            continue
        chord = points[last] - points[first]
        inner = points[first + 1 : last] - points[first]
        norm = float(np.hypot(chord[0], chord[1]))
        off = np.abs(inner[:, 0] * chord[1] - inner[:, 1] * chord[0]) / max(norm, 1e-9)
        worst = int(off.argmax())
        if float(off[worst]) > _STRAIGHT_M:
            middle = first + 1 + worst
            kept.add(middle)
            spans += [(first, middle), (middle, last)]
    return tuple(_pair(points[index]) for index in sorted(kept))
