"""What goes between control and policy, and how control reads it: everything that comes is data, and may be garbage."""

from __future__ import annotations

import json
import math
import struct
from dataclasses import asdict, dataclass
from typing import Any, Final, Literal, cast, get_args

from chauffeur.concept import Command, Intervention, LaneId, ProgramState, Turn, Wishes

_OBSERVATION = struct.Struct("<QQ")
MOST_SPEED_MPS: Final = 100.0
MOST_HEADWAY_S: Final = 60.0
_MOST_NAME: Final = 64
_MOST_STOPS: Final = 64

Rung = Literal["follow", "hold", "keep", "slow", "stop"]
"""Of the fallback ladder, best first (ladder.py)."""


class MessageError(ValueError):
    """A message that is none. The text is short and fixed, so that it can be counted."""


@dataclass(frozen=True, slots=True)
class Observation:
    """An instant of the world, for the other processes' own copies of it.

    Attributes:
        trip: Number of the trip since control started, from 1.
        tick: Control periods since the trip began.
        world: What `World.adopt` takes.
    """

    trip: int
    tick: int
    world: bytes

    def encode(self) -> bytes:
        """As bytes."""
        return _OBSERVATION.pack(self.trip, self.tick) + self.world

    @classmethod
    def decode(cls, payload: bytes) -> Observation:
        """From bytes. Raises MessageError."""
        if len(payload) < _OBSERVATION.size:
            raise MessageError("too short")
        trip, tick = _OBSERVATION.unpack_from(payload)
        return cls(trip, tick, payload[_OBSERVATION.size :])


@dataclass(frozen=True, slots=True)
class Wish:
    """What the policy wishes now.

    Attributes:
        trip, tick: Of the observation it was made for.
        plan: Id of the plan that is driven, empty for none.
        issued_ns: When, `time.monotonic_ns()`.
        expires_ns: Until when the plan may be followed.
        state: Of the program.
        line: Program line it waits at.
        wishes: For the driver.
    """

    trip: int
    tick: int
    plan: str
    issued_ns: int
    expires_ns: int
    state: ProgramState
    line: int | None
    wishes: Wishes

    def encode(self) -> bytes:
        """As bytes."""
        wishes = self.wishes
        return json.dumps(
            {
                "trip": self.trip,
                "tick": self.tick,
                "plan": self.plan,
                "issued_ns": self.issued_ns,
                "expires_ns": self.expires_ns,
                "state": self.state,
                "line": self.line,
                "speed": wishes.target_speed_mps,
                "headway": wishes.time_headway_s,
                "lane": wishes.target_lane,
                "turn": wishes.turn,
                "served": sorted(wishes.served_stops),
            }
        ).encode()

    @classmethod
    def decode(cls, payload: bytes) -> Wish:
        """From bytes, every field of its type and within what a car could mean.

        Raises:
            MessageError: It is no wish.
        """
        try:
            loaded = json.loads(payload)
        except (ValueError, RecursionError) as error:
            raise MessageError("not JSON") from error
        if not isinstance(loaded, dict):
            raise MessageError("no object")
        fields = cast("dict[str, Any]", loaded)
        line = fields.get("line")
        return cls(
            trip=_count(fields, "trip"),
            tick=_count(fields, "tick"),
            plan=_name(fields.get("plan")),
            issued_ns=_count(fields, "issued_ns"),
            expires_ns=_count(fields, "expires_ns"),
            state=_one_of(fields.get("state"), get_args(ProgramState), "state"),
            line=None if line is None else _count(fields, "line"),
            wishes=Wishes(
                target_speed_mps=None if fields.get("speed") is None else _number(fields, "speed", 0.0, MOST_SPEED_MPS),
                time_headway_s=_number(fields, "headway", 0.0, MOST_HEADWAY_S),
                target_lane=_lane(fields.get("lane")),
                turn=None if fields.get("turn") is None else _one_of(fields["turn"], get_args(Turn), "turn"),
                served_stops=_stops(fields.get("served")),
            ),
        )


