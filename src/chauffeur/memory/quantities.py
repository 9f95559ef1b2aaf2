"""Numbers with units, as people say them, in SI."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

from chauffeur.concept.units import M_PER_CAR_LENGTH, M_PER_FOOT, M_PER_YARD, MPS_PER_KMH, MPS_PER_MPH
from chauffeur.memory.words import even

Dimension = Literal["speed", "length", "time"]

_UNITS: tuple[tuple[str, Dimension, float], ...] = (
    (r"km/?h|kph|kmph|kilomet(?:er|re)s? (?:per|an|a) hour", "speed", MPS_PER_KMH),
    (r"mph|miles? (?:per|an|a) hour", "speed", MPS_PER_MPH),
    (r"m/s|mps|met(?:er|re)s? (?:per|a) second", "speed", 1.0),
    (r"met(?:er|re)s?|m", "length", 1.0),
    (r"feet|foot|ft", "length", M_PER_FOOT),
    (r"yards?", "length", M_PER_YARD),
    (r"car[ -]lengths?", "length", M_PER_CAR_LENGTH),
    (r"seconds?|secs?|s", "time", 1.0),
)
_ONES = (
    *("zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve"),
    *("thirteen", "fourteen", "fifteen", "sixteen", "seventeen", "eighteen", "nineteen"),
)
_TENS = ("twenty", "thirty", "forty", "fifty", "sixty", "seventy", "eighty", "ninety", "hundred")
_WORDS = {word: float(value) for value, word in enumerate(_ONES)} | {
    word: 10.0 * value for value, word in enumerate(_TENS, start=2)
}
_NUMBER = rf"(?P<number>\d+(?:[.,]\d+)?|\b(?:{'|'.join(_WORDS)}))"
_PATTERNS: tuple[tuple[re.Pattern[str], Dimension, float], ...] = tuple(
    (re.compile(rf"{_NUMBER} ?(?:{unit})(?![\w/])"), dimension, factor) for unit, dimension, factor in _UNITS
)


@dataclass(frozen=True, slots=True)
class Quantity:
    """A number in SI: m/s, m or s."""

    dimension: Dimension
    value: float


def read_quantities(text: str) -> tuple[Quantity, ...]:
    """All numbers with a unit of speed, length or time, one per mention."""
    left = even(text)
    found: list[Quantity] = []
    for pattern, dimension, factor in _PATTERNS:
        while (match := pattern.search(left)) is not None:
            left = left[: match.start()] + " " + left[match.end() :]
            number = match["number"]
            value = _WORDS[number] if number in _WORDS else float(number.replace(",", "."))
            found.append(Quantity(dimension, value * factor))
    return tuple(found)
