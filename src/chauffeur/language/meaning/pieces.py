"""WordPiece tokens of a text, with the characters that each stands for (Devlin et al. 2019, BERT's uncased scheme)."""

from __future__ import annotations

import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Final

MOST_PIECES: Final = 96
"""Longer texts are cut; a hundred pieces are some seventy words."""
_LONGEST_WORD: Final = 64
_MOST_KNOWN: Final = 20_000
"""Words whose pieces are kept."""
_UNKNOWN, _CLASS, _SEPARATOR = "[UNK]", "[CLS]", "[SEP]"


@dataclass(frozen=True, slots=True)
class Pieces:
    """Tokens of a text.

    Attributes:
        ids: With the class token in front and the separator behind, (n,).
        spans: Characters of each in the text; empty ones for the two added.
        words: Index of the word, split at white space, that each belongs to; -1 for the two added.
    """

    ids: tuple[int, ...]
    spans: tuple[tuple[int, int], ...]
    words: tuple[int, ...]


class WordPieces:
    """Splits texts by a vocabulary."""

    def __init__(self, vocabulary: Mapping[str, int]) -> None:
        """Args: ids of the pieces; those inside a word begin with `##`."""
        self._ids = vocabulary
        self._known: dict[str, tuple[tuple[int, int, int], ...]] = {}
        self._unknown = vocabulary[_UNKNOWN]
        self._ends = vocabulary[_CLASS], vocabulary[_SEPARATOR]

    def split(self, text: str) -> Pieces:
        """Tokens of a text, `MOST_PIECES` at most."""
        ids, spans, words = [self._ends[0]], [(0, 0)], [-1]
        word, at = -1, 0
        for low, high in _parts(text):
            if low >= at and (word < 0 or any(char.isspace() for char in text[at:low])):
                word += 1
            at = high
            for piece, start, end in self._pieces(text, low, high):
                ids.append(piece)
                spans.append((start, end))
                words.append(word)
        ids, spans, words = ids[: MOST_PIECES - 1], spans[: MOST_PIECES - 1], words[: MOST_PIECES - 1]
        return Pieces((*ids, self._ends[1]), (*spans, (0, 0)), (*words, -1))

    def _pieces(self, text: str, low: int, high: int) -> list[tuple[int, int, int]]:
        """(id, first character, end) of a word or sign; of words met before, from memory."""
        word = text[low:high]
        held = self._known.get(word)
        if held is None:
            held = tuple((one, a - low, b - low) for one, a, b in self._split_word(text, low, high))
            if len(self._known) < _MOST_KNOWN:
                self._known[word] = held
        return [(one, low + a, low + b) for one, a, b in held]

    def _split_word(self, text: str, low: int, high: int) -> list[tuple[int, int, int]]:
        plain = [(_plain(char), at) for at, char in enumerate(text[low:high], low)]
        chars = [(char, at) for said, at in plain for char in said]
        if len(chars) > _LONGEST_WORD:
            return [(self._unknown, low, high)]
        found: list[tuple[int, int, int]] = []
        start = 0
        while start < len(chars):
            for end in range(len(chars), start, -1):
                name = "".join(char for char, _ in chars[start:end])
                known = self._ids.get(f"##{name}" if start else name)
                if known is not None:
                    found.append((known, chars[start][1], chars[end - 1][1] + 1))
                    start = end
                    break
            else:
                return [(self._unknown, low, high)]
        return found


@cache
def _plain(char: str) -> str:
    """A letter without case and accents."""
    return "".join(one for one in unicodedata.normalize("NFD", char.lower()) if not unicodedata.combining(one))


def _parts(text: str) -> list[tuple[int, int]]:
    """Words and signs of a text, (first character, end) each: white space parts, and every sign stands alone."""
    found: list[tuple[int, int]] = []
    start = -1
    for at, char in enumerate(text):
        kind = _kind(char)
        if kind:
            if start >= 0:
                found.append((start, at))
            start = -1
            if kind == "sign":
                found.append((at, at + 1))
        elif start < 0:
            start = at
    return [*found, (start, len(text))] if start >= 0 else found


@cache
def _kind(char: str) -> str:
    """`sign`, `gap`, or empty for a letter or digit."""
    if unicodedata.category(char).startswith("P") or char in "$+<=>^`|~" or "一" <= char <= "鿿":
        return "sign"
    return "gap" if char.isspace() or unicodedata.category(char) in ("Cc", "Cf") else ""


def read_vocabulary(path: Path) -> dict[str, int]:
    """Ids of the pieces in a vocabulary file, one a line."""
    return {piece: at for at, piece in enumerate(path.read_text(encoding="utf-8").splitlines())}
