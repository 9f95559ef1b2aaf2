"""What goes between control and policy, and how control reads it: everything that comes is data, and may be garbage."""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, Final, Literal, cast, get_args

from chauffeur.concept import (
    ActionMatrix,
    Command,
    Intervention,
    LaneId,
    Parameters,
    ProgramState,
    Setpoints,
    Trajectory,
    Turn,
    VehicleState,
)

_INSTANT = struct.Struct("<QQQ")
_HAND = struct.Struct("<4s?8s")
_HAND_MARK: Final = b"HAND"
MOST_SPEED_MPS: Final = 100.0
MOST_HEADWAY_S: Final = 60.0
MOST_LOOK_AHEAD_M: Final = 10_000.0
MOST_LOOK_AHEAD_S: Final = 1000.0
MOST_WAYPOINTS: Final = 100
LEAST_PERIOD_S: Final = 0.01
MOST_PERIOD_S: Final = 10.0
_FURTHEST: Final = 1e7
"""Of any number of a row: metres from the origin of a map, above all."""
_MOST_NAME: Final = 64
_LONGEST_LANE: Final = 200
_MOST_STOPS: Final = 64

FallbackLevel = Literal["follow", "hold", "keep", "slow", "stop", "hand"]
"""Fallback level, best first (fallback_levels.py); beside it `hand`: the person has taken over."""

Key = Literal["faster", "slower", "left", "right", "brake"]
"""Of the person at the wheel."""


class MessageError(ValueError):
    """Malformed message. The text is short and fixed, so that it can be counted."""


@dataclass(frozen=True, slots=True)
class MirroredInstant:
    """An instant of the world, for the other processes' own copies of it.

    Attributes:
        trip: Number of the trip since control started, from 1.
        tick: Control periods since the trip began.
        world: What `World.adopt` takes.
        handovers: How often the wheel has changed hands: odd while the person has it.
    """

    trip: int
    tick: int
    world: bytes
    handovers: int = 0

    def encode(self) -> bytes:
        """As bytes."""
        return _INSTANT.pack(self.trip, self.tick, self.handovers) + self.world

    @classmethod
    def decode(cls, payload: bytes) -> MirroredInstant:
        """From bytes. Raises MessageError."""
        if len(payload) < _INSTANT.size:
            raise MessageError("too short")
        trip, tick, handovers = _INSTANT.unpack_from(payload)
        return cls(trip, tick, payload[_INSTANT.size :], handovers)


@dataclass(frozen=True, slots=True)
class WheelHand:
    """What the person at the wheel does. Each message says who has the wheel, so that none of them may be missed.

    Attributes:
        on: Whether the person has the wheel.
        key: What they pressed, if anything.
    """

    on: bool
    key: Key | None = None

    def encode(self) -> bytes:
        """As bytes."""
        return _HAND.pack(_HAND_MARK, self.on, (self.key or "").encode())

    @classmethod
    def decode(cls, payload: bytes) -> WheelHand:
        """From bytes. Raises MessageError."""
        if len(payload) != _HAND.size or payload[: len(_HAND_MARK)] != _HAND_MARK or payload[len(_HAND_MARK)] > 1:
            raise MessageError("no hand")
        _, on, name = _HAND.unpack(payload)
        key = next((each for each in get_args(Key) if each.encode() == name.rstrip(b"\0")), None)
        if key is None and name.strip(b"\0"):
            raise MessageError("no key")
        return cls(on, key)


