"""Drawings from above that stand still: shapes in metres, bottom to top, as SVG or as pixels.

Filmstrips, town maps and maps of routes say what is to be drawn; how it looks stands in `LOOKS`. The frame is that of
pictures, y downwards. Numbers go in as numbers and words are escaped, so nothing a person or a model wrote is ever
markup.
"""

from __future__ import annotations

import html
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, Literal

from PIL import Image, ImageDraw, ImageFont

from chauffeur.concept import Observation, VehicleState
from chauffeur.concept.paint import css_colour
from chauffeur.hmi.road import BAR_M, Bounds, PaintedRoad, PaintedSign, Points

LOOKS: Final[dict[str, str]] = {
    "ground": "#dfe3d3", "verge": "#cdd2bf", "edge": "#444a52", "asphalt": "#50565f", "emergency": "#646a73",
    "paint": "#f4f2ea", "centre": "#f2c14b", "trail": "#c9963a", "stop": "#b3201a", "rim": "#b3201a",
    "plate": "#ffffff", "light": "#d0342c", "name": "#f4f2ea", "place": "#2f5d3f", "word": "#1c1f24", "cone": "#e8641b",
    "other": "#d9dee4", "car-edge": "#2d3239", "ego": "#ffb224", "ego-edge": "#4a2c00", "obstacle": "#c9452f",
    "crashed": "#d6281e", "ring": "#cbb9ff",
}  # fmt: skip
"""Colours by day; amber is the ego and nothing else."""
_CAR_M: Final = (5.0, 2.0)
_DASH_M: Final = (3.0, 6.0)
_LINE_M: Final = 0.2
_SIGN_M: Final = 1.6


@dataclass(frozen=True, slots=True)
class DrawnShape:
    """Something to draw, in m.

    Attributes:
        kind: `dot` has one point, `car` and `text` too, and a heading.
        look: Its colour in `LOOKS`.
        points: x, y downwards.
        width: Of a line; radius of a dot; height of letters.
        text: Words.
        heading_rad: Clockwise.
        dashed: Of a line: as lanes are marked.
        size: Length and width of a car.
        paint: Colour that stands in for the look's, `#rrggbb`; empty for none.
        start: Words begin at the point instead of standing in the middle of it.
    """

    kind: Literal["line", "area", "dot", "text", "car"]
    look: str
    points: Points
    width: float = _LINE_M
    text: str = ""
    heading_rad: float = 0.0
    dashed: bool = False
    size: tuple[float, float] = _CAR_M
    paint: str = ""
    start: bool = False


def road_shapes(road: PaintedRoad) -> Iterator[DrawnShape]:
    """Everything that does not move, names of streets left out."""
    for extra, look in ((3.0, "verge"), (0.8, "edge"), (0.06, "asphalt")):
        for surface in road.surfaces:
            more = min(extra, 1.2) if surface.kind in ("parking", "aisle") else extra
            yield DrawnShape("line", look, surface.centre_m, surface.width_m + more)
    for outline in road.islands_m:
        yield DrawnShape("area", "asphalt", outline)
    for surface in road.surfaces:
        if surface.emergency:
            yield DrawnShape("line", "emergency", surface.centre_m, surface.width_m)
    for bar in road.bars_m:
        yield DrawnShape("line", "paint", bar, BAR_M)
    for line in road.lines:
        yield DrawnShape(
            "line", "centre" if line.style == "centre" else "paint", line.points_m, dashed=line.style == "dashed"
        )
    for sign in road.signs:
        yield from _sign_shapes(sign)


def _sign_shapes(sign: PaintedSign) -> Iterator[DrawnShape]:
    x, y = sign.post_m
    if sign.line_m is not None:
        yield DrawnShape("line", "paint", sign.line_m, 0.5)
    if sign.kind == "speed_limit":
        yield DrawnShape("dot", "rim", (sign.post_m,), _SIGN_M)
        yield DrawnShape("dot", "plate", (sign.post_m,), 0.75 * _SIGN_M)
        yield DrawnShape("text", "word", (sign.post_m,), 0.9 * _SIGN_M, sign.text)
        return
    corners, first = (8, math.pi / 8.0) if sign.kind == "stop" else (3, math.pi / 2.0)
    angles = [first + 2.0 * math.pi * i / corners for i in range(corners)]
    yield DrawnShape("area", "stop", tuple((x + _SIGN_M * math.cos(a), y + _SIGN_M * math.sin(a)) for a in angles))
    if sign.text:
        yield DrawnShape("text", "plate", (sign.post_m,), 0.6 * _SIGN_M, sign.text)


