"""A road as it looks from above: surfaces, painted lines, signs and street names, worked out from lane geometry.

Every picture of a road is drawn from here: the pages' canvas (`as_json`, drawn by `assets/drawer.js`), filmstrips,
town maps and maps of routes (`stills`). Worlds give centrelines only; here they are in the frame of pictures
(`view`), with y downwards. A line between two lanes of one road is dashed, towards an emergency lane or the verge
solid, between opposite directions a centre line. An edge that lies on another lane's surface is not painted, and the
islands that lanes leave open inside a junction are paved: that is how the inside of an intersection stays clear. A
lane on which people cross is painted as the bars of a crosswalk.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from chauffeur.concept import Lane, LaneId, RoadGraph, Sign, VehicleState
from chauffeur.concept.scene import stop_sign_of
from chauffeur.concept.units import kmh
from chauffeur.geometry import LaneKind

Points = tuple[tuple[float, float], ...]
LineStyle = Literal["solid", "dashed", "centre"]
_Array = NDArray[np.float64]

_SAMPLE_M = 1.0
_LAP_M = 0.6
"""Ends of curves are straightened within centimetres: over a lane's width that opens some decimetres."""
_SHORTEST_LINE_M = 3.0, 1.5
"""Shorter runs are leftovers where lanes fan out: of streets, and of the narrow curves of a parking lot."""
_BESIDE_M = 12.0
"""Lanes farther apart than this, from middle to middle, share no line."""
_ON_EDGE_M = 0.35
_STRAIGHT_M = 0.02
BAR_M = 0.5
"""Width of a crosswalk's bar, and of the gap between two."""
_SIGN_OFFSET_M = 4.2
"""From the middle of the lane to the post: half a lane and a step into the verge."""
_CELL_M: Final = 0.5
"""Grid on which islands inside a junction are looked for."""
_ISLAND_M2: Final = 400.0
"""A larger open area within a ring of lanes is no gap between them: the middle of a roundabout stays green."""
_GUTTER_M: Final = 1.0
_PLANTED_M2: Final = 30.0
"""Between bays that stand back to back; a larger area of a parking lot is planted."""
_NAME_EVERY_M: Final = 150.0
"""A street's name stands on it once in so many metres of view."""
_ON_FOOT: Final[tuple[LaneKind, ...]] = ("sidewalk", "crossing")
_ORDER: Final[tuple[LaneKind, ...]] = ("parking", "emergency", "bicycle", "aisle", "driving")
"""Bottom to top: a bay reaches under the aisle that it opens to."""


@dataclass(frozen=True, slots=True)
class Surface:
    """One lane's asphalt. `centre_m` is cut to the part that can be seen."""

    lane: LaneId
    centre_m: Points
    width_m: float
    kind: LaneKind = "driving"

    @property
    def emergency(self) -> bool:
        """True if it is a shoulder."""
        return self.kind == "emergency"


@dataclass(frozen=True, slots=True)
class PaintedLine:
    """One painted line."""

    points_m: Points
    style: LineStyle


@dataclass(frozen=True, slots=True)
class PaintedSign:
    """A sign beside its lane, the line to stop or yield at (None without one), and the words on it."""

    kind: Literal["stop", "yield", "speed_limit"]
    post_m: tuple[float, float]
    line_m: tuple[tuple[float, float], tuple[float, float]] | None
    text: str = ""


@dataclass(frozen=True, slots=True)
class StreetName:
    """A street's name on its asphalt: where its middle stands, and the direction of the lane there, rad."""

    text: str
    x_m: float
    y_m: float
    heading_rad: float


@dataclass(frozen=True, slots=True)
class PaintedRoad:
    """Everything to be drawn that does not move, surfaces bottom to top."""

    surfaces: tuple[Surface, ...]
    lines: tuple[PaintedLine, ...]
    signs: tuple[PaintedSign, ...]
    bars_m: tuple[Points, ...] = ()
    """The middle lines of the bars of crosswalks, each `BAR_M` wide."""
    islands_m: tuple[Points, ...] = ()
    """Outlines of what is paved between the lanes of a junction."""
    names: tuple[StreetName, ...] = ()


def as_json(road: PaintedRoad) -> dict[str, Any]:
    """The road as `drawer.js` takes it, in m: `p` and `line` hold x, y, x, y ..."""
    return {
        "surfaces": [{"p": flat(s.centre_m), "w": round(s.width_m, 2), "k": s.kind} for s in road.surfaces],
        "islands": [flat(outline) for outline in road.islands_m],
        "lines": [{"p": flat(line.points_m), "s": line.style} for line in road.lines],
        "bars": {"w": BAR_M, "p": [flat(bar) for bar in road.bars_m]},
        "signs": [
            {"k": s.kind, "p": flat([s.post_m]), "line": None if s.line_m is None else flat(s.line_m), "n": s.text}
            for s in road.signs
        ],
        "names": [{"n": n.text, "x": round(n.x_m, 1), "y": round(n.y_m, 1), "h": n.heading_rad} for n in road.names],
    }


