"""A town from above: lanes by kind, junctions, lights, signs, crossings, landmarks, as SVG or PNG."""

from __future__ import annotations

import html
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

from chauffeur.geometry import LaneKind, Pose

if TYPE_CHECKING:
    from PIL.Image import Image

    from chauffeur.worlds.town.pack import MapPack, Point

_SURFACE: Final[dict[LaneKind, str]] = {
    "sidewalk": "#d8d3c8", "emergency": "#a9aeb4", "parking": "#9aa7b8", "aisle": "#8b9199", "bicycle": "#b98f7e",
    "crossing": "#e8e8e8", "driving": "#5c636b",
}  # fmt: skip
_ORDER: Final = tuple(_SURFACE)
_GROUND, _INK, _LINE = "#f4f3ee", "#1d2430", "#f7f7f7"
_HEAD, _SIGN, _PLACE = "#d0342c", {"stop": "#b3261e", "yield": "#e08a00", "speed_limit": "#3f6fb5"}, "#2f7d4f"
_MARGIN_M: Final = 15.0
_LABEL_M: Final = 40.0


@dataclass(frozen=True, slots=True)
class _Shape:
    """Something to draw, in metres. `width` of a line; radius of a dot; `size` of letters."""

    kind: Literal["line", "area", "dot", "text"]
    points: Sequence[Point]
    colour: str
    width: float = 1.0
    text: str = ""


def map_svg(pack: MapPack) -> str:
    """The town as an SVG document, a user unit a metre, north up."""
    left, bottom, right, top = _bounds(pack)
    view = f"{left:.1f} {-top:.1f} {right - left:.1f} {top - bottom:.1f}"
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{view}">',
        f"<title>{html.escape(pack.name)}</title>",
        f'<rect x="{left:.1f}" y="{-top:.1f}" width="100%" height="100%" fill="{_GROUND}"/>',
    ]
    for shape in _shapes(pack):
        points = " ".join(f"{x:.2f},{-y:.2f}" for x, y in shape.points)
        (x, y), colour = shape.points[0], shape.colour
        match shape.kind:
            case "line":
                stroke = f'fill="none" stroke="{colour}" stroke-width="{shape.width:.2f}"'
                parts.append(f'<polyline points="{points}" {stroke}/>')
            case "area":
                parts.append(f'<polygon points="{points}" fill="{colour}"/>')
            case "dot":
                parts.append(f'<circle cx="{x:.2f}" cy="{-y:.2f}" r="{shape.width:.2f}" fill="{colour}"/>')
            case "text":
                style = f'font-family="sans-serif" font-size="{shape.width:.1f}" fill="{colour}"'
                parts.append(f'<text x="{x:.2f}" y="{-y:.2f}" {style}>{html.escape(shape.text)}</text>')
    return "\n".join([*parts, "</svg>", ""])


def map_picture(pack: MapPack, pixels: int = 1600) -> Image:
    """The town as a picture, its longer side so many pixels, north up."""
    from PIL import Image, ImageDraw, ImageFont

    left, bottom, right, top = _bounds(pack)
    scale = 2.0 * pixels / max(right - left, top - bottom)
    picture = Image.new("RGB", (round((right - left) * scale), round((top - bottom) * scale)), _GROUND)
    draw = ImageDraw.Draw(picture)

    def place(points: Sequence[Point]) -> list[tuple[float, float]]:
        return [((x - left) * scale, (top - y) * scale) for x, y in points]

    for shape in _shapes(pack):
        points = place(shape.points)
        x, y = points[0]
        match shape.kind:
            case "line":
                draw.line(points, fill=shape.colour, width=max(1, round(shape.width * scale)), joint="curve")
            case "area":
                draw.polygon(points, fill=shape.colour)
            case "dot":
                radius = shape.width * scale
                draw.ellipse((x - radius, y - radius, x + radius, y + radius), fill=shape.colour)
            case "text":
                font = ImageFont.load_default(max(14.0, shape.width * scale))
                draw.text((x, y), shape.text, fill=shape.colour, font=font, anchor="ls")
    return picture.resize((picture.width // 2, picture.height // 2), Image.Resampling.LANCZOS)


def _bounds(pack: MapPack) -> tuple[float, float, float, float]:
    xs, ys = zip(*(point for lane in pack.road.lanes for point in lane.centre.points_m), strict=True)
    xs, ys = (*xs, *(place.x_m for place in pack.places)), (*ys, *(place.y_m for place in pack.places))
    labels = _LABEL_M if pack.places or any(lane.street for lane in pack.road.lanes) else 0.0
    return min(xs) - _MARGIN_M, min(ys) - _MARGIN_M, max(xs) + _MARGIN_M + labels, max(ys) + _MARGIN_M


def _shapes(pack: MapPack) -> Iterator[_Shape]:
    """Bottom to top."""
    lanes = sorted(pack.road.lanes, key=lambda lane: _ORDER.index(lane.kind))
    for lane in lanes:
        yield _Shape("line", lane.centre.points_m, _SURFACE[lane.kind], max(lane.width_m, 0.3) + 0.1)
    for lane in lanes:
        if lane.kind == "driving" and not lane.junction:
            yield _Shape("line", lane.centre.points_m, _LINE, 0.2)
            yield _arrow(lane.centre.at(lane.length_m / 2.0))
    for crossing in pack.crossings:
        yield _Shape("area", crossing.polygon_m, "#fdfdfd")
    for group in pack.signals:
        for head in group.heads:
            yield _Shape("line", head.stop_line_m, _HEAD, 0.9)
    for sign in pack.signs:
        if sign.stop_line_m is not None:
            yield _Shape("line", sign.stop_line_m, _SIGN[sign.kind], 0.9)
        yield _Shape("dot", ((sign.x_m, sign.y_m),), _SIGN[sign.kind], 1.0)
    named: set[str] = set()
    for lane in lanes:
        if lane.street and lane.kind == "driving" and lane.street not in named:
            named.add(lane.street)
            middle = lane.centre.at(lane.length_m / 2.0)
            yield _Shape("text", ((middle.x_m + 3.0, middle.y_m + 3.0),), _INK, 5.0, lane.street)
    for place in pack.places:
        yield _Shape("dot", ((place.x_m, place.y_m),), _PLACE, 2.5)
        yield _Shape("text", ((place.x_m + 3.0, place.y_m - 2.0),), _PLACE, 5.0, place.name)


def _arrow(at: Pose) -> _Shape:
    cos, sin = math.cos(at.heading_rad), math.sin(at.heading_rad)
    corners = ((2.0, 0.0), (-1.0, 1.0), (-1.0, -1.0))
    return _Shape("area", [(at.x_m + u * cos - v * sin, at.y_m + u * sin + v * cos) for u, v in corners], _LINE)
