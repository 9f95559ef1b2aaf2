"""What a person's memory keeps of a drive in real time: every wish that was answered, with what was made of it.

H + (I, C, P, R): feedback joins when the person speaks. What was never planned, or gave way before it was begun, is
no trip, and is not kept.
"""

from __future__ import annotations

from typing import Final

from chauffeur.concept import Causes, Outcome, Trip, Verdict
from chauffeur.driving.events import EventKind
from chauffeur.driving.live.messages import Report
from chauffeur.driving.live.starts import Start
from chauffeur.driving.live.supervisor import Interaction
from chauffeur.driving.session import provenance, trip_id
from chauffeur.safety.shield import SHIELD_VERSION

_ENDED_BADLY: Final[dict[str, Outcome]] = {"collision": "collision", "off_road": "off_road"}
_OUTCOMES: Final[dict[EventKind, Outcome]] = {
    "finished": "ended",
    "superseded": "ended",
    "interrupted": "ended",
    "failed": "failure",
    "declined": "refused",
    "answered": "refused",
    "refused": "refused",
}


def trip_of(interaction: Interaction, start: Start, dt_s: float, last: Report | None) -> Trip | None:
    """A closed wish as a trip; None if nothing was planned, or nothing driven of what was planned.

    Args:
        interaction: The wish, its plan, and what became of it.
        start: The drive it belongs to.
        dt_s: Control period in vehicle time.
        last: Control's newest report.
    """
    brief, answer, begun = interaction.brief, interaction.answer, interaction.started_tick
    if brief is None or answer is None or answer.kind not in _OUTCOMES:
        return None
    outcome: Outcome = _OUTCOMES[answer.kind]
    if begun is None and outcome != "refused":
        return None
    driven_s = 0.0
    if begun is not None:
        now = answer.tick if last is None else max(answer.tick, last.tick)
        driven_s = round(max(0, now - begun) * dt_s, 6)
        if answer.kind == "interrupted" and last is not None and last.outcome in _ENDED_BADLY:
            outcome = _ENDED_BADLY[last.outcome]
    plan, seed = brief.plan, start.seed
    why = answer.text if outcome in ("refused", "failure") else ""
    verdicts = (Verdict("live", passed=False, reason=why),) if answer.kind == "refused" else ()
    return Trip(
        id=trip_id(brief.instruction, start.limits, plan, start.scenario, seed, tick=brief.tick),
        instruction=brief.instruction,
        context=brief.context,
        history=brief.history,
        plan=plan,
        verdicts=verdicts,
        outcome=outcome,
        causes=Causes(
            refused=outcome == "refused",
            policy_failed=outcome == "failure",
            fallback_used=outcome == "failure",
            detail=why,
        ),
        metrics=(),
        duration_s=driven_s,
        scenario=start.scenario.id,
        seed=seed,
        said=tuple((event.tick * dt_s, event.text) for event in interaction.events if event.kind == "said"),
        record=(
            *provenance(plan, start.scenario, seed, start.limits),
            ("shield", SHIELD_VERSION),
            ("live", True),
            ("tick", brief.tick),
            *((("taken_over", True),) if interaction.taken_over else ()),
        ),
    )
