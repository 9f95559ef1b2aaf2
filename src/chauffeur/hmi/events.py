"""What happened when: the marks on a drive's time line, read off its frames."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

from chauffeur.concept import Frame, Observation
from chauffeur.driving.recording import RecordedTrip
from chauffeur.hmi import words
from chauffeur.hmi.interventions import ShieldedStretch, stretches_of
from chauffeur.hmi.view import instants_of

EventKind = Literal[
    "said", "lane_change", "stopped", "drove_on", "finished", "failed", "collision", "off_road", "shield"
]

_STANDING_MPS = 0.3
_MOVING_MPS = 1.0
_AT_LIGHT_M = 15.0
"""From the car's middle to an end of the stop line: the first car or the second."""


@dataclass(frozen=True, slots=True)
class TripMark:
    """One mark.

    Attributes:
        time_s: When.
        kind: What kind.
        label: In words.
    """

    time_s: float
    kind: EventKind
    label: str


def events_of(recorded: RecordedTrip) -> tuple[TripMark, ...]:
    """All marks of a trip, in order of time."""
    events = [*_program_events(recorded.frames), *_drive_events(instants_of(recorded))]
    events.extend(TripMark(s.start_s, "shield", shield_label(s)) for s in stretches_of(recorded.frames))
    events.extend(TripMark(f.observation.time_s, "said", text) for f in recorded.frames for text in f.said)
    return tuple(sorted(events, key=lambda event: event.time_s))


def shield_label(stretch: ShieldedStretch) -> str:
    """A stretch of the shield in words."""
    lasted = stretch.end_s - stretch.start_s
    return f"Shield, {lasted:.1f} s: {words.rule_words(stretch.rule)}. {stretch.reason}"


def _program_events(frames: tuple[Frame, ...]) -> list[TripMark]:
    events: list[TripMark] = []
    for before, after in pairwise(frames):
        if after.program == before.program:
            continue
        time = after.observation.time_s
        if after.program == "finished":
            events.append(TripMark(time, "finished", "The plan is done; the car keeps its set-points."))
        elif after.program == "failed":
            events.append(TripMark(time, "failed", "The program failed; the autopilot drives on."))
    return events


def _drive_events(instants: tuple[Observation, ...]) -> list[TripMark]:
    events: list[TripMark] = []
    standing = bool(instants) and instants[0].ego.speed_mps < _STANDING_MPS
    for before, after in pairwise(instants):
        old, new = before.ego.lane, after.ego.lane
        # A change of place on the same stretch of road; the next stretch numbers its lanes afresh.
        moved = after.road.places_between(old, new) if old is not None and new is not None else None
        if moved:
            events.append(
                TripMark(after.time_s, "lane_change", f"Changed lane to the {'left' if moved < 0 else 'right'}.")
            )
        if not standing and after.ego.speed_mps < _STANDING_MPS:
            standing = True
            events.append(TripMark(after.time_s, "stopped", f"Came to a stop{' at a red light' * _at_red(after)}."))
        elif standing and after.ego.speed_mps > _MOVING_MPS:
            standing = False
            stood = any(event.kind == "stopped" for event in events)
            events.append(TripMark(after.time_s, "drove_on", "Drove on." if stood else "Set off."))
        if after.ego.crashed and not before.ego.crashed:
            events.append(TripMark(after.time_s, "collision", "Collision."))
        if after.off_road and not before.off_road:
            events.append(TripMark(after.time_s, "off_road", "Left the road."))
    return events


def _at_red(shot: Observation) -> bool:
    """True where the car stands before a light of its lane that is red."""
    lights = (light for light in shot.signals if light.state == "red" and shot.ego.lane in light.lanes)
    return any(math.dist(light.stop_line_m[0], (shot.ego.x_m, shot.ego.y_m)) < _AT_LIGHT_M for light in lights)
