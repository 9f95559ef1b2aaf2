"""The checks' verdicts on a plan, for a screen: the very ones that decided, or else no more than their sum.

The policy process judges a plan and tells one thing: started, or refused and why. The checks are functions of the plan
and the instant, so they are run again here, on the same plan and the same instant. Where that instant was not seen, or
the sum of the verdicts is not what was told, only what was told is shown.
"""

from __future__ import annotations

import logging
import queue
import threading
from dataclasses import dataclass
from typing import Final

from chauffeur.concept import Limits, Observation, Plan, Program, Verdict
from chauffeur.driving.events import DriveEvent
from chauffeur.driving.talk.messages import VerdictShown
from chauffeur.safety.checks import drive_checks, run_checks
from chauffeur.safety.faithfulness import check_faithfulness

JUDGED: Final = "live"
"""Name of the sum of all verdicts, as in the books."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class JudgedCase:
    """What is to be judged; the fields are those of `verdicts_of`."""

    wish: str
    plan: Plan
    observation: Observation | None
    limits: Limits
    event: DriveEvent


class Judge:
    """Works verdicts out in a thread of its own, one case after the other.

    A plan is foreign text, and how long its checks take depends on it; whoever hands a case in reads "stop" meanwhile.
    """

    def __init__(self) -> None:
        self._cases: queue.SimpleQueue[JudgedCase | None] = queue.SimpleQueue()
        self._ready: list[tuple[str, tuple[VerdictShown, ...]]] = []
        self._waiting = 0
        self._changed = threading.Condition()
        self._thread: threading.Thread | None = None

    def submit(self, case: JudgedCase) -> None:
        """Hand a case in; its verdicts come with `ready`."""
        with self._changed:
            self._waiting += 1
        self._cases.put(case)
        if self._thread is None:  # a daemon: a case that takes long must not keep the process from ending
            self._thread = threading.Thread(target=self._run, name="verdicts", daemon=True)
            self._thread.start()

    def ready(self, within_s: float = 0.0) -> list[tuple[str, tuple[VerdictShown, ...]]]:
        """Wishes and their verdicts since the last call; waits so long for those that are still worked on."""
        with self._changed:
            self._changed.wait_for(lambda: not self._waiting, within_s)
            ready, self._ready = self._ready, []
        return ready

    def close(self) -> None:
        """Take no further case; the thread ends with those it has."""
        self._cases.put(None)

    def _run(self) -> None:
        while (case := self._cases.get()) is not None:
            try:
                verdicts = verdicts_of(case.plan, case.observation, case.limits, case.event)
            except Exception:  # noqa: BLE001 - what was told is shown, whatever is wrong with the checks
                _log.exception("a plan could not be judged again")
                verdicts = (_told(case.event),)
            with self._changed:
                self._ready.append((case.wish, verdicts))
                self._waiting -= 1
                self._changed.notify_all()


def verdicts_of(
    plan: Plan, observation: Observation | None, limits: Limits, event: DriveEvent
) -> tuple[VerdictShown, ...]:
    """What the checks said, and whether the explanation fits the program.

    Args:
        plan: R and P as the planner gave them.
        observation: The instant the plan was judged in; None if it was not seen.
        limits: Of the trip.
        event: What was told: `started` or `refused`.
    """
    verdicts = () if observation is None else run_checks(plan, observation, limits, drive_checks())
    told = tuple(_shown(verdict) for verdict in verdicts)
    if not verdicts or not _as_told(verdicts, event):
        told = (_told(event),)
    if observation is None or not isinstance(plan.policy, Program):
        return told
    fits = run_checks(plan, observation, limits, (check_faithfulness,))
    return (*told, *(_shown(verdict, informs=True) for verdict in fits))


def _told(event: DriveEvent) -> VerdictShown:
    """The sum of the verdicts, as the policy process told it."""
    started = event.kind == "started"
    return VerdictShown(JUDGED, started, "" if started else event.text)


def _as_told(verdicts: tuple[Verdict, ...], event: DriveEvent) -> bool:
    reasons = " ".join(verdict.reason for verdict in verdicts if verdict.stops)
    return not reasons if event.kind == "started" else reasons == event.text


def _shown(verdict: Verdict, *, informs: bool = False) -> VerdictShown:
    compared = verdict.not_compared is None
    informs = informs or not verdict.vetoes
    return VerdictShown(verdict.check, verdict.passed, verdict.reason, informs, verdict.proven, compared)
