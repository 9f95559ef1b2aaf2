"""Banks of phrases whose writers are held apart: what training may say, and what each test split says instead."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final, Literal
from zlib import crc32

import numpy as np

from chauffeur.concept import DataError
from chauffeur.concept.data import read_data

Split = Literal["train", "fit", "tune", "seen", "composition", "phrasing", "vocabulary"]
"""`fit`, `tune`: training's combinations in the phrases of some of its writers and of its others, to choose what has
to hold for writers never met; `seen`: phrases and combinations of training; `composition`: combinations that training
does not have; `phrasing`: phrases of other writers in words that training has; `vocabulary`: phrases with a word that
training does not have. The last two have any combination."""
TESTS: Final[tuple[Split, ...]] = ("seen", "composition", "phrasing", "vocabulary")
OPENERS: Final = ("", "", "", "Please ", "Could you ", "Can you ", "I would like you to ", "Hey, ", "Now ", "OK, ")

_TRAINED: Final = frozenset("abcdef")
_WRITERS: Final[Mapping[Split, frozenset[str]]] = {
    "train": _TRAINED,
    "seen": _TRAINED,
    "composition": _TRAINED,
    "fit": frozenset("abcd"),
    "tune": frozenset("ef"),
}
"""Writers whose phrases a split may use; the others have those of writers that are held out."""
_HELD_BACK_OF: Final = 5
"""One combination of so many is kept from training."""
_WORD: Final = re.compile(r"[a-z']+")


@dataclass(frozen=True, slots=True)
class CommandPhrase:
    """A line of a bank."""

    section: str
    writer: str
    kind: str
    text: str


class PhraseBank:
    """The phrases of a file in `data/vilad`."""

    def __init__(self, file: str, around: Sequence[str] = (), base: PhraseBank | None = None) -> None:
        """Args: the file; texts that commands of every split are put together with; the bank of the model that training
        begins with: its words are known."""
        self._file, self._around, self._base = file, tuple(around), base
        self._found: dict[tuple[str, str, Split], tuple[str, ...]] = {}

    @cached_property
    def lines(self) -> tuple[CommandPhrase, ...]:
        """All phrases. Raises DataError where the table cannot be read."""
        found: list[CommandPhrase] = []
        section = ""
        for number, line in enumerate(read_data("vilad", self._file).decode().splitlines(), start=1):
            if line.startswith("["):
                section = line.strip("[]")
            elif line and not line.startswith("#"):
                parts = line.split("|")
                if len(parts) != 3 or not section:
                    raise DataError(f"data/vilad/{self._file}, line {number}, is no phrase: {line!r}.")
                found.append(CommandPhrase(section, parts[0], parts[1], parts[2]))
        return tuple(found)

    @cached_property
    def trained_words(self) -> frozenset[str]:
        """Words that training has."""
        texts = [one.text for one in self.lines if one.writer in _TRAINED]
        known = frozenset[str]() if self._base is None else self._base.trained_words
        return known | frozenset(_WORD.findall(" ".join((*texts, *OPENERS, *self._around)).lower()))

    def unheard(self, text: str) -> list[str]:
        """Words of a text that training does not have."""
        plain = re.sub(r"\{[a-z]\}", "", text.lower())
        return [word for word in _WORD.findall(plain) if word not in self.trained_words]

    def phrases(self, section: str, kinds: str, split: Split) -> tuple[str, ...]:
        """Texts of a section, of any of some kinds, that a split may use."""
        key = section, kinds, split
        if key not in self._found:
            own = [one for one in self.lines if one.section == section and one.kind in kinds]
            if split in _WRITERS:
                texts = [one.text for one in own if one.writer in _WRITERS[split]]
            else:
                held = [one.text for one in own if one.writer not in _TRAINED]
                texts = [text for text in held if bool(self.unheard(text)) == (split == "vocabulary")]
            self._found[key] = tuple(texts)
        return self._found[key]


def held_back(asked: Mapping[str, str], nothing: Mapping[str, str]) -> bool:
    """True if a combination of things asked for is kept from training.

    Args:
        asked: A value for each criterion.
        nothing: What each is when nothing is asked.
    """
    parts = sorted(f"{name}={value}" for name, value in asked.items() if value != nothing[name])
    return len(parts) > 1 and crc32(" ".join(parts).encode()) % _HELD_BACK_OF == 0


def novel(rng: np.random.Generator, count: int, split: Split) -> list[Split]:
    """Which split each phrase of a command is taken from: of a test of new words, one or more have one."""
    if split != "vocabulary":
        return [split] * count
    found: list[Split] = ["vocabulary" if rng.random() < 0.5 else "phrasing" for _ in range(count)]
    found[int(rng.integers(count))] = "vocabulary"
    return found


def pick(rng: np.random.Generator, texts: Sequence[str]) -> str:
    """One of some texts."""
    return texts[int(rng.integers(len(texts)))]


def sentence(text: str) -> str:
    """With a capital letter."""
    return text[0].upper() + text[1:]


def worn(rng: np.random.Generator, text: str) -> str:
    """A command as it may be typed: at times without capitals, at times without punctuation."""
    style = rng.random()
    if style < 0.25:
        text = text.lower()
    return text if style > 0.12 else re.sub(r"[.,!?]", "", text)
