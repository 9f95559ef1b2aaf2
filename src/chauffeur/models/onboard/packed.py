"""Tokenised examples, as they are stored and fed to the training."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, slots=True)
class Packed:
    """Tokenised examples.

    Attributes:
        tokens: All tokens, one example after the other, dtype uint16.
        starts: Where each example begins, shape (n + 1,).
        replies: Where each example's reply begins, counted from its own beginning, shape (n,).
    """

    tokens: Array
    starts: Array
    replies: Array

    @classmethod
    def of(cls, pairs: Sequence[tuple[str, str]], tokenizer: Any, end: int) -> Packed:
        """Tokenise (prompt, reply) pairs.

        Args:
            pairs: Texts.
            tokenizer: A `tokenizers.Tokenizer`.
            end: Token that ends a reply.
        """
        tokens: list[int] = []
        starts, replies = [0], list[int]()
        prompts = tokenizer.encode_batch([prompt for prompt, _ in pairs])
        answers = tokenizer.encode_batch([reply for _, reply in pairs])
        for asked, answered in zip(prompts, answers, strict=True):
            tokens += [*asked.ids, *answered.ids, end]
            starts.append(len(tokens))
            replies.append(len(asked.ids))
        return cls(np.array(tokens, np.uint16), np.array(starts, np.int64), np.array(replies, np.int32))

    def __len__(self) -> int:
        return len(self.replies)

    def save(self, path: Path) -> None:
        """Write as one `.npz`."""
        np.savez(path, tokens=self.tokens, starts=self.starts, replies=self.replies)

    @classmethod
    def load(cls, path: Path) -> Packed:
        """Read what `save` wrote."""
        with np.load(path) as held:
            return cls(held["tokens"], held["starts"], held["replies"])
