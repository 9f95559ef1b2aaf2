"""What a memory must offer: H of one person, never of another."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from chauffeur.concept import Context, Feedback, History, HistoryItem, Instruction, PersonId, Trip


@runtime_checkable
class Memory(Protocol):
    """Remembers what each person wished, what was driven and how they liked it.

    `NOBODY` stands for "no profile": nothing is stored under it and nothing is found. Every method raises
    ProfileError when the person's profile cannot be used; other profiles are never affected.
    """

    def recall(self, person: PersonId, instruction: Instruction, context: Context, k: int) -> History:
        """Up to `k` remembered interactions that bear on the present wish, most relevant first; never writes."""
        ...

    def latest(self, person: PersonId, world: str, k: int) -> History:
        """The newest interactions with feedback in a kind of world, newest first, whatever was wished; never writes.

        Their similarity is -1: nothing was compared.
        """
        ...

    def remember(self, trip: Trip, feedback: Feedback | None = None) -> None:
        """Keep a trip under the person of its instruction; on return it is on disk."""
        ...

    def attach_feedback(self, person: PersonId, feedback: Feedback, trip_id: str | None = None) -> bool:
        """Add feedback to a remembered trip, the last one by default; False where there is no such trip."""
        ...

    def export(self, person: PersonId) -> str:
        """Everything kept of a person, as one JSON document; its `trips` are in order, the oldest first."""
        ...

    def forget_last(self, person: PersonId) -> HistoryItem | None:
        """Remove the most recent trip for good; what it was, or None where there was none."""
        ...

    def erase(self, person: PersonId) -> bool:
        """Remove a person and all that is kept of them for good; False where there was nothing."""
        ...

    def sweep(self) -> int:
        """Remove what is older than retention allows, of everyone; how many trips that were."""
        ...

    def people(self) -> tuple[PersonId, ...]:
        """Everyone with a readable profile, sorted."""
        ...
