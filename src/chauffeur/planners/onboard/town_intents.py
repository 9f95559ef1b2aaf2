"""Intents in a town: the learned reading of a whole sentence, before any of its parts are read.

A sorter that learned from sentences of many writers (`data/sorters/town.tsv`) says how likely each intent is. It tells
a story from an instruction, a question from a wish and a hint from small talk; sides, numbers, places and denials are
read by rules, for they must be certain.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from chauffeur.language.text_classifier import load_sorter

WEIGHTS: Final = Path(__file__).parent / "weights" / "town.npz"

TOWN_INTENTS: Final = (
    "turn", "straight", "lane", "uturn", "goto", "stop", "wait", "go", "faster", "slower", "speed", "hurry", "calm",
    "closer", "further", "yield", "none", "question", "unsafe", "distress",
)  # fmt: skip
"""`none`: nothing that is for the driver: praise, small talk, stories, other people's driving."""

SURE: Final = 0.4
"""From this share on an intent decides alone: of writers that were left out of the training, 97.5 % are then right."""
LIKELY: Final = 0.25
"""From this share on it agrees or disagrees with what the rules read; below it nothing is driven unasked."""

PLAIN_WISHES: Final = {
    "faster": "Drive faster.",
    "slower": "Drive slower.",
    "hurry": "I am in a hurry.",
    "calm": "Drive gently.",
    "closer": "Drive closer to the car ahead.",
    "further": "Keep more distance to the car ahead.",
}
"""Wish that a hint of each kind becomes: an ordinary wish, never more."""


@dataclass(frozen=True, slots=True)
class TownIntent:
    """The likeliest intent.

    Attributes:
        kind: One of `TOWN_INTENTS`.
        share: How likely it is, 0..1.
    """

    kind: str
    share: float

    @property
    def sure(self) -> bool:
        """True if it decides alone."""
        return self.share >= SURE

    @property
    def likely(self) -> bool:
        """True if it counts beside what the rules read."""
        return self.share >= LIKELY

    def surely(self, *kinds: str) -> bool:
        """True if it is surely one of some kinds."""
        return self.sure and self.kind in kinds


def intent_of(words: str) -> TownIntent:
    """The likeliest intent of words. Raises DataError if the sorter is missing."""
    kind, share = next(iter(load_sorter(WEIGHTS).shares(words).items()))
    return TownIntent(kind, share)