@dataclass(frozen=True, slots=True)
class Steered:
    """A policy that an executor of control drives, and what it is relative to: the same two mean the same way, however
    often they come.

    Attributes:
        policy: Parameters with their route resolved: a spot by its name; an action matrix; a trajectory.
        origin: The ego's lane when the plan began; the lane wish counts from there.
        pose: Of the ego then, from which waypoints count: x, y, m; heading, rad; and its speed, m/s. None for as it is.
    """

    policy: Parameters | ActionMatrix | Trajectory
    origin: LaneId | None
    pose: tuple[float, float, float, float] | None = None

    def ego(self, now: VehicleState) -> VehicleState:
        """The ego when the plan began."""
        if self.pose is None:
            return replace(now, lane=self.origin)
        x, y, heading, speed = self.pose
        return replace(now, lane=self.origin, x_m=x, y_m=y, heading_rad=heading, speed_mps=speed)

    def fields(self) -> dict[str, Any]:
        """As JSON values."""
        policy = self.policy
        common = {"kind": policy.kind, "origin": self.origin, "pose": self.pose}
        match policy:
            case Parameters():
                return common | {
                    "speed": policy.target_speed_mps,
                    "ahead": policy.look_ahead_m,
                    "ratio": policy.look_ahead_ratio,
                    "lane": policy.lane,
                    "route": policy.route,
                }
            case ActionMatrix():
                return common | {"rows": [policy.pid, policy.mpc]}
            case Trajectory():
                return common | {"rows": policy.waypoints_m, "period": policy.period_s}

    @classmethod
    def read(cls, value: object) -> Steered:
        """From JSON values, each of its type and within what a car could mean. Raises MessageError."""
        if not isinstance(value, dict):
            raise MessageError("bad policy")
        fields = cast("dict[str, Any]", value)
        pose = fields.get("pose")
        return cls(
            _policy(fields),
            _lane(fields.get("origin")),
            None if pose is None else cast("tuple[float, float, float, float]", _row(pose, 4)),
        )


def _policy(fields: dict[str, Any]) -> Parameters | ActionMatrix | Trajectory:
    match fields.get("kind"):
        case "parameters":
            lane, route = fields.get("lane"), fields.get("route")
            if type(lane) is not int or lane not in (-1, 0, 1):
                raise MessageError("bad lane wish")
            if not isinstance(route, str) or len(route) > _MOST_NAME:
                raise MessageError("bad route")
            return Parameters(
                target_speed_mps=_number(fields, "speed", 0.0, MOST_SPEED_MPS),
                look_ahead_m=_number(fields, "ahead", 0.0, MOST_LOOK_AHEAD_M),
                look_ahead_ratio=_number(fields, "ratio", 0.0, MOST_LOOK_AHEAD_S),
                lane=lane,
                route=route,
            )
        case "action_matrix":
            pid, mpc = (_row(row, 3) for row in _rows(fields, 2, 2))
            if min(*pid, *mpc) < 0.0:
                raise MessageError("rows out of range")
            return ActionMatrix(cast("tuple[float, float, float]", pid), cast("tuple[float, float, float]", mpc))
        case "trajectory":
            points = tuple(cast("tuple[float, float]", _row(row, 2)) for row in _rows(fields, 1, MOST_WAYPOINTS))
            return Trajectory(points, _number(fields, "period", LEAST_PERIOD_S, MOST_PERIOD_S))
        case _:
            raise MessageError("bad policy")


@dataclass(frozen=True, slots=True)
class LiveSetpoints:
    """What the policy asks for now.

    Attributes:
        trip, tick: Of the observation it was made for.
        plan: Id of the plan that is driven, empty for none.
        issued_ns: When, `time.monotonic_ns()`.
        expires_ns: Until when the plan may be followed.
        state: Of the program.
        line: Program line it waits at.
        setpoints: For the driver.
        steered: Policy that an executor drives in the driver's place; None where a program, or nobody, wishes.
        handovers: How often the wheel had changed hands in that instant.
    """

    trip: int
    tick: int
    plan: str
    issued_ns: int
    expires_ns: int
    state: ProgramState
    line: int | None
    setpoints: Setpoints
    steered: Steered | None = None
    handovers: int = 0

    def encode(self) -> bytes:
        """As bytes."""
        setpoints, steered = self.setpoints, self.steered
        return json.dumps(
            {
                "trip": self.trip,
                "tick": self.tick,
                "plan": self.plan,
                "issued_ns": self.issued_ns,
                "expires_ns": self.expires_ns,
                "state": self.state,
                "line": self.line,
                "speed": setpoints.target_speed_mps,
                "headway": setpoints.time_headway_s,
                "lane": setpoints.target_lane,
                "turn": setpoints.turn,
                "served": sorted(setpoints.served_stops),
                "steered": None if steered is None else steered.fields(),
                "handovers": self.handovers,
            }
        ).encode()

    @classmethod
    def decode(cls, payload: bytes) -> LiveSetpoints:
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
            setpoints=Setpoints(
                target_speed_mps=None if fields.get("speed") is None else _number(fields, "speed", 0.0, MOST_SPEED_MPS),
                time_headway_s=_number(fields, "headway", 0.0, MOST_HEADWAY_S),
                target_lane=_lane(fields.get("lane")),
                turn=None if fields.get("turn") is None else _one_of(fields["turn"], get_args(Turn), "turn"),
                served_stops=_stops(fields.get("served")),
            ),
            steered=None if fields.get("steered") is None else Steered.read(fields["steered"]),
            handovers=_count(fields, "handovers"),
        )