def scene_shapes(so_far: Sequence[Observation], seen: Bounds) -> Iterator[DrawnShape]:
    """The ego at the last of the instants with its way so far, and who else is seen there."""
    shot = so_far[-1]
    yield DrawnShape("line", "trail", tuple((each.ego.x_m, each.ego.y_m) for each in (*so_far[::5], shot)), 0.5)
    for thing in (*shot.objects, *shot.others):
        if not (seen.x0 <= thing.x_m <= seen.x1 and seen.y0 <= thing.y_m <= seen.y1):
            continue
        place = ((thing.x_m, thing.y_m),)
        if thing.kind == "static":
            yield DrawnShape("dot", "cone", place, max(thing.length_m, thing.width_m) / 2.0)
        elif thing.kind == "pedestrian":
            yield DrawnShape("dot", "other", place, 0.5, paint=_paint(thing))
        elif thing.kind != "stop_sign":
            yield _body(thing, "obstacle" if thing.kind == "obstacle" else "other")
    yield _body(shot.ego, "ego")


def _body(body: VehicleState, look: str) -> DrawnShape:
    return DrawnShape(
        "car",
        "crashed" if body.crashed else look,
        ((body.x_m, body.y_m),),
        heading_rad=body.heading_rad,
        size=(body.length_m, body.width_m),
        paint="" if look == "ego" or body.crashed else _paint(body),
    )


def _paint(body: VehicleState) -> str:
    return "" if body.colour is None else css_colour(body.colour)


# As SVG ---------------------------------------------------------------------------------------------------------------


def svg_of(shapes: Iterable[DrawnShape]) -> str:
    """Elements whose class is their kind and their look; `style_of_looks` colours them."""
    return "".join(_element(shape) for shape in shapes)


def style_of_looks() -> str:
    """A style sheet for a drawing that stands alone."""
    rules = "".join(f".r-{name}{{color:{colour}}}" for name, colour in LOOKS.items())
    return (
        "<style>.r-line{fill:none;stroke:currentColor;stroke-linejoin:round}"
        ".r-area,.r-dot,.r-text,.r-car{fill:currentColor}"
        f".r-text{{font:500 1px sans-serif}}{rules}"
        f".r-place{{stroke:{LOOKS['ground']};stroke-width:.4px;paint-order:stroke}}</style>"
    )


def _element(shape: DrawnShape) -> str:
    x, y = shape.points[0]
    points = " ".join(f"{px:.1f},{py:.1f}" for px, py in shape.points)
    look = f'class="r-{shape.kind}" color="{shape.paint}"' if shape.paint else f'class="r-{shape.kind} r-{shape.look}"'
    match shape.kind:
        case "line":
            dashes = ' stroke-dasharray="3 6"' if shape.dashed else ""
            return f'<polyline {look} stroke-width="{shape.width:.2f}"{dashes} points="{points}"/>'
        case "area":
            return f'<polygon {look} points="{points}"/>'
        case "dot":
            return f'<circle {look} cx="{x:.1f}" cy="{y:.1f}" r="{shape.width:.2f}"/>'
        case "text":
            turn = math.degrees(shape.heading_rad)
            place = f"translate({x:.1f} {y:.1f})" + (f" rotate({turn:.0f})" if turn else "")
            anchor = "start" if shape.start else "middle"
            scale = f"{place} scale({shape.width:.2f})"
            return (
                f'<text {look} transform="{scale}" text-anchor="{anchor}" dominant-baseline="central">'
                f"{html.escape(shape.text)}</text>"
            )
        case "car":
            (long, wide), turn = shape.size, math.degrees(shape.heading_rad)
            return (
                f'<rect {look} x="{-long / 2.0:.2f}" y="{-wide / 2.0:.2f}" width="{long:.2f}" height="{wide:.2f}" '
                f'rx="0.5" transform="translate({x:.1f} {y:.1f}) rotate({turn:.1f})"/>'
            )


# As pixels ------------------------------------------------------------------------------------------------------------


