"""What a person's memory keeps of a drive in real time: every wish that was answered, with what was made of it.

H + (I, C, P, R): feedback joins when the person speaks. What was never planned, or gave way before it was begun, is
no trip, and is not kept.
"""

from __future__ import annotations

import logging
from typing import Final

from chauffeur.concept import Causes, ChauffeurError, Outcome, Trip, Verdict
from chauffeur.drive.live.messages import Report
from chauffeur.drive.live.orders import Brief, Event, EventKind
from chauffeur.drive.live.starts import Start
from chauffeur.drive.live.supervisor import Interaction, Replaced, Runtime
from chauffeur.drive.loop import Memory
from chauffeur.drive.session import provenance, trip_id
from chauffeur.safety.shield import SHIELD_VERSION

_ENDED_BADLY: Final[dict[str, Outcome]] = {"collision": "collision", "off_road": "off_road"}
_OUTCOMES: Final[dict[EventKind, Outcome]] = {
    "finished": "ended",
    "superseded": "ended",
    "interrupted": "ended",
    "failed": "failure",
    "declined": "refused",
    "refused": "refused",
}

_log = logging.getLogger(__name__)


class Remembering:
    """Hands each wish of a drive to a memory as soon as nothing more becomes of it."""

    def __init__(self, memory: Memory, start: Start, dt_s: float) -> None:
        """Remember.

        Args:
            memory: Keeps it.
            start: The trip.
            dt_s: Control period in vehicle time.
        """
        self._memory, self._start, self._dt_s = memory, start, dt_s
        self._runtime: Runtime | None = None
        self.trouble = ""
        """Why a wish could not be kept, in words; empty while all could."""

    def follow(self, runtime: Runtime) -> None:
        """A drive has begun; what is told from now on is its."""
        self._runtime = runtime

    def tell(self, heard: Event | Report | Brief | Replaced) -> None:
        """Hear what the drive tells."""
        if self._runtime is None or not isinstance(heard, Event):
            return
        interaction = self._runtime.interactions.get(heard.wish)
        if interaction is None or interaction.answer is not heard:
            return
        trip = trip_of(interaction, self._start, self._dt_s, self._runtime.report)
        if trip is None:
            return
        try:
            self._memory.remember(trip, None)
        except ChauffeurError as error:  # the drive goes on, and the person is told
            self.trouble = str(error)
            _log.warning("a wish could not be remembered: %s", error)


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