@dataclass(frozen=True, slots=True)
class LiveEnd:
    """How a drive in real time ended.

    Attributes:
        outcome: As control reported it, or what became of control.
        figures: Punctuality of control, as far as it could still tell.
        lost_reports: Control periods that were never heard of.
    """

    outcome: str
    figures: Mapping[str, Any]
    lost_reports: int


@dataclass(frozen=True, slots=True)
class Report:
    """One control period, for whoever looks on.

    Attributes:
        trip, tick: Which.
        late_ns: How late it began.
        level: Fallback level.
        plan: Id of the plan that is followed, empty for none.
        state, line: Of its program, as last heard.
        age_s: Age of the wish that is followed.
        setpoints: What was handed to the driver.
        requested: What the driver asked for.
        applied: What the vehicle did.
        interventions: Of the shield.
        clipped: What was taken off the set-points, by name.
        refused: Messages from the policy that were none, by reason, since the start.
        missed: Control periods never begun, since the start.
        faults: Errors inside the control period itself, answered by braking, since the start.
        speed_mps, lane: Of the ego, before the command.
        ended: The trip is over.
        outcome: How; empty while it goes on.
        taken_over: The person has the wheel.
        said: What there was to tell the passenger, of lane changes above all.
    """

    trip: int
    tick: int
    late_ns: int
    level: FallbackLevel
    plan: str
    state: ProgramState
    line: int | None
    age_s: float
    setpoints: Setpoints
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
    taken_over: bool = False
    said: tuple[str, ...] = ()

    def encode(self) -> bytes:
        """As bytes."""
        fields = asdict(self)
        fields["setpoints"]["served_stops"] = sorted(self.setpoints.served_stops)
        return json.dumps(fields).encode()

    @classmethod
    def decode(cls, payload: bytes) -> Report:
        """From the bytes of a control process, which is trusted."""
        fields = json.loads(payload)
        setpoints = fields["setpoints"]
        setpoints["served_stops"] = frozenset(setpoints["served_stops"])
        setpoints["target_lane"] = _lane(setpoints["target_lane"])
        fields["setpoints"] = Setpoints(**setpoints)
        fields["requested"], fields["applied"] = Command(**fields["requested"]), Command(**fields["applied"])
        fields["interventions"] = tuple(
            Intervention(i["rule"], i["reason"], Command(**i["before"]), Command(**i["after"]))
            for i in fields["interventions"]
        )
        fields["clipped"], fields["lane"] = tuple(fields["clipped"]), _lane(fields["lane"])
        fields["said"] = tuple(fields["said"])
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


def _rows(fields: dict[str, Any], least: int, most: int) -> list[Any]:
    rows = fields.get("rows")
    if not isinstance(rows, list) or not least <= len(cast("list[Any]", rows)) <= most:
        raise MessageError("bad rows")
    return cast("list[Any]", rows)


def _row(value: object, length: int) -> tuple[float, ...]:
    if not isinstance(value, list) or len(cast("list[Any]", value)) != length:
        raise MessageError("bad row")
    return tuple(_number({"row": one}, "row", -_FURTHEST, _FURTHEST) for one in cast("list[Any]", value))


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
    if not isinstance(value, str) or len(value) > _LONGEST_LANE:
        raise MessageError("bad lane")
    return value


def _stops(value: object) -> frozenset[int]:
    if not isinstance(value, list) or len(cast("list[Any]", value)) > _MOST_STOPS:
        raise MessageError("bad stops")
    stops = cast("list[Any]", value)
    if any(type(stop) is not int for stop in stops):
        raise MessageError("bad stops")
    return frozenset(cast("list[int]", stops))
