"""What people want in a parking lot: hardly anybody says "park" there, and nearly everybody wants to.

An event nearby is where they go to, the more so the worse they walk; leaving soon, or before the crowd, makes the exit
worth more than the walk; who is done with driving takes the nearest free spot. A wish for another pace is for the pace.
"""

from __future__ import annotations

import re
from typing import Final, Literal

from chauffeur.planners.onboard.patterns import said
from chauffeur.planners.talk2drive.style import place_of
from chauffeur.planners.talk2drive.words import WORDS

_HINTS: Final = ("exit", "stadium", "nearest")
"""Places that words may point to, the more telling ones first."""
_LOT: Final = re.compile(r"\b(?:parking (?:lot|garage|area)|car ?parks?|parked cars|parked vans)\b", re.IGNORECASE)
_ASKS: Final = re.compile(r"\bpark(?! and)\b", re.IGNORECASE)

_PACES: Final = ("speed.", "style.")


def wanted_pace(wish: str) -> Literal[-1, 0, 1]:
    """Whether words in a lot ask for another pace and not for a spot: 1 faster, -1 slower."""
    if _ASKS.search(wish) and not _shows("no parking", wish):
        return 0
    faster, slower = _shows("faster", wish), _shows("slower", wish)
    return 0 if faster == slower else 1 if faster else -1


def wanted_place(wish: str) -> str:
    """Which place of a lot a wish means: as `place_of`, and where it only hints at one."""
    if _shows("no parking", wish):
        return ""
    plain = _LOT.sub("here", wish)  # whoever speaks of the lot does not ask to park by that
    named, hinted = place_of(plain), hinted_place(plain)
    return hinted if named in ("", "nearest") and hinted else named


def hinted_place(wish: str) -> str:
    """Which place of a lot a hint points to: `stadium`, `exit`, `nearest`, or none (empty)."""
    return next((place for place in _HINTS if _shows(place, wish)), "")


def parks(intent: str) -> bool:
    """Whether a wish in a lot, read as `intent`, is rather one for a spot: it says nothing of how to drive there."""
    return not intent.startswith((*_PACES, "stop"))


def _shows(what: str, wish: str) -> bool:
    return said("lot.txt", what, WORDS).search(wish) is not None
