"""Takeover by a passenger: a pure function of a drive and of what the passenger likes, and what they say then.

A passenger takes over when the car does not do what they meant within their patience, when it is faster or slower than
they like beyond their tolerance, or when it is closer, harsher or tighter than they put up with. It is the first of
these that counts. Being slow is forgiven while somebody ahead, a bend or a stop sign is the reason.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from chauffeur.bench.personalization.population import Passenger, Talk
from chauffeur.bench.personalization.sayings import Aim, Force, Half, Level, Topic, feedback_of
from chauffeur.bench.personalization.scenes import GROUND_OF, Ground, Task
from chauffeur.bench.personalization.traces import Array, Flags, Trace

TAKEOVER_VERSION: Final = "takeover-v1"
"""Changes whenever the same drive could be judged differently."""

_PATIENCE: Final[dict[Ground, float]] = {"highway": 1.0, "intersection": 0.35, "parking": 0.6}
"""Shares of a highway's patience: less time where there is less way."""
_MIND: Final = 0.3
"""Share of the patience for which a wrong speed must last."""
_HELD_UP_S: Final = 5.0
"""Time gap up to which a vehicle counts as following another (Highway Capacity Manual, 1985)."""
_FALLS_BACK_MPS: Final = 1.5
_NEAR_M: Final = 12.0
_BEND: Final = 0.04
"""Yaw rate, rad/s, of a bend."""
_BEND_BEFORE_S: Final = 4.0
_BEND_AFTER_S: Final = 3.0
_STOP_MPS2: Final = 1.5
_STOP_M: Final = 12.0
_START_S: Final = 6.0
_CLOSE_S: Final = 2.0
"""How long a headway must be too short."""
_STANDING_MPS: Final = 0.2
_LOT_TOLERANCE: Final = 1.5
"""Speeds in a lot are small: tolerances are wider there."""
_PARKING_TOLERANCE: Final = 2.5
"""Whoever wants a spot thinks of the spot."""
_PASSING_S: Final = 2.0
"""Passing may take this many times the patience once it has begun."""
_REMARK: Final = 0.6
"""Share of the tolerance from which a drive that was all right is remarked upon."""
_SPEAKS: Final[dict[Talk, float]] = {"silent": 0.0, "brief": 0.5, "open": 1.0}
"""Probability of a remark after a drive that was all right (assumed)."""


@dataclass(frozen=True, slots=True)
class Mood:
    """A passenger's wants for one trip.

    Attributes:
        task: What for.
        aim: With their own choice of place or direction.
        level: How directly they put it.
        pace: Factor on the wanted speed, on this day.
    """

    task: Task
    aim: Aim
    level: Level
    pace: float = 1.0


@dataclass(frozen=True, slots=True)
class Judgement:
    """A passenger's verdict on a drive.

    Attributes:
        takes_over: Whether they took over.
        at_s: When, since the drive began; 0 where the manner is judged as a whole.
        topic: What it was about; of a drive that was all right, what they would remark on.
        force: How strongly.
        deviation: By how many tolerances speed or gains were off, signed; 0 where they were not the matter.
    """

    takes_over: bool
    at_s: float
    topic: Topic
    force: Force
    deviation: float = 0.0


def wanted_mps(passenger: Passenger, mood: Mood, limit_mps: float) -> float:
    """The speed a passenger has in mind on an open road."""
    match mood.task:
        case "overtake" | "go":
            share = passenger.brisk_share
        case "follow" | "right_lane" | "yield":
            share = passenger.calm_share
        case "park" | "pace":
            share = passenger.lot_share
    return share * mood.pace * limit_mps


def aim_of(passenger: Passenger, task: Task, choice: int, start_mps: float, limit_mps: float) -> Aim:
    """The exact aim: a place by choice, a direction by how fast they want to go."""
    match task:
        case "park":
            return ("park.nearest", "park.stadium", "park.exit")[choice % 3]
        case "pace":
            wanted = wanted_mps(passenger, Mood("pace", "pace.faster", "I"), limit_mps)
            return "pace.faster" if wanted > start_mps else "pace.slower"
        case _:
            return task


def judge(trace: Trace, passenger: Passenger, mood: Mood) -> Judgement:
    """A passenger's verdict on a drive."""
    events = sorted(_events(trace, passenger, mood), key=lambda event: event[0])
    if events:
        index, topic, off = events[0]
        return Judgement(True, round(index * trace.dt_s, 1), topic, _force(topic, off), round(off, 3))
    off = _felt(trace, passenger, mood)
    if abs(off) > _REMARK:
        return Judgement(False, trace.seconds, "too_fast" if off > 0 else "too_slow", "bit", round(off, 3))
    return Judgement(False, trace.seconds, "fine", "plain", round(off, 3))


