"""A second look at what the model wrote, by rules that know words: what contradicts the wish is asked about.

A small network may copy a number wrongly or mix up two sides. So every number of a program must be one that the person
named or history holds (see `copying`), and where the rule-based reading of the same words is sure of a side or a
direction, the program must not say the opposite.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

from chauffeur.planners.arbitration import pace_of
from chauffeur.planners.onboard.dialect import DialectStep
from chauffeur.planners.onboard.meaning import Meaning, NotUnderstood, Reading
from chauffeur.planners.onboard.moods import mood_of, pace_complaint
from chauffeur.planners.onboard.quoted_numbers import unnamed
from chauffeur.planners.onboard.understand import understand

_SIDES: Final = ("left", "right")
_SERVICE: Final = re.compile(
    r"\A(?:please|hey|ok|okay|can you|could you|would you|will you|just|now|\W)*"
    r"(?:play|sing|order|book|ring|phone|email|text|google|tell (?:me|us) (?:a|about)|put on (?:the|some))\b",
    re.IGNORECASE,
)
"""How a sentence begins that asks for something else than driving."""
NOT_THE_NUMBER: Final = "I am not sure about the number"
_WHICH_SIDE: Final = "Do you mean left or right?"


def doubt(wish: str, history: Sequence[str], steps: Sequence[DialectStep]) -> str:
    """What to ask back about a program before it is driven; empty when nothing speaks against it.

    Args:
        wish: The passenger's words.
        history: Remembered trips as the model read them.
        steps: What the program does.
    """
    strange = unnamed(wish, history, steps)
    if strange is not None:
        return f"{NOT_THE_NUMBER}: did you mean {strange.value:g}?"
    reading = understand(wish)
    if isinstance(reading, NotUnderstood):
        if reading.why == "off_topic" and _SERVICE.match(wish):
            return reading.words
        both = set(_SIDES) <= set(re.findall(r"[a-z]+", wish.lower()))
        sided = any(step.meaning.direction in _SIDES for step in steps)
        return _WHICH_SIDE if reading.why == "ambiguous" and both and sided else ""
    return _contradiction(wish, reading, steps)


def _outvoted(wish: str, ruled: Meaning, pace: int) -> bool:
    """Whether complaints ("a bit fast") speak for a program's pace and against the rules' reading.

    Moods ("others race, we have time") do so where the rules saw a mood as well: what is asked for outright stands.
    """
    mood = {"hurry": 1, "ease": -1, "": 0}[mood_of(wish)] if ruled.manoeuvre == "style" else 0
    complaint = pace_complaint(wish)
    return complaint * pace > 0 or (not complaint and mood * pace > 0)


def _contradiction(wish: str, reading: Reading, steps: Sequence[DialectStep]) -> str:
    """Where both read the same manoeuvres, whether one of them says left for right or more for less.

    On the pace a third reader may side with the program, see `_outvoted`.
    """
    if len(reading.steps) != len(steps):
        return ""
    for ruled, step in zip(reading.steps, steps, strict=True):
        written = step.meaning
        if step.number is not None and step.number.factor != 1.0:
            continue  # "a bit slower than last time" may still be faster than now
        if pace_of(ruled) * pace_of(written) < 0 and not _outvoted(wish, ruled, pace_of(written)):
            return "Shall I drive faster or slower?"
        if ruled.manoeuvre != written.manoeuvre:
            continue
        if {ruled.direction, written.direction} == set(_SIDES):
            return _WHICH_SIDE
        if ruled.change * written.change < 0:
            return "Do you want more or less of it?"
    return ""
