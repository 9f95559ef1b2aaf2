"""C and R of the on-board VLM in words, from the tokens it wrote."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Final

from chauffeur.language.weather import SaidWeather
from chauffeur.planners.vlm.template import SEEN_WEATHERS

_SUNNY: Final = "clear and sunny, the road is dry"
_SKY: Final[Mapping[tuple[str, str], str]] = {
    ("night", "light"): "clear, at dusk",
    ("night", "heavy"): "clear, at night",
    ("rain", "light"): "light rain, the road is wet",
    ("rain", "heavy"): "heavy rain, the road is wet",
    ("fog", "light"): "light fog",
    ("fog", "heavy"): "dense fog",
    ("snow", "light"): "light snow, the road is slippery",
    ("snow", "heavy"): "heavy snow, the road is slippery",
}
_LEAD: Final[Mapping[str, str]] = {
    "no_lead": "No vehicle is ahead in my lane.",
    "far_lead": "A vehicle is far ahead in my lane.",
    "lead": "A vehicle is ahead in my lane.",
    "near_lead": "A vehicle is close ahead in my lane.",
}
_ROAD: Final[Mapping[str, str]] = {
    "straight": "The road goes straight on.",
    "bend_left": "The road bends to the left.",
    "bend_right": "The road bends to the right.",
}
_STYLE: Final[Mapping[str, str]] = {
    "aggressive": "You want to get on quickly",
    "moderate": "You ask for nothing out of the ordinary",
    "conservative": "You want a gentle drive",
}
_GAINS: Final[Mapping[str, str]] = {
    "aggressive": "high gains that follow speed and path closely",
    "moderate": "middle gains",
    "conservative": "low gains and a high steering weight",
}
_RECALL: Final[Mapping[str, str]] = {
    "none": "",
    "gentler": " Last time you found this too much, so I am gentler than then.",
    "brisker": " Last time you found this too little, so I am brisker than then.",
}

SAID: Final[Mapping[SaidWeather, str]] = {
    "night": "it is dark",
    "rain": "it is wet",
    "fog": "one cannot see far",
    "snow": "there is snow",
    "slippery": "it is slippery",
}
"""Wording for repeating a passenger's remark on the weather or the road."""
AS_SEEN: Final[Mapping[SaidWeather, str]] = {
    "night": "night",
    "rain": "rain",
    "fog": "fog",
    "snow": "snow",
    "slippery": "snow",
}
"""The picture that would ask for as much care."""

FACTS: Final = frozenset({"grade", "lead", "road"})
"""Remarks on a scene beside the weather."""


def scene_words(values: Mapping[str, str], told: Collection[str] = FACTS) -> str:
    """C: the scene in the picture, from the words of the template's slots.

    Args:
        values: Word of each slot.
        told: Slots beside the weather that are told; others are not seen well enough.
    """
    weather = values["weather"]
    sky = _SUNNY if weather == "sunny" else _SKY[weather, "heavy" if values["grade"] == "heavy" else "light"]
    if "grade" not in told and weather != "sunny":
        sky = weather
    words = [f"Weather, as the camera sees it: {sky}."]
    words += [_ROAD[values["road"]]] if "road" in told else []
    words += [_LEAD[values["lead"]]] if "lead" in told else []
    return " ".join(words)


def thought_words(values: Mapping[str, str], where: str = "") -> str:
    """R: what was heard, what the weather makes of it, what was chosen.

    Args:
        values: Word of each slot.
        where: What is said of the weather instead of its slot's word, e.g. "on a slippery road".
    """
    heard, weather = _STYLE[values["style"]], values["weather"]
    if weather == "sunny":
        why = "and the road allows it" if values["style"] == "aggressive" else "and nothing outside asks for more care"
    else:
        why = f"and {where or ('in the dark' if weather == 'night' else f'in {weather}')} I take more care"
    kept = "" if weather == "sunny" else ", on the careful side"
    return f"{heard}, {why}: {_GAINS[values['style']]}{kept}.{_RECALL[values['recall']]}"


def taste_words(shift: float) -> str:
    """The effect of a person's earlier feedback, to follow R; empty if there is none."""
    if not shift:
        return ""
    much, how = ("too much", "gentler") if shift > 0.0 else ("too little", "brisker")
    return f" You often found my drives {much}, so I am {how} than your words alone ask for."


def more_careful(one: str, two: str) -> str:
    """Of two kinds of weather, the one that asks for more care."""
    return max(one, two, key=SEEN_WEATHERS.index)
