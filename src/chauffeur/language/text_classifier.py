"""Sorts short sentences into kinds: a linear model over words, pairs of words, negated words and parts of words.

What is learned lies in one small file of numbers; looking at a sentence takes a tenth of a millisecond, needs no
network and gives the same shares everywhere. `chauffeur model train sorters` makes the files
(`chauffeur.models.sorting`).
"""

from __future__ import annotations

import zlib
from collections.abc import Collection, Iterator, Mapping
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import IO, Any, Final
from zipfile import BadZipFile

import numpy as np

from chauffeur.concept import DataError
from chauffeur.language.tokens import tokens_of

Array = np.ndarray[Any, Any]

BITS: Final = 16
"""Marks are hashed to so many bits; with some ten thousand sentences few collide."""
_PART: Final = 4
"""Letters of the parts of words, which make up for forms and spellings never seen."""

_TURNS_ROUND: Final = frozenset(
    {"not", "no", "never", "nobody", "nothing", "without", "neither", "nor", "hardly", "rather"}
)
_REACH: Final = 4
"""Words after which, and how many words on, others mean the opposite: they get marks of their own."""


def hashed_features(text: str) -> Array:
    """Hashed features of a sentence, unique and sorted; shape (n,), empty for a text without words.

    Its words, pairs of neighbours, pairs with one word between, words that a negation reaches, and parts of words.
    """
    tokens = tokens_of(text)
    if not any(token[0].isalnum() for token in tokens):
        return np.zeros(0, np.int64)
    words = ["<s>", *tokens, "</s>"]
    found = {f"w {word}" for word in words}
    found |= {f"p {one} {two}" for one, two in pairwise(words)}
    found |= {f"k {one} {two}" for one, two in zip(words, words[2:], strict=False)}
    found |= {f"n {word}" for word in _turned_round(tokens)}
    for word in tokens:
        if word[0].isalpha():
            whole = f"<{word}>"
            found |= {f"c {whole[at : at + _PART]}" for at in range(len(whole) - _PART + 1)}
    return np.unique(np.fromiter((zlib.crc32(mark.encode()) % (1 << BITS) for mark in found), np.int64, len(found)))


def _turned_round(tokens: list[str]) -> Iterator[str]:
    """Words that a negation before them reaches, up to the next punctuation."""
    left = 0
    for token in tokens:
        if token in _TURNS_ROUND:
            left = _REACH
        elif not token[0].isalpha():
            left = 0
        elif left:
            yield token
            left -= 1


def negated(text: str) -> frozenset[str]:
    """Words of a text that a negation before them reaches."""
    return frozenset(_turned_round(tokens_of(text)))


class TextClassifier:
    """A learned sorting, loaded."""

    def __init__(self, kinds: tuple[str, ...], weights: Array, steps: Array, bias: Array) -> None:
        """Put together.

        Args:
            kinds: Names of the kinds.
            weights: int8, shape (2^BITS, kinds).
            steps: What one step of a kind's weights is worth, shape (kinds,).
            bias: Shape (kinds,).
        """
        self.kinds = kinds
        self._weights, self._steps, self._bias = weights, steps, bias

    def scores(self, text: str) -> Array:
        """Logits of the kinds for a text; shape (kinds,)."""
        marks = hashed_features(text)
        if not len(marks):
            return self._bias.copy()
        summed = self._weights[marks].sum(axis=0, dtype=np.int32)
        return summed * self._steps / np.sqrt(len(marks)) + self._bias

    def shares(self, text: str, among: Collection[str] | None = None) -> Mapping[str, float]:
        """Probabilities of the kinds, the likeliest first; they sum to 1.

        Args:
            text: What was said.
            among: The kinds that can be; None for all.
        """
        scores = self.scores(text)
        taken = [index for index, kind in enumerate(self.kinds) if among is None or kind in among]
        raised = np.exp(scores[taken] - scores[taken].max())
        raised /= raised.sum()
        order = np.argsort(-raised, kind="stable")
        return {self.kinds[taken[int(index)]]: float(raised[int(index)]) for index in order}

    def store(self, stream: IO[bytes]) -> None:
        """Write what `load_sorter` reads."""
        np.savez_compressed(
            stream, kinds=np.array(self.kinds), weights=self._weights, steps=self._steps, bias=self._bias
        )


@cache
def load_sorter(path: Path) -> TextClassifier:
    """A sorter from its file, read once in a process.

    Raises:
        DataError: There is none, or it is damaged or of another shape.
    """
    try:
        with np.load(path, allow_pickle=False) as stored:
            kinds = tuple(str(kind) for kind in stored["kinds"])
            weights, steps, bias = stored["weights"], stored["steps"], stored["bias"]
    except (OSError, ValueError, KeyError, EOFError, zlib.error, BadZipFile) as error:
        raise DataError(
            f"The sorter {path} cannot be read: {error}.", hint="Install Chauffeur again; the file ships with it."
        ) from error
    if (
        weights.dtype != np.int8
        or weights.shape != (1 << BITS, len(kinds))
        or not steps.shape == bias.shape == (len(kinds),)
    ):
        raise DataError(f"The sorter {path} is of another shape than this version reads.")
    return TextClassifier(kinds, weights, steps.astype(np.float64), bias.astype(np.float64))
