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
from chauffeur.language.questions import ADDRESS
from chauffeur.language.tokens import words_of
from chauffeur.worlds.places import Destination

DONT_KNOW: Final = "I don't know that. I can tell our speed, the limit, our lane and who is ahead."

_US: Final = r"(?:i|we|you|it|he|the car)"
_WHY_STANDING: Final = re.compile(
    rf"{ADDRESS}why (?:(?:are|did|do|have|is|has) {_US} (?:just |now |still |all )?"
    r"(?:stand\w*|stop\w*|wait\w*|brak\w*|slow(?:ed|ing)|still)|"
    rf"(?:are|is) (?:not {_US}|{_US} (?:still )?not) (?:moving|driving|going))"
    r"(?: (?:here|now|there|down|still|for|at all|anywhere))*$"
)
"""Why the car stands or brakes; not a complaint that it is slow, which is a wish."""
_IN_THE_WAY: Final = re.compile(r"light [^.]{0,40}(?:red|yellow)|on foot|stop sign")
_SENTENCE_ENDS: Final = re.compile(r"(?<=[a-z])\. ")
_STANDS_BEHIND_M: Final = 25.0
"""A car this near ahead, centre to centre, may be why one brakes or waits."""
_NO_REASON: Final = "I see no light, sign, car or person ahead that would hold us up."

_MAY: Final = r"(?:may|can|could|should|must)"
_WE: Final = r"(?:i|we|you|one)"
_ASKS: Final = re.compile(
    rf"{ADDRESS}"
    r"(?:(?:can|could|would|will) you (?:please )?tell (?:me|us) |(?:do|did) you (?:happen to )?know |"
    r"tell (?:me|us) |i wonder )?"
    r"(?:whats?|which|how (?:fast|far|many|much|long|old|big|tall|close|late)|where|when|who|whose|"
    r"is there|are there|is it|are we (?:nearly |almost |soon |about )?there|will we (?:arrive|be there) soon)\b"
)
"""How a question begins that wants to know something; not one that asks for something, complains or proposes."""
_PROPOSES: Final = re.compile(
    r"^what (?:about|if|are you (?:doing|waiting)|the|a|do you think you)\b|\bhow about\b|"
    r"\bwhat is (?:taking|the (?:hold|matter|point|rush))\b|^when (?:you|we|he|she|it|there|the)\b"
)
_THEIRS: Final = (
    r"(?:he|she|they|him|her|it|"
    r"(?:the|that|this) (?:\w+ )?(?:car|vehicle|truck|van|lorry|bus|one|guy|driver|front|lead)\b.*)"
)
_AHEAD: Final = r"(?:ahead|in front|before us|front|lead)"


_WAY: Final = "way"
"""Name of the fact how far it is to where the car is going."""
_DOING: Final = "doing"
"""Name of the fact what is driven, and what became of what was driven last."""
_ABOUT_DOING: Final = re.compile(
    rf"{ADDRESS}(?:what (?:are|were) {_US} doing(?: now| here| there| right now)?$|"
    rf"what (?:did|have) {_US} (?:just )?(?:do|done)(?: now| there| just now)?$|"
    rf"did {_US} (?:do|finish) (?:it|that)(?: already| yet)?$|"
    rf"are {_US} (?:doing|still doing) (?:it|that)(?: now| yet)?$|"
    rf"why (?:are|were|did|do|have|has|is) {_US} (?:just |now |still |all )?"
    r"(?:chang|overtak|pass|turn|follow|accelerat|speed(?:ing)? up|mov|cross|merg|leav|pull)\w*\b)"
)
"""Asks about what the car does or did; answered by its execution."""


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


