"""The gate of a set of questions: it must not give away its answers.

Whoever reads only options, or options and control signals, or goes by lengths or letters, must do little better than
chance (25 %). The bound is 35 %.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from chauffeur.bench.nuplanqa.blind import blind_guesses, by_length, fit_blind
from chauffeur.bench.nuplanqa.questions import SUBTASKS, VqaItem

BOUND: Final = 0.35
LEAST: Final = 100
"""With fewer questions chance alone passes the bound."""
LEAST_A_SUBTASK: Final = 60
"""With fewer questions of a subtask its own accuracy says little, and is not bounded."""


@dataclass(frozen=True, slots=True)
class GateLine:
    """A trick and how far it leads.

    Attributes:
        trick: In words.
        accuracy: Over all questions.
        worst: Subtask where it leads farthest; empty where none has enough questions.
        worst_accuracy: There.
        questions: How many were tried.
    """

    trick: str
    accuracy: float
    worst: str
    worst_accuracy: float
    questions: int

    @property
    def worst_told(self) -> str:
        """For people."""
        return f"{self.worst} {self.worst_accuracy:.1%}" if self.worst else "too few questions"

    def passes(self, bound: float = BOUND) -> bool:
        """True if the set withstands it: over all questions, where there are enough to tell."""
        return self.questions < LEAST or self.accuracy <= bound


def gate(items: Sequence[VqaItem], taught: Sequence[VqaItem] = ()) -> tuple[GateLine, ...]:
    """Accuracy of each trick.

    Args:
        items: The set.
        taught: Another set, e.g. the training split, from which the blind baseline learns as well.
    """
    usual = Counter(item.answer for item in items).most_common(1)[0][0] if items else 0
    lines = [
        _line("longest option", items, [by_length(item, longest=True) for item in items]),
        _line("shortest option", items, [by_length(item, longest=False) for item in items]),
        _line("most frequent letter", items, [usual] * len(items)),
    ]
    for signals, what in ((False, "words of the options"), (True, "words of the options and control signals")):
        guesses = blind_guesses(items, signals=signals)
        if guesses is not None:
            lines.append(_line(f"{what}, learned from other scenes of the set", items, guesses))
        if taught:
            found = fit_blind(taught, signals=signals).guess(items).tolist()
            lines.append(_line(f"{what}, learned from the training split", items, found))
    return tuple(lines)


def _line(trick: str, items: Sequence[VqaItem], guesses: Sequence[int]) -> GateLine:
    hits: Mapping[str, list[bool]] = {task: [] for task in SUBTASKS}
    for item, guess in zip(items, guesses, strict=True):
        hits[item.subtask].append(guess == item.answer)
    shares = {task: sum(found) / len(found) for task, found in hits.items() if len(found) >= LEAST_A_SUBTASK}
    worst = max(shares, key=lambda task: shares[task], default="")
    total = sum(sum(found) for found in hits.values()) / max(1, len(items))
    return GateLine(trick, total, worst, shares.get(worst, 0.0), len(items))
