"""What becomes of a wish for a real vehicle, and what its session tells on the way (driving/events.py)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

from chauffeur.concept import Feedback, Parameters, Plan, Verdict
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

DONE: Final[frozenset[Status]] = frozenset({"delivered", "dry-run", "taken", "answered"})
"""What a person wished was done, as far as can be known here."""


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
    def done(self) -> bool:
        """Whether it was done, as far as can be known here."""
        return self.status in DONE


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
