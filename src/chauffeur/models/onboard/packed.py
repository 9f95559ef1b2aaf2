"""Tokenised examples, as they are stored and fed to the training."""

from __future__ import annotations

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
