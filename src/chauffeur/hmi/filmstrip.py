"""A drive as a strip of pictures from above, for a README or a report."""

from __future__ import annotations

import io
import math
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

from chauffeur.concept import DataError, Observation, VehicleState
from chauffeur.concept.paint import css_colour
from chauffeur.concept.units import people_speed
from chauffeur.driving.files import publish
from chauffeur.driving.recording import RecordedTrip
from chauffeur.hmi import words
from chauffeur.hmi.events import EventKind, TripMark, events_of
from chauffeur.hmi.interventions import stretches_of
from chauffeur.hmi.road import BAR_M, Bounds, PaintedRoad, draw_road, track_box
from chauffeur.hmi.view import facing_right, frame_drive, instants_of

_WIDTH = 1600
_MARGIN = 40
_GAP = 20
_TITLE_PX = 38
_HEAD_PX = 21
_SMALL_PX = 18
_HEAD_HEIGHT = 36
_SCALE = 9.0
"""Pixels per metre of a lengthwise strip: 170 m of road, a car 45 px long."""
_EGO_PLACE = 0.36
_BESIDE_M = 2.5
_COLUMNS = 3
_SHOWN_WITHIN_S = 0.15
_WHOLE_M = 250.0
"""A way that reaches farther is not shown as a whole: the pictures follow the car."""
_FOLLOWED_M = 110.0
_SUPERSAMPLE = 2

_PAPER, _INK, _MUTED = "#f4f2ec", "#1c1f24", "#59606a"
_GROUND, _VERGE, _EDGE, _ASPHALT = "#dfe3d3", "#cdd2bf", "#444a52", "#50565f"
_MARK, _CENTRE, _HATCH = "#f4f2ea", "#f2c14b", "#737a84"
_CAR, _CAR_EDGE = "#d9dee4", "#2d3239"
_EGO, _EGO_EDGE, _TRAIL = "#ffb224", "#4a2c00", "#c9963a"
_OBSTACLE, _STOP, _CRASH = "#c9452f", "#b3201a", "#d6281e"
_CONE = "#e8641b"
_GUARD, _RING = "#5a3ea6", "#cbb9ff"

_RANK: dict[EventKind, int] = {
    "collision": 0,
    "off_road": 1,
    "failed": 2,
    "lane_change": 3,
    "shield": 4,
    "stopped": 5,
    "said": 6,
    "finished": 7,
}

_Font = ImageFont.FreeTypeFont | ImageFont.ImageFont


@dataclass(frozen=True, slots=True)
class Moment:
    """One picture of the strip: which instant, and what happened there."""

    index: int
    event: TripMark | None


def write_filmstrip(path: Path, recorded: RecordedTrip, frames: int = 6) -> Path:
    """Write the strip as a PNG; the file appears whole or not at all.

    Args:
        path: The `.png` file; its folder is made if need be.
        recorded: The trip.
        frames: How many pictures, at least 1.

    Raises:
        DataError: Nothing was driven, or the file cannot be written.
    """
    image = render_filmstrip(recorded, frames)
    buffer = io.BytesIO()
    image.save(buffer, "PNG", optimize=True)
    return publish(path, buffer.getvalue(), "filmstrip")


