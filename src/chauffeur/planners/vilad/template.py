"""The fixed pattern of a driving decision: what never changes, what is decided, and which words may stand there.

The paper trains and decodes with a pattern whose punctuation and length are fixed, so that a model spends nothing on
formatting (Sec. VII-A, "Fix Pattern Training"). `ActionTemplate` is that pattern as a type. Training, Algorithms 1 and
2, the autoregressive twin and validation all use the same object.

    template = ActionTemplate(("spot", ActionSlot("spot", pointer=True), "; stop", ActionSlot("stop", ("yes", "no"))))

Token ids: 0 is the mask [M]; then come the words of the pattern and of the slots; ids from `size` on point at
candidates of the scene (parking spots, lanes), so that a quantity is always one token. Digits of one number that are
unmasked in the same step need not fit together; one token cannot contradict itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np

from chauffeur.concept import DataError

Array = np.ndarray[Any, Any]

MASK: Final = 0
"""Token id of [M]."""


@dataclass(frozen=True, slots=True)
class ActionSlot:
    """A decision: one token.

    Attributes:
        name: Unique in its template.
        words: What may stand there; empty for a pointer.
        pointer: Whether it points at a candidate of the scene instead.
    """

    name: str
    words: tuple[str, ...] = ()
    pointer: bool = False


@dataclass(frozen=True)
class ActionTemplate:
    """A pattern of fixed words and slots; L is its length in tokens.

    Attributes:
        pieces: Fixed words and slots in the order in which they stand.
    """

    pieces: tuple[str | ActionSlot, ...]

    def __post_init__(self) -> None:
        """Raises DataError for a pattern that cannot be decided."""
        names = [slot.name for slot in self.slots]
        if len(set(names)) != len(names):
            raise DataError(f"A template has two slots of one name: {', '.join(names)}.")
        empty = [slot.name for slot in self.slots if bool(slot.words) == slot.pointer]
        if empty:
            raise DataError(f"ActionSlot {empty[0]!r} has neither words nor candidates, or both.")

    @cached_property
    def slots(self) -> tuple[ActionSlot, ...]:
        """The decisions, in their order."""
        return tuple(piece for piece in self.pieces if isinstance(piece, ActionSlot))

    @cached_property
    def words(self) -> tuple[str, ...]:
        """Words by token id; the mask is the first."""
        said: dict[str, None] = {"[M]": None}
        for piece in self.pieces:
            said |= dict.fromkeys((piece,) if isinstance(piece, str) else piece.words)
        return tuple(said)

    @property
    def size(self) -> int:
        """Number of words; ids from here on point at candidates."""
        return len(self.words)

    @property
    def length(self) -> int:
        """L of Eq. 29: tokens of the whole pattern, punctuation included."""
        return len(self.pieces)

    @cached_property
    def ids(self) -> Mapping[str, int]:
        """Token ids by word."""
        return {word: place for place, word in enumerate(self.words)}

    @cached_property
    def places(self) -> Mapping[str, int]:
        """Position of each slot in the sequence."""
        return {piece.name: at for at, piece in enumerate(self.pieces) if isinstance(piece, ActionSlot)}

    @cached_property
    def maskable(self) -> Array:
        """Mask of the action tokens, the only ones that are ever masked; bool, shape (L,)."""
        return np.array([isinstance(piece, ActionSlot) for piece in self.pieces])

    @cached_property
    def canvas(self) -> Array:
        """y_1: every action masked, everything else in place; int64, shape (L,)."""
        return np.array([MASK if isinstance(piece, ActionSlot) else self.ids[piece] for piece in self.pieces], np.int64)

    def allowed(self, candidates: int = 0) -> Array:
        """Tokens that may stand at each position; bool, shape (L, size + candidates)."""
        found = np.zeros((self.length, self.size + candidates), np.bool_)
        for at, piece in enumerate(self.pieces):
            if isinstance(piece, str):
                found[at, self.ids[piece]] = True
            elif piece.pointer:
                found[at, self.size :] = True
            else:
                found[at, [self.ids[word] for word in piece.words]] = True
        return found

    def encode(self, values: Mapping[str, str | int]) -> Array:
        """y_0 of a decision; int64, shape (L,).

        Args:
            values: A word for each slot, the number of a candidate for each pointer.

        Raises:
            DataError: A slot has no value, or one it does not know.
        """
        row = self.canvas.copy()
        for slot in self.slots:
            value = values.get(slot.name)
            if slot.pointer and isinstance(value, int) and value >= 0:
                row[self.places[slot.name]] = self.size + value
            elif isinstance(value, str) and value in slot.words:
                row[self.places[slot.name]] = self.ids[value]
            else:
                known = "the number of a candidate" if slot.pointer else ", ".join(slot.words)
                raise DataError(f"ActionSlot {slot.name!r} cannot hold {value!r}.", hint=f"It takes {known}.")
        return row

    def decode(self, row: Array | Sequence[int]) -> dict[str, str | int]:
        """Values of the slots of a decided sequence, shape (L,); the opposite of `encode`.

        Raises:
            DataError: The sequence is none of this template, or not decided yet.
        """
        self.validate(row)
        return {
            slot.name: int(row[at]) - self.size if slot.pointer else self.words[int(row[at])]
            for slot, at in ((slot, self.places[slot.name]) for slot in self.slots)
        }

    def validate(self, row: Array | Sequence[int], candidates: int | None = None) -> None:
        """Check that a sequence is a decision of this template.

        Args:
            row: Token ids.
            candidates: How many there are to point at; None for any number.

        Raises:
            DataError: Wrong length, another pattern, a mask left, or a token that may not stand where it stands.
        """
        if len(row) != self.length:
            raise DataError(f"A decision of {len(row)} tokens; the template has {self.length}.")
        for at, (piece, token) in enumerate(zip(self.pieces, (int(one) for one in row), strict=True)):
            if isinstance(piece, str):
                if token != self.ids[piece]:
                    raise DataError(f"Token {at} is fixed ({piece!r}) and was changed.")
            elif token == MASK:
                raise DataError(f"ActionSlot {piece.name!r} is still masked.")
            elif piece.pointer:
                if token < self.size or (candidates is not None and token >= self.size + candidates):
                    raise DataError(f"ActionSlot {piece.name!r} points at no candidate (token {token}).")
            elif token >= self.size or self.words[token] not in piece.words:
                raise DataError(f"ActionSlot {piece.name!r} cannot hold token {token}.")

    def text(self, row: Array | Sequence[int]) -> str:
        """A sequence as people read it; masks as [M], candidates as #number."""
        return " ".join(
            self.words[int(token)] if int(token) < self.size else f"#{int(token) - self.size}" for token in row
        )
