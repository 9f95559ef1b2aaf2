"""The meaning of words wherever the car is: the acts of the one reader as steps of the dialect."""

from __future__ import annotations

from functools import lru_cache
from typing import Final

from chauffeur.concept import Situation
from chauffeur.language.meaning.reader import read
from chauffeur.planners.meaning.highway import steps_of
from chauffeur.planners.onboard.meaning import Meaning

NOWHERE: Final = Situation("highway", 25.0, 31.2928, 3, 1, False, None, None)
"""A road on which every act has a place; its signs are in mph."""


@lru_cache(maxsize=32)  # a plan and the learned words of a town ask about the same sentence
def meanings_said(text: str) -> tuple[Meaning, ...]:
    """Meanings of a wish, in order; empty if it is not understood, or asks for nothing. Never raises."""
    return tuple(step.meaning for step in steps_of(read(text).acts, NOWHERE).steps)
