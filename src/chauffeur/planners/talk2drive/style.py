"""Pure pursuit's two numbers for a way of driving.

A long look-ahead cuts corners and is smooth, a short one is exact and busy. The paper's example (Eq. 15) is 12 m and
2.0 s; around it stand a gentler and a livelier pair.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final, Literal

from chauffeur.language.denials import denied_words
from chauffeur.language.tokens import tokens_of

Manner = Literal["gentle", "usual", "lively"]


@dataclass(frozen=True, slots=True)
class LookAhead:
    """Pure pursuit's parameters.

    Attributes:
        distance_m: Shortest look-ahead.
        ratio_s: Look-ahead per speed.
    """

    distance_m: float
    ratio_s: float


LOOK_AHEAD: Final[dict[Manner, LookAhead]] = {
    "gentle": LookAhead(14.0, 2.4),
    "usual": LookAhead(12.0, 2.0),
    "lively": LookAhead(9.0, 1.5),
}

LOOK_AHEAD_PARKING: Final = LookAhead(4.0, 1.0)
BRISK_SHARE: Final = 0.98
CALM_SHARE: Final = 0.8
RIGHT_SHARE: Final = 0.85
LOT_SHARE: Final = 0.75
"""Speeds as shares of the limit where words name none: in a hurry, at ease, at most in the right lane, and in a lot.
Chosen by trips of simulated passengers (`bench personalization --words tuning`, `benchmarks/personalization_floor.py`).
"""

PARKING_MPS: Final = 3.0
"""In a parking lot, where ways are narrow."""

DISTANCE_M: Final = (3.0, 60.0)
RATIO_S: Final = (0.5, 4.0)
"""Choices of a model."""

_PARKS: Final = re.compile(r"\b(?:park|parking|spots?|spaces?|places?|bays?|stalls?)\b", re.IGNORECASE)
_SPOT: Final = re.compile(
    r"\b(?:spot|space|bay|stall|place|in|into|at|on)\s+(?:number\s+)?([A-Z])\s?(\d{1,2})\b", re.IGNORECASE
)
_PLACES: Final[tuple[tuple[str, re.Pattern[str]], ...]] = (
    ("exit", re.compile(r"\b(?:exits?|way out)\b", re.IGNORECASE)),
    ("stadium", re.compile(r"\b(?:stadium|entrance|gate|game)\b", re.IGNORECASE)),
    ("exit", re.compile(r"\b(?:leave|get away)\b", re.IGNORECASE)),
    ("nearest", re.compile(r"\b(?:near|nearest|close|closest|next|first|any|free|here)\b", re.IGNORECASE)),
)


_TAKES: Final = re.compile(
    r"\b(?:take|bring|drive|drop|get|go|head|run)\b[^.;!?]*?\b(?:to|at|for)\s+(?:the\s+|my\s+|our\s+)?(?P<place>(?:St\.|[^.,;!?])+)",
    re.IGNORECASE,
)
_HOME: Final = re.compile(r"\b(?:take|bring|drive|get|go|head)\b(?: \w+){0,2} (?P<place>home)\b", re.IGNORECASE)
_BARE: Final = re.compile(
    r"^(?:(?:no|please|ok|now)\b[\s,]*)*to\s+(?:the|my|our)\s+(?P<place>(?:St\.|[^.,;!?])+)", re.IGNORECASE
)
_NO_PLACE: Final = re.compile(r"^(?:left|right|straight|stop|a stop|the (?:left|right)|\d)", re.IGNORECASE)
_TRAILING: Final = re.compile(
    r"\s{1,3}(?:please|now|quickly|as (?:fast|soon|quickly).{0,200}|(?:and|as|because|but|since|without) .{0,200})$",
    re.IGNORECASE,
)


_CLAUSE: Final = re.compile(r"[,;!?]|(?<!\bSt)\.|\bbut (?=don't|do not|never)", re.IGNORECASE)


def destination_of(wish: str) -> str:
    """The place of a town that a wish asks to be taken to, in its own words; empty where it asks for none, or says that
    it is not to be gone to."""
    for found in (*_TAKES.finditer(wish), *_HOME.finditer(wish), *_BARE.finditer(wish)):
        begins = max((one.end() for one in _CLAUSE.finditer(wish, 0, found.start())), default=0)
        place = _TRAILING.sub("", found["place"].strip())
        denied = denied_words(f"{wish[begins : found.start('place')]} {place}")
        if not denied & {*tokens_of(found.group())[:1], *tokens_of(place)}:
            return "" if _NO_PLACE.match(place) else place
    return ""


def named_spot(wish: str) -> str:
    """The spot of a parking lot that a wish names, e.g. `B7`; empty where it names none."""
    named = _SPOT.search(wish)
    return "" if named is None else f"{named[1].upper()}{int(named[2])}"


def place_of(wish: str) -> str:
    """The spot of a parking lot that a wish means: `stadium`, `exit`, `nearest` or a name; empty for none."""
    if named := named_spot(wish):
        return named
    if not _PARKS.search(wish):
        return ""
    return next((place for place, words in _PLACES if words.search(wish)), "nearest")


_MANNERS: Final[dict[str, Manner]] = {
    "style.comfort": "gentle",
    "style.careful": "gentle",
    "style.relax": "gentle",
    "style.sporty": "lively",
    "style.hurry": "lively",
}


def manner_of(intent: str, *, gentle: bool) -> Manner:
    """The way of driving of an intent; `gentle` is a person who finds us too harsh."""
    found: list[Manner] = [_MANNERS[part] for part in intent.split("+") if part in _MANNERS]
    if gentle or "gentle" in found:
        return "gentle"
    return found[0] if found else "usual"
