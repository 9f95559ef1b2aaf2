"""What becomes of a wish for a real vehicle, and what its session tells on the way (driving/events.py)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

from chauffeur.concept import ASKS, Feedback, Parameters, Plan, Result, Verdict
from chauffeur.worlds.ros.base import Published, RosVehicleState

Status = Literal[
    "delivered",
    "dry-run",
    "unconfirmed",
    "unreachable",
    "refused",
    "declined",
    "failed",
    "superseded",
    "taken",
    "answered",
]
"""What became of a wish. `delivered`: every receiver was handed it. `dry-run`: it would have been published.
`unconfirmed`: it was published, and nobody was seen to take all of it. `unreachable`: there is no way to the vehicle,
nothing was published. `refused`: a check, or the vehicle's own limits. `declined`: the planner, or it is no wish for
parameters. `failed`: no plan could be had. `superseded`: a newer wish came before anything was published.
`taken`: feedback, kept. `answered`: it was a question, and what is in force stays."""

_RESULTS: Final[dict[Status, Result]] = {
    "delivered": Result.DONE, "dry-run": Result.DONE, "taken": Result.DONE, "answered": Result.DONE,
    "unconfirmed": Result.NOT_DONE, "unreachable": Result.NOT_DONE, "superseded": Result.NOT_DONE,
    "refused": Result.DECLINED, "declined": Result.DECLINED, "failed": Result.FAILED,
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class OnRoadAnswer:
    """What became of a wish.

    Attributes:
        wish: Its number in the session.
        text: What was wished.
        status: In a word.
        words: For the person.
        plan: R and P, if there are any.
        verdicts: Of the checks.
        published: What was handed to the vehicle.
        trip: Id it is remembered under; empty where nothing was planned.
        plan_s: Time that planning took.
        confirmed_s: Time from `apply` to every receiver having it.
        took_s: Time from the wish to knowing what became of it; it is remembered after that.
    """

    wish: int
    text: str
    status: Status
    words: str
    plan: Plan | None = None
    verdicts: tuple[Verdict, ...] = ()
    published: Published | None = None
    trip: str = ""
    plan_s: float = 0.0
    confirmed_s: float | None = None
    took_s: float = 0.0

    @property
    def result(self) -> Result:
        """What became of it in the words of every drive, as far as can be known here."""
        plan = self.plan
        if self.status == "declined" and plan is not None and (plan.offer or plan.intent == ASKS):
            return Result.ASKED_BACK
        return _RESULTS[self.status]


@dataclass(frozen=True, slots=True)
class SetpointRequest:
    """What the vehicle is about to be asked for; told before anything is published.

    Attributes:
        parameters: What.
        in_force: What holds until then; None before the first.
        state: Of the way to it.
    """

    parameters: Parameters
    in_force: Parameters | None
    state: RosVehicleState


@dataclass(frozen=True, slots=True)
class SetpointResult:
    """What came of asking: the answer as it stands, and the way to the vehicle."""

    answer: OnRoadAnswer
    state: RosVehicleState


@dataclass(frozen=True, slots=True)
class Opinion:
    """F: whose it is, and whether it is in their memory."""

    feedback: Feedback
    person: str
    kept: bool
