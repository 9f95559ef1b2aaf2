"""Requests to a planner, item by item: the part of a run that a learning loop replaces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, Self

from chauffeur.concept import Context, Instruction, Limits, PlanRequest, SystemMessage
from chauffeur.driving.planning import screened_request
from chauffeur.planners.prompts import Setting, build_system_message
from chauffeur.worlds.highway.dblv1 import Item


class Requests(Protocol):
    """Makes the request of an item."""

    @property
    def id(self) -> str:
        """Identity of what decides them beside the prompt setting, item and limits; empty for the plain wish."""
        ...

    @property
    def labels(self) -> tuple[str, ...]:
        """Caveats to show with every result of these requests."""
        ...

    async def request(self, item: Item, context: Context) -> PlanRequest:
        """Everything the planner is given. Raises ChauffeurError when the item cannot be asked."""
        ...


@dataclass(frozen=True, slots=True)
class PlainRequests:
    """The words, the situation and one system message for all: zero-shot and few-shot."""

    system: SystemMessage
    limits: Limits
    id: str = ""
    labels: tuple[str, ...] = ()

    @classmethod
    def of(cls, setting: Setting, limits: Limits) -> Self:
        """Requests under a prompt setting."""
        return cls(build_system_message(setting, limits=limits), limits)

    async def request(self, item: Item, context: Context) -> PlanRequest:
        return screened_request(Instruction(item.command, source="benchmark"), context, self.system, limits=self.limits)
