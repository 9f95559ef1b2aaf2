"""Whether a speed or a gap was reached, and held."""

from __future__ import annotations

import math
from typing import Final

from chauffeur.concept.units import M_PER_CAR_LENGTH
from chauffeur.concept.utterance import Act
from chauffeur.driving.judge.conditions import begin, metres, mps
from chauffeur.driving.judge.references import meant
from chauffeur.driving.judge.trace import PERIOD_S, STANDS_MPS, Found, TracedDrive

SPEED_MPS: Final = 0.8
"""A speed this near the one asked for is that speed (3 km/h): a vehicle far ahead already takes half of it."""
CHANGED_MPS: Final = 1.0
"""A speed without a number is another one from this change on (4 km/h), which a passenger notices."""
GAP_M: Final = 1.0
GAP_SHARE: Final = 0.03
"""A gap is the one asked for within 1 m, or 3 % where that is more."""
GROWN_M: Final = 2.0
"""A gap without a number is another one from this change on."""
SET_MPS: Final = 0.3
"""A set-point that changes by more while it is held is still on its way."""
_HELD_UP_M: Final = 80.0
_SLOWER, _SLOWLY, _USUAL_SHARE, _ROLLS_MPS = 0.85, 0.7, 0.6, 3.0
"""In a town: a share of the speed before, of the limit, of the limit at which one usually drives; rolling."""
_SIGNS: Final = {"faster": 1, "more": 1, "slower": -1, "less": -1}


def speed_asked(drive: TracedDrive, act: Act, start: int) -> float | None:
    """The speed that words name, m/s; None where they name none."""
    began, limit = drive.all[start].ego.speed_mps, drive.limit_mps(start)
    if act.aim in ("limit", "maximum"):
        return limit
    if act.aim == "traffic":
        others = [one.speed_mps for one in drive.all[start].agents.values() if one.speed_mps > STANDS_MPS]
        return sum(others) / len(others) if others else None
    if act.value is None:
        return None
    sign = _SIGNS.get(act.direction or "", 1)
    if act.measure == "times" or (act.unit == "share" and act.measure != "by"):
        return began * act.value
    value = began * act.value if act.unit == "share" else mps(act.value, act.unit)
    match act.measure:
        case "by":
            return began + sign * value
        case "over_limit":
            return limit + value
        case "under_limit":
            return limit - value
        case _:
            return value


def speed(drive: TracedDrive, act: Act, start: int, *, last: bool) -> Found:
    """That the car drives at the speed that was named, or at another one than before, and keeps to it."""
    start, waits = begin(drive, act, start)
    if waits:
        return Found(*waits)
    users = ()
    if act.when is not None and act.when.ref is not None and act.when.type == "while":
        users = meant(drive, act.when.ref, start)
    asked, began = speed_asked(drive, act, start), drive.all[start].ego.speed_mps
    sign, planned = _SIGNS.get(act.direction or "", 0), False
    least_change = CHANGED_MPS
    if asked is None:
        if sign <= 0 and act.direction != "same" and not users and not drive.road.uninterrupted:
            return _slower_in_town(drive, start)
        asked = began if act.direction == "same" else drive.numbers.get("target_speed_mps")
        planned = asked is not None and not act.direction
    elif sign * (asked - began) < -SPEED_MPS and act.measure is None:
        return Found("not_done", start, "the speed that was named lies the other way")
    else:
        least_change = -math.inf  # a number that was said decides

    def fits(i: int) -> bool:
        now = drive.all[i].ego.speed_mps
        if users and not any(_abreast(drive, i, number) for number in users):
            return False
        if asked is None and users and sign <= 0:
            return STANDS_MPS < now < _SLOWLY * drive.limit_mps(i)
        changed = sign * (now - began) >= (least_change if sign else -math.inf)
        return changed and (asked is None or _near(now, asked, SPEED_MPS, act.measure)) and drive.settled(i)

    if asked is None and not users and not sign:
        return Found("not_judged", start, "no speed was named")
    done = drive.held(start, fits, last=last)
    if done is not None:
        return Found("done", done, planned=planned)
    front = drive.all[-1].front
    slow = front is not None and front.distance_m < _HELD_UP_M and asked is not None and front.speed_mps < asked
    why = "the vehicle ahead held the car up" if slow and drive.road.uninterrupted else "the speed was not reached"
    return Found("not_done", start, why, planned)


def _abreast(drive: TracedDrive, i: int, number: int) -> bool:
    seen, gap = drive.sees(i, number), drive.gap_m(i, number)
    return seen is not None and gap is not None and gap < 3.0