def flat(points: Iterable[tuple[float, float]]) -> list[float]:
    """Points as x, y, x, y ..., to the centimetre."""
    return [round(value, 2) for point in points for value in point]


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

    def meets(self, points: Points) -> bool:
        """True if the box round a line touches this one."""
        xs, ys = zip(*points, strict=True)
        return min(xs) <= self.x1 and max(xs) >= self.x0 and min(ys) <= self.y1 and max(ys) >= self.y0


def track_box(track: Points) -> Bounds:
    """Bounding box of a path."""
    xs, ys = [x for x, _ in track], [y for _, y in track]
    return Bounds(min(xs), min(ys), max(xs), max(ys))


def draw_road(
    road: RoadGraph, objects: Iterable[VehicleState], visible: Bounds, signs: Iterable[Sign] = ()
) -> PaintedRoad:
    """Work out what to draw of a road.

    Args:
        road: The lanes.
        objects: Signs and obstacles; only stop signs are drawn here.
        visible: Part of the world that can be seen, in m.
        signs: Signs that a map knows, in the frame of the road.
    """
    paved = [
        (lane, _resample(lane.centre.points_m))
        for lane in road.lanes
        if lane.kind not in _ON_FOOT and visible.meets(lane.centre.points_m)
    ]
    surfaces = tuple(
        Surface(lane.id, _lapped(_simplify(centre[part]), lane), lane.width_m, _look_of(lane))
        for lane, centre in sorted(paved, key=lambda pair: _ORDER.index(pair[0].kind))
        for part in _runs(visible.holds(centre))
    )
    marked = [(lane, centre) for lane, centre in paved if not _is_gutter(lane)]
    lanes, centres = tuple(lane for lane, _ in marked), [centre for _, centre in marked]
    slim = [np.asarray(_simplify(centre)) for centre in centres]
    near = [index for index, centre in enumerate(centres) if bool(visible.holds(centre).any())]
    bounds = np.array([[*centre.min(axis=0), *centre.max(axis=0)] for centre in centres]).reshape(-1, 4)
    islands = _islands(lanes, slim, near)
    lines: list[PaintedLine] = []
    for index in near:
        x0, y0, x1, y1 = bounds[index] + np.array([-_BESIDE_M, -_BESIDE_M, _BESIDE_M, _BESIDE_M])
        meets = (bounds[:, 0] <= x1) & (bounds[:, 2] >= x0) & (bounds[:, 1] <= y1) & (bounds[:, 3] >= y0)
        hidden = [outline for outline in islands if bool(_meets(outline, x0, y0, x1, y1))]
        lines.extend(
            _lines_of(index, lanes, centres[index], slim, [other for other in near if meets[other]], visible, hidden)
        )
    crossings = [lane for lane in road.lanes if lane.kind == "crossing"]
    return PaintedRoad(
        surfaces,
        tuple(lines),
        tuple(
            _sign(one, lanes, slim, near)
            for one in (*signs, *(stop_sign_of(each) for each in objects if each.kind == "stop_sign"))
            if bool(visible.holds(np.array([[one.x_m, one.y_m]])).all())
        ),
        tuple(bar for lane in crossings for bar in _bars(lane) if bool(visible.holds(np.array(bar)).any())),
        tuple(tuple(_pair(point) for point in outline) for outline in islands),
        _street_names(lanes, centres, visible),
    )


def _is_gutter(lane: Lane) -> bool:
    """True for a strip beside the carriageway too narrow for lines of its own."""
    return lane.kind == "emergency" and lane.width_m < _GUTTER_M


def _look_of(lane: Lane) -> LaneKind:
    return "driving" if _is_gutter(lane) else lane.kind


