"""What a session says to whoever shows it (a terminal, the cabin page), and what it is told: one JSON each.

Everything is shown from here: what a screen needs to know stands in a message, and a screen that joins late gets the
newest `Session`, `Road`, `Scene` and `MemoryState`, and every `Conversation` of the session so far.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final, Literal

from pydantic import Field, TypeAdapter, ValidationError

from chauffeur.concept import AgentKind, LaneId, Mark, Sign, SignalState, mark_of
from chauffeur.driving.live.messages import MessageError
from chauffeur.geometry.road_graph import LaneKind

MOST_TEXT: Final = 2000
"""Characters of what a person says or types at once."""

# Said by the session -------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class SessionState:
    """What is driven, and how it listens.

    Attributes:
        scenario, title, seed: Where, and the seed of its traffic.
        planner: Name of the planner.
        engine: Name of the speech engine, empty for none.
        engine_remote: Whether sound leaves this machine.
        person: Whose memory is used; empty for nobody's.
        vehicle: `simulated`, or the interface of a real one.
        dt_s: Control period.
        limits: Bounds no plan may cross, in words, one each.
    """

    scenario: str
    title: str
    seed: int
    planner: str
    engine: str
    engine_remote: bool
    person: str
    vehicle: str
    dt_s: float
    limits: tuple[str, ...]
    kind: Literal["session"] = "session"


@dataclass(frozen=True, slots=True)
class RoadLane:
    """A lane, m: its place among those of its road (0 leftmost); what is no carriageway is drawn but not driven, as a
    `shoulder` is. Lanes inside a `junction` name it."""

    id: LaneId
    width_m: float
    road: str
    index: int
    shoulder: bool
    centre_m: tuple[tuple[float, float], ...]
    what: LaneKind = "driving"
    junction: str = ""
    street: str = ""


@dataclass(frozen=True, slots=True)
class Road:
    """The road of the trip, with its signs; told once, and again when another trip begins."""

    world: str
    lanes: tuple[RoadLane, ...]
    signs: tuple[Sign, ...] = ()
    kind: Literal["road"] = "road"


@dataclass(frozen=True, slots=True)
class ShownBody:
    """A vehicle or thing from above: centre, heading (rad), size, speed, and its colour as `#rrggbb`, if known."""

    id: int
    what: AgentKind
    x_m: float
    y_m: float
    heading_rad: float
    length_m: float
    width_m: float
    speed_mps: float
    paint: str | None = None


@dataclass(frozen=True, slots=True)
class ShownLight:
    """A traffic light: what it shows, and the ends of its stop line, m."""

    state: SignalState
    stop_line_m: tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True, slots=True)
class ShownGoal:
    """Where the car is going: its name, empty for none; where one stops; how far it is by road (m), how long that takes
    at the limits of the way (s), and the lanes of the way."""

    name: str
    x_m: float
    y_m: float
    left_m: float
    left_s: float = 0.0
    lanes: tuple[LaneId, ...] = ()


@dataclass(frozen=True, slots=True)
class Scene:
    """An instant of the drive.

    Attributes:
        time_s: Since the trip began, in the car's time.
        ego, others: As seen from above.
        acceleration_mps2, steering_rad: The command that was applied.
        limit_mps: Speed limit here.
        target_mps, headway_s, lane: What is wished now; None where nothing is.
        place: Of the wished lane on its road, counted from the left; 0 leftmost.
        level: Fallback level (`follow`, `hold`, `keep`, `slow`, `stop`).
        wish: Id of the wish that is driven, empty for none.
        line: Program line it waits at.
        shield: Why the shield changed the command; empty where it did not.
        taken_over: The person drives.
        missed: Control periods never begun, since the start.
        lights: Traffic lights around.
        street: Name of the street, where it has one.
        goal: Where the car is going, where that is a place.
    """

    time_s: float
    ego: ShownBody
    others: tuple[ShownBody, ...]
    acceleration_mps2: float
    steering_rad: float
    limit_mps: float
    target_mps: float | None
    headway_s: float
    lane: LaneId | None
    place: int | None
    level: str
    wish: str
    line: int | None
    shield: str
    taken_over: bool
    missed: int
    lights: tuple[ShownLight, ...] = ()
    street: str = ""
    goal: ShownGoal | None = None
    kind: Literal["scene"] = "scene"


@dataclass(frozen=True, slots=True)
class SeatView:
    """The front camera's picture, rendered; sent while somebody looks (`ShowSeat`).

    Attributes:
        time_s: When it was taken, since the trip began, in the car's time.
        png: The file, base64.
        why: Why there is none; empty where there is one.
    """

    time_s: float
    png: str
    why: str = ""
    kind: Literal["seat_view"] = "seat_view"


@dataclass(frozen=True, slots=True)
class Listening:
    """State of the microphone: `speaking` while somebody speaks, `button` while one is held."""

    state: Literal["off", "idle", "speaking", "recognising"]
    button: str = ""
    why: str = ""
    kind: Literal["listening"] = "listening"


@dataclass(frozen=True, slots=True)
class HeardWords:
    """What was heard (speech.base.Heard without the sound, which is gone). `to_confirm`: `Confirm` is waited for."""

    status: str
    text: str
    hotword: str
    engine: str
    confidence: float | None
    to_confirm: bool
    reason: str
    after_speech_s: float
    kind: Literal["heard"] = "heard"


@dataclass(frozen=True, slots=True)
class VerdictShown:
    """A check's verdict. One that only `informs` stops nothing: whether the explanation fits the program."""

    check: str
    passed: bool
    reason: str
    informs: bool = False
    proven: bool = True
    compared: bool = True

    @property
    def mark(self) -> Mark:
        """How it is marked."""
        return mark_of(passed=self.passed, vetoes=not self.informs, proven=self.proven, compared=self.compared)


