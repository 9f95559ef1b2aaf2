"""Whether what an act waits for had come when it was done."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final, NamedTuple

from chauffeur.concept import PartResult
from chauffeur.concept.units import M_PER_CAR_LENGTH, M_PER_FOOT, M_PER_KM, M_PER_YARD, MPS_PER_KMH, MPS_PER_MPH
from chauffeur.concept.utterance import Act, Condition, Event
from chauffeur.driving.judge.references import ROAD_USERS, WAYSIDE, meant
from chauffeur.driving.judge.trace import ON_PATH_M, PERIOD_S, Passage, TracedDrive

_METRES: Final = {"km": M_PER_KM, "ft": M_PER_FOOT, "yd": M_PER_YARD, "lengths": M_PER_CAR_LENGTH}
_MPS: Final = {"mph": MPS_PER_MPH, "m/s": 1.0}
_CLOCK_S: Final = 1.5
"""How much sooner than at the time that was said an act may begin."""
_CLOSE_M, _SLOWER_MPS = 2.0, 1.0
_NEAR_M: Final = 25.0
_STOPPED_MPS: Final = 0.5


class _At(NamedTuple):
    """A condition of an act that begins at an instant, looked for from another one on."""

    drive: TracedDrive
    when: Condition
    begins: int
    start: int
    passage: Passage | None = None


def metres(value: float, unit: str) -> float:
    """A length in the unit in which it was said."""
    return value * _METRES.get(unit, 1.0)


def mps(value: float, unit: str) -> float:
    """A speed in the unit in which it was said; km/h where none was."""
    return value * _MPS.get(unit, MPS_PER_KMH)


def unknown(when: Condition | None) -> bool:
    """Whether there is no telling of a condition when it holds."""
    if when is None:
        return False
    place = when.ref is not None and when.ref.kind not in (*ROAD_USERS, *WAYSIDE)
    return place or when.event not in _EVENTS or when.type == "unless"


def too_early(drive: TracedDrive, act: Act, begins: int, start: int, passage: Passage | None = None) -> str:
    """What was too early, or too late, about an act that begins at an instant; empty where nothing was."""
    when = act.when
    if when is None or unknown(when) or when.type in ("while", "until"):
        return ""
    begins = min(max(begins, start), len(drive.all) - 1)
    why = _EVENTS[when.event](_At(drive, when, begins, start, passage))
    if when.type == "before":
        return "" if why or when.event == "clear" else "it was too late for that"
    return why


def begin(drive: TracedDrive, act: Act, start: int) -> tuple[int, tuple[PartResult, int, str] | None]:
    """The instant from which an act that lasts can be looked for, and what becomes of it where that does not come."""
    if act.when is None or act.when.type in ("while", "until", "before"):
        return start, None
    why = ""
    for i in range(start, len(drive.all)):
        if not (why := too_early(drive, act, i, start)):
            return i, None
    if act.when.type == "if":
        return start, ("not_judged", start, "what it depends on did not come")
    return start, ("not_done", start, why)


def came(drive: TracedDrive, when: Condition, i: int, start: int) -> bool:
    """Whether an event has come."""
    return when.event in _EVENTS and not _EVENTS[when.event](_At(drive, when, i, start))


def _green(at: _At) -> str:
    lane = (at.passage.before if at.passage is not None else at.drive.all[at.begins].ego.lane) or ""
    shown = at.drive.all[max(0, at.begins - 1)].lights.get(lane)
    return "" if shown == at.when.event else f"the light showed {shown or 'nothing'}"


def _gone(at: _At) -> str:
    users = () if at.when.ref is None else meant(at.drive, at.when.ref, at.start)
    return next((why for number in users if (why := _still_there(at.drive, number, at.begins, at.start))), "")


def _passed(at: _At) -> str:
    if at.when.ref is not None and at.when.ref.kind in WAYSIDE:
        return "" if any(one.leaves <= at.begins for one in at.drive.passages) else "it had not been passed"
    users = () if at.when.ref is None else meant(at.drive, at.when.ref, at.start)
    return "" if any(at.drive.is_behind(at.begins, number) for number in users) else "it had not been passed"


def _moves(at: _At) -> str:
    users = () if at.when.ref is None else meant(at.drive, at.when.ref, at.start)
    return "" if any(at.drive.moved(number, at.begins) for number in users) else "it had not moved"


def _stopped(at: _At) -> str:
    return _some(at, lambda i, number: _speed(at.drive, i, number) < _STOPPED_MPS, "stopped")


def _near(at: _At) -> str:
    if at.when.ref is not None and at.when.ref.kind in WAYSIDE:
        return "" if at.drive.before_junction(at.begins) else "it was not near"
    return _some(at, lambda i, number: _away(at.drive, i, number) < _NEAR_M, "come near")


def _closer(at: _At) -> str:
    most = math.inf if at.when.value is None else metres(at.when.value, at.when.unit) + _CLOSE_M
    return _some(at, lambda i, number: _away(at.drive, i, number) < most, "come so close")


def _further(at: _At) -> str:
    least = 0.0 if at.when.value is None else metres(at.when.value, at.when.unit) - _CLOSE_M
    return _some(at, lambda i, number: _away(at.drive, i, number) > least, "got so far")


def _slower(at: _At) -> str:
    most = at.drive.limit_mps(at.begins) if at.when.value is None else mps(at.when.value, at.when.unit) + _SLOWER_MPS
    return _some(at, lambda i, number: _speed(at.drive, i, number) < most, "been so slow")


def _time(at: _At) -> str:
    least = at.drive.all[at.start].time_s + (at.when.value or 0.0) - _CLOCK_S
    return "" if at.drive.all[at.begins].time_s >= least else "it was too soon"


def _clear(at: _At) -> str:
    """Nothing: what every at.drive sees to, and the judge of collisions."""
    return "" if at.when.ref is None else _gone(at)


_EVENTS: Final[dict[Event, Callable[[_At], str]]] = {
    "green": _green, "red": _green, "gone": _gone, "clear": _clear, "passed": _passed, "moves": _moves,
    "stopped": _stopped, "near": _near, "closer": _closer, "further": _further, "slower": _slower, "time": _time,
}  # fmt: skip


def _some(at: _At, fits: Callable[[int, int], bool], had: str) -> str:
    """Empty where something holds of one of those that are meant, at an instant or just before it."""
    users = meant(at.drive, at.when.ref, at.start)
    looked = range(max(at.start, at.begins - round(_CLOCK_S / PERIOD_S)), at.begins + 1)
    return "" if any(fits(i, number) for i in looked for number in users) else f"it had not {had}"


def _speed(drive: TracedDrive, i: int, number: int) -> float:
    agent = drive.all[i].agents.get(number)
    return math.inf if agent is None else agent.speed_mps


def _away(drive: TracedDrive, i: int, number: int) -> float:
    seen = drive.sees(i, number)
    return math.nan if seen is None else math.hypot(*seen)


def _still_there(drive: TracedDrive, number: int, begins: int, start: int) -> str:
    """Why a road user had not gone when an act began: it came onto the car's way afterwards, or was coming."""
    agent = drive.all[begins].agents.get(number)
    if agent is None:
        return ""
    ahead = [(one.ego.x_m, one.ego.y_m) for one in drive.all[begins:]][::3]
    for i in range(begins + 2, len(drive.all)):
        later, seen = drive.all[i].agents.get(number), drive.sees(i, number)
        if later is None or seen is None:
            break
        near = (math.dist(point, (later.x_m, later.y_m)) for point in ahead)
        if seen[0] > 0.0 and later.speed_mps > 0.3 and min(near, default=math.inf) < ON_PATH_M:
            along = math.cos(later.heading_rad - drive.all[i].ego.heading_rad) > 0.8
            if not along:
                return "it came onto the way after that"
    earlier = max(start, begins - 10)
    if number not in drive.all[earlier].agents:
        return ""
    if agent.kind == "pedestrian" and not drive.moved(number, begins):
        return "it had not gone yet"
    seen, ego = drive.sees(begins, number), drive.all[begins].ego
    facing = math.cos(agent.heading_rad - ego.heading_rad) < -0.5
    nears = _away(drive, begins, number) < _away(drive, earlier, number)
    coming = seen is not None and seen[0] > 0.0 and facing and nears and agent.speed_mps > 1.0
    return "it was still coming" if coming else ""
