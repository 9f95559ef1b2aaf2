"""What a remark after a drive says that no table of phrases knows: sorted by a model that learned from such remarks."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from chauffeur.language.text_classifier import load_sorter

WEIGHTS: Final = Path(__file__).parent / "weights" / "remarks.npz"

REMARK_KINDS: Final = (
    "too_fast/bit", "too_fast/plain", "too_fast/much", "too_slow/bit", "too_slow/plain", "too_slow/much",
    "too_close", "too_far", "harsh", "swerving", "timid", "close_call",
    "no_overtake", "passed", "not_right", "waited", "not_waited",
    "not_parked", "wrong_spot.nearest", "wrong_spot.stadium", "wrong_spot.exit", "parked/faster", "parked/slower",
    "fine", "none",
)  # fmt: skip
"""What a remark can say: how it was driven; what was not done that had been wanted, or done that had not; that it was
all right; nothing of the drive."""


@dataclass(frozen=True, slots=True)
class Sorted:
    """A remark, sorted.

    Attributes:
        kind: One of REMARK_KINDS.
        share: How likely it is that, 0..1.
    """

    kind: str
    share: float


def sort_remark(text: str) -> Sorted:
    """The likeliest kind of a remark. Raises DataError where the sorter's file is damaged."""
    shares = load_sorter(WEIGHTS).shares(text)
    kind = next(iter(shares))
    return Sorted(kind, shares[kind])
