"""Where two drives of one situation part: at a set-point, in the ego's motion, or in the last bit of a replay."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, fields
from itertools import zip_longest
from typing import Any, Final

from chauffeur.concept import Frame, Limits, Verdict
from chauffeur.driving.episode import make_world
from chauffeur.driving.recording import Difference, RecordedTrip
from chauffeur.driving.trips import provenance
from chauffeur.safety.shield import SHIELD_VERSION

APART_M: Final = 0.1
"""So far from one another two egos have parted; less cannot be seen in a lane."""
APART_MPS: Final = 0.1
_ROUNDING: Final = 1e-9
"""Relative size up to which a difference is one of rounding: a thousand times that of a double's last bits."""
_VERSION: Final = re.compile(r"^(.*)-v(\d+)$")
_NAMED: Final = {
    "chauffeur": "Chauffeur",
    "engine": "the core of the world",
    "python": "Python",
    "shield": "the safety filter",
}

_LAYERS: Final[tuple[tuple[str, str], ...]] = (
    ("observation", "The world moved otherwise on the same commands: its core, or its compiler, is another."),
    ("setpoints", "The policy set other set-points in the same situation: its executor or the driving APIs changed."),
    ("requested", "The controller asked for another command for the same set-points."),
    ("applied", "The safety filter or the actuator made something else of the same command."),
    ("interventions", "The safety filter stepped in otherwise."),
    ("program", "The program ran otherwise: the sandbox, its budgets or the driving APIs changed."),
    ("line", "The program stands at another line: the sandbox or the driving APIs changed."),
    ("said", "The program said something else: the sandbox or the driving APIs changed."),
    ("calls", "The program called other driving APIs, or they answered otherwise."),
)  # fmt: skip
"""The loop's parts in causal order, by the field of a frame in which they first show."""
_START: Final = "The scene began otherwise, before any command: the world's core or the scenario's data changed."
_LENGTH: Final = "One drive ends earlier: the judge, or the bound of the trip's length, changed."
_JUDGE: Final = (
    "The drive is the same, and is judged otherwise: the judge, its metrics or the weights that read the words."
)


@dataclass(frozen=True, slots=True)
class Parting:
    """First control period in which two drives of one situation are apart.

    Attributes:
        tick: Control period, from 0.
        time_s: Of the simulated clock.
        name: What differs: a set-point, `position`, `speed`, or `end` where one drive is over.
        first, second: Values of either drive, m, m/s or as the set-point has them; None where it has none.
    """

    tick: int
    time_s: float
    name: str
    first: Any
    second: Any


def setpoints_part(first: RecordedTrip, second: RecordedTrip) -> Parting | None:
    """Where the set-points first differ; None where they never do while both drive."""
    for tick, (one, other) in enumerate(zip(first.frames, second.frames, strict=False)):
        for part in fields(one.setpoints):
            values = getattr(one.setpoints, part.name), getattr(other.setpoints, part.name)
            if values[0] != values[1]:
                return Parting(tick, one.observation.time_s, part.name, *values)
    return None


def motion_parts(first: RecordedTrip, second: RecordedTrip) -> Parting | None:
    """Where the egos are first `APART_M` or `APART_MPS` apart, or one drive is over; None where neither happens."""
    for tick, (one, other) in enumerate(zip_longest(first.frames, second.frames)):
        if one is not None and other is not None:
            if (found := _apart(one, other)) is not None:
                return Parting(tick, one.observation.time_s, *found)
        elif (longer := one or other) is not None:
            ends = first.trip.duration_s, second.trip.duration_s
            return Parting(tick, longer.observation.time_s, "end", *ends)
    return None


def _apart(one: Frame, other: Frame) -> tuple[str, float, float] | None:
    a, b = one.observation.ego, other.observation.ego
    if abs(a.speed_mps - b.speed_mps) >= APART_MPS:
        return "speed", a.speed_mps, b.speed_mps
    away_m = math.dist((a.x_m, a.y_m), (b.x_m, b.y_m))
    return ("position", 0.0, away_m) if away_m >= APART_M else None


def probable_reasons(recorded: RecordedTrip, difference: Difference, verdicts: tuple[Verdict, ...]) -> tuple[str, ...]:
    """Sentences on why a replay may differ from its recording: the part of the loop, then versions that changed.

    Args:
        recorded: The recording.
        difference: The first one that was found.
        verdicts: Those of today's checks.
    """
    told = [_layer(difference)]
    if (size := _relative(difference)) is not None and size <= _ROUNDING:
        told.append("So small a difference is one of rounding: another processor, compiler or numerical library.")
    changed = [*_changed(recorded), *_checks_changed(recorded.trip.verdicts, verdicts)]
    same = "Chauffeur, Python, the world's core, safety filter and checks have the versions that are recorded."
    return (*told, *(changed or [same]))


def _layer(difference: Difference) -> str:
    if difference.tick is None:
        return _JUDGE
    if difference.field.startswith("number of"):
        return _LENGTH
    if difference.tick == 0 and difference.field.startswith("observation"):
        return _START
    return next((words for name, words in _LAYERS if difference.field.startswith(name)), _JUDGE)


def _relative(difference: Difference) -> float | None:
    try:
        one, other = float(difference.first), float(difference.second)
    except ValueError:
        return None
    if not math.isfinite(one) or not math.isfinite(other):
        return None
    return abs(one - other) / max(abs(one), abs(other), 1.0)


def _changed(recorded: RecordedTrip) -> Iterator[str]:
    trip = recorded.trip
    then = dict(trip.record)
    scenario = recorded.scenario
    today = provenance(trip.plan, scenario, trip.seed, Limits(), make_world(scenario).engine)
    now = {**dict(today), "shield": SHIELD_VERSION}
    for name, said in _NAMED.items():
        if name in then and then[name] != now[name]:
            yield f"Recorded with {said} {then[name]}; now {now[name]}."


def _checks_changed(then: tuple[Verdict, ...], now: tuple[Verdict, ...]) -> Iterator[str]:
    """Checks whose version is another than the recording's."""
    known = {found[1]: one.check for one in then if (found := _VERSION.match(one.check))}
    for one in now:
        found = _VERSION.match(one.check)
        if found and known.get(found[1], one.check) != one.check:
            yield f"Recorded with the check {known[found[1]]}; now {one.check}."