@dataclass(frozen=True, slots=True)
class StageTimes:
    """Where the time from the end of speech (or Enter) to the first changed set-point went, s; None: not yet or not so.

    Of a wish that was asked back, the time counts from the person's yes.

    Attributes:
        wait_s, recognise_s: Of speech; 0 for typed words.
        plan_s: From the wish handed on to its plan.
        check_s: From the plan to its start, checks included.
        set_point_s: From the start to the control period that followed it.
        total_s: All of it.
    """

    wait_s: float = 0.0
    recognise_s: float = 0.0
    plan_s: float | None = None
    check_s: float | None = None
    set_point_s: float | None = None
    total_s: float | None = None


@dataclass(frozen=True, slots=True)
class Conversation:
    """A wish and all that became of it so far; told again whenever something changes.

    Attributes:
        wish: Id, in order from `w1`.
        text: The person's words.
        spoken: Whether it was said and not typed.
        follows: Wish whose opinion became this wish; empty where it is none.
        stage: `asked`, `planned`, `driven`, `closed`.
        outcome: Kind of the event that closed it (driving.live.messages.EventKind); empty before.
        result: The same in the words of every screen (`concept.Result`); empty before.
        why: What was told last, in words.
        thoughts: R of the planner.
        policy: Kind of P (`program`, `parameters`), empty where there is none.
        source: Program text with its helper functions, or the parameters one a line.
        recalled: What of the person's history was used, in words, one each; conflicts with both sides and dates.
        verdicts: Of the checks.
        said: What the program said to the passenger.
        opinion: What the person said of it afterwards.
        remembered: Where it stands in the memory, in words; empty where it is not remembered (yet).
        stages: Latency.
        waits: The words that are pending, until their time or event; empty where nothing is.
        ends: Whether the plan may end by itself, as a turn or a way to a place; not one that holds a speed.
    """

    wish: str
    text: str
    spoken: bool = False
    stage: Literal["asked", "planned", "driven", "closed"] = "asked"
    outcome: str = ""
    result: str = ""
    why: str = ""
    thoughts: str = ""
    policy: str = ""
    source: str = ""
    recalled: tuple[str, ...] = ()
    verdicts: tuple[VerdictShown, ...] = ()
    said: tuple[str, ...] = ()
    opinion: str = ""
    remembered: str = ""
    stages: StageTimes = StageTimes()
    follows: str = ""
    waits: str = ""
    ends: bool = False
    kind: Literal["conversation"] = "conversation"


@dataclass(frozen=True, slots=True)
class HowWasIt:
    """The car asks for an opinion on a wish; any `Evaluate` answers it."""

    wish: str
    text: str
    kind: Literal["how_was_it"] = "how_was_it"