class Canvas:
    """A picture, with a place of the world in its middle."""

    def __init__(self, width: int, height: int, scale: float, middle_m: tuple[float, float]) -> None:
        """A picture of the ground alone.

        Args:
            width, height: Pixels.
            scale: Pixels a metre.
            middle_m: What stands in the middle.
        """
        self.image = Image.new("RGB", (width, height), LOOKS["ground"])
        self._draw = ImageDraw.Draw(self.image)
        self._scale, self._middle = scale, middle_m

    def paint(self, shapes: Iterable[DrawnShape]) -> None:
        """Draw them, each over those before it."""
        for shape in shapes:
            self._paint(shape)

    def ring(self, body: VehicleState) -> None:
        """A ring around a body, as while the shield acts."""
        corners = self._corners((body.x_m, body.y_m), body.heading_rad, body.length_m + 2.4, body.width_m + 1.6)
        self._draw.line([*corners, corners[0]], LOOKS["ring"], max(4, round(0.35 * self._scale)), joint="curve")

    def _at(self, point: tuple[float, float]) -> tuple[float, float]:
        return (
            (point[0] - self._middle[0]) * self._scale + self.image.width / 2.0,
            (point[1] - self._middle[1]) * self._scale + self.image.height / 2.0,
        )

    def _paint(self, shape: DrawnShape) -> None:
        colour = shape.paint or LOOKS[shape.look]
        x, y = self._at(shape.points[0])
        match shape.kind:
            case "line":
                for piece in _dashes(shape.points) if shape.dashed else [shape.points]:
                    if len(piece) > 1:
                        width = max(2, round(shape.width * self._scale))
                        self._draw.line([self._at(point) for point in piece], colour, width, joint="curve")
            case "area":
                self._draw.polygon([self._at(point) for point in shape.points], colour)
            case "dot":
                radius = max(4.0, shape.width * self._scale)
                self._draw.ellipse((x - radius, y - radius, x + radius, y + radius), colour)
            case "text":
                self._write(shape, x, y, colour)
            case "car":
                self._body(shape, colour)

    def _body(self, shape: DrawnShape, colour: str) -> None:
        (length, width), edge = shape.size, LOOKS["ego-edge" if shape.look == "ego" else "car-edge"]
        if shape.look == "ego":
            self._draw.polygon(
                self._corners(shape.points[0], shape.heading_rad, 1.24 * length, 1.56 * width), "#ffe2a6"
            )
        self._draw.polygon(self._corners(shape.points[0], shape.heading_rad, length, width), colour, edge, 3)
        for ahead, long, wide in ((0.165, 0.17, 0.74), (-0.315, 0.09, 0.68)):
            glass = self._corners(shape.points[0], shape.heading_rad, long * length, wide * width, ahead * length)
            self._draw.polygon(glass, edge)

    def _corners(
        self, place: tuple[float, float], heading_rad: float, length: float, width: float, ahead: float = 0.0
    ) -> list[tuple[float, float]]:
        """Pixels of the corners of a rectangle."""
        c, s = math.cos(heading_rad), math.sin(heading_rad)
        around = ((-length, -width), (length, -width), (length, width), (-length, width))
        places = [(ahead + u / 2.0, v / 2.0) for u, v in around]
        return [self._at((place[0] + c * u - s * v, place[1] + s * u + c * v)) for u, v in places]

    def _write(self, shape: DrawnShape, x: float, y: float, colour: str) -> None:
        font = ImageFont.load_default(max(10.0, shape.width * self._scale))
        if not shape.heading_rad:
            halo = round(0.25 * shape.width * self._scale) if shape.look == "place" else 0  # it stands across roads
            anchor = "lm" if shape.start else "mm"
            self._draw.text((x, y), shape.text, colour, font, anchor, stroke_width=halo, stroke_fill=LOOKS["ground"])
            return
        left, top, right, bottom = (round(value) for value in self._draw.textbbox((0, 0), shape.text, font))
        words = Image.new("L", (right - left + 4, bottom - top + 4))
        ImageDraw.Draw(words).text((2 - left, 2 - top), shape.text, 255, font)
        words = words.rotate(-math.degrees(shape.heading_rad), Image.Resampling.BICUBIC, expand=True)
        self._draw.bitmap((round(x - words.width / 2.0), round(y - words.height / 2.0)), words, colour)


def _dashes(points: Points) -> Iterator[Points]:
    """Paint of a dashed line, which goes on over its corners."""
    along, period = 0.0, sum(_DASH_M)
    for (x0, y0), (x1, y1) in pairwise(points):
        length = math.dist((x0, y0), (x1, y1))
        if not length:
            continue
        start = -(along % period)
        while start < length:
            first, last = max(start, 0.0) / length, min(start + _DASH_M[0], length) / length
            if last > first:
                yield ((x0 + (x1 - x0) * first, y0 + (y1 - y0) * first), (x0 + (x1 - x0) * last, y0 + (y1 - y0) * last))
            start += period
        along += length
