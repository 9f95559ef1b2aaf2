"""Lanes and speeds that a mood implies: past a slower car in a hurry, out of the fast lane at ease.

The paper's own example (Sec. V, S) answers "I'm really in a hurry now" behind a slower car with a free lane on the left
by changing lanes. Whether the lane is free is for the driver to see, who waits until it is.
"""

from __future__ import annotations

from typing import Final, Literal

from chauffeur.concept import Limits, Situation
from chauffeur.planners.onboard.options import last_lane
from chauffeur.planners.talk2drive.style import BRISK_SHARE, CALM_SHARE, LOT_SHARE, RIGHT_SHARE

_HURRIES: Final = ("style.hurry", "style.sporty")
_EASES: Final = ("style.relax", "style.comfort", "style.careful", "style.eco")
_STAYS: Final = ("follow", "lane.keep")
_LOT_STEP: Final = 0.3
_LOT_MOST: Final = 0.6
"""Shares of the present speed in a lot by which a step changes it, and by which it may to come up to what is usual."""
_ROAD_STEP: Final = 0.12
_CALM_ENOUGH: Final = 0.85
"""Share of the limit above which a car that is found too fast goes down to a calm speed."""
_NEAR_S: Final = 4.0
"""Distance beyond which a car ahead holds no one up yet."""
_SLOWER_SHARE: Final = 0.92
"""Share of the limit above which a car holds no one up."""
_LEAST_BY_MPS: Final = 1.0
_PASSES_BY_MPS: Final = 5.0
"""By how much a car is passed that holds somebody up: a long way side by side helps nobody."""


def mood_lane(intent: str, situation: Situation) -> Literal[-1, 0, 1]:
    """The lane a way of driving asks for, relative to the present one."""
    if situation.world != "highway":
        return 0
    if intent.startswith(_HURRIES) and situation.lane_index > 0 and held_up(situation):
        return -1
    if intent.startswith(_EASES) and situation.lane_index < last_lane(situation):
        return 1
    return 0


def follows(situation: Situation) -> bool:
    """True if a lead vehicle is near enough to be followed."""
    front = situation.front
    return front is not None and front.distance_m < max(20.0, _NEAR_S * situation.speed_mps)


def held_up(situation: Situation) -> bool:
    """True if a slower lead vehicle is near."""
    front = situation.front
    return front is not None and follows(situation) and front.speed_mps < _SLOWER_SHARE * situation.speed_limit_mps


def cap_mps(situation: Situation, limits: Limits) -> float:
    """The highest speed to choose where none was named, m/s: that of the sign, within the limits."""
    return min(situation.speed_limit_mps, limits.most_mps(situation.speed_limit_mps))


def passing_mps(situation: Situation, wanted_mps: float, leaning_mps: float = 0.0) -> float:
    """The speed to pass at, m/s: what is wanted, or enough to get by, within the sign.

    Args:
        situation: Who is ahead, and what the sign says.
        wanted_mps: What the words ask for.
        leaning_mps: What the person's history adds to chosen speeds.
    """
    front = situation.front
    if front is None:
        return wanted_mps
    enough = front.speed_mps + max(_LEAST_BY_MPS, _PASSES_BY_MPS + leaning_mps)
    return max(wanted_mps, min(enough, situation.speed_limit_mps))


def fitting_mps(speed_mps: float, intent: str, situation: Situation, limits: Limits, leaning_mps: float = 0.0) -> float:
    """A speed that was chosen for a highway, made fit for where we are, m/s.

    Who is in a hurry drives close to the limit, who leaves for the right lane a little below it. At ease, four fifths
    of it are enough; behind somebody, whom the cruise control follows in any case, that is what the car goes up to when
    they go on. In a lot speeds are small, and so are the steps between them.

    Args:
        speed_mps: As it was chosen.
        intent: For which wish.
        situation: Where we are.
        limits: No speed beyond them.
        leaning_mps: What the person's history added to the chosen speed.
    """
    now, sign = situation.speed_mps, cap_mps(situation, limits)
    if situation.world == "parking":
        return _in_lot(speed_mps, intent, now, sign)
    if situation.world != "highway" or not speed_mps:
        return speed_mps
    brisk, calm = BRISK_SHARE * sign + leaning_mps, CALM_SHARE * sign + leaning_mps
    if intent.startswith(_HURRIES):
        return min(max(speed_mps, brisk), max(speed_mps, sign))
    if intent.startswith("overtake") and situation.front is not None:
        return min(speed_mps, max(brisk, situation.front.speed_mps + _PASSES_BY_MPS))
    if intent.startswith(_EASES):
        keeps_behind = follows(situation) and mood_lane(intent, situation) == 0
        return calm if keeps_behind or now > CALM_SHARE * sign else min(speed_mps, now)
    if intent.startswith(_STAYS) and follows(situation):
        return max(speed_mps, calm)
    if intent == "lane.right":
        return min(speed_mps, max(RIGHT_SHARE * sign + leaning_mps, 0.0))
    return speed_mps


def _in_lot(speed_mps: float, intent: str, now_mps: float, sign_mps: float) -> float:
    usual = LOT_SHARE * sign_mps
    if intent.startswith(_HURRIES):
        return max(speed_mps, usual)
    if intent.startswith("speed.increase"):
        return max(min(speed_mps, (1.0 + _LOT_STEP) * now_mps), min(usual, (1.0 + _LOT_MOST) * now_mps))
    if intent == "speed.decrease":
        return (1.0 - _LOT_STEP) * now_mps
    if intent.startswith("speed.decrease"):
        return max((1.0 - _LOT_MOST) * now_mps, speed_mps)
    return speed_mps


def eased_mps(sign: int, situation: Situation, limits: Limits) -> float:
    """The speed after a complaint on the pace, m/s.

    Args:
        sign: 1 where it was too slow, -1 where it was too fast.
        situation: The speed now, and the limit.
        limits: No speed beyond them.
    """
    now, limit, cap = situation.speed_mps, situation.speed_limit_mps, cap_mps(situation, limits)
    if situation.world == "parking":
        return _in_lot((1.0 + sign * _LOT_STEP) * now, "speed.increase" if sign > 0 else "speed.decrease", now, cap)
    if sign > 0:
        return min((1.0 + _ROAD_STEP) * now, cap)
    return CALM_SHARE * limit if now > _CALM_ENOUGH * limit else (1.0 - _ROAD_STEP) * now


def unsaid_turn(wish: str, intent: str) -> bool:
    """True if a turn was read into words that name no side."""
    side = intent.removeprefix("turn.")
    return side in ("left", "right") and intent.startswith("turn.") and side not in wish.lower()
