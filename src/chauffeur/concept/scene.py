"""What a world shows and what it is told: scenario, snapshot, wishes, command. All frozen, all SI."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final, Literal

from chauffeur.concept.nouns import Lead
from chauffeur.geometry import Box

LaneId = tuple[str, str, int]
"""(from node, to node, index); index 0 is leftmost."""


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
    """

    id: str
    world: str
    config: dict[str, Any]
    seed: int
    goal: dict[str, Any] = field(default_factory=dict[str, Any])
    wish: str = ""
    title: str = ""


@dataclass(frozen=True, slots=True)
class LaneView:
    """A lane as geometry. `centre_m` is a polyline ((x, y), ...) in world metres, start to end."""

    id: LaneId
    width_m: float
    length_m: float
    speed_limit_mps: float
    forbidden: bool
    emergency: bool
    centre_m: tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class VehicleState:
    """A vehicle or object at one instant.

    Attributes:
        id: Stable within a trip; the ego is 0.
        kind: What it is.
        x_m, y_m: Centre, world frame (highway worlds: y grows to the right of +x travel).
        heading_rad: World frame.
        speed_mps: Along its heading.
        length_m, width_m: Size.
        lane: Closest lane.
        crashed: Whether it has been in a collision.
    """

    id: int
    kind: Literal["car", "obstacle", "stop_sign"]
    x_m: float
    y_m: float
    heading_rad: float
    speed_mps: float
    length_m: float
    width_m: float
    lane: LaneId | None
    crashed: bool = False

    @property
    def box(self) -> Box:
        """The ground it covers."""
        return Box(self.x_m, self.y_m, self.heading_rad, self.length_m, self.width_m)


@dataclass(frozen=True, slots=True)
class Snapshot:
    """A world at one instant; nothing in it changes afterwards.

    Attributes:
        time_s: Since the trip began.
        tick: Control periods since the trip began.
        kind: `highway` or `intersection`.
        ego: The ego.
        others: All other vehicles.
        objects: Obstacles and signs.
        lanes: The road, the same tuple throughout a trip.
        front: Vehicle ahead in the ego lane, at any distance.
        stop_sign_m: Distance to an unserved stop sign ahead in the ego lane.
        off_road: Ego centre outside every lane.
        ended: The world will not step further: crash, off the road, end of road or time.
    """

    time_s: float
    tick: int
    kind: str
    ego: VehicleState
    others: tuple[VehicleState, ...]
    objects: tuple[VehicleState, ...]
    lanes: tuple[LaneView, ...]
    front: Lead | None
    stop_sign_m: float | None
    off_road: bool
    ended: bool


STOPPED_MPS: Final = 1.0
"""Slower than this a car has stopped at a stop sign: LaMPilot's own bound for letting it go on."""
STOP_ZONE_M: Final = 8.0
"""A stop farther before its sign, from the car's centre, is none at it."""


def stops_at_sign(speed_mps: float, ahead_m: float, *, zone_m: float = STOP_ZONE_M) -> bool:
    """Whether a car with this speed, its centre so far before a stop sign, has served it."""
    return speed_mps < STOPPED_MPS and 0.0 <= ahead_m <= zone_m


Turn = Literal["left", "straight", "right"]


@dataclass(frozen=True, slots=True)
class Wishes:
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
    """What an actuator gets. acceleration_mps2 along the heading, steering_rad of the front wheels."""

    acceleration_mps2: float
    steering_rad: float
