"""What goes between planner, policy and supervisor: wishes, plans, events, briefs. Control reads none of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, Literal, TypeVar

from pydantic import TypeAdapter, ValidationError

from chauffeur.concept import NOBODY, Context, History, Instruction, LaneId, Observation, Plan, Verdict
from chauffeur.driving.events import DriveEvent, WishEventKind
from chauffeur.driving.live.messages import MessageError
from chauffeur.language.questions import said_aside

TOOK_OVER: Final = "You took over."
"""What is told of a wish that ended because the person took the wheel."""
TAKES_BACK: Final = "cancel"
"""Intent of an order without a policy: what is driven ends, and the car drives on as before it."""
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
        runs: Whether another wish is driven, or on its way, which a question must not end.
        doing: What is driven, or what became of what was driven last, in words: the answer to questions about it.
    """

    wish: str
    text: str
    person: str = NOBODY
    turn: int = 1
    confirmed: str = ""
    runs: bool = False
    doing: str = ""

    @property
    def aside(self) -> bool:
        """Whether it is said beside the other wishes, and takes the place of none that is still being planned."""
        return not self.confirmed and said_aside(self.text)


@dataclass(frozen=True, slots=True)
class PlannedScene:
    """The instant a plan was made for.

    Attributes:
        trip, tick: Of the observation.
        lane: The ego's.
        lead: Id of the vehicle ahead, None for none.
        pose: Of the ego: x, y, m; heading, rad. Waypoints count from there.
    """

    trip: int
    tick: int
    lane: LaneId | None
    lead: int | None
    pose: tuple[float, float, float] | None = None

    @classmethod
    def of(cls, trip: int, observation: Observation) -> PlannedScene:
        """What of an instant a plan relies on."""
        ego, front = observation.ego, observation.front
        lead = None if front is None else front.vehicle
        return cls(trip, observation.tick, ego.lane, lead, (ego.x_m, ego.y_m, ego.heading_rad))


@dataclass(frozen=True, slots=True)
class PlanMessage:
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
    scene: PlannedScene
    issued_ns: int
    start_by_ns: int
    expires_ns: int


@dataclass(frozen=True, slots=True)
class PlanningInputs:
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


@dataclass(frozen=True, slots=True)
class _EventFields:
    """What goes of an event from process to process: only of wishes, with no value but verdicts, and never final."""

    kind: WishEventKind | Literal["verdicts"]
    wish: str
    text: str = ""
    trip: int = 0
    tick: int = 0
    again: bool = True
    offer: str = ""
    verdicts: tuple[Verdict, ...] = ()


_T = TypeVar("_T")
_request, _order, _brief = TypeAdapter(Request), TypeAdapter(PlanMessage), TypeAdapter(PlanningInputs)
_event = TypeAdapter(_EventFields)


def encode(message: Request | PlanMessage | DriveEvent | PlanningInputs) -> bytes:
    """As bytes."""
    match message:
        case Request():
            return _request.dump_json(message)
        case PlanMessage():
            return _order.dump_json(message)
        case DriveEvent():
            verdicts = message.value if isinstance(message.value, tuple) else ()
            judged = tuple(_short(one, len(verdicts)) for one in verdicts if isinstance(one, Verdict))
            fields = {name: getattr(message, name) for name in _EventFields.__slots__ if name != "verdicts"}
            return _event.dump_json(_EventFields(**fields, verdicts=judged))
        case PlanningInputs():
            return _brief.dump_json(message)


def read_request(payload: bytes) -> Request:
    """From bytes. Raises MessageError."""
    return _read(_request, payload)


def read_order(payload: bytes) -> PlanMessage:
    """From bytes. Raises MessageError."""
    return _read(_order, payload)


def read_event(payload: bytes) -> DriveEvent:
    """From bytes. Raises MessageError."""
    event = _read(_event, payload)
    fields = {name: getattr(event, name) for name in _EventFields.__slots__ if name != "verdicts"}
    return DriveEvent(**fields, value=event.verdicts or None)


def _short(verdict: Verdict, of: int) -> Verdict:
    """A verdict among so many whose texts fit together into an event."""
    most = MOST_SAID // (2 * of)
    return replace(verdict, reason=verdict.reason[:most], remedy=verdict.remedy[:most], alignment=None)


def read_brief(payload: bytes) -> PlanningInputs:
    """From bytes. Raises MessageError."""
    return _read(_brief, payload)


def _read(adapter: TypeAdapter[_T], payload: bytes) -> _T:
    try:
        return adapter.validate_json(payload)
    except (ValidationError, ValueError, RecursionError) as error:
        raise MessageError(f"not as it should be: {type(error).__name__}") from error
