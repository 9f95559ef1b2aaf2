"""Colours of a town's vehicles and people: drawn from the trip's seed and their own number, and from nothing
else, so that colours change no other draw of a trip."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from typing import Final

from chauffeur.concept import AgentKind
from chauffeur.concept.utterance import Colour

_CARS: Final[Mapping[Colour, int]] = {
    "white": 24, "black": 20, "grey": 18, "silver": 11, "blue": 9, "red": 8, "green": 3, "brown": 3, "beige": 2,
    "orange": 1, "yellow": 1,
}  # fmt: skip
"""Per cent of new cars, as paint makers' yearly reports round them."""
_LARGE: Final[Mapping[Colour, int]] = {
    "white": 45, "red": 12, "blue": 12, "yellow": 8, "green": 8, "grey": 6, "silver": 5, "orange": 4,
}  # fmt: skip
_CLOTHES: Final[Mapping[Colour, int]] = {
    "black": 28, "blue": 20, "grey": 14, "white": 12, "red": 8, "green": 6, "brown": 4, "yellow": 3, "pink": 3,
    "orange": 2,
}  # fmt: skip
_SHARES: Final[Mapping[AgentKind, Mapping[Colour, int]]] = {
    "car": _CARS,
    "motorcycle": _CARS,
    "bicycle": _CARS,
    "truck": _LARGE,
    "bus": _LARGE,
    "pedestrian": _CLOTHES,
}


def drawn_colour(seed: int, number: int, kind: AgentKind) -> Colour | None:
    """The colour of a road user; None for a thing, which has none that is spoken of.

    Args:
        seed: Of the trip.
        number: The road user's id.
        kind: What it is.
    """
    shares = _SHARES.get(kind)
    if shares is None:
        return None
    left = zlib.crc32(f"{seed}:{number}".encode()) % sum(shares.values())
    for colour, share in shares.items():
        if left < share:
            return colour
        left -= share
    raise AssertionError("the shares add up")
