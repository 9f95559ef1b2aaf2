"""A wish for a real vehicle as a trip, as memory keeps it. What was not measured is absent, and the reason is given."""

from __future__ import annotations

import math
import platform
from dataclasses import asdict, replace
from importlib.metadata import version
from typing import Any, Final

from chauffeur.concept import Causes, Limits, Outcome, Parameters, Plan, PlanRequest, Scenario, Trip, Verdict
from chauffeur.driving.onroad.answers import Status
from chauffeur.driving.onroad.vehicle_observation import WORLD
from chauffeur.driving.session import trip_id

NO_METRICS: Final = (
    "The vehicle tells its speed and nothing of gaps, lanes or others: no time to collision, comfort or efficiency is "
    "given. How long it drove so is not known: the parameters stay in force until others are asked for."
)
_OUTCOMES: Final[dict[Status, Outcome]] = {
    "delivered": "ended",
    "refused": "refused",
    "declined": "refused",
    "answered": "refused",
}


def make_trip(
    request: PlanRequest,
    plan: Plan,
    verdicts: tuple[Verdict, ...],
    status: Status,
    words: str,
    *,
    number: int,
    began: str,
    interface: str,
    dry_run: bool,
    confirmed_s: float | None,
) -> Trip:
    """File what became of a wish.

    Args:
        request: I, C, S and H.
        plan: R and P.
        verdicts: Of the checks.
        status: What became of it.
        words: The same in words.
        number: Of the wish in its session.
        began: When the session began; two sessions' trips are never the same.
        interface: The way to the vehicle.
        dry_run: Whether nothing was published.
        confirmed_s: Time until every receiver had it.
    """
    if isinstance(plan.policy, Parameters) and not math.isfinite(plan.policy.target_speed_mps):
        plan = replace(plan, policy=None, settings=())  # no number, and nothing to learn from
    scenario = Scenario(f"{WORLD}:{interface}", WORLD, {"began": began, "dry_run": dry_run}, 0)
    outcome = _OUTCOMES.get(status, "not_driven")
    return Trip(
        id=trip_id(request.instruction, request.limits, plan, scenario, 0, tick=number),
        instruction=request.instruction,
        context=request.context,
        history=request.history,
        plan=plan,
        verdicts=verdicts,
        outcome=outcome,
        causes=Causes(refused=outcome == "refused", detail="" if status == "delivered" else words),
        metrics=(),
        duration_s=0.0,
        scenario=scenario.id,
        seed=0,
        record=_record(plan, request.limits, status, interface, dry_run, confirmed_s),
    )


def _record(
    plan: Plan, limits: Limits, status: Status, interface: str, dry_run: bool, confirmed_s: float | None
) -> tuple[tuple[str, Any], ...]:
    return (
        ("chauffeur", version("chauffeur")),
        ("python", platform.python_version()),
        ("planner", plan.planner),
        ("model", plan.model),
        ("limits", asdict(limits)),
        ("simulated", False),
        ("interface", interface),
        ("dry_run", dry_run),
        ("status", status),
        ("confirmed_s", confirmed_s),
        ("metrics_absent", NO_METRICS),
    )
