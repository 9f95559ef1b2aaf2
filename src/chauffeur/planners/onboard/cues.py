"""Cues: which words speak for which manoeuvre. The table is `words/cues.txt`; this reads it.

Kinds of evidence:
    act    asks for a change ("speed up", "closer"); negated it asks for no change.
    state  describes speed or gap ("fast", "close"); whether it is a wish or a complaint is decided by the clause.
    verb   a direction of change that needs a noun ("increase", "less").
    noun   the quantity meant ("speed", "gap").
    adj    a state that needs a noun ("the gap is too small").
    style  a way of driving, or a feeling that asks for one.
    side   left, right or straight with nothing else said.
    place  a junction.
    keep, resume  leave things as they are, or as they were.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal, cast

from chauffeur.planners.onboard.meaning import Change, Manoeuvre, Side
from chauffeur.planners.onboard.words import words_file

Kind = Literal["act", "state", "verb", "noun", "adj", "style", "side", "place", "keep", "resume"]


@dataclass(frozen=True, slots=True)
class Cue:
    """A group of the table: its patterns as one, and what they are evidence for."""

    pattern: re.Pattern[str]
    kind: Kind
    manoeuvre: Manoeuvre
    change: Change = 0
    variant: str = ""
    loose: bool = False
    weight: float = 1.0
    side: Side | None = None


_NOUNS = (
    "car|cars|vehicle|vehicles|truck|van|bus|lorry|guy|bike|motorcycle|motorbike|suv|slowpoke|driver|one|person|idiot"
    "|snail|tractor|trailer|thing|sedan|taxi|cab|dude|rv|camper|semi|traffic|turtle|fellow|lady|wagon|pickup"
)
VEHICLE = (
    rf"(?:(?:the|that|this|a|those|these|our|my|your) (?:\w+ ){{0,3}}?(?:{_NOUNS})\b(?: ahead)?"
    r"|vehicle ahead|him|her|it|them|that|this|everyone|everybody|traffic|slowpokes?|others?)"
)
_SIDE = r"(?P<side>left|right)"
_SOME = r"(?:some|more|a (?:bit|little|lot|tad|touch)(?: of)?(?: more)?|plenty of|extra|much more|lots of)"
_ROOM = r"(?:space|room|distance|gap|air|buffer|clearance|headway|cushion|spacing)"
_MOVE = (
    r"(?:go|get|move|drive|navigate|swing|steer|zip|slip|scoot|squeeze|blow|zoom|speed|cruise|race|shoot|run|make|cut"
    r"|push|maneuver|manoeuvre|fly|slide|hop|nip|whip|dart|work|take|bring|jump|leap)(?:ing|s)?"
)

_PIECES = {
    "VEHICLE": VEHICLE,
    "NOUNS": _NOUNS,
    "SIDE": _SIDE,
    "SIDE2": _SIDE.replace("side", "side2"),
    "SOME": _SOME,
    "ROOM": _ROOM,
    "MOVE": _MOVE,
}
_PIECE = re.compile(r"\{([A-Z]+2?)\}")


def _cue(group: list[str]) -> Cue:
    kind, manoeuvre, change, weight, *rest = group[0].strip("[]").split(" ")
    variant = rest[0].replace("_", " ") if rest else ""
    loose, straight = variant == "loose", variant == "straight"
    pattern = _PIECE.sub(lambda piece: _PIECES[piece[1]], "|".join(group[1:]))
    return Cue(
        re.compile(pattern),
        cast(Kind, kind),
        cast(Manoeuvre, manoeuvre),
        cast(Change, int(change)),
        "" if loose or straight else variant,
        loose,
        float(weight),
        "straight" if straight else None,
    )


CUES: tuple[Cue, ...] = tuple(_cue(group) for group in words_file("cues.txt"))
