"""Words beside the pictures: sentences of many writers, each with the style of driving it asks for.

Sources: the sorters' table (`data/sorters`, 31 writers; hints, reasons and remarks), the on-board model's grammar of
moods (`data/onboard`), and manners of the three manoeuvres (`data/vlm/manners.txt`). Whole writers, and the templates
that a grammar holds out, are kept from training.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any, Final, Literal

import numpy as np

from chauffeur.concept import DataError
from chauffeur.concept.data import data_folder, read_data
from chauffeur.language.grammar import Grammar, Manner
from chauffeur.models.onboard.wordings import utter
from chauffeur.planners.vlm.template import STYLES

Array = np.ndarray[Any, Any]
WishSplit = Literal["train", "val", "test"]

VAL_WRITERS: Final = frozenset("gs")
TEST_WRITERS: Final = frozenset(("c", "m", "t", "y", "ee", "k"))
"""Writers of the sorters' table that training does not know."""

_STYLE_OF: Final[Mapping[str, str]] = {
    "highway/pass/III": "aggressive",
    "highway/faster/I": "aggressive",
    "highway/faster/II": "aggressive",
    "crossing/go/III": "aggressive",
    "lot/faster/I": "aggressive",
    "lot/faster/III": "aggressive",
    "highway/stay/III": "conservative",
    "highway/slower/I": "conservative",
    "highway/slower/II": "conservative",
    "crossing/yield/III": "conservative",
    "lot/slower/I": "conservative",
    "lot/slower/III": "conservative",
    "highway/none": "moderate",
    "crossing/none": "moderate",
    "lot/none": "moderate",
    "highway/pass/I": "moderate",
}
"""Labels of the table that stand for a style; the others say what to do rather than how. A remark that asks for
nothing, and a bare request to overtake, leave the car its usual manner."""

_MOODS: Final[Mapping[str, tuple[str, ...]]] = {
    "aggressive": ("hurry", "hurry/2", "hurry/3", "sportily", "sportily/2", "sportily/3", "much_faster", "faster"),
    "moderate": ("turn_left", "overtake", "carry_on", "carry_on/2", "match_traffic", "keep_lane", "hold_speed/2"),
    "conservative": (
        "gently", "gently/2", "gently/3", "carefully", "carefully/2", "carefully/3", "relax", "relax/2", "relax/3",
    ),
}  # fmt: skip
"""Sections of the on-board model's grammar by style."""

_SOURCES: Final = (0.50, 0.28, 0.22)
"""Shares of the three sources in training."""
_WEATHER_SAID: Final = 0.08
"""Share of wishes that also speak of the weather: how one wants to be driven is not what the road is like."""
_TRIES: Final = 20
MOST_WORDS: Final = 40
"""Longer wishes are not drawn: they would make every batch longer."""


@cache
def manners() -> Grammar:
    """The grammar of manners."""
    return Grammar(data_folder("vlm"), ("manners",), Manner(unfinished=0.3))


@cache
def written(split: WishSplit) -> Mapping[str, tuple[str, ...]]:
    """Sentences of the table by style, of a split's writers. Raises DataError: the table is damaged."""
    found: dict[str, list[str]] = {style: [] for style in STYLES}
    for number, line in enumerate(read_data("sorters", "wishes.tsv").decode("utf-8").splitlines(), start=1):
        label, _, rest = line.partition("\t")
        text, _, writer = rest.partition("\t")
        if not text or not writer:
            raise DataError(f"Line {number} of wishes.tsv is no sentence with its label and writer.")
        own: WishSplit = "test" if writer in TEST_WRITERS else "val" if writer in VAL_WRITERS else "train"
        if own == split and label in _STYLE_OF:
            found[_STYLE_OF[label]].append(text)
    return {style: tuple(texts) for style, texts in found.items()}


def training_wish(style: str, rng: np.random.Generator) -> str:
    """A wish of training for a style."""
    source = int(rng.choice(3, p=_SOURCES))
    text = _of_source(source, style, rng)
    for _ in range(_TRIES):
        if len(text.split()) <= MOST_WORDS:
            break
        text = _of_source(source, style, rng)
    if rng.random() < _WEATHER_SAID:
        text = with_weather(text, rng)
    return text


def with_weather(text: str, rng: np.random.Generator) -> str:
    """A wish with a remark on weather or road behind it, which says nothing of its style."""
    return f"{text.rstrip('.!?')} {_manner('slippery', rng)}"


def composed_wish(style: str, rng: np.random.Generator) -> str:
    """A wish of the grammars, for a style."""
    return _of_source(1 + int(rng.integers(2)), style, rng)


def _of_source(source: int, style: str, rng: np.random.Generator) -> str:
    if source == 0:
        texts = written("train")[style]
        return texts[int(rng.integers(len(texts)))]
    if source == 1:
        sections = _MOODS[style]
        return utter(sections[int(rng.integers(len(sections)))], _SlotWords(), rng, held=False).text
    return _manner(style, rng)


class _SlotWords(dict[str, str]):
    """Whatever a template of the on-board grammar asks for: a word that says nothing about style."""

    def __missing__(self, key: str) -> str:
        return ""


def _manner(section: str, rng: np.random.Generator, *, held: bool = False) -> str:
    lines = manners().templates(section, held=held)
    return manners().say(lines[int(rng.integers(len(lines)))], {}, rng).text


def held_wishes(split: WishSplit, count: int, seed: int) -> list[tuple[str, str]]:
    """(wish, style) of writers and templates that training does not have; a third of each style, in turn.

    Of `test` three of four sentences are the table's (six writers), the others the manners' held-out templates.
    """
    rng = np.random.default_rng([seed, 13, ("train", "val", "test").index(split)])
    found: list[tuple[str, str]] = []
    for place in range(count):
        style = STYLES[place % len(STYLES)]
        if place // len(STYLES) % 4 == 3:
            found.append((_manner(style, rng, held=True), style))
        else:
            texts = written(split)[style]
            found.append((texts[int(rng.integers(len(texts)))], style))
    return found
