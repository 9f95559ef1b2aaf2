"""Kinds of weather, as a service words them and as a passenger mentions them in passing.

Services have a small vocabulary, which patterns read; memory tells trips apart by it. People have none ("the road's
like glass by that stop line"), so a learned sorter reads them (`chauffeur.language.text_classifier`).
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Final, Literal

from chauffeur.concept import Context, Situation
from chauffeur.language.denials import denied_words
from chauffeur.language.text_classifier import TextClassifier, load_sorter
from chauffeur.language.tokens import tokens_of

WEATHER_FACT: Final = "weather"
"""Name of the fact in `Situation.scene`; the words of a context say it as a sentence that begins with it."""

UNKNOWN: Final = 0
DRY, RAIN, SNOW, FOG = 1, 2, 4, 8
"""Bits: sleet is rain and snow. Dry is what is known and none of the others."""

SaidWeather = Literal["none", "night", "rain", "fog", "snow", "slippery"]
SAID_WEATHERS: Final[tuple[SaidWeather, ...]] = "none", "night", "rain", "fog", "snow", "slippery"
"""Remarks of a passenger on weather or road, as they are here and now; in the order in which they ask for care."""
WEIGHTS: Final = Path(__file__).parent / "weights" / "weather.npz"
SURE: Final = 0.5
"""Share from which on a clause is taken to say something of the weather."""
_NAMED: Final = 0.1
"""The same where the clause has a word for it."""

_KINDS: Final = (
    (RAIN, re.compile(r"rain|drizzle|(?<!snow )shower|thunderstorm|sleet|\bwet\b|downpour")),
    (SNOW, re.compile(r"snow|sleet|hail|\bic[ey]\b|freez|blizzard")),
    (FOG, re.compile(r"fog|mist|haze|smoke|dust|sand|\bash\b")),
)
_NOT_KNOWN: Final = re.compile(r"\bnot known\b|\bunknown\b")
_SENTENCE: Final = re.compile(r"\bWeather\b[^:.]{0,40}: (?P<words>.*?)(?:\.(?!\d)|$)", re.DOTALL)
"""The sentence about the weather among the words of a context."""
_GAPS: Final = re.compile(r"\s{2,}")
_CLAUSES: Final = re.compile(r"[,.;!?:]\s|\s-\s|\s(?:but|and|because|although|though|as|since|so)\s")


def weather_of(situation: Situation) -> int:
    """Bits of a situation's weather; `UNKNOWN` where no one told it."""
    return _kinds(" ".join(said for name, said in situation.scene if name == WEATHER_FACT))


def weather_in(context: str) -> int:
    """The same, from the words of a context."""
    return _kinds(" ".join(match["words"] for match in _SENTENCE.finditer(context)))


def said_weather(text: str, sorter: TextClassifier | None = None) -> SaidWeather:
    """The worst that a passenger says of the weather or the road; "none" where nothing is said, or all is denied.

    The text is read whole and clause by clause: in "I'm late, but it is slippery" half is about something else.

    Args:
        text: What was said.
        sorter: Another reader than the one that ships.
    """
    sorter = sorter or load_sorter(WEIGHTS)
    worst: SaidWeather = "none"
    for clause in (text, *_CLAUSES.split(text)):
        denied = denied_words(clause)
        named = [word for word in tokens_of(clause) if any(pattern.match(word) for _, pattern in _KINDS)]
        undenied = [word for word in named if word not in denied]
        if named and not undenied:
            continue
        shares = sorter.shares(clause)
        if 1.0 - shares["none"] < (_NAMED if undenied else SURE):
            continue
        likeliest = max(range(1, len(SAID_WEATHERS)), key=lambda place: shares[SAID_WEATHERS[place]])
        worst = SAID_WEATHERS[max(likeliest, SAID_WEATHERS.index(worst))]
    return worst


def without_said_weather(text: str) -> str:
    """A wish without the clauses about weather or road; empty if nothing is left."""
    parts, begin, kept = list[tuple[str, str]](), 0, list[str]()
    for sign in _CLAUSES.finditer(text):
        parts.append((text[begin : sign.start()], sign[0]))
        begin = sign.end()
    parts.append((text[begin:], ""))
    for clause, sign in parts:
        if said_weather(clause) == "none":
            kept += [clause, sign]
    rest = "".join(kept[:-1]).strip() if kept else ""
    end = text.rstrip()[-1:]
    return rest + end if rest and end in ".!?" and rest[-1] not in ".!?" else rest


def without_told_weather(context: Context) -> Context:
    """C without what the services tell of the weather."""
    scene = tuple(one for one in context.situation.scene if one[0] != WEATHER_FACT)
    text = _GAPS.sub(" ", _SENTENCE.sub(" ", context.text)).strip()
    return replace(context, text=text, situation=replace(context.situation, scene=scene))


def _kinds(words: str) -> int:
    words = words.casefold().strip()
    if not words or _NOT_KNOWN.search(words):
        return UNKNOWN
    return sum(bit for bit, pattern in _KINDS if pattern.search(words)) or DRY
