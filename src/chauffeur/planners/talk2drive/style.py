"""How closely the car follows its path: pure pursuit's two numbers for a way of driving.

A long look-ahead cuts corners and is smooth, a short one is exact and busy. The seed's example (Eq. 15) is 12 m and
2.0 s; around it stand a gentler and a livelier pair.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

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

DISTANCE_M: Final = (3.0, 60.0)
RATIO_S: Final = (0.5, 4.0)
"""What a model may choose between."""

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