def _slower_in_town(drive: TracedDrive, start: int) -> Found:
    """That the car drives slower than it did, or than one usually does where it has just set off."""
    began = drive.all[start].ego.speed_mps
    first, end = (2.0, 6.0) if began > _ROLLS_MPS else (4.0, 12.0)
    most = _SLOWER * max(began, _USUAL_SHARE * drive.limit_mps(start))
    at = drive.all[start].time_s
    window = [one for one in drive.all[start:] if first <= one.time_s - at <= end]
    if not window or window[-1].time_s - at < end - 2.0 * PERIOD_S:
        return Found("not_done", start, "it was not driven for long enough")
    if max(one.ego.speed_mps for one in window) >= most:
        return Found("not_done", start, "the car did not drive slower")
    return Found("done", start + len(window))


def gap_asked(drive: TracedDrive, act: Act, start: int, i: int) -> float | None:
    """The gap that words name, m, centre to centre; of a time headway at the speed of an instant; None of none."""
    if act.value is None:
        return None
    front = drive.all[start].front
    began = None if front is None else front.distance_m
    if act.measure == "times" or act.unit == "share":
        share = act.value if act.measure != "by" else 1.0 + _SIGNS.get(act.direction or "", 1) * act.value
        return None if began is None else began * share
    speed_mps = drive.all[i].ego.speed_mps
    value = act.value * speed_mps if act.unit == "s" else metres(act.value, act.unit)
    if act.measure == "by":
        return None if began is None else began + _SIGNS.get(act.direction or "", 1) * value
    return value + (M_PER_CAR_LENGTH if act.unit == "s" else 0.0)


def planned_gap(drive: TracedDrive, i: int) -> float | None:
    """The gap that the plan sets, m; None where it sets none."""
    headway = drive.numbers.get("time_headway_s")
    at_speed = None if headway is None else M_PER_CAR_LENGTH + headway * drive.all[i].ego.speed_mps
    return drive.numbers.get("gap_m", at_speed)


def gap(drive: TracedDrive, act: Act, start: int, *, last: bool) -> Found:
    """That the gap to the vehicle ahead is the one that was named, or another one than before, and is kept."""
    start, waits = begin(drive, act, start)
    if waits:
        return Found(*waits)
    front, sign = drive.all[start].front, _SIGNS.get(act.direction or "", 0)
    began = None if front is None else front.distance_m
    named = act.value is not None
    by_plan = not named and bool({"gap_m", "time_headway_s"} & drive.numbers.keys())
    planned = by_plan and not sign
    if not named and not by_plan and not sign:
        return Found("not_judged", start, "no gap was named")

    def fits(i: int) -> bool:
        now = drive.all[i].front
        asked = gap_asked(drive, act, start, i) if named else planned_gap(drive, i)
        if now is None:  # a headway to whoever comes is kept while nobody does
            return act.unit == "s" or act.measure == "at_least" or (not named and "gap_m" not in drive.numbers)
        near = asked is None or _near(now.distance_m, asked, max(GAP_M, GAP_SHARE * asked), act.measure)
        other = named or began is None or not sign or sign * (now.distance_m - began) >= GROWN_M
        return near and other and drive.settled(i)

    done = drive.held(start, fits, last=last)
    if done is None:
        return Found("not_done", start, "the gap was not reached", planned)
    return Found("done", done, planned=planned)


def style(drive: TracedDrive, act: Act, start: int, *, last: bool) -> Found:
    """That the car drives at the plan's set-point, once that has come to rest: what a mood comes to is the plan's."""
    del act
    rests_at = math.nan

    def fits(i: int) -> bool:
        nonlocal rests_at
        wanted = drive.all[i].setpoints.target_speed_mps
        if wanted is None:
            return drive.settled(i)
        if not abs(wanted - rests_at) <= SET_MPS:  # nor is the first one, which is compared with no number
            rests_at = wanted
            return False
        return abs(drive.all[i].ego.speed_mps - wanted) <= SPEED_MPS and drive.settled(i)

    done = drive.held(start, fits, last=last)
    if done is not None:
        return Found("done", done, planned=True)
    return Found("not_done", start, "the speed that was planned was not reached", planned=True)


def _near(value: float, asked: float, within: float, measure: str | None) -> bool:
    low, high = value >= asked - within, value <= asked + within
    return low if measure == "at_least" else high if measure == "at_most" else low and high