_TOPICS: Final[tuple[tuple[re.Pattern[str], Callable[[Situation], str]], ...]] = tuple(
    (re.compile("|".join(patterns)), answer)
    for patterns, answer in (
        (
            (
                r"\b(?:are|were) we (?:\w+ )?there\b|\bwhen (?:do|will|are) we (?:arrive|get there|be there|there)\b",
                r"\bhow (?:far|long(?! (?:ha|is|was|did))|much longer|many minutes|soon)\b"
                r"(?!.*\b(?:ahead|front|away|behind)\b)",
                r"\bwhere (?:are we (?:going|heading)|are you taking)\b|\bwill we (?:arrive|be there) soon\b",
            ),
            _of_scene(_WAY),
        ),
        ((r"\b(?:weather|raining|rain|snowing|foggy|forecast)\b(?! tomorrow)",), _of_scene("weather")),
        ((r"\btraffic (?:like|ahead|rules?)\b|\btraffic$",), _of_scene("traffic")),
        (
            (
                r"\b(?:which|what) (?:road|street|highway|motorway) (?:is this|are we|am i)\b",
                r"^where are we\b",
                r"\b(?:whats?|what is) (?:this|the name of (?:this|the)) (?:road|street)\b",
                r"\b(?:road|street) (?:name|called)\b|\bhow (?:it is|is it|is this (?:road|street)) called\b",
            ),
            _of_scene("road"),
        ),
        (
            (
                rf"\blimit\b|\bmaximum speed\b|\bhow fast (?:{_MAY}|{_WE} {_MAY})\b",
                rf"\bhow fast (?:am|are|is) {_WE} allowed\b",
            ),
            _limit,
        ),
        ((rf"\bhow fast (?:is|are|was|does|do) {_THEIRS}", rf"\bspeed of (?:the|that) \w+ {_AHEAD}\b"), _front),
        (
            (
                r"\bhow fast (?:am|are|is|do) (?:i|we|you|it|this)\b",
                r"\b(?:our|my|your|current) speed\b|\bspeed (?:are|am|is) (?:we|i|it|this)\b|\bthe speed$",
            ),
            _own_speed,
        ),
        ((r"\bstop sign\b",), _stop_sign),
        ((r"\b(?:which|what) lane\b|\bhow many lanes\b",), _lane),
        (
            (rf"\b(?:which way|where) {_MAY} {_WE} (?:turn|go)\b", r"\b(?:junction|crossing|intersection)\b"),
            _turns,
        ),
        (
            (
                rf"\bhow (?:far|close|much (?:room|space|distance))\b.*\b{_AHEAD}\b|\b(?:distance|gap|headway)\b",
                rf"\b(?:any(?:one|body)|some(?:one|body)|nobody|who|what|car|vehicle)\b.*\b{_AHEAD}\b",
                r"^how (?:far|close) (?:away )?(?:is|are) (?:he|she|they|it)\b",
            ),
            _front,
        ),
    )
)


def _held_up(situation: Situation, seen: str) -> str:
    """What C holds that may be why the car stands or brakes."""
    front = situation.front
    found = [one.rstrip(". ") for one in _SENTENCE_ENDS.split(seen) if _IN_THE_WAY.search(one) and "no stop" not in one]
    if front is not None and front.distance_m < _STANDS_BEHIND_M:
        found.append(_front(situation).rstrip("."))
    told = ". ".join(re.sub(r"\bmy\b", "our", re.sub(r"\bme\b", "us", one)) for one in found)
    return f"{told}." if told else _NO_REASON


def asks_to_know(text: str) -> bool:
    """Whether words ask for knowledge and for nothing to be done."""
    words = words_of(text).rstrip(" ?.!")
    return _ASKS.match(words) is not None and _PROPOSES.search(words) is None and not re.search(r"[.,;!?]", words)


def answer_to(text: str, situation: Situation, seen: str = "") -> str:
    """What C says to a question about it; empty where it is no such question, or C does not hold the answer.

    Args:
        text: The person's words.
        situation: C as numbers.
        seen: C in words.
    """
    words = words_of(text).rstrip(" ?.!")
    if _ABOUT_DOING.match(words) and (doing := dict(situation.scene).get(_DOING, "")):
        return doing
    if _WHY_STANDING.match(words):
        return _held_up(situation, seen)
    if not asks_to_know(text):
        return ""
    return next((said for pattern, answer in _TOPICS if pattern.search(words) and (said := answer(situation))), "")
