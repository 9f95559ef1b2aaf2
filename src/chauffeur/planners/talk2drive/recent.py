"""Memory for a planner that learns habits: beside what is similar, what was said last on such a road.

Words differ from day to day ("my train leaves soon", "the meeting has begun") where the wish is the same; no likeness
of texts shows that. Whoever can read the wishes decides what bears on what, so the newest judged trips are shown too.
"""

from __future__ import annotations

from typing import Final

from chauffeur.concept import Context, Feedback, History, HistoryItem, Instruction, PersonId, Trip
from chauffeur.memory.base import Memory

_RECENT: Final = 6


class RecentToo:
    """A memory whose recall adds the newest judged trips in the same kind of world; they have a similarity
    of -1, since nothing was compared."""

    def __init__(self, memory: Memory) -> None:
        self._memory = memory

    def recall(self, person: PersonId, instruction: Instruction, context: Context, k: int) -> History:
        """As `Memory.recall`, the added trips last."""
        found = self._memory.recall(person, instruction, context, k)
        if not person.strip():
            return found
        known = {(item.trip_id, item.when) for item in found.items}
        newest = self._memory.latest(person, context.situation.world, _RECENT + len(known)).items
        added = [item for item in newest if (item.trip_id, item.when) not in known][:_RECENT]
        return History((*found.items, *added))

    def latest(self, person: PersonId, world: str, k: int) -> History:
        """As the memory behind it, like all that follows."""
        return self._memory.latest(person, world, k)

    def remember(self, trip: Trip, feedback: Feedback | None = None) -> None:
        self._memory.remember(trip, feedback)

    def attach_feedback(self, person: PersonId, feedback: Feedback, trip_id: str | None = None) -> bool:
        return self._memory.attach_feedback(person, feedback, trip_id)

    def export(self, person: PersonId) -> str:
        return self._memory.export(person)

    def forget_last(self, person: PersonId) -> HistoryItem | None:
        return self._memory.forget_last(person)

    def erase(self, person: PersonId) -> bool:
        return self._memory.erase(person)

    def sweep(self) -> int:
        return self._memory.sweep()

    def people(self) -> tuple[PersonId, ...]:
        return self._memory.people()


def fitting(memory: Memory, planner: str) -> Memory:
    """The memory as a planner wants it, by its specification (`talk2drive`, `talk2drive/openai/...`, `vlm`, others)."""
    return RecentToo(memory) if planner.partition("/")[0] in ("talk2drive", "vlm") else memory
