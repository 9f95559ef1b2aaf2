"""Parking commands in words: a bank of phrases whose writers are held apart, and commands composed from it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from chauffeur.models.vilad.phrases import OPENERS, PhraseBank, Split, held_back, novel, pick, sentence, worn
from chauffeur.planners.vilad.parking import LANDMARKS, NONE, NOTHING

_SLOTS: Final[Mapping[str, tuple[str, str]]] = {
    "quick": ("soon", "yes"),
    "apart": ("apart", "yes"),
    "ev": ("bay", "ev"),
    "accessible": ("bay", "accessible"),
    "family": ("bay", "family"),
    "roof": ("covered", "yes"),
    "end": ("end", "yes"),
}
"""Sections of the bank that ask for something by themselves."""

_PHRASINGS: Final[tuple[tuple[Split, Split], ...]] = (
    ("phrasing", "phrasing"),
    ("phrasing", "train"),
    ("train", "phrasing"),
)
_VOCABULARIES: Final[tuple[tuple[Split, Split], ...]] = (
    ("vocabulary", "phrasing"),
    ("phrasing", "vocabulary"),
    ("vocabulary", "vocabulary"),
)
"""Sources of the words around a place and its name."""

_JOINS: Final = (", ", " and ", ", and ", " but also ", ", ideally ", " ")
BANK: Final = PhraseBank("parking.txt", _JOINS)


@dataclass(frozen=True, slots=True)
class ParkingCommand:
    """A command and what it asks for.

    Attributes:
        text: The words.
        asked: A value for each of the template's criteria.
    """

    text: str
    asked: Mapping[str, str]


def _draw_asked(rng: np.random.Generator) -> list[tuple[str, str]]:
    """Sections with the landmark they are about; each slot at most once."""
    count = int(rng.choice(4, p=(0.03, 0.37, 0.38, 0.22)))
    drawn: dict[str, tuple[str, str]] = {}
    while len(drawn) < count:
        kind = rng.random()
        if kind < 0.5:
            landmark = LANDMARKS[int(rng.integers(len(LANDMARKS)))]
            drawn[landmark] = ("far" if rng.random() < 0.3 else "near", landmark)
        else:
            section = tuple(_SLOTS)[int(rng.integers(len(_SLOTS)))]
            drawn[_SLOTS[section][0]] = (section, "")
    return list(drawn.values())


def wish(rng: np.random.Generator, split: Split) -> ParkingCommand:
    """One command of a split."""
    while True:
        chosen = _draw_asked(rng)
        asked = dict(NOTHING)
        for section, landmark in chosen:
            name, value = (landmark, section) if landmark else _SLOTS[section]
            asked[name] = value
        if split in ("train", "fit", "tune", "seen") and held_back(asked, NOTHING):
            continue
        if split == "composition" and not held_back(asked, NOTHING):
            continue
        if split in ("phrasing", "vocabulary") and not chosen:
            continue
        return ParkingCommand(_said(rng, chosen, asked, split), asked)


def _said(rng: np.random.Generator, chosen: Sequence[tuple[str, str]], asked: Mapping[str, str], split: Split) -> str:
    new = novel(rng, len(chosen), split)
    after: list[str] = []
    alone: list[str] = []
    for (section, landmark), own in zip(chosen, new, strict=True):
        text, kind = _phrase(rng, section, landmark, own)
        (after if kind == "p" else alone).append(text)
    alone += _beside(rng, asked, _around(split))
    sentences: list[str] = []
    if after or not alone or rng.random() < 0.3:
        sentences.append(_frame(rng, after, _around(split)))
    at = [int(rng.integers(len(sentences) + 1)) for _ in alone]
    for text, place in zip(alone, at, strict=True):
        sentences.insert(min(place, len(sentences)), text)
    joined = " ".join(sentences)
    return worn(rng, joined)


def _phrase(rng: np.random.Generator, section: str, landmark: str, split: Split) -> tuple[str, str]:
    kind = "p" if rng.random() < 0.65 else "s"
    if not landmark:
        texts = BANK.phrases(section, kind, split) or BANK.phrases(section, "ps"[kind == "p"], split)
        if not BANK.phrases(section, kind, split):
            kind = "ps"[kind == "p"]
        return pick(rng, texts), kind
    how: Split = split
    what: Split = split
    if split == "phrasing":  # new words around the place, a new name of the place, or both
        how, what = _PHRASINGS[int(rng.integers(3))]
    elif split == "vocabulary":
        how, what = _VOCABULARIES[int(rng.integers(3))]
    text, noun = pick(rng, BANK.phrases(section, kind, how)), pick(rng, BANK.phrases(landmark, "n", what))
    filled = text.replace("{L}", noun)
    return (sentence(filled) if kind == "s" else filled), kind


def _around(split: Split) -> Split:
    """Where what asks for nothing is taken from."""
    return "phrasing" if split in ("phrasing", "vocabulary") else "train"


def _beside(rng: np.random.Generator, asked: Mapping[str, str], split: Split) -> list[str]:
    """Sentences that ask for nothing."""
    found: list[str] = []
    if rng.random() < 0.12:
        found.append(pick(rng, BANK.phrases("chatter", "s", split)))
    if asked["bay"] == "plain" and rng.random() < 0.08:
        found.append(pick(rng, BANK.phrases("plain", "s", split)))
    idle = [name for name in LANDMARKS if asked[name] == NONE]
    if rng.random() < 0.08:
        noun = pick(rng, BANK.phrases(pick(rng, idle), "n", "train"))
        text = pick(rng, BANK.phrases("ignore", "s", split)).replace("{L}", noun)
        found.append(sentence(text))
    return found


def _frame(rng: np.random.Generator, after: Sequence[str], split: Split) -> str:
    joined = ""
    for place, text in enumerate(after):
        joined += (" " if place == 0 else pick(rng, _JOINS)) + text
    if rng.random() < 0.35:
        begun = pick(rng, BANK.phrases("want", "f", split))
    else:
        begun = pick(rng, OPENERS) + pick(rng, BANK.phrases("verb", "f", split))
    return sentence(begun) + joined + "."
