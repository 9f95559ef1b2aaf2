"""The checks' verdicts on a plan, for a screen: the very ones that decided, or else no more than their sum.

The policy process judges a plan and tells one thing: started, or refused and why. The checks are functions of the plan
and the instant, so they are run again here, on the same plan and the same instant. Where that instant was not seen, or
the sum of the verdicts is not what was told, only what was told is shown.
"""

from __future__ import annotations

from typing import Final

from chauffeur.concept import Limits, Plan, Program, Snapshot, Verdict
from chauffeur.drive.live.orders import Event
from chauffeur.drive.talk.messages import VerdictShown
from chauffeur.safety.alignment import check_alignment
from chauffeur.safety.checks import DRIVE_CHECKS, run_checks

JUDGED: Final = "live"
"""Name of the sum of all verdicts, as in the books."""


def verdicts_of(plan: Plan, snapshot: Snapshot | None, limits: Limits, event: Event) -> tuple[VerdictShown, ...]:
    """What the checks said, and whether the explanation fits the program.

    Args:
        plan: R and P as the planner gave them.
        snapshot: The instant the plan was judged in; None if it was not seen.
        limits: Of the trip.
        event: What was told: `started` or `refused`.
    """
    verdicts = () if snapshot is None else run_checks(plan, snapshot, limits, DRIVE_CHECKS)
    told = tuple(_shown(verdict) for verdict in verdicts)
    if not verdicts or not _as_told(verdicts, event):
        started = event.kind == "started"
        told = (VerdictShown(JUDGED, started, "" if started else event.text),)
    if snapshot is None or not isinstance(plan.policy, Program):
        return told
    fits = run_checks(plan, snapshot, limits, (check_alignment,))
    return (*told, *(_shown(verdict, informs=True) for verdict in fits))


def _as_told(verdicts: tuple[Verdict, ...], event: Event) -> bool:
    reasons = " ".join(verdict.reason for verdict in verdicts if verdict.stops)
    return not reasons if event.kind == "started" else reasons == event.text


def _shown(verdict: Verdict, *, informs: bool = False) -> VerdictShown:
    return VerdictShown(verdict.check, verdict.passed, verdict.reason, informs or not verdict.vetoes, verdict.proven)
