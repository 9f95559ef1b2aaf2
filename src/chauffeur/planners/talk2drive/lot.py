"""What people want in a parking lot: hardly anybody says "park" there, and nearly everybody wants to.

An event nearby is where they go to; leaving soon, or before the crowd, makes the exit worth more than the walk. Where
the words say nothing of a place and nothing of the speed, the nearest free spot is meant.
"""

from __future__ import annotations

import re
from typing import Final

from chauffeur.planners.talk2drive.style import place_of

_PLACES: Final[tuple[tuple[str, re.Pattern[str]], ...]] = (
    (
        "exit",
        re.compile(
            r"\b(?:exit|way out|leav(?:e|es|ing)|(?:get|getting|got) out|out of (?:here|this)|jam(?:med)?|crowd"
            r"|gone before|away before|catch (?:my|the|a) (?:plane|flight|train|bus)|pick(?:ing)? up (?!the pace|speed)"
            r"|drop(?:ping)? off"
            r"|right (?:after|afterwards)|off we go|drive on)\b",
            re.IGNORECASE,
        ),
    ),
    (
        "stadium",
        re.compile(
            r"\b(?:stadium|arena|gate|entrance|game|match|concert|show|event|seats?|tickets?|kick-?off|anthem|team"
            r"|football|soccer|baseball)\b",
            re.IGNORECASE,
        ),
    ),
)
_LOT: Final = re.compile(r"\b(?:parking (?:lot|garage|area)|car park)\b", re.IGNORECASE)
_OUT_OF_CAR: Final = re.compile(r"\bget(?:ting)? out of (?:the|this) car\b", re.IGNORECASE)

_PACES: Final = ("speed.", "style.")


def wanted_place(wish: str) -> str:
    """Which place of a lot a wish means: as `place_of`, and where it only hints at one."""
    plain = _LOT.sub("here", wish)  # whoever speaks of the lot does not ask to park by that
    return place_of(plain) or hinted_place(plain)


def hinted_place(wish: str) -> str:
    """Which place of a lot a hint points to: `stadium`, `exit`, or none (empty)."""
    if _OUT_OF_CAR.search(wish):
        return ""
    return next((place for place, words in _PLACES if words.search(wish)), "")


def parks(intent: str) -> bool:
    """Whether a wish in a lot, read as `intent`, is rather one for a spot: it says nothing of how to drive there."""
    return not intent.startswith((*_PACES, "stop"))
