"""How any drive files what became of a wish: one `Trip`, with the provenance that it takes to repeat it.

H + (I, C, P, R); feedback joins when the person speaks. A drive in simulated time files its episode, one in real time
the wish as its supervisor kept it, and a session on a vehicle its answer. What was not measured is absent.
"""

from __future__ import annotations

import hashlib
import json
import math
import platform
from dataclasses import asdict, replace
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, Final

from chauffeur.concept import (
    Causes,
    Instruction,
    Limits,
    Metric,
    Outcome,
    Parameters,
    Plan,
    PlanRequest,
    Program,
    Scenario,
    SystemMessage,
    Trip,
)
from chauffeur.driving.emergency import not_checked
from chauffeur.driving.episode import Episode, make_world
from chauffeur.driving.events import EventKind
from chauffeur.driving.judge.account import unused_of
from chauffeur.driving.planning import Planned
from chauffeur.safety.shield import SHIELD_VERSION

if TYPE_CHECKING:
    from chauffeur.driving.live.messages import Report
    from chauffeur.driving.live.starts import Start
    from chauffeur.driving.live.supervisor import Interaction
    from chauffeur.driving.onroad.answers import OnRoadAnswer, Status

Facts = tuple[tuple[str, Any], ...]
"""Provenance: names and JSON values."""

NO_METRICS: Final = (
    "The vehicle tells its speed and nothing of gaps, lanes or others: no time to collision, comfort or efficiency is "
    "given. How long it drove so is not known: the parameters stay in force until others are asked for."
)

_ENDED_BADLY: Final[dict[str, Outcome]] = {"collision": "collision", "off_road": "off_road"}
_OF_EVENTS: Final[dict[EventKind, Outcome]] = {
    "finished": "ended", "superseded": "ended", "interrupted": "ended", "failed": "failure", "declined": "refused",
    "answered": "refused", "refused": "refused",
}  # fmt: skip
_OF_ANSWERS: Final[dict[Status, Outcome]] = {
    "delivered": "ended", "refused": "refused", "declined": "refused", "answered": "refused",
}  # fmt: skip


def file_trip(
    planned: Planned,
    scenario: Scenario,
    seed: int,
    outcome: Outcome,
    *,
    causes: Causes,
    engine: str,
    facts: Facts = (),
    tick: int = 0,
    metrics: tuple[Metric, ...] = (),
    duration_s: float = 0.0,
    said: tuple[tuple[float, str], ...] = (),
    episode: Episode | None = None,
) -> Trip:
    """File what became of a planned wish. Every other function here hands what it knows to this one.

    Args:
        planned: I, C, S and H; R and P; V.
        scenario: The start situation, or the vehicle.
        seed: Of the traffic; 0 where nothing is drawn.
        outcome: What happened.
        causes: Why.
        engine: Name of the simulator; empty for a vehicle.
        facts: Further provenance.
        tick: When it was wished, of drives that take several wishes.
        metrics: Scores.
        duration_s: Time driven, s.
        said: What the passenger was told, as (time s, text).
        episode: The drive, where one was judged.
    """
    request, plan = planned.request, planned.plan
    return Trip(
        id=_trip_id(request.instruction, request.limits, plan, scenario, seed, tick),
        instruction=request.instruction,
        context=request.context,
        history=request.history,
        plan=plan,
        verdicts=planned.verdicts,
        outcome=outcome,
        causes=causes,
        metrics=metrics,
        duration_s=duration_s,
        scenario=scenario.id,
        seed=seed,
        said=said,
        record=(*provenance(plan, scenario, seed, request.limits, engine), *facts),
        unused=() if outcome in ("refused", "not_driven") else unused_of(request.instruction.text, plan),
        parts=() if episode is None else episode.parts,
        judged_by="" if episode is None else episode.judged_by,
    )


def make_trip(
    planned: Planned,
    scenario: Scenario,
    seed: int,
    episode: Episode | None,
    refusal: str = "",
    *,
    shielded: bool = False,
) -> Trip:
    """File a wish of a drive in simulated time.

    Args:
        planned: What the words came to.
        scenario, seed: Where.
        episode: The drive; None where nothing was driven.
        refusal: Why nothing was, in words.
        shielded: Whether the run-time shield had the last word.
    """
    facts: Facts = (("shield", SHIELD_VERSION),) if shielded else ()
    if planned.verdicts[: len(own := not_checked(planned.plan))] != own:
        facts = (*facts, ("minimum_speed", True))
    engine = make_world(scenario).engine
    if episode is None:
        failed = planned.unusable
        causes = Causes(refused=not failed, policy_failed=failed, detail=refusal)
        return file_trip(planned, scenario, seed, "refused", causes=causes, engine=engine, facts=facts)
    if episode.bounded:
        facts = (*facts, ("bounded", dict(episode.bounded)))
    return file_trip(
        planned,
        scenario,
        seed,
        episode.outcome,
        causes=episode.causes,
        engine=engine,
        facts=facts,
        metrics=episode.metrics,
        duration_s=episode.duration_s,
        said=episode.said,
        episode=episode,
    )


