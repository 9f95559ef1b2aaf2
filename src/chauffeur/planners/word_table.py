"""Words as vectors: WordPiece tokens and a small table of what they mean.

A model of a million parameters that is trained on some thousand sentences knows no word it has not met. The table lends
it the lexical knowledge of a large language model: the input embeddings of all-MiniLM-L6-v2 (Apache-2.0), reduced to
`WIDTH` principal components and 8 bits, in which "kiosk" lies near "booth" whether training said so or not.
`benchmarks/shipped_words.py` makes it.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import Any, Final
from zipfile import BadZipFile

import numpy as np

from chauffeur.concept import DataError

Array = np.ndarray[Any, Any]

WIDTH: Final = 96
UNKNOWN: Final = "[UNK]"
MOST_PIECES: Final = 64
"""Longer texts are cut."""
SHIPPED_WORDS: Final = Path(__file__).parent / "vilad" / "weights" / "words.npz"
"""The table that comes with the package."""
_PARTS: Final = re.compile(r"[a-z]+|[0-9]|[.,!?;:'\"-]")


class WordTable:
    """Pieces of words and their vectors."""

    def __init__(self, pieces: tuple[str, ...], values: Array, steps: Array) -> None:
        """Put together.

        Args:
            pieces: WordPiece vocabulary; pieces inside a word begin with ##.
            values: int8, (pieces, WIDTH).
            steps: What one step of a column is worth, (WIDTH,).
        """
        self.pieces = pieces
        self._values, self._steps = values, steps.astype(np.float32)
        self._ids = {piece: place for place, piece in enumerate(pieces)}
        self._seen: dict[str, tuple[int, ...]] = {}

    def tokens(self, text: str) -> Array:
        """Ids of a text's pieces, int64, at most `MOST_PIECES`; never empty."""
        found: list[int] = []
        for word in _PARTS.findall(text.lower().replace("\u2019", "'")):
            if word not in self._seen:
                self._seen[word] = self._split(word)
            found += self._seen[word]
        return np.array(found[:MOST_PIECES] or [self._ids[UNKNOWN]], np.int64)

    def vectors(self, ids: Array) -> Array:
        """Vectors of pieces, float32, (..., WIDTH)."""
        return self._values[ids].astype(np.float32) * self._steps

    def _split(self, word: str) -> tuple[int, ...]:
        """Longest pieces first, as WordPiece (Wu et al. 2016)."""
        found: list[int] = []
        start = 0
        while start < len(word):
            for end in range(len(word), start, -1):
                piece = word[start:end] if start == 0 else f"##{word[start:end]}"
                if piece in self._ids:
                    found.append(self._ids[piece])
                    start = end
                    break
            else:
                return (self._ids[UNKNOWN],)
        return tuple(found)

    def store(self, path: Path) -> None:
        """Write what `load_words` reads."""
        text = np.frombuffer("\n".join(self.pieces).encode(), np.uint8)
        np.savez_compressed(path, pieces=text, values=self._values, steps=self._steps)


@cache
def load_words(path: Path) -> WordTable:
    """A stored table. Raises DataError for a file that is missing or damaged."""
    try:
        with np.load(path, allow_pickle=False) as held:
            pieces = tuple(bytes(held["pieces"]).decode().split("\n"))
            values, steps = held["values"], held["steps"]
    except (OSError, KeyError, ValueError, BadZipFile) as error:
        raise DataError(f"The word table {path} cannot be read: {error}.") from error
    if values.shape != (len(pieces), WIDTH) or steps.shape != (WIDTH,) or UNKNOWN not in pieces:
        raise DataError(f"The word table {path} is damaged.")
    return WordTable(pieces, values, steps)
