"""What a world shows and what it is told: scenario, observation, wishes, command. All frozen, all SI."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final, Literal

from chauffeur.concept.nouns import Lead, ParkingLot
from chauffeur.concept.utterance import Colour
from chauffeur.geometry import Box, LaneId, RoadGraph, Route, Turn


@dataclass(frozen=True, slots=True)
class Scenario:
    """A start situation and, for benchmarks, a goal.

    Attributes:
        id: E.g. `left_overtake_s0`, or the name of a built-in one.
        world: Registry name of the world that can load it.
        config: World's own configuration (LaMPilot's `env` mapping for highway worlds), JSON values only.
        seed: Default seed; any non-negative integer, however large.
        goal: Benchmark's success condition (LaMPilot's `eval` mapping), empty for free driving.
        wish: A wish this scenario shows well.
        title: One line for people.

    >>> config = {"type": "dt-highway-v0", "num_lanes": 3, "vehicles_count": 8}
    >>> quiet = chauffeur.Scenario("quiet", "highway", config, seed=3)
    >>> chauffeur.drive("Keep going.", scenario=quiet).trip.scenario
    'quiet'
    """

    id: str
    world: str
    config: dict[str, Any]
    seed: int
    goal: dict[str, Any] = field(default_factory=dict[str, Any])
    wish: str = ""
    title: str = ""


AgentKind = Literal["car", "truck", "bus", "motorcycle", "bicycle", "pedestrian", "static", "obstacle", "stop_sign"]
"""What stands or moves on the road."""


@dataclass(frozen=True, slots=True)
class VehicleState:
    """A road user or object at one instant.

    Attributes:
        id: Stable within a trip; the ego is 0.
        kind: What it is.
        x_m, y_m: Centre, world frame (right-handed).
        heading_rad: Counter-clockwise from +x.
        speed_mps: Along its heading.
        length_m, width_m: Size.
        lane: Closest lane.
        crashed: Whether it has been in a collision.
        acceleration_mps2: Along its heading; 0 where the world does not say.
        yaw_rate_radps: Counter-clockwise; 0 where the world does not say.
        steering_rad: Angle of the front wheels, positive to the left; 0 where the world does not say.
        colour: Of its paint, or a person's clothes; None where the world does not say.
    """

    id: int
    kind: AgentKind
    x_m: float
    y_m: float
    heading_rad: float
    speed_mps: float
    length_m: float
    width_m: float
    lane: LaneId | None
    crashed: bool = False
    acceleration_mps2: float = 0.0
    yaw_rate_radps: float = 0.0
    steering_rad: float = 0.0
    colour: Colour | None = None

    @property
    def box(self) -> Box:
        """The ground it covers."""
        return Box(self.x_m, self.y_m, self.heading_rad, self.length_m, self.width_m)


SignalState = Literal["red", "yellow", "green", "off"]


@dataclass(frozen=True, slots=True)
class Signal:
    """A traffic light at one instant.

    Attributes:
        id: Stable within a trip.
        state: What it shows.
        lanes: Names of the lanes of the road graph that it rules, those before the junction.
        stop_line_m: Ends of the stop line, ((x, y), (x, y)), world frame.
        remaining_s: Until it changes, where the world knows; None otherwise.
    """

    id: str
    state: SignalState
    lanes: tuple[str, ...]
    stop_line_m: tuple[tuple[float, float], tuple[float, float]]
    remaining_s: float | None = None


@dataclass(frozen=True, slots=True)
class Sign:
    """A traffic sign; it does not change within a trip.

    Attributes:
        id: Stable within a trip.
        kind: What it says.
        lanes: Names of the lanes of the road graph that it rules.
        x_m, y_m: Where it stands, world frame.
        stop_line_m: Ends of the line to stop or yield at; None where it has none.
        value: Of a speed limit: m/s.
    """

    id: str
    kind: Literal["stop", "yield", "speed_limit"]
    lanes: tuple[str, ...]
    x_m: float
    y_m: float
    stop_line_m: tuple[tuple[float, float], tuple[float, float]] | None = None
    value: float | None = None


def stop_sign_of(thing: VehicleState) -> Sign:
    """A stop sign that a world shows among its objects: it stands on its lane, where one stops."""
    return Sign(str(thing.id), "stop", () if thing.lane is None else (thing.lane,), thing.x_m, thing.y_m)


@dataclass(frozen=True, slots=True)
class Observation:
    """A world at one instant; nothing in it changes afterwards.

    Attributes:
        time_s: Since the trip began.
        tick: Control periods since the trip began.
        kind: `highway` or `intersection`.
        ego: The ego.
        others: All other vehicles.
        objects: Obstacles and signs.
        road: The road as a graph of lanes, the same object throughout a trip.
        front: Vehicle ahead in the ego lane, at any distance.
        stop_sign_m: Distance to an unserved stop sign ahead in the ego lane.
        off_road: Ego centre outside every lane.
        ended: The world will not step further: crash, off the road, end of road or time.
        signals: Traffic lights.
        signs: Traffic signs.
        route: Where the trip leads, in a world that has a goal.
        lot: Spots and landmarks of a parking lot, the same object throughout a trip.
    """

    time_s: float
    tick: int
    kind: str
    ego: VehicleState
    others: tuple[VehicleState, ...]
    objects: tuple[VehicleState, ...]
    road: RoadGraph
    front: Lead | None
    stop_sign_m: float | None
    off_road: bool
    ended: bool
    signals: tuple[Signal, ...] = ()
    signs: tuple[Sign, ...] = ()
    route: Route | None = None
    lot: ParkingLot | None = None


STOPPED_MPS: Final = 1.0
"""Slower than this a car has stopped at a stop sign: LaMPilot's own bound for letting it go on."""
STOP_ZONE_M: Final = 8.0
"""A stop farther before its sign, from the car's centre, is none at it."""


def stops_at_sign(speed_mps: float, ahead_m: float, *, zone_m: float = STOP_ZONE_M) -> bool:
    """Whether a car with this speed, its centre so far before a stop sign, has served it."""
    return speed_mps < STOPPED_MPS and 0.0 <= ahead_m <= zone_m


@dataclass(frozen=True, slots=True)
class Setpoints:
    """What a policy wants of the controller. A policy sets wishes; only the controller actuates.

    Attributes:
        target_speed_mps: Speed in free traffic; None keeps the present.
        time_headway_s: Desired time headway to the lead vehicle.
        target_lane: Lane to follow; None keeps the present.
        turn: Route at the next intersection.
        served_stops: Ids of stop signs the policy has served and wants to leave.
    """

    target_speed_mps: float | None = None
    time_headway_s: float = 1.5
    target_lane: LaneId | None = None
    turn: Turn | None = None
    served_stops: frozenset[int] = frozenset()


@dataclass(frozen=True, slots=True)
class Command:
    """What an actuator gets. acceleration_mps2 along the heading, steering_rad of the front wheels, left positive."""

    acceleration_mps2: float
    steering_rad: float
