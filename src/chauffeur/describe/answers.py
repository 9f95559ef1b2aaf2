"""Answers to questions about the situation, read off C: no model guesses, and an answer never changes the drive.

What C does not hold is not made up: a question it leaves open gets an honest "I don't know".
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Final

from chauffeur.concept import Context, Situation
from chauffeur.concept.units import people_speed
from chauffeur.describe.road import SIGHT_M, ordinal
from chauffeur.language.inquiries import Topic, topics_of
from chauffeur.worlds.places import Destination

DONT_KNOW: Final = "I don't know that. I can tell our speed, the limit, our lane and who is ahead."

_IN_THE_WAY: Final = re.compile(r"light [^.]{0,40}(?:red|yellow)|on foot|stop sign")
_SENTENCE_ENDS: Final = re.compile(r"(?<=[a-z])\. ")
_STANDS_BEHIND_M: Final = 25.0
"""A car this near ahead, centre to centre, may be why one brakes or waits."""
_NO_REASON: Final = "I see no light, sign, car or person ahead that would hold us up."

_WAY: Final = "way"
"""Name of the fact how far it is to where the car is going."""
_DOING: Final = "doing"
"""Name of the fact what is driven, and what became of what was driven last."""


def _speed(speed_mps: float) -> str:
    return f"{people_speed(speed_mps)} ({people_speed(speed_mps, 'mph')})"


def _own_speed(situation: Situation) -> str:
    return f"We are driving at {_speed(situation.speed_mps)}."


def _limit(situation: Situation) -> str:
    return f"The speed limit here is {_speed(situation.speed_limit_mps)}."


def _front(situation: Situation) -> str:
    front = situation.front
    if front is None:
        return f"Nobody is ahead of us in our lane within {SIGHT_M:.0f} m."
    return f"The car ahead is {front.distance_m:.0f} m away, centre to centre, and drives at {_speed(front.speed_mps)}."


def _lane(situation: Situation) -> str:
    count = situation.lane_count
    if count == 1:
        return "There is one lane in our direction."
    place = "leftmost" if situation.lane_index == 0 else "rightmost" if situation.lane_index == count - 1 else ""
    where = f"the {place}" if place else f"the {ordinal(situation.lane_index + 1)} from the left"
    also = " The rightmost is an emergency lane." if situation.emergency_lane else ""
    return f"We are in {where} of {count} lanes.{also}"


def _stop_sign(situation: Situation) -> str:
    at = situation.stop_sign_m
    return "No stop sign is ahead that I see." if at is None else f"A stop sign is ahead in {at:.0f} m."


def _turns(situation: Situation) -> str:
    if not situation.turns:
        return "No junction is ahead that I know of."
    return f"At the next junction we can go {' or '.join(situation.turns)}."


def with_way(context: Context, there: Destination | None) -> Context:
    """C that knows how far it is to where the car is going; as it was where that is nowhere."""
    if there is None:
        return context
    left = (
        f"{there.left_m / 1000.0:.1f} km" if there.left_m >= 1000.0 else f"{max(10.0, round(there.left_m, -1)):.0f} m"
    )
    words = f"It is about {left} by road to {there.name or 'where we are going'}."
    return _with_fact(context, _WAY, words)


def with_doing(context: Context, doing: str) -> Context:
    """C that knows what is driven, and what became of what was driven last; as it was where that is nothing."""
    return _with_fact(context, _DOING, doing) if doing else context


def _with_fact(context: Context, name: str, words: str) -> Context:
    situation = replace(context.situation, scene=(*context.situation.scene, (name, words)))
    return replace(context, situation=situation)


def _of_scene(name: str) -> Callable[[Situation], str]:
    return lambda situation: dict(situation.scene).get(name, "")


_ANSWERS: Final[dict[Topic, Callable[[Situation], str]]] = {
    "doing": _of_scene(_DOING), "way": _of_scene(_WAY), "weather": _of_scene("weather"),
    "traffic": _of_scene("traffic"), "road": _of_scene("road"), "limit": _limit, "front": _front, "speed": _own_speed,
    "stop sign": _stop_sign, "lane": _lane, "turns": _turns,
}  # fmt: skip


def _held_up(situation: Situation, seen: str) -> str:
    """What C holds that may be why the car stands or brakes."""
    front = situation.front
    found = [one.rstrip(". ") for one in _SENTENCE_ENDS.split(seen) if _IN_THE_WAY.search(one) and "no stop" not in one]
    if front is not None and front.distance_m < _STANDS_BEHIND_M:
        found.append(_front(situation).rstrip("."))
    told = ". ".join(re.sub(r"\bmy\b", "our", re.sub(r"\bme\b", "us", one)) for one in found)
    return f"{told}." if told else _NO_REASON


def answer_to(text: str, situation: Situation, seen: str = "") -> str:
    """What C says to a question about it; empty where it is no such question, or C does not hold the answer.

    Args:
        text: The person's words.
        situation: C as numbers.
        seen: C in words.
    """
    for topic in topics_of(text):
        said = _held_up(situation, seen) if topic == "standing" else _ANSWERS[topic](situation)
        if said:
            return said
    return ""