def remark(passenger: Passenger, found: Judgement, half: Half, rng: np.random.Generator) -> str:
    """Feedback after a drive in the words of one half, placeholders unfilled; empty where they say nothing."""
    if not found.takes_over and rng.random() >= _SPEAKS[passenger.talk]:
        return ""
    texts = feedback_of(found.topic, found.force, half)
    return texts[int(rng.integers(len(texts)))]


Event = tuple[int, Topic, float]


def _events(trace: Trace, passenger: Passenger, mood: Mood) -> Iterator[Event]:
    """First times at which each thing was too much: index of the period, what, and by how many tolerances."""
    if trace.outcome in ("collision", "off_road"):
        yield len(trace.speed) - 1, "close_call", 0.0
    yield from _discomfort(trace, passenger)
    yield from _wrong_speed(trace, passenger, mood)
    yield from _wrong_deed(trace, passenger, mood)


def _discomfort(trace: Trace, passenger: Passenger) -> Iterator[Event]:
    felt = _mean_over(trace.acceleration, 1.0, trace.dt_s)
    sideways = np.abs(_mean_over(trace.sideways, 1.0, trace.dt_s))
    period = max(1, round(1.0 / trace.dt_s))
    jerk = np.zeros(len(felt))
    jerk[period:] = np.abs(felt[period:] - felt[:-period])
    limits: tuple[tuple[Flags, Topic], ...] = (
        (felt < -passenger.braking_mps2, "harsh"),
        (felt > passenger.accelerating_mps2, "harsh"),
        (jerk > passenger.jerk_mps3, "harsh"),
        (sideways > passenger.sideways_mps2, "swerving"),
    )
    for flags, topic in limits:
        if flags.any():
            yield int(np.argmax(flags)), topic, 0.0
    close = (trace.gap_m < passenger.headway_s * trace.speed) & (trace.speed > 3.0)
    if (index := _lasting(close, _CLOSE_S, trace.dt_s)) is not None:
        yield index, "too_close", 0.0
    for index, missed in trace.encroachment:
        if missed < passenger.encroachment_s:
            yield index, "close_call", 0.0
            break


def _wrong_speed(trace: Trace, passenger: Passenger, mood: Mood) -> Iterator[Event]:
    off, minded = _off(trace, passenger, mood)
    patience = _patience(passenger, mood)
    minded = minded & (np.arange(len(off)) * trace.dt_s >= patience)
    hold = _MIND * patience
    slow = (off < -1.0) & ~_excused(trace, wanted_mps(passenger, mood, trace.limit_mps))
    both: tuple[tuple[Flags, Topic], ...] = ((minded & (off > 1.0), "too_fast"), (minded & slow, "too_slow"))
    for flags, topic in both:
        index = _lasting(flags, hold, trace.dt_s)
        if index is not None:
            yield index, topic, float(off[index])


def _off(trace: Trace, passenger: Passenger, mood: Mood) -> tuple[Array, Flags]:
    """By how many tolerances the speed is off, and where that can matter."""
    wanted = wanted_mps(passenger, mood, trace.limit_mps)
    tolerance = passenger.tolerance
    if mood.task == "pace":
        tolerance *= _LOT_TOLERANCE
    elif mood.task == "park":
        tolerance *= _PARKING_TOLERANCE
    matters = np.ones(len(trace.speed), dtype=np.bool_)
    if GROUND_OF[mood.task] == "intersection":
        matters &= ~trace.across
    if trace.parked:
        matters &= trace.speed > _STANDING_MPS
    return (trace.speed - wanted) / (tolerance * wanted), matters


def _excused(trace: Trace, wanted: float) -> Flags:
    """Instants at which a low speed has a visible reason: a slower agent ahead, a stop sign, a bend, pulling away."""
    follows = (trace.gap_m < _HELD_UP_S * trace.speed) & (trace.lead_speed < wanted)
    held_up = follows & (trace.speed > trace.lead_speed - _FALLS_BACK_MPS)
    near = (trace.gap_m < _NEAR_M) | (trace.somebody_m < _NEAR_M)
    stopping = trace.stop_m < trace.speed**2 / (2.0 * _STOP_MPS2) + _STOP_M
    bend = _around(np.abs(trace.turning) > _BEND, _BEND_BEFORE_S, _BEND_AFTER_S, trace.dt_s)
    starting = _around(trace.speed < _STANDING_MPS, 0.0, _START_S, trace.dt_s)
    return held_up | near | stopping | bend | starting


