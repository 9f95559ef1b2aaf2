"""A remark on weather or road beside a wish never makes its plan faster.

A learned reading may take a wish for another one when a clause is added to it. So a wish with such a clause is planned
as it stands and without it, and of the two plans the slower one is driven. Planners of gains do the same by the care of
their gains.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import replace
from functools import wraps
from typing import Final, TypeVar, cast

from chauffeur.concept import Parameters, Plan, PlanRequest
from chauffeur.language.weather import said_weather, without_said_weather

F = TypeVar("F", bound=Callable[..., Awaitable[Plan]])
_SLACK_MPS: Final = 0.01
"""Planners write speeds in hundredths."""


def never_faster(plan: F) -> F:
    """A planner's `plan`, which plans a wish that says something of the weather without it as well. In a benchmark each
    wish is planned once, as it stands."""

    @wraps(plan)
    async def slower(planner: object, request: PlanRequest) -> Plan:
        made, text = await plan(planner, request), request.instruction.text
        if made.policy is None or request.instruction.source == "benchmark" or said_weather(text) == "none":
            return made
        rest = without_said_weather(text)
        if not rest:
            return made
        other = await plan(planner, replace(request, instruction=replace(request.instruction, text=rest)))
        speed, now_mps = target_mps(other), request.context.situation.speed_mps
        if speed is None or speed >= (target_mps(made) or now_mps) - _SLACK_MPS:
            return made
        return other

    return cast("F", slower)


def target_mps(plan: Plan) -> float | None:
    """The highest speed that a plan sets, m/s; None where it sets none that is known, or drives nothing."""
    if isinstance(plan.policy, Parameters):
        return plan.policy.target_speed_mps
    return None if plan.policy is None else dict(plan.settings).get("target_speed_mps")
