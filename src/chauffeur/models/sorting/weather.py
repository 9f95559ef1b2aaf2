"""Training data of the sorter of weather, and how well it reads writers it has not learned from.

Sentences of `weather.tsv` and the grammar `weather.txt`, by themselves and beside wishes, since that is how weather is
said; and wishes alone, of which the sorter must take none for weather.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np

from chauffeur.concept.data import data_folder
from chauffeur.language.grammar import Grammar, Manner
from chauffeur.language.text_classifier import TextClassifier
from chauffeur.language.weather import SAID_WEATHERS, said_weather
from chauffeur.models.sorting.sentences import Sentence, sentences

TEST_WRITERS: Final = frozenset(("c", "m", "t", "y", "ee", "k"))
"""Writers that are left out where it is measured; g and s chose what is learned from."""
_COMPOSED, _ALONE, _BESIDE, _EACH = 6_000, 16_000, 4_000, 4
"""Sentences of the grammar; wishes alone, and two together; sentences made of each of the table's."""
_JOINTS: Final = (", {}", ", but {}", ", and {}", " because {}", ". {}", "; {}", " {}")
_BY_ITSELF, _LAST = 0.35, 0.8
_OTHERS: Final = 1_500


@cache
def _grammar() -> Grammar:
    return Grammar(data_folder("sorters"), ("weather",), Manner(unfinished=0.3))


def _wishes(but: Sequence[Sentence]) -> list[Sentence]:
    known = {one.text.lower() for one in but}
    return [one for one in sentences("wishes") if one.text.lower() not in known]


class _Speaker:
    """Puts what is said of the weather beside wishes."""

    def __init__(self, wishes: Sequence[Sentence], rng: np.random.Generator) -> None:
        self._wishes, self._rng = wishes, rng

    def wish(self) -> str:
        return self._wishes[int(self._rng.integers(len(self._wishes)))].text

    def phrase(self, kind: str, *, held: bool) -> str:
        templates = _grammar().templates(kind, held=held)
        return _grammar().say(templates[int(self._rng.integers(len(templates)))], {}, self._rng).text

    def joined(self, one: str, two: str) -> str:
        return one.rstrip(".!?") + _JOINTS[int(self._rng.integers(len(_JOINTS)))].format(two)

    def said(self, phrase: str) -> str:
        drawn = self._rng.random()
        if drawn < _BY_ITSELF:
            return phrase
        return self.joined(self.wish(), phrase) if drawn < _LAST else f"{phrase}, {self.wish()}"


def weather_sentences(seed: int, without: Collection[str] = ()) -> tuple[Sentence, ...]:
    """Training data of the sorter.

    Args:
        seed: Of what is drawn.
        without: Writers to leave out.
    """
    rng = np.random.default_rng([seed, 61])
    labelled = sentences("weather")
    wishes = [one for one in _wishes(labelled) if one.writer not in without]
    speaker = _Speaker(wishes, rng)
    found: list[tuple[str, str]] = []
    for one in labelled:
        if one.writer not in without:
            found += [(one.text, one.kind), *((speaker.said(one.text), one.kind) for _ in range(_EACH))]
    for place in range(_COMPOSED):
        kind = SAID_WEATHERS[place % len(SAID_WEATHERS)]
        found.append((speaker.said(speaker.phrase(kind, held=False)), kind))
    found += [(wishes[int(place)].text, "none") for place in rng.permutation(len(wishes))[:_ALONE]]
    found += [(speaker.joined(speaker.wish(), speaker.wish()), "none") for _ in range(_BESIDE)]
    return tuple(Sentence(text, kind, SAID_WEATHERS, "", kind) for text, kind in found)


@dataclass(frozen=True, slots=True)
class WeatherFigures:
    """Figures of a sorter on writers and templates that it has not learned from.

    Attributes:
        said, heard: Sentences of the table that say something of the weather; how many are taken to.
        alike, mistaken: Those that only look so; how many are taken to.
        held, held_heard: The grammar's held-out templates beside wishes; how many are taken to.
        denied, denied_mistaken: Those of them that say nothing of it or deny it; how many are taken to.
        others, others_mistaken: Wishes that do not look so; how many are taken to.
    """

    said: int
    heard: int
    alike: int
    mistaken: int
    held: int
    held_heard: int
    denied: int
    denied_mistaken: int
    others: int
    others_mistaken: int


def weather_figures(sorter: TextClassifier, seed: int, writers: Collection[str] = TEST_WRITERS) -> WeatherFigures:
    """Measure a sorter that was trained without these writers."""
    rng = np.random.default_rng([seed, 67])
    labelled = sentences("weather")
    wishes = [one for one in _wishes(labelled) if one.writer in writers]
    speaker = _Speaker(wishes, rng)

    def hits(texts: Sequence[str]) -> tuple[int, int]:
        return len(texts), sum(said_weather(text, sorter) != "none" for text in texts)

    own = [one for one in labelled if one.writer in writers]
    held = [speaker.said(speaker.phrase(kind, held=True)) for kind in SAID_WEATHERS[1:] for _ in range(30)]
    return WeatherFigures(
        *hits([one.text for one in own if one.kind != "none"]),
        *hits([one.text for one in own if one.kind == "none"]),
        *hits(held),
        *hits([speaker.said(speaker.phrase("none", held=True)) for _ in range(60)]),
        *hits([wishes[int(place)].text for place in rng.permutation(len(wishes))[:_OTHERS]]),
    )