@dataclass(frozen=True, slots=True)
class Report:
    """One control period, for whoever looks on.

    Attributes:
        trip, tick: Which.
        late_ns: How late it began.
        rung: Of the fallback ladder.
        plan: Id of the plan that is followed, empty for none.
        state, line: Of its program, as last heard.
        age_s: Age of the wish that is followed.
        wishes: What was handed to the driver.
        requested: What the driver asked for.
        applied: What the vehicle did.
        interventions: Of the shield.
        clipped: What was taken off the wishes, by name.
        refused: Messages from the policy that were none, by reason, since the start.
        missed: Control periods never begun, since the start.
        faults: Errors inside the control period itself, answered by braking, since the start.
        speed_mps, lane: Of the ego, before the command.
        ended: The trip is over.
        outcome: How; empty while it goes on.
    """

    trip: int
    tick: int
    late_ns: int
    rung: Rung
    plan: str
    state: ProgramState
    line: int | None
    age_s: float
    wishes: Wishes
    requested: Command
    applied: Command
    interventions: tuple[Intervention, ...]
    clipped: tuple[str, ...]
    refused: dict[str, int]
    missed: int
    faults: int
    speed_mps: float
    lane: LaneId | None
    ended: bool = False
    outcome: str = ""

    def encode(self) -> bytes:
        """As bytes."""
        fields = asdict(self)
        fields["wishes"]["served_stops"] = sorted(self.wishes.served_stops)
        return json.dumps(fields).encode()

    @classmethod
    def decode(cls, payload: bytes) -> Report:
        """From the bytes of a control process, which is trusted."""
        fields = json.loads(payload)
        wishes = fields["wishes"]
        wishes["served_stops"] = frozenset(wishes["served_stops"])
        wishes["target_lane"] = _lane(wishes["target_lane"])
        fields["wishes"] = Wishes(**wishes)
        fields["requested"], fields["applied"] = Command(**fields["requested"]), Command(**fields["applied"])
        fields["interventions"] = tuple(
            Intervention(i["rule"], i["reason"], Command(**i["before"]), Command(**i["after"]))
            for i in fields["interventions"]
        )
        fields["clipped"], fields["lane"] = tuple(fields["clipped"]), _lane(fields["lane"])
        return cls(**fields)


def _count(fields: dict[str, Any], name: str) -> int:
    value = fields.get(name)
    if type(value) is not int or not 0 <= value < 1 << 63:
        raise MessageError(f"bad {name}")
    return value


def _number(fields: dict[str, Any], name: str, least: float, most: float) -> float:
    value = fields.get(name)
    if type(value) not in (int, float):
        raise MessageError(f"bad {name}")
    try:
        number = float(cast("float", value))
    except OverflowError as error:  # JSON knows no largest integer
        raise MessageError(f"{name} out of range") from error
    if not math.isfinite(number):
        raise MessageError(f"bad {name}")
    if not least <= number <= most:
        raise MessageError(f"{name} out of range")
    return number


def _name(value: object) -> str:
    if not isinstance(value, str) or len(value) > _MOST_NAME:
        raise MessageError("bad plan")
    return value


def _one_of(value: object, known: tuple[Any, ...], name: str) -> Any:
    if value not in known:
        raise MessageError(f"bad {name}")
    return value


def _lane(value: object) -> LaneId | None:
    if value is None:
        return None
    match value:
        case [str(start), str(end), int(index)] if not isinstance(value[2], bool):  # pyright: ignore[reportUnknownArgumentType]
            return start, end, index
        case _:
            raise MessageError("bad lane")


def _stops(value: object) -> frozenset[int]:
    if not isinstance(value, list) or len(cast("list[Any]", value)) > _MOST_STOPS:
        raise MessageError("bad stops")
    stops = cast("list[Any]", value)
    if any(type(stop) is not int for stop in stops):
        raise MessageError("bad stops")
    return frozenset(cast("list[int]", stops))
