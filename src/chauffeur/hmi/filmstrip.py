"""A drive as a strip of pictures from above, or as a moving one, for a README or a report."""

from __future__ import annotations

import io
import math
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

from chauffeur.concept import DataError, Observation
from chauffeur.concept.units import people_speed
from chauffeur.driving.files import publish
from chauffeur.driving.recording import RecordedTrip
from chauffeur.hmi import words
from chauffeur.hmi.events import EventKind, TripMark, events_of
from chauffeur.hmi.interventions import stretches_of
from chauffeur.hmi.road import Bounds, draw_road, track_box
from chauffeur.hmi.stills import Canvas, road_shapes, scene_shapes
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
_FRAME_S = 0.1
"""Least time between two pictures of a moving one."""
_TOLD_S = 1.5
"""How long a moving picture tells of an event."""
_HELD_MS = 2500
_QUALITY = 60
"""WebP's: flat colours stay clean, a drive of 11 s takes some 0.6 MB."""

_PAPER, _INK, _MUTED = "#f4f2ec", "#1c1f24", "#59606a"
_GUARD = "#5a3ea6"

_RANK: dict[EventKind, int] = {
    "collision": 0,
    "off_road": 1,
    "failed": 2,
    "lane_change": 3,
    "shield": 4,
    "stopped": 5,
    "said": 6,
    "finished": 7,
    "drove_on": 8,
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
    shots = _shots(recorded)
    return _sheet(recorded, shots, choose_moments([shot.time_s for shot in shots], events_of(recorded), frames))


def write_moving_picture(path: Path, recorded: RecordedTrip, width: int = 880) -> Path:
    """Write the drive as an animated WebP that plays at the drive's own pace and stands still for a moment at its end.

    Args:
        path: The `.webp` file; its folder is made if need be.
        recorded: The trip.
        width: Width, px.

    Raises:
        DataError: Nothing was driven, or the file cannot be written.
    """
    shots, events = _shots(recorded), events_of(recorded)
    shown = [0]
    for index in range(1, len(shots)):
        if shots[index].time_s - shots[shown[-1]].time_s > _FRAME_S - 1e-6 or index == len(shots) - 1:
            shown.append(index)
    pictures: list[Image.Image] = []
    for index in shown:
        past = [event for event in events if 0.0 <= shots[index].time_s - event.time_s <= _TOLD_S]
        moment = Moment(index, min(past, key=lambda e: (_RANK[e.kind], -e.time_s), default=None))
        sheet = _sheet(recorded, shots, (moment,))
        pictures.append(sheet.resize((width, round(sheet.height * width / sheet.width)), Image.Resampling.LANCZOS))
    times = [shots[index].time_s for index in shown]
    still_ms = [round(1000.0 * (after - before)) for before, after in pairwise(times)] + [_HELD_MS]
    buffer = io.BytesIO()
    pictures[0].save(
        buffer, "WEBP", save_all=True, append_images=pictures[1:], duration=still_ms, loop=0, quality=_QUALITY, method=6
    )
    return publish(path, buffer.getvalue(), "moving picture")


def _shots(recorded: RecordedTrip) -> tuple[Observation, ...]:
    shots = facing_right(instants_of(recorded))
    if not shots:
        raise DataError("Nothing was driven, so there is no picture.", hint="The page shows why.")
    return shots


def _sheet(recorded: RecordedTrip, shots: tuple[Observation, ...], moments: Sequence[Moment]) -> Image.Image:
    """Title and pictures."""
    camera = frame_drive(shots)
    seen = track_box(_path(shots)).grown(200.0)
    road = tuple(road_shapes(draw_road(shots[0].road, shots[0].objects, seen, shots[0].signs)))

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
        panel = Canvas(round(width * k), round(height * k), scale * k, middle)
        panel.paint((*road, *scene_shapes(shots[: moment.index + 1], seen)))
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