def live_trip(interaction: Interaction, start: Start, dt_s: float, last: Report | None) -> Trip | None:
    """File a wish of a drive in real time; None if nothing was planned, or nothing driven of what was planned.

    Args:
        interaction: The closed wish, its plan, and what became of it.
        start: The drive it belongs to.
        dt_s: Control period in vehicle time.
        last: Control's newest report.
    """
    brief, answer, begun = interaction.brief, interaction.answer, interaction.started_tick
    if brief is None or answer is None or answer.kind not in _OF_EVENTS:
        return None
    outcome: Outcome = _OF_EVENTS[answer.kind]
    if begun is None and outcome != "refused":
        return None
    driven_s = 0.0
    if begun is not None:
        now = answer.tick if last is None else max(answer.tick, last.tick)
        driven_s = round(max(0, now - begun) * dt_s, 6)
        if answer.kind == "interrupted" and last is not None and last.outcome in _ENDED_BADLY:
            outcome = _ENDED_BADLY[last.outcome]
    why = answer.text if outcome in ("refused", "failure") else ""
    failed = outcome == "failure"
    request = PlanRequest(brief.instruction, brief.context, SystemMessage(""), brief.history, limits=start.limits)
    return file_trip(
        Planned(brief.plan, interaction.verdicts, request),
        start.scenario,
        start.seed,
        outcome,
        causes=Causes(refused=outcome == "refused", policy_failed=failed, fallback_used=failed, detail=why),
        engine=make_world(start.scenario).engine,
        facts=(
            ("shield", SHIELD_VERSION),
            ("live", True),
            ("tick", brief.tick),
            *((("taken_over", True),) if interaction.taken_over else ()),
        ),
        tick=brief.tick,
        duration_s=driven_s,
        said=tuple((event.tick * dt_s, event.text) for event in interaction.events if event.kind == "said"),
    )


def vehicle_trip(request: PlanRequest, plan: Plan, answer: OnRoadAnswer, session: Scenario) -> Trip:
    """File a wish for a real vehicle.

    Args:
        request: I, C, S and H.
        plan: R and P.
        answer: What became of it.
        session: The way to the vehicle (`interface`), when it began, and whether nothing is published (`dry_run`).
    """
    if isinstance(plan.policy, Parameters) and not math.isfinite(plan.policy.target_speed_mps):
        plan = replace(plan, policy=None, settings=())  # no number, and nothing to learn from
    outcome = _OF_ANSWERS.get(answer.status, "not_driven")
    detail = "" if answer.status == "delivered" else answer.words
    return file_trip(
        Planned(plan, answer.verdicts, request),
        session,
        0,
        outcome,
        causes=Causes(refused=outcome == "refused", detail=detail),
        engine="",
        facts=(
            ("interface", session.config["interface"]),
            ("dry_run", session.config["dry_run"]),
            ("status", answer.status),
            ("confirmed_s", answer.confirmed_s),
            ("metrics_absent", NO_METRICS),
        ),
        tick=answer.wish,
    )


def scenario_hash(scenario: Scenario) -> str:
    """SHA-256 of a scenario's content."""
    return hashlib.sha256(json.dumps(asdict(scenario), sort_keys=True).encode()).hexdigest()


def _trip_id(instruction: Instruction, limits: Limits, plan: Plan, scenario: Scenario, seed: int, tick: int) -> str:
    """Content hash of what decides a trip: wish, scenario, seed, limits, planner and policy, and when it was wished."""
    policy = str(plan.policy)
    if isinstance(plan.policy, Program):
        policy = "\0".join(text for text in (plan.policy.source, plan.policy.library) if text)
    parts = [
        instruction.text,
        str(instruction.person),
        scenario_hash(scenario),
        str(seed),
        str(limits),
        plan.planner,
        plan.model,
        policy,
        plan.refusal,
        *([str(tick)] if tick else []),
    ]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:16]


def provenance(plan: Plan, scenario: Scenario, seed: int, limits: Limits, engine: str) -> Facts:
    """What a result must name to be repeated; a vehicle's drive cannot be."""
    repeats: Facts = (("scenario_sha256", scenario_hash(scenario)), ("seed", seed)) if engine else ()
    return (
        ("chauffeur", version("chauffeur")),
        *((("engine", engine),) if engine else ()),
        ("python", platform.python_version()),
        ("planner", plan.planner),
        ("model", plan.model),
        *repeats,
        ("limits", asdict(limits)),
        ("simulated", bool(engine)),
    )
