"""What passengers say of the weather and the road in passing, and what only sounds so."""

from __future__ import annotations

import pytest

from chauffeur.language.text_classifier import load_sorter
from chauffeur.language.weather import SAID_WEATHERS, WEIGHTS, said_weather


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("I'm late, but it is slippery.", "slippery"),
        ("Careful, there's ice.", "slippery"),
        ("Hurry up, although it's raining.", "rain"),
        ("Take it easy in this fog, please.", "fog"),
        ("It is snowing, go slowly.", "snow"),
        ("It's raining, and the road is icy.", "slippery"),  # the worse of what is said
        ("Lights on, it's pitch dark.", "night"),
    ],
)
def test_what_is_said_of_weather_and_road_is_heard(text: str, said: str) -> None:
    assert said_weather(text) == said


@pytest.mark.parametrize(
    "text",
    [
        "", "...", "Overtake the car in front.", "It's not slippery.", "There is no ice on the road.",
        "The road isn't wet.", "No fog today, go on.", "The train leaves at five.", "My ice cream's melting.",
        "The rain has stopped.",
    ],
)  # fmt: skip
def test_what_is_denied_or_only_sounds_so_is_not(text: str) -> None:
    assert said_weather(text) == "none"


def test_what_ships_knows_the_kinds() -> None:
    assert load_sorter(WEIGHTS).kinds == SAID_WEATHERS
