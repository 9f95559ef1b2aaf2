"""A drive as a few small drawings from above, as SVG: sharp at any size, a few kilobytes, coloured by style sheet.

The moments are chosen, framed and turned as in the filmstrip.
"""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import dataclass

from chauffeur.concept import Observation
from chauffeur.concept.units import kmh, people_speed
from chauffeur.driving.recording import RecordedTrip
from chauffeur.hmi.events import events_of
from chauffeur.hmi.filmstrip import choose_moments
from chauffeur.hmi.road import Bounds, draw_road, track_box
from chauffeur.hmi.stills import road_shapes, scene_shapes, svg_of
from chauffeur.hmi.view import facing_right, frame_drive, instants_of

MOMENTS = 6
_WIDTH_M = 120.0
"""Stretch of road in a picture of a lengthwise drive."""
_EGO_PLACE = 0.4
_BESIDE_M = 2.5
_AROUND_M = 12.0
_STANDING_MPS = 0.3
_PIXELS_A_METRE = 4.5
"""Of a lengthwise picture: where there is less room it shows a shorter stretch, not smaller cars."""
_AHEAD_M = 100.0
"""Vehicles further ahead are not led by."""
_LED_SHARE = 0.4
"""Least share of a drive with a vehicle ahead for the gap to be charted."""
_CHART = (600.0, 60.0)


@dataclass(frozen=True, slots=True)
class Picture:
    """One moment.

    Attributes:
        time_s: When.
        caption: Time, speed and what happened there, in words.
        svg: The drawing.
    """

    time_s: float
    caption: str
    svg: str


@dataclass(frozen=True, slots=True)
class Chart:
    """A quantity over time, with a mark at each picture.

    Attributes:
        svg: The drawing.
        caption: The same in a sentence.
    """

    svg: str
    caption: str


@dataclass(frozen=True, slots=True)
class DrivePictures:
    """A drive in pictures.

    Attributes:
        lengthwise: Pictures are long and flat, to be stacked; otherwise they stand side by side.
        pictures: In order of time.
        charts: Speed, and the gap to the vehicle ahead where there mostly is one, over time.
    """

    lengthwise: bool
    pictures: tuple[Picture, ...]
    charts: tuple[Chart, ...]


def draw_strip(recorded: RecordedTrip, name: str, moments: int = MOMENTS) -> DrivePictures | None:
    """Draw a drive; None when nothing was driven.

    Args:
        recorded: The drive.
        name: Prefix of ids within the page, letters and digits only, unlike any other strip's.
        moments: How many pictures at most.
    """
    shots = facing_right(instants_of(recorded))
    if not shots:
        return None
    camera = frame_drive(shots)
    chosen = choose_moments([shot.time_s for shot in shots], events_of(recorded), moments)
    path = tuple((shot.ego.x_m, shot.ego.y_m) for shot in shots)
    seen = track_box(path).grown(_WIDTH_M if camera.along else 3 * _AROUND_M)
    road = svg_of(road_shapes(draw_road(shots[0].road, shots[0].objects, seen, shots[0].signs)))
    pictures: list[Picture] = []
    for moment in chosen:
        shot = shots[moment.index]
        if camera.along:
            left = shot.ego.x_m - _EGO_PLACE * _WIDTH_M
            box = Bounds(left, camera.box.y0 - _BESIDE_M, left + _WIDTH_M, camera.box.y1 + _BESIDE_M)
        else:
            box = camera.box.grown(_AROUND_M)
        # The road is drawn in the first picture and shown again in the others.
        ground = f'<g id="{name}">{road}</g>' if not pictures else f'<use href="#{name}"/>'
        standing = abs(shot.ego.speed_mps) < _STANDING_MPS
        caption = f"{shot.time_s:.1f} s, {'standing' if standing else people_speed(shot.ego.speed_mps)}"
        if moment.event is not None:
            caption += f" \N{EN DASH} {moment.event.label}"
        moving = svg_of(scene_shapes(shots[: moment.index + 1], box.grown(5.0)))
        pictures.append(Picture(shot.time_s, caption, _svg(box, ground + moving, caption, lengthwise=camera.along)))
    return DrivePictures(camera.along, tuple(pictures), _charts(shots, [p.time_s for p in pictures]))


def _svg(box: Bounds, content: str, label: str, *, lengthwise: bool) -> str:
    width, height = box.x1 - box.x0, box.y1 - box.y0
    size = f' height="{_PIXELS_A_METRE * height:.0f}" preserveAspectRatio="xMidYMid slice"' if lengthwise else ""
    return (
        f'<svg viewBox="{box.x0:.1f} {box.y0:.1f} {width:.1f} {height:.1f}"{size} role="img" '
        f'aria-label="From above: {html.escape(label)}">{content}</svg>'
    )


def _charts(shots: Sequence[Observation], marks: Sequence[float]) -> tuple[Chart, ...]:
    times = [shot.time_s for shot in shots]
    speeds: list[float | None] = [kmh(max(shot.ego.speed_mps, 0.0)) for shot in shots]
    gaps = [
        shot.front.distance_m if shot.front is not None and shot.front.distance_m <= _AHEAD_M else None
        for shot in shots
    ]
    charts = [_chart("Speed", "km/h", times, speeds, marks)]
    if sum(gap is not None for gap in gaps) >= _LED_SHARE * len(gaps):
        charts.append(_chart("Gap to the vehicle ahead", "m", times, gaps, marks))
    return tuple(charts)


def _chart(
    name: str, unit: str, times: Sequence[float], values: Sequence[float | None], marks: Sequence[float]
) -> Chart:
    """A quantity over time from 0 up; where it has no value the line is broken."""
    width, height = _CHART
    known = [value for value in values if value is not None]
    span = max(times[-1] - times[0], 1e-9)
    top = max(*known, 1.0) * 1.08
    step = max(1, len(values) // 200)
    path, drawing = "", False
    for index in (*range(0, len(values) - 1, step), len(values) - 1):
        value = values[index]
        if value is not None:
            x, y = width * (times[index] - times[0]) / span, height * (1 - value / top)
            path += f"{'L' if drawing else 'M'}{x:.1f} {y:.1f}"
        drawing = value is not None
    ticks = "".join(f"M{width * (time - times[0]) / span:.1f} 0V{height:.0f}" for time in marks)
    label = html.escape(f"{name} over time")
    svg = (
        f'<svg viewBox="0 0 {width:.0f} {height:.0f}" preserveAspectRatio="none" role="img" aria-label="{label}">'
        f'<path class="tick" d="{ticks}"/><path class="curve" d="{path}"/></svg>'
    )
    return Chart(
        svg,
        f"{name}: {known[0]:.1f} {unit} at first, between {min(known):.1f} and {max(known):.1f}, "
        f"{known[-1]:.1f} {unit} at the end, over {span:.1f} s.",
    )