def _around(flags: Flags, before_s: float, after_s: float, dt_s: float) -> Flags:
    """Flags spread out in time: also true a while before and after."""
    before, after = round(before_s / dt_s), round(after_s / dt_s)
    spread = np.convolve(flags.astype(float), np.ones(before + after + 1), mode="full")
    return spread[before : before + len(flags)] > 0.5


def _wrong_deed(trace: Trace, passenger: Passenger, mood: Mood) -> Iterator[Event]:
    patience = _patience(passenger, mood)
    by_hint = mood.level == "III"  # then it depends on the person what a hint is to mean
    match mood.task:
        case "overtake":
            if not (by_hint and passenger.lane_habit == "stays"):
                yield from _not_passed(trace, patience)
        case "follow":
            if (trace.lane != 0).any():
                yield int(np.argmax(trace.lane != 0)), "passed", 0.0
        case "right_lane":
            yield from _not_right(trace, passenger, patience, by_hint=by_hint)
        case "yield" | "go":
            yield from _not_across(trace, passenger)
        case "park":
            yield from _not_parked(trace, passenger, mood)
        case "pace":
            if trace.parked:
                yield len(trace.speed) - 1, "parked", 0.0


def _not_passed(trace: Trace, patience_s: float) -> Iterator[Event]:
    begun = _at(trace, patience_s)
    if begun is not None and not trace.passed[begun] and trace.lane[begun] == 0:
        yield begun, "no_overtake", 0.0
        return
    end = _at(trace, _PASSING_S * patience_s)
    if end is not None and not trace.passed[end] and not trace.passed[-1]:
        yield end, "no_overtake", 0.0


def _not_right(trace: Trace, passenger: Passenger, patience_s: float, *, by_hint: bool) -> Iterator[Event]:
    if (trace.lane < 0).any():
        yield int(np.argmax(trace.lane < 0)), "not_right", 0.0
    if by_hint and passenger.lane_habit == "stays":
        return
    at = _at(trace, patience_s)
    if at is not None and trace.lane[at] <= 0:
        yield at, "not_right", 0.0


def _not_across(trace: Trace, passenger: Passenger) -> Iterator[Event]:
    """Standing without a reason, at the line or before it."""
    idle = (trace.speed < _STANDING_MPS) & ~trace.crossing & ~trace.across
    stood = np.cumsum(idle) * trace.dt_s
    if (stood > passenger.standing_s).any():
        yield int(np.argmax(stood > passenger.standing_s)), "waited", 0.0


def _not_parked(trace: Trace, passenger: Passenger, mood: Mood) -> Iterator[Event]:
    place = mood.aim.partition(".")[2]
    last = len(trace.speed) - 1
    if not trace.parked:
        yield last, "not_parked", 0.0
    elif trace.walk_m[place] > passenger.walk_m:
        yield last, "wrong_spot", 0.0


def _felt(trace: Trace, passenger: Passenger, mood: Mood) -> float:
    """By how many tolerances the speed was off for most of the time in which it could be chosen."""
    off, matters = _off(trace, passenger, mood)
    matters = matters & (np.arange(len(off)) * trace.dt_s >= _patience(passenger, mood))
    excused = _excused(trace, wanted_mps(passenger, mood, trace.limit_mps))
    chosen = off[matters & ((off > 0.0) | ~excused)]
    return float(np.median(chosen)) if len(chosen) else 0.0


def _force(topic: Topic, off: float) -> Force:
    if topic not in ("too_fast", "too_slow"):
        return "plain"
    size = abs(off)
    return "bit" if size < 1.5 else "plain" if size < 2.5 else "much"


def _patience(passenger: Passenger, mood: Mood) -> float:
    return passenger.patience_s * _PATIENCE[GROUND_OF[mood.task]]


def _at(trace: Trace, time_s: float) -> int | None:
    """Index of the period at a time; None after the end."""
    index = round(time_s / trace.dt_s)
    return index if index < len(trace.speed) else None


def _lasting(flags: Flags, seconds: float, dt_s: float) -> int | None:
    """First period at which something has lasted so long."""
    need = max(1, round(seconds / dt_s))
    run = 0
    for index, flag in enumerate(flags):
        run = run + 1 if flag else 0
        if run >= need:
            return index
    return None


def _mean_over(values: Array, seconds: float, dt_s: float) -> Array:
    """Mean over the time up to each period."""
    width = max(1, round(seconds / dt_s))
    return np.convolve(values, np.ones(width) / width, mode="full")[: len(values)]