def _islands(lanes: tuple[Lane, ...], slim: list[_Array], near: list[int]) -> list[_Array]:
    """Convex outlines (n, 2) of the gaps that the lanes of a junction, or the bays of a parking lot, enclose."""
    together: dict[str, list[int]] = {}
    for index in near:
        if lanes[index].junction or lanes[index].kind == "parking":
            together.setdefault(lanes[index].junction, []).append(index)
    found: list[_Array] = []
    for junction, members in together.items():
        if len(members) < 3:
            continue
        points = np.concatenate([slim[i] for i in members])
        low, high = points.min(axis=0) - _BESIDE_M, points.max(axis=0) + _BESIDE_M
        xs, ys = np.arange(low[0], high[0], _CELL_M), np.arange(low[1], high[1], _CELL_M)
        open_ = np.ones((len(xs), len(ys)), dtype=np.bool_)
        for i in near:
            half = lanes[i].width_m / 2.0 + (_CELL_M if lanes[i].kind == "parking" else 0.0)
            first, last = slim[i].min(axis=0) - half, slim[i].max(axis=0) + half
            part = (
                slice(*np.searchsorted(xs, (first[0], last[0])).tolist()),
                slice(*np.searchsorted(ys, (first[1], last[1])).tolist()),
            )
            cells = np.stack(np.meshgrid(xs[part[0]], ys[part[1]], indexing="ij"), axis=-1).reshape(-1, 2)
            if len(cells):
                open_[part] &= ~_covered(cells, slim[i], half, square=lanes[i].kind == "parking").reshape(
                    open_[part].shape
                )
        for area in _enclosed(open_):
            if area.sum() * _CELL_M**2 < (_ISLAND_M2 if junction else _PLANTED_M2):
                where = np.argwhere(area)
                found.append(_hull(np.column_stack([xs[where[:, 0]], ys[where[:, 1]]])))
    return found


def _covered(points: _Array, slim: _Array, half_m: float, *, square: bool) -> NDArray[np.bool_]:
    """Which of the points lie on a lane; `square`: of a straight one, little beyond its ends, so that corners meet."""
    distance, along = _distance(points, slim)
    covered = distance <= half_m
    if square:
        ahead = ((points - slim[0]) * along).sum(axis=1)
        covered &= (ahead >= -_CELL_M) & (ahead <= float(np.hypot(*(slim[-1] - slim[0]))) + _CELL_M)
    return covered


def _enclosed(open_: NDArray[np.bool_]) -> list[NDArray[np.bool_]]:
    """Connected areas of a grid (n, m) that do not reach its border."""
    left = open_.copy()
    areas: list[NDArray[np.bool_]] = []
    while left.any():
        area = np.zeros_like(left)
        area[tuple(np.argwhere(left)[0])] = True
        grown = np.zeros_like(left)
        while not np.array_equal(area, grown):
            grown = area
            area = area.copy()
            area[1:] |= grown[:-1]
            area[:-1] |= grown[1:]
            area[:, 1:] |= grown[:, :-1]
            area[:, :-1] |= grown[:, 1:]
            area &= left
        left &= ~area
        at_border = area[0].any() or area[-1].any() or area[:, 0].any() or area[:, -1].any()
        if not at_border:
            areas.append(area)
    return areas


