"""What happened when: the marks on a drive's time line, read off its frames."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

from chauffeur.concept import Frame, Snapshot
from chauffeur.drive.recording import RecordedTrip
from chauffeur.hmi import words
from chauffeur.hmi.shielding import Stretch, stretches_of
from chauffeur.hmi.view import instants_of

EventKind = Literal["said", "lane_change", "stopped", "finished", "failed", "collision", "off_road", "shield"]

_STANDING_MPS = 0.3
_MOVING_MPS = 1.0


@dataclass(frozen=True, slots=True)
class Event:
    """One mark.

    Attributes:
        time_s: When.
        kind: What kind.
        label: In words.
    """

    time_s: float
    kind: EventKind
    label: str


def events_of(recorded: RecordedTrip) -> tuple[Event, ...]:
    """All marks of a trip, in order of time."""
    events = [*_program_events(recorded.frames), *_drive_events(instants_of(recorded))]
    events.extend(Event(s.start_s, "shield", shield_label(s)) for s in stretches_of(recorded.frames))
    events.extend(Event(f.snapshot.time_s, "said", text) for f in recorded.frames for text in f.said)
    return tuple(sorted(events, key=lambda event: event.time_s))


def shield_label(stretch: Stretch) -> str:
    """A stretch of the shield in words, with what became of the command."""
    lasted = stretch.end_s - stretch.start_s
    change = words.change_words(stretch.before, stretch.after)
    return f"Shield ({words.rule_words(stretch.rule)}, {lasted:.1f} s): {change}. {stretch.reason}"


def _program_events(frames: tuple[Frame, ...]) -> list[Event]:
    events: list[Event] = []
    for before, after in pairwise(frames):
        if after.program == before.program:
            continue
        time = after.snapshot.time_s
        if after.program == "finished":
            events.append(Event(time, "finished", "The program finished; the car keeps its wishes."))
        elif after.program == "failed":
            events.append(Event(time, "failed", "The program failed; the autopilot drives on."))
    return events


def _drive_events(instants: tuple[Snapshot, ...]) -> list[Event]:
    events: list[Event] = []
    standing = bool(instants) and instants[0].ego.speed_mps < _STANDING_MPS
    for before, after in pairwise(instants):
        old, new = before.ego.lane, after.ego.lane
        # A change of index on the same stretch of road; the next stretch numbers its lanes afresh.
        if old is not None and new is not None and old[:2] == new[:2] and old[2] != new[2]:
            events.append(Event(after.time_s, "lane_change", f"Changed lane to the {_side(old[2], new[2])}."))
        if not standing and after.ego.speed_mps < _STANDING_MPS:
            standing = True
            events.append(Event(after.time_s, "stopped", "Came to a stop."))
        elif standing and after.ego.speed_mps > _MOVING_MPS:
            standing = False
        if after.ego.crashed and not before.ego.crashed:
            events.append(Event(after.time_s, "collision", "Collision."))
        if after.off_road and not before.off_road:
            events.append(Event(after.time_s, "off_road", "Left the road."))
    return events


def _side(old: int, new: int) -> str:
    return "left" if new < old else "right"
