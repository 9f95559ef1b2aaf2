"""Words as the compact network reads them: a table of known words, and hashed places for all others."""

from __future__ import annotations

import re
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

from chauffeur.bench.nuplanqa.scenes.wording import word_bank, wordings

PAD: Final = 0
END: Final = 1
"""Ends the speeds, the question and the option: at the last one the score is read."""
STRANGE: Final = 16
"""Places for words that the table does not know."""
_WORD: Final = re.compile(r"[a-z]+|\d")


@dataclass(frozen=True)
class QuestionWordTable:
    """A vocabulary.

    Attributes:
        words: Known words, sorted.
    """

    words: tuple[str, ...]

    @classmethod
    def taught(cls, half: str = "train") -> QuestionWordTable:
        """The words of a half of all wordings (see `wordings`), and the names of speeds."""
        bank = word_bank()
        found: set[str] = {f"v{place}:{speed}" for place in range(2) for speed in range(31)}
        texts = [*bank.motion["train"].values(), "left", "right"]
        for family in bank.families.values():
            texts += wordings(family.asked, half)
            texts += [text for said in family.classes.values() for text in wordings(said, half)]
        for text in texts:
            found |= set(_WORD.findall(re.sub(r"\{\w+\}", " ", text.lower())))
        return cls(tuple(sorted(found)))

    @property
    def size(self) -> int:
        """Tokens."""
        return 2 + STRANGE + len(self.words)

    @cached_property
    def _places(self) -> dict[str, int]:
        return {word: 2 + STRANGE + place for place, word in enumerate(self.words)}

    def tokens(self, text: str) -> list[int]:
        """Tokens of a text."""
        return [self._token(word) for word in _WORD.findall(text.lower())]

    def text(self, question: str, option: str, speeds_mps: Sequence[float] = ()) -> list[int]:
        """Tokens of a question with one of its options; of the velocity samples the first and the last are read."""
        ends = (speeds_mps[0], speeds_mps[-1]) if speeds_mps else ()
        known = [self._token(f"v{place}:{min(30, max(0, round(speed)))}") for place, speed in enumerate(ends)]
        return [*known, END, *self.tokens(question), END, *self.tokens(option), END]

    def _token(self, word: str) -> int:
        return self._places.get(word, 2 + zlib.crc32(word.encode()) % STRANGE)
