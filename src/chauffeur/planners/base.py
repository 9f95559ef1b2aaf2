"""What a planner must offer, and the shared idea of its price in time."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from chauffeur.concept import Plan, PlanRequest


@runtime_checkable
class Planner(Protocol):
    """Turns (I, C, S, H, feedback rounds) into (R, P)."""

    @property
    def id(self) -> str:
        """Registry name with the model, e.g. `openai/gpt-4o` or `onboard`; stands in every result."""
        ...

    @property
    def model(self) -> str:
        """Model or rule set with its version; stands in every result."""
        ...

    async def plan(self, request: PlanRequest) -> Plan:
        """One plan. Raises PlannerError when no plan can be had; declining is a Plan with `refusal`."""
        ...