def _hull(points: _Array) -> _Array:
    """The convex outline of cells (n, 2), as far out as their corners and a little over the lanes round them."""
    reach = 1.5 * _CELL_M * np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]])
    corners = sorted({_pair(point) for point in (points[:, None, :] + reach[None, :, :]).reshape(-1, 2)})

    def side(ordered: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
        kept: list[tuple[float, float]] = []
        for x, y in ordered:
            while len(kept) > 1 and (kept[-1][0] - kept[-2][0]) * (y - kept[-2][1]) <= (kept[-1][1] - kept[-2][1]) * (
                x - kept[-2][0]
            ):
                kept.pop()
            kept.append((x, y))
        return kept[:-1]

    return np.array([*side(corners), *side(reversed(corners))])


def _meets(outline: _Array, x0: float, y0: float, x1: float, y1: float) -> bool:
    (a, b), (c, d) = outline.min(axis=0), outline.max(axis=0)
    return bool(a <= x1 and c >= x0 and b <= y1 and d >= y0)


def _within(points: _Array, outline: _Array) -> NDArray[np.bool_]:
    """Which of the points lie inside a convex outline."""
    edge = np.roll(outline, -1, axis=0) - outline
    offset = points[:, None, :] - outline[None, :, :]
    left = edge[None, :, 0] * offset[:, :, 1] - edge[None, :, 1] * offset[:, :, 0] >= 0.0
    return np.asarray(left.all(axis=1))


def _street_names(lanes: tuple[Lane, ...], centres: list[_Array], visible: Bounds) -> tuple[StreetName, ...]:
    """Each street's name on the middle of its longest stretches, no two of one street close together."""
    named = [i for i, lane in enumerate(lanes) if lane.street and lane.kind == "driving" and not lane.junction]
    found: list[StreetName] = []
    for i in sorted(named, key=lambda i: (-lanes[i].length_m, lanes[i].id)):
        for part in _runs(visible.holds(centres[i])):
            piece = centres[i][part]
            (x, y), (ux, uy) = piece[len(piece) // 2], _direction(piece)[len(piece) // 2]
            name = StreetName(lanes[i].street, float(x), float(y), round(math.atan2(uy, ux), 3))
            if all(o.text != name.text or math.hypot(o.x_m - x, o.y_m - y) > _NAME_EVERY_M for o in found):
                found.append(name)
    return tuple(found)


def _lines_of(
    index: int,
    lanes: tuple[Lane, ...],
    centre: _Array,
    slim: list[_Array],
    near: list[int],
    visible: Bounds,
    islands: list[_Array],
) -> list[PaintedLine]:
    lane = lanes[index]
    crossed = bool(lane.junction) and sum(lanes[i].junction == lane.junction for i in near) > 2
    places = {(lanes[i].road, lanes[i].index): lanes[i] for i in near if lanes[i].road}
    lines: list[PaintedLine] = []
    for side in (-1, 1):
        outward = _right_normal(centre) * side
        edge = centre + outward * (lane.width_m / 2.0)
        beside = places.get((lane.road, lane.index + side))
        if beside is not None:
            if side < 0 or crossed:
                continue  # the lane to the left paints it; inside a junction none does
            style: LineStyle = "solid" if beside.emergency or lane.emergency else "dashed"
            shown = visible.holds(edge)
            lines.extend(PaintedLine(_simplify(edge[part]), style) for part in _runs(shown))
            continue
        shown, centre_line = visible.holds(edge), np.zeros(len(edge), dtype=np.bool_)
        for outline in islands:
            shown &= ~_within(edge, outline)
        for other in near:
            if other == index:
                continue
            half = lanes[other].width_m / 2.0
            if crossed:  # lanes that go on side by side hide each other's edge, and leave the one that they share
                shown &= _distance(edge + outward * _ON_EDGE_M, slim[other])[0] > half
                continue
            distance, along = _distance(edge, slim[other])
            shown &= distance > half - _ON_EDGE_M
            opposite = (along * _direction(centre)).sum(axis=1) < -0.9
            touching = opposite & (np.abs(distance - half) <= _ON_EDGE_M)
            centre_line |= touching
            if other < index:
                shown &= ~touching  # painted once, by the first of the two
        for mask, name in ((shown & ~centre_line, "solid"), (shown & centre_line, "centre")):
            for part in _runs(mask):
                points = edge[part]
                if np.hypot(*(points[-1] - points[0])) >= _SHORTEST_LINE_M[lane.kind == "aisle"]:
                    lines.append(PaintedLine(_simplify(points), name))  # type: ignore[arg-type]
    return lines


def _lapped(points: Points, lane: Lane) -> Points:
    """A line that is longer by `_LAP_M` at both ends: two surfaces that meet at a slight angle leave no wedge open.

    A bay meets its aisle at any angle: it reaches half its width under it.
    """
    (x0, y0), (x1, y1), (x2, y2), (x3, y3) = points[0], points[1], points[-2], points[-1]
    first, last = math.hypot(x0 - x1, y0 - y1), math.hypot(x3 - x2, y3 - y2)
    if not first or not last:
        return points
    before, behind = (lane.width_m / 2.0 if lane.kind == "parking" else _LAP_M) / first, _LAP_M / last
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


def _sign(sign: Sign, lanes: tuple[Lane, ...], slim: list[_Array], near: list[int]) -> PaintedSign:
    text = "STOP" if sign.kind == "stop" else "" if sign.value is None else f"{kmh(sign.value):.0f}"
    if sign.kind != "stop" or sign.stop_line_m is not None or not near:
        return PaintedSign(sign.kind, (sign.x_m, sign.y_m), sign.stop_line_m, text)
    # A world without a map puts the sign on its lane, where one stops: the post stands beside the road.
    point = np.array([[sign.x_m, sign.y_m]])
    candidates = [i for i in near if lanes[i].id in sign.lanes] or near
    _, index = min((float(_distance(point, slim[i])[0][0]), i) for i in candidates)
    _, along = _distance(point, slim[index])
    right = np.array([-along[0][1], along[0][0]])
    half = right * (lanes[index].width_m / 2.0 - 0.2)
    return PaintedSign(
        "stop", _pair(point[0] + right * _SIGN_OFFSET_M), (_pair(point[0] - half), _pair(point[0] + half)), text
    )


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


def _distance(points: _Array, slim: _Array) -> tuple[_Array, _Array]:
    """Distance of each point to a polyline of few points, and the polyline's direction there."""
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
