"""What a session on a real vehicle tells whoever shows it: events as they happen, and one answer for each wish."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

from chauffeur.concept import Plan, Verdict
from chauffeur.worlds.ros.base import Published

Status = Literal[
    "delivered", "dry-run", "unconfirmed", "unreachable", "refused", "declined", "failed", "superseded", "taken"
]
"""What became of a wish. `delivered`: every receiver was handed it. `dry-run`: it would have been published.
`unconfirmed`: it was published, and nobody was seen to take all of it. `unreachable`: there is no way to the vehicle,
nothing was published. `refused`: a check, or the vehicle's own limits. `declined`: the planner, or it is no wish for
parameters. `failed`: no plan could be had. `superseded`: a newer wish came before anything was published.
`taken`: feedback, kept."""

DONE: Final[frozenset[Status]] = frozenset({"delivered", "dry-run", "taken"})
"""What a person wished was done, as far as can be known here."""

EventKind = Literal["link", "context", "history", "plan", "verdicts", "asked", "late", "trouble", "over"]
"""`link`: the way to the vehicle changed. `asked`: messages are handed to the interface. `late`: what was unconfirmed
was taken after all. `trouble`: something besides the wish failed (memory, audit log). `over`: the session ended."""


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened, in words and, where there is one, with its value.

    Attributes:
        kind: What.
        words: For the person.
        wish: Number of the wish it belongs to; 0 where it belongs to none.
        value: `VehicleState` (link), `Context`, `History`, `Plan`, tuple of `Verdict`, `Published` (asked, late).
    """

    kind: EventKind
    words: str
    wish: int = 0
    value: object = None


@dataclass(frozen=True, slots=True)
class Answer:
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
