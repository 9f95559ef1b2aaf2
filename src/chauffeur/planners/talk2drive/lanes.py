"""What a mood asks for where nothing was named: past a slower car in a hurry, out of the fast lane at ease.

The seed's own example (Sec. V, S) answers "I'm really in a hurry now" behind a slower car with a free lane on the left
by changing lanes. Whether the lane is free is for the driver to see, who waits until it is.
"""

from __future__ import annotations

import re
from typing import Final, Literal

from chauffeur.concept import Situation
from chauffeur.memory.feedback import interpret_feedback

_HURRIES: Final = ("style.hurry", "style.sporty")
_EASES: Final = ("style.relax", "style.comfort", "style.careful", "style.eco")
_MOVES: Final = re.compile(
    r"\b(?:change|move|switch|go|get|take|merge|pull|shift|steer|use|drive|keep|stay|head)\b", re.IGNORECASE
)
_STEPS: Final = ("speed.increase", "speed.decrease")
_LOT_STEP: Final = 0.3
_ROAD_STEP: Final = 0.12
_NEAR_S: Final = 4.0
"""A car farther ahead than this holds nobody up yet."""
_SLOWER_SHARE: Final = 0.92
"""Of the limit: a car that is faster than this holds nobody up."""
_LEAST_BY_MPS: Final = 1.0
_PASSES_BY_MPS: Final = 5.0
"""By how much a car is passed that holds somebody up: a long way side by side helps nobody."""


def mood_lane(intent: str, situation: Situation) -> Literal[-1, 0, 1]:
    """The lane a way of driving asks for, relative to the present one."""
    if situation.world != "highway":
        return 0
    if intent.startswith(_HURRIES) and situation.lane_index > 0 and held_up(situation):
        return -1
    last = situation.lane_count - (2 if situation.emergency_lane else 1)
    if intent.startswith(_EASES) and situation.lane_index < last:
        return 1
    return 0


def held_up(situation: Situation) -> bool:
    """Whether a slower car is right ahead."""
    front = situation.front
    if front is None:
        return False
    near = front.distance_m < max(20.0, _NEAR_S * situation.speed_mps)
    return near and front.speed_mps < _SLOWER_SHARE * situation.speed_limit_mps


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


def fitting_mps(speed_mps: float, intent: str, situation: Situation) -> float:
    """A speed that was chosen for a highway, made fit for where we are, m/s.

    At ease behind a slower car, in the lane for it, nothing needs to change: it sets a calm pace. And in a lot, where
    speeds are small, so are the steps between them.
    """
    now = situation.speed_mps
    stays = mood_lane(intent, situation) == 0
    if intent.startswith(_EASES) and stays and held_up(situation) and situation.front is not None:
        return max(speed_mps, min(now, situation.front.speed_mps))
    if situation.world == "parking" and intent.startswith(_STEPS):
        return max((1.0 - _LOT_STEP) * now, min(speed_mps, (1.0 + _LOT_STEP) * now))
    return speed_mps


def complaint_mps(wish: str, situation: Situation) -> float:
    """By how much words that are no wish, but a complaint on the pace, ask to change the speed, m/s; 0 where they do
    not complain."""
    heard = interpret_feedback(wish)
    sign = heard.speed or (-1 if heard.comfort < 0 else 0)
    if not sign or heard.approval > 0:
        return 0.0
    step = _LOT_STEP if situation.world == "parking" else _ROAD_STEP
    return sign * step * situation.speed_mps


def of_left_lane(wish: str, intent: str, situation: Situation) -> bool:
    """Whether words speak of the left lane we are in already, and do not ask for it: nobody praises it that way."""
    in_it = situation.lane_index == 0 and situation.lane_count > 1 + situation.emergency_lane
    return in_it and intent.startswith("lane.left") and _MOVES.search(wish) is None


def unsaid_turn(wish: str, intent: str) -> bool:
    """Whether a turn was read into words that name no side."""
    side = intent.removeprefix("turn.")
    return side in ("left", "right") and intent.startswith("turn.") and side not in wish.lower()
