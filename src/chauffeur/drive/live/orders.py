"""What goes between planner, policy and supervisor: wishes, plans, events, briefs. Control reads none of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, TypeVar

from pydantic import TypeAdapter, ValidationError

from chauffeur.concept import NOBODY, Context, History, Instruction, LaneId, Plan, Snapshot
from chauffeur.drive.live.messages import MessageError

EventKind = Literal[
    "planning", "planned", "declined", "unplanned", "superseded", "started", "refused", "stale", "finished", "failed",
    "interrupted", "resumed", "said", "garbage",
]  # fmt: skip
"""What becomes of a wish, in about this order. `declined`: the planner says no, in words; `unplanned`: it could not;
`refused`: a check says no; `stale`: the plan came too late; `interrupted`: the process that ran it is gone, or the
person has taken over (`TOOK_OVER`)."""

FINAL: Final[frozenset[EventKind]] = frozenset(
    {"declined", "unplanned", "superseded", "refused", "stale", "finished", "failed", "interrupted"}
)
"""Events after which nothing more becomes of a wish."""


START_WITHIN_S: Final = 10.0
"""Vehicle time from the instant a plan was made for to its start."""
TOOK_OVER: Final = "You took over."
"""What is told of a wish that ended because the person took the wheel."""
MOST_SAID: Final = 2000
"""Characters of an event's text: in JSON at most 6 bytes each, so that any event fits into its ring."""


@dataclass(frozen=True, slots=True)
class Request:
    """A wish, to the planner.

    Attributes:
        wish: Id.
        text: The person's words.
        person: Who says it.
        turn: Counts how often it was asked for; more than once where a plan was stale or the planner died.
        confirmed: The car's question to which these words are the person's yes; empty for none.
    """

    wish: str
    text: str
    person: str = NOBODY
    turn: int = 1
    confirmed: str = ""


@dataclass(frozen=True, slots=True)
class Scene:
    """The instant a plan was made for.

    Attributes:
        trip, tick: Of the observation.
        lane: The ego's.
        lead: Id of the vehicle ahead, None for none.
    """

    trip: int
    tick: int
    lane: LaneId | None
    lead: int | None

    @classmethod
    def of(cls, trip: int, snapshot: Snapshot) -> Scene:
        """What of an instant a plan relies on."""
        return cls(trip, snapshot.tick, snapshot.ego.lane, None if snapshot.front is None else snapshot.front.vehicle)


@dataclass(frozen=True, slots=True)
class Order:
    """A plan, to the policy.

    Attributes:
        wish: Id of the wish.
        plan: R and P, unchecked.
        scene: The instant it was made for.
        issued_ns: When the planner saw that instant.
        start_by_ns: Not started after this.
        expires_ns: Not followed after this.
    """

    wish: str
    plan: Plan
    scene: Scene
    issued_ns: int
    start_by_ns: int
    expires_ns: int


@dataclass(frozen=True, slots=True)
class Event:
    """Something that became of a wish.

    Attributes:
        kind: What.
        wish: Id, empty where it is about none.
        text: In words, for the person.
        trip, tick: When.
        again: Whether asking once more may help.
        offer: Where the text is a question: the wish that a yes stands for, empty for none.
    """

    kind: EventKind
    wish: str
    text: str = ""
    trip: int = 0
    tick: int = 0
    again: bool = True
    offer: str = ""


@dataclass(frozen=True, slots=True)
class Brief:
    """What a plan was made of: for the books and the memory, whatever becomes of the plan.

    Attributes:
        wish: Id of the wish.
        instruction, context, history, plan: I, C, H, and (R, P), as the planner had and gave them.
        trip, tick: The instant the context tells of.
    """

    wish: str
    instruction: Instruction
    context: Context
    history: History
    plan: Plan
    trip: int
    tick: int


_T = TypeVar("_T")
_request, _order, _event, _brief = TypeAdapter(Request), TypeAdapter(Order), TypeAdapter(Event), TypeAdapter(Brief)


def encode(message: Request | Order | Event | Brief) -> bytes:
    """As bytes."""
    match message:
        case Request():
            return _request.dump_json(message)
        case Order():
            return _order.dump_json(message)
        case Event():
            return _event.dump_json(message)
        case Brief():
            return _brief.dump_json(message)


def read_request(payload: bytes) -> Request:
    """From bytes. Raises MessageError."""
    return _read(_request, payload)


def read_order(payload: bytes) -> Order:
    """From bytes. Raises MessageError."""
    return _read(_order, payload)


def read_event(payload: bytes) -> Event:
    """From bytes. Raises MessageError."""
    return _read(_event, payload)


def read_brief(payload: bytes) -> Brief:
    """From bytes. Raises MessageError."""
    return _read(_brief, payload)


def _read(adapter: TypeAdapter[_T], payload: bytes) -> _T:
    try:
        return adapter.validate_json(payload)
    except (ValidationError, ValueError, RecursionError) as error:
        raise MessageError(f"not as it should be: {type(error).__name__}") from error