@dataclass(frozen=True, slots=True)
class Answered:
    """A question of the car (`HeardWords` to be confirmed, `HowWasIt`) was answered, or is asked no more."""

    question: Literal["heard", "how_was_it"]
    kind: Literal["answered"] = "answered"


@dataclass(frozen=True, slots=True)
class MemoryEntry:
    """A remembered wish: its id, when (ISO 8601), words, what became of it, and the opinion."""

    id: str
    when: str
    text: str
    outcome: str
    opinion: str


@dataclass(frozen=True, slots=True)
class MemoryState:
    """What the person's memory holds, newest first, and its rules. `private`: nothing is written. `encrypted`: by the
    memory, whose name is `memory`."""

    person: str
    private: bool
    retention_days: float | None
    count: int
    newest: tuple[MemoryEntry, ...]
    memory: str = "vault"
    encrypted: bool = True
    kind: Literal["memory"] = "memory"


@dataclass(frozen=True, slots=True)
class Note:
    """Something to tell: `trouble` where it went wrong."""

    text: str
    trouble: bool = False
    kind: Literal["note"] = "note"


@dataclass(frozen=True, slots=True)
class Ended:
    """The drive is over."""

    outcome: str
    text: str
    kind: Literal["ended"] = "ended"


Said = (
    SessionState
    | Road
    | Scene
    | SeatView
    | Listening
    | HeardWords
    | Conversation
    | HowWasIt
    | Answered
    | MemoryState
    | Note
    | Ended
)
"""All a session says."""

# Told to the session -------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Say:
    """A typed wish."""

    text: Annotated[str, Field(max_length=MOST_TEXT)]
    kind: Literal["say"] = "say"


@dataclass(frozen=True, slots=True)
class Confirm:
    """Whether what was heard last is meant."""

    yes: bool
    kind: Literal["confirm"] = "confirm"


@dataclass(frozen=True, slots=True)
class Button:
    """A button is held, or let go. Sound comes as 16 kHz, 16 bit, little-endian, mono PCM beside these messages."""

    button: Literal["command", "evaluate"]
    held: bool
    kind: Literal["button"] = "button"


@dataclass(frozen=True, slots=True)
class Evaluate:
    """An opinion on a wish; on the last one if `wish` is empty."""

    text: Annotated[str, Field(max_length=MOST_TEXT)]
    wish: Annotated[str, Field(max_length=16)] = ""
    kind: Literal["evaluate"] = "evaluate"


@dataclass(frozen=True, slots=True)
class TakeOver:
    """The person takes the wheel, or gives it back. While they have it, `Hand` moves the car, and nothing else does."""

    on: bool
    kind: Literal["take_over"] = "take_over"


@dataclass(frozen=True, slots=True)
class Hand:
    """A key of the person at the wheel, each once per press; the shield stays."""

    key: Literal["faster", "slower", "left", "right", "brake"]
    kind: Literal["hand"] = "hand"


@dataclass(frozen=True, slots=True)
class ShowSeat:
    """Show the view from the seat, or no longer: pictures cost time, and are made only while they are looked at."""

    on: bool
    kind: Literal["show_seat"] = "show_seat"


@dataclass(frozen=True, slots=True)
class Stop:
    """Bring the car to a stand and end the drive."""

    kind: Literal["stop"] = "stop"


@dataclass(frozen=True, slots=True)
class MemoryOrder:
    """What the person does with their memory. `erase` needs `sure`; `days` goes with `retention`, None for ever."""

    do: Literal["show", "forget_last", "erase", "export", "retention", "private", "public"]
    days: float | None = None
    sure: bool = False
    kind: Literal["memory_order"] = "memory_order"


Told = Annotated[
    Say | Confirm | Button | Evaluate | TakeOver | Hand | ShowSeat | Stop | MemoryOrder, Field(discriminator="kind")
]
"""All a session is told."""

_said: TypeAdapter[Said] = TypeAdapter(Said)
_told: TypeAdapter[Told] = TypeAdapter(Told)


def encode(said: Said) -> bytes:
    """As JSON."""
    return _said.dump_json(said)


def read_told(payload: str | bytes) -> Told:
    """From a screen. Raises MessageError."""
    try:
        return _told.validate_json(payload)
    except (ValidationError, ValueError, RecursionError) as error:
        raise MessageError("not as it should be") from error
