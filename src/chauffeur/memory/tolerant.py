"""A memory that cannot be used does not keep the car from driving: the person is told, and it drives without."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from chauffeur.concept import ChauffeurError, Context, Feedback, History, Instruction, PersonId, Trip


class _Memory(Protocol):
    """What a drive asks of a memory."""

    def recall(self, person: PersonId, instruction: Instruction, context: Context, k: int) -> History: ...
    def remember(self, trip: Trip, feedback: Feedback | None) -> None: ...


class TolerantMemory:
    """The memory of a drive; where it fails, it is said, and nothing is recalled or kept."""

    def __init__(self, memory: _Memory, tell: Callable[[str], None]) -> None:
        """Wrap.

        Args:
            memory: May fail at any call.
            tell: Hears what went wrong, in words for the person.
        """
        self._memory, self._tell = memory, tell

    def recall(self, person: PersonId, instruction: Instruction, context: Context, k: int) -> History:
        """As `Memory.recall`; an empty history where that fails."""
        try:
            return self._memory.recall(person, instruction, context, k)
        except ChauffeurError as error:
            self._tell(f"Nothing is recalled of {person}: {error}")
            return History()

    def remember(self, trip: Trip, feedback: Feedback | None = None) -> None:
        """As `Memory.remember`; where that fails the trip is not kept."""
        try:
            self._memory.remember(trip, feedback)
        except ChauffeurError as error:
            self._tell(f"This trip is not kept for {trip.instruction.person}: {error}")
