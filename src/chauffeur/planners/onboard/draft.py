"""The rules' reading of a wish, as the network is shown it: names of skills, no numbers; it may agree with them or not.

A small network that learned from a grammar knows the phrasings of that grammar; the rules know words. Shown both, it
is right on phrasings that only one of them understands.
"""

from __future__ import annotations

from functools import cache
from typing import Final

from chauffeur.planners.onboard.dialect import SKILLS, DialectStep, Number
from chauffeur.planners.onboard.meaning import BIT, MUCH, Meaning, NotUnderstood
from chauffeur.planners.onboard.understand import understand

UNREAD: Final = ""
"""The draft where nobody read the words: the network alone decides."""


def draft(wish: str) -> str:
    """What the rules read: `lane_left(), faster_by()`, or why they read nothing: `ambiguous`."""
    reading = understand(wish)
    if isinstance(reading, NotUnderstood):
        return reading.why
    return ", ".join(_named(meaning) for meaning in reading.steps)


def _named(meaning: Meaning) -> str:
    """The call of the skill that comes nearest to a meaning; the meaning's family where none does."""
    for condition in dict.fromkeys((meaning.condition, "")):
        name = _skills().get(_key(meaning, condition))
        if name is not None:
            return f"{name}()"
    measured = meaning.amount.dimension if meaning.amount is not None else ""
    return f"{meaning.family} {measured}".strip()


def _key(meaning: Meaning, condition: str) -> tuple[object, ...]:
    """What tells skills apart: a number's kind, not its value; degrees as three; no direction for what is absolute."""
    amount = meaning.amount
    change: int = meaning.change
    measured = ""
    degree = 0
    if amount is not None:
        below = amount.frame == "over_limit" and amount.value < 0.0
        measured = f"{amount.dimension} {amount.frame} {'' if amount.dimension == 'lanes' else amount.bound} {below}"
        change = change if amount.frame == "relative" else 0
    elif change:
        degree = -1 if meaning.degree <= BIT else 1 if meaning.degree >= MUCH else 0
    return (meaning.manoeuvre, meaning.direction, change, measured, degree, meaning.variant, condition)


@cache
def _skills() -> dict[tuple[object, ...], str]:
    out: dict[tuple[object, ...], str] = {}
    for name in SKILLS:
        meaning = DialectStep(name, Number(1.0)).meaning
        out[_key(meaning, meaning.condition)] = name
    return out
