"""What kind of weather it is, as far as memory tells trips apart by it."""

from __future__ import annotations

import re
from typing import Final

from chauffeur.concept import Situation

WEATHER_FACT: Final = "weather"
"""Name of the fact in `Situation.scene`; the words of a context say it as a sentence that begins with it."""

UNKNOWN: Final = 0
DRY, RAIN, SNOW, FOG = 1, 2, 4, 8
"""Bits: sleet is rain and snow. Dry is what is known and none of the others."""

_KINDS: Final = (
    (RAIN, re.compile(r"rain|drizzle|(?<!snow )shower|thunderstorm|sleet|\bwet\b|downpour")),
    (SNOW, re.compile(r"snow|sleet|hail|\bic[ey]\b|freez|blizzard")),
    (FOG, re.compile(r"fog|mist|haze|smoke|dust|sand|\bash\b")),
)
_NOT_KNOWN: Final = re.compile(r"\bnot known\b|\bunknown\b")
_SENTENCE: Final = re.compile(r"\bWeather\b[^:.]{0,40}: (?P<words>.*?)(?:\.(?!\d)|$)", re.DOTALL)
"""The sentence about the weather among the words of a context."""


def weather_of(situation: Situation) -> int:
    """Bits of a situation's weather; `UNKNOWN` where nobody told it."""
    return _kinds(" ".join(said for name, said in situation.scene if name == WEATHER_FACT))


def weather_in(context: str) -> int:
    """The same, from the words of a context."""
    return _kinds(" ".join(match["words"] for match in _SENTENCE.finditer(context)))


def _kinds(words: str) -> int:
    words = words.casefold().strip()
    if not words or _NOT_KNOWN.search(words):
        return UNKNOWN
    return sum(bit for bit, pattern in _KINDS if pattern.search(words)) or DRY
