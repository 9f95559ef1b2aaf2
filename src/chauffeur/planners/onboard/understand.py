"""What words mean wherever the car is: the acts of the one reader as steps of the dialect, with their meanings."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Final

from chauffeur.concept import Situation
from chauffeur.concept.utterance import Address
from chauffeur.language.meaning.reader import read
from chauffeur.planners.meaning.highway import steps_of
from chauffeur.planners.onboard.doubts import CAN_DO
from chauffeur.planners.onboard.meaning import Meaning, NotUnderstood, Reading, Why

NOWHERE: Final = Situation("highway", 25.0, 31.2928, 3, 1, False, None, None)
"""A road on which every act has a place; its signs are in mph."""
_SURE: Final = 0.5
"""Below this a reading is more likely wrong than right, and says nothing outright."""
_WHY: Final[dict[Address, Why]] = {"question": "question", "car": "unknown"}


@lru_cache(maxsize=32)  # a plan and the learned words of a town ask about the same sentence
def understand(text: str) -> Reading | NotUnderstood:
    """Meaning of a wish, or why it has none for us. Never raises."""
    utterance = read(text)
    spoken = steps_of(utterance.acts, NOWHERE)
    if spoken.question:
        return NotUnderstood("ambiguous", spoken.question)
    if not spoken.steps:
        unsupported = bool(spoken.undoable)
        why = "unsupported" if unsupported else _WHY.get(utterance.address, "off_topic")
        return NotUnderstood(why, f"I did not understand what you want me to drive. {CAN_DO}")
    score = 1.0 if utterance.sure >= _SURE else _SURE
    return Reading(tuple(replace(step.meaning, score=score) for step in spoken.steps))


def meanings_said(text: str) -> tuple[Meaning, ...]:
    """What a wish asks for; nothing where it is not understood."""
    reading = understand(text)
    return () if isinstance(reading, NotUnderstood) else reading.steps
