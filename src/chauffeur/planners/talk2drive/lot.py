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
            r"\b(?:exit|way out|trapped|stuck|boxed in|leav(?:e|es|ing)|(?:get|getting|got) out|out of (?:here"
            r"|this)|jam(?:med)?|crowd"
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
_ARRIVED: Final = re.compile(
    r"\b(?:restroom|bathroom|toilet|loo|stretch|legs?|fresh air|some air|stuffy|hot in here|coffee|hungry|thirsty"
    r"|starving|(?:my )?phone|call|smoke|cigarette|dog|puppy|sit(?:ting)? still|(?:get|got|getting|step|out) out"
    r"|out of (?:the|this) car|stiff|walk(?:ing)? (?:a bit|around|is|will|does|isn't)|(?:don't|do not) mind walking"
    r"|driv\w+ around|circling|cruising around|search\w*|looking for|be parked|stand(?:ing)? (?:here|there)"
    r"|(?:does not|doesn't|not) matter|don't care|wherever|anywhere|whichever|any (?:one|of them) will"
    r"|whole lot|all (?:the )?(?:way )?(?:through|around) (?:the|this) lot)\b",
    re.IGNORECASE,
)
"""Somebody who is done with driving, wherever the car comes to stand."""
_LOT: Final = re.compile(r"\b(?:parking (?:lot|garage|area)|car park)\b", re.IGNORECASE)
_OUT_OF_CAR: Final = re.compile(r"\bget(?:ting)? out of (?:the|this) car\b", re.IGNORECASE)
_ON_FOOT: Final = re.compile(r"\b(?:people|kids|children|pedestrians|someone|somebody)\b", re.IGNORECASE)
"""Who is around, not what is wanted."""

_PACES: Final = ("speed.", "style.")


def wanted_place(wish: str) -> str:
    """Which place of a lot a wish means: as `place_of`, and where it only hints at one."""
    plain = _LOT.sub("here", wish)  # whoever speaks of the lot does not ask to park by that
    named, hinted = place_of(plain), hinted_place(plain)
    return hinted if named in ("", "nearest") and hinted else named


def hinted_place(wish: str) -> str:
    """Which place of a lot a hint points to: `stadium`, `exit`, `nearest`, or none (empty)."""
    if not _OUT_OF_CAR.search(wish) and (found := next((p for p, words in _PLACES if words.search(wish)), "")):
        return found
    return "nearest" if _ARRIVED.search(wish) and not _ON_FOOT.search(wish) else ""


def parks(intent: str) -> bool:
    """Whether a wish in a lot, read as `intent`, is rather one for a spot: it says nothing of how to drive there."""
    return not intent.startswith((*_PACES, "stop"))