def render_filmstrip(recorded: RecordedTrip, frames: int = 6) -> Image.Image:
    """The strip as an image. Raises DataError when nothing was driven."""
    shots = facing_right(instants_of(recorded))
    if not shots:
        raise DataError("Nothing was driven, so there is no filmstrip.", hint="The page shows why.")
    camera = frame_drive(shots)
    moments = choose_moments([shot.time_s for shot in shots], events_of(recorded), frames)
    road = draw_road(shots[0].road, shots[0].objects, track_box(_path(shots)).grown(200.0))

    columns = 1 if camera.along else min(_COLUMNS, len(moments))
    width = (_WIDTH - 2 * _MARGIN - _GAP * (columns - 1)) / columns
    if camera.along:
        scale, height = _SCALE, (camera.box.y1 - camera.box.y0 + 2 * _BESIDE_M) * _SCALE
    else:
        scale = width / (camera.box.x1 - camera.box.x0)
        height = min((camera.box.y1 - camera.box.y0) * scale, width * 1.2)
        scale = min(scale, height / (camera.box.y1 - camera.box.y0))
    follows = not camera.along and max(camera.box.x1 - camera.box.x0, camera.box.y1 - camera.box.y0) > _WHOLE_M
    if follows:  # the whole way would show no car
        scale, height = width / _FOLLOWED_M, width
    rows = math.ceil(len(moments) / columns)
    shielded = words.shield_words([change for frame in recorded.frames for change in frame.interventions])
    top = _MARGIN + _TITLE_PX + 14 + _HEAD_PX + 28 + (_HEAD_PX + 10 if shielded else 0)
    total = top + rows * (_HEAD_HEIGHT + height) + (rows - 1) * _GAP + _MARGIN

    k = _SUPERSAMPLE
    sheet = Image.new("RGB", (_WIDTH * k, round(total) * k), _PAPER)
    _title(ImageDraw.Draw(sheet), recorded, shielded)
    stretches = stretches_of(recorded.frames)
    for number, moment in enumerate(moments):
        x = _MARGIN + (number % columns) * (width + _GAP)
        y = top + (number // columns) * (_HEAD_HEIGHT + height + _GAP)
        shot = shots[moment.index]
        now = [stretch.rule for stretch in stretches if stretch.start_s <= shot.time_s < stretch.end_s]
        _head(ImageDraw.Draw(sheet), shot, moment.event, now, x, y, width)
        middle_x = shot.ego.x_m + width / scale * (0.5 - _EGO_PLACE) if camera.along else _middle(camera.box)[0]
        middle = (shot.ego.x_m, shot.ego.y_m) if follows else (middle_x, _middle(camera.box)[1])
        panel = _Panel(round(width * k), round(height * k), scale * k, *middle)
        panel.paint(road, shots[: moment.index + 1])
        if now:
            panel.ring(shot.ego)
        sheet.paste(panel.image, (round(x * k), round((y + _HEAD_HEIGHT) * k)))
    return sheet.resize((_WIDTH, round(total)), Image.Resampling.LANCZOS)


def choose_moments(times: Sequence[float], events: Sequence[TripMark], count: int) -> tuple[Moment, ...]:
    """Evenly spread instants, each moved to the weightiest event of its own stretch of time.

    Args:
        times: Time of every instant, in s, rising.
        events: Marks of the drive.
        count: How many are wanted; fewer come back when there are not so many instants.
    """
    count = max(1, min(count, len(times)))
    spacing = (times[-1] - times[0]) / max(count - 1, 1)
    chosen: dict[int, TripMark | None] = {}
    for slot in range(count):
        middle = times[0] + slot * spacing
        near = [e for e in events if abs(e.time_s - middle) < spacing / 2]
        event = min(near, key=lambda e: (_RANK[e.kind], e.time_s), default=None)
        # The first and the last picture stay at the ends of the drive.
        pinned = slot in (0, count - 1) and count > 1
        at = middle if event is None or pinned else event.time_s
        index = min(bisect_left(times, at - 1e-6), len(times) - 1)
        shown = event if event is not None and abs(times[index] - event.time_s) <= _SHOWN_WITHIN_S else None
        chosen.setdefault(index, shown)
    return tuple(Moment(index, event) for index, event in sorted(chosen.items()))


def _path(shots: Sequence[Observation]) -> tuple[tuple[float, float], ...]:
    return tuple((shot.ego.x_m, shot.ego.y_m) for shot in shots)


def _middle(box: Bounds) -> tuple[float, float]:
    return (box.x0 + box.x1) / 2.0, (box.y0 + box.y1) / 2.0


def _font(size: float) -> _Font:
    return ImageFont.load_default(size * _SUPERSAMPLE)


def _fit(draw: ImageDraw.ImageDraw, text: str, font: _Font, width: float) -> str:
    """Text cut to a width in sheet pixels, with an ellipsis."""
    clean = " ".join(text.split())
    if draw.textlength(clean, font=font) <= width:
        return clean
    low, high = 0, len(clean)
    while low < high:
        middle = (low + high + 1) // 2
        if draw.textlength(clean[:middle].rstrip() + "...", font=font) <= width:
            low = middle
        else:
            high = middle - 1
    return clean[:low].rstrip() + "..."


def _title(draw: ImageDraw.ImageDraw, recorded: RecordedTrip, shielded: str) -> None:
    k, trip = _SUPERSAMPLE, recorded.trip
    room = (_WIDTH - 2 * _MARGIN) * k
    font = _font(_TITLE_PX)
    draw.text((_MARGIN * k, _MARGIN * k), _fit(draw, f'"{trip.instruction.text}"', font, room), _INK, font)
    _, label, _ = words.trip_words(trip)
    facts = (
        f"{label}   |   {trip.plan.planner or 'no planner'}   |   {trip.scenario}, seed {words.seed_words(trip.seed)}"
    )
    small = _font(_HEAD_PX)
    line = _fit(draw, f"{facts}   |   {words.simulated(recorded.scenario.world)}", small, room)
    below = _MARGIN + _TITLE_PX + 14
    draw.text((_MARGIN * k, below * k), line, _MUTED, small)
    if shielded:
        draw.text((_MARGIN * k, (below + _HEAD_PX + 10) * k), _fit(draw, shielded, small, room), _GUARD, small)


def _head(
    draw: ImageDraw.ImageDraw,
    shot: Observation,
    event: TripMark | None,
    rules: Sequence[str],
    x: float,
    y: float,
    width: float,
) -> None:
    """Time, speed, which rules of the shield act, and what happened."""
    k = _SUPERSAMPLE
    pen, right = x * k, (x + width) * k
    baseline = (y + _HEAD_HEIGHT - 11) * k
    parts = [(f"{shot.time_s:.1f} s", _INK, _HEAD_PX), (people_speed(shot.ego.speed_mps), _MUTED, _SMALL_PX)]
    if rules:
        acting = ", ".join(words.rule_words(rule) for rule in dict.fromkeys(rules))
        parts.append((f"Shield: {acting}", _GUARD, _SMALL_PX))
    if event is not None and not (rules and event.kind == "shield"):
        quoted = f'"{event.label}"' if event.kind == "said" else event.label
        parts.append((quoted, _INK, _SMALL_PX))
    for text, ink, size in parts:
        font = _font(size)
        if right - pen < 60 * k:
            break
        words_fit = _fit(draw, text, font, right - pen)
        draw.text((pen, baseline), words_fit, ink, font, anchor="ls")
        pen += draw.textlength(words_fit, font=font) + 16 * k


class _Panel:
    """One picture: world metres onto pixels."""

    def __init__(self, width: int, height: int, scale: float, middle_x: float, middle_y: float) -> None:
        self.image = Image.new("RGB", (width, height), _GROUND)
        self._draw = ImageDraw.Draw(self.image)
        self._size = width, height
        self._scale = scale
        self._middle = middle_x, middle_y

    def paint(self, road: PaintedRoad, so_far: Sequence[Observation]) -> None:
        """Road, traffic and the ego at the last of the instants, with its way so far."""
        shot = so_far[-1]
        for extra, ink in ((3.0, _VERGE), (0.8, _EDGE), (0.06, _ASPHALT)):
            for surface in road.surfaces:
                self._line(surface.centre_m, surface.width_m + extra, ink)
        for surface in road.surfaces:
            if surface.emergency:
                self._hatch(surface.centre_m, surface.width_m / 2.0)
        for line in road.lines:
            ink = _CENTRE if line.style == "centre" else _MARK
            for piece in _dashes(line.points_m) if line.style == "dashed" else [line.points_m]:
                self._line(piece, 0.17, ink)
        for bar in road.bars_m:
            self._line(bar, BAR_M, _MARK)
        self._line(_path(so_far), 0.45, _TRAIL)
        for sign in road.signs:
            if sign.kind != "stop" or sign.line_m is None:
                continue
            self._line(sign.line_m, 0.5, _MARK)
            self._octagon(sign.post_m)
        for thing in shot.objects:
            if thing.kind == "obstacle":
                self._body(thing, _OBSTACLE, _CAR_EDGE)
            elif thing.kind == "static":
                self._cone(thing)
        for car in shot.others:
            paint = _CAR if car.colour is None else css_colour(car.colour)
            self._body(car, _CRASH if car.crashed else paint, _CAR_EDGE)
        self._body(shot.ego, _CRASH if shot.ego.crashed else _EGO, _EGO_EDGE, halo=True)

    def ring(self, ego: VehicleState) -> None:
        """A ring around the ego while the shield acts."""
        u, v = 0.5 + 1.2 / ego.length_m, 0.5 + 0.8 / ego.width_m
        corners = [self._on(ego, *place) for place in ((-u, -v), (u, -v), (u, v), (-u, v))]
        self._draw.line([*corners, corners[0]], fill=_RING, width=max(4, round(0.35 * self._scale)), joint="curve")

    def _at(self, x_m: float, y_m: float) -> tuple[float, float]:
        return (
            (x_m - self._middle[0]) * self._scale + self._size[0] / 2.0,
            (y_m - self._middle[1]) * self._scale + self._size[1] / 2.0,
        )

    def _line(self, points: Sequence[tuple[float, float]], width_m: float, ink: str) -> None:
        if len(points) < 2:
            return
        pixels = [self._at(x, y) for x, y in points]
        self._draw.line(pixels, fill=ink, width=max(2, round(width_m * self._scale)), joint="curve")

    def _hatch(self, centre: Sequence[tuple[float, float]], half_m: float) -> None:
        for (x0, y0), (x1, y1) in pairwise(centre):
            length = math.dist((x0, y0), (x1, y1))
            ux, uy = (x1 - x0) / length, (y1 - y0) / length
            inner = half_m * 0.86
            for step in range(int(length // 4)):
                x, y = x0 + ux * step * 4, y0 + uy * step * 4
                start = (x + uy * inner, y - ux * inner)
                end = (x + ux * 2 * inner - uy * inner, y + uy * 2 * inner + ux * inner)
                self._line((start, end), 0.18, _HATCH)

    def _octagon(self, post: tuple[float, float]) -> None:
        x, y = self._at(*post)
        radius = max(13.0, 1.5 * self._scale)
        corners = [math.pi / 8 + i * math.pi / 4 for i in range(8)]
        shape = [(x + radius * math.cos(a), y + radius * math.sin(a)) for a in corners]
        self._draw.polygon(shape, fill=_STOP, outline="#ffffff", width=3)
        self._draw.text((x, y), "STOP", "#ffffff", ImageFont.load_default(radius * 0.62), anchor="mm")

    def _cone(self, thing: VehicleState) -> None:
        x, y = self._at(thing.x_m, thing.y_m)
        radius = max(5.0, 0.5 * max(thing.length_m, thing.width_m) * self._scale)
        for share, ink in ((1.0, _CONE), (0.62, "#ffffff"), (0.38, _CONE)):
            own = radius * share
            self._draw.ellipse((x - own, y - own, x + own, y + own), fill=ink)

    def _body(self, body: VehicleState, fill: str, edge: str, *, halo: bool = False) -> None:
        if halo:
            self._rectangle(body, -0.62, 0.62, 0.78, "#ffe2a6")
        self._rectangle(body, -0.5, 0.5, 0.5, fill, edge)
        self._rectangle(body, 0.08, 0.25, 0.37, edge)
        self._rectangle(body, -0.36, -0.27, 0.34, edge)

    def _on(self, body: VehicleState, u: float, v: float) -> tuple[float, float]:
        """Pixel of a place on a body, in shares of its length and width from its centre."""
        c, s = math.cos(body.heading_rad), math.sin(body.heading_rad)
        return self._at(
            body.x_m + c * u * body.length_m - s * v * body.width_m,
            body.y_m + s * u * body.length_m + c * v * body.width_m,
        )

    def _rectangle(
        self, body: VehicleState, back: float, front: float, half: float, fill: str, edge: str | None = None
    ) -> None:
        """A part of a body, in shares of its length and width."""
        corners = [(back, -half), (front, -half), (front, half), (back, half)]
        points = [self._on(body, u, v) for u, v in corners]
        self._draw.polygon(points, fill=fill, outline=edge, width=3 if edge else 1)


def _dashes(points: Sequence[tuple[float, float]]) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """3 m of paint, 6 m without, along a line."""
    pieces: list[tuple[tuple[float, float], tuple[float, float]]] = []
    for (x0, y0), (x1, y1) in pairwise(points):
        length = math.dist((x0, y0), (x1, y1))
        ux, uy = (x1 - x0) / length, (y1 - y0) / length
        start = 0.0
        while start < length:
            end = min(start + 3.0, length)
            pieces.append(((x0 + ux * start, y0 + uy * start), (x0 + ux * end, y0 + uy * end)))
            start += 9.0
    return pieces
