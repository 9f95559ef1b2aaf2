"""The contract of worlds. A world knows its own simulator and nothing of language.

`World` is stepped with physical commands and shows frozen observations. `Perception` answers the questions that driving
APIs ask, at the present instant, by vehicle id and lane id. `Driver` turns set-points into a command; it is the world's
own low-level driver (IDM and lane keeping on LaMPilot's roads, a town driver elsewhere).
"""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from chauffeur.concept import (
    AgentKind,
    Capabilities,
    Command,
    LaneId,
    Observation,
    Scenario,
    Setpoints,
    SignalState,
    Turn,
    VehicleState,
)
from chauffeur.geometry import Pose

EGO = 0
"""Id of the ego in every observation and perception."""


@runtime_checkable
class Perception(Protocol):
    """Read-only questions about the present instant. Distances in m, speeds in m/s, ids as in the observation."""

    def vehicle(self, vehicle_id: int) -> VehicleState:
        """State of a vehicle. Raises KeyError for an id that is not (or no longer) on the road."""
        ...

    def has_lane(self, lane: LaneId) -> bool:
        """True if the road has this lane."""
        ...

    def lane_of(self, vehicle_id: int) -> LaneId:
        """Closest lane of a vehicle."""
        ...

    def adjacent_lane(self, lane: LaneId, offset: int) -> LaneId | None:
        """Lane `offset` places to the right (negative: left) on the same road segment; None beyond the edge."""
        ...

    def speed_limit(self, lane: LaneId) -> float:
        """Speed limit of a lane."""
        ...

    def neighbours(self, lane: LaneId) -> tuple[int | None, int | None]:
        """Nearest vehicle or obstacle ahead of and behind the ego in a lane, as (front, rear)."""
        ...

    def distance_along(self, from_id: int, to_id: int) -> float:
        """Centre-to-centre distance from one vehicle to another along the first one's lane; negative if behind."""
        ...

    def cross_traffic_lanes(self, from_left: bool) -> tuple[LaneId, ...]:
        """Lanes of the traffic crossing from the left (or right) at the next intersection; empty where none."""
        ...

    def stop_sign_ahead(self, served: frozenset[int]) -> tuple[int, float] | None:
        """(id, distance) of the nearest stop sign ahead in the ego lane that is not in `served`."""
        ...

    def front_blocker(self, served: frozenset[int]) -> int | None:
        """Nearest vehicle, or stop sign not in `served`, ahead on the ego's own lane."""
        ...

    def idm_entering(self, follower_id: int, leader_id: int, time_headway_s: float) -> float:
        """IDM acceleration of `follower` if `leader` drove right ahead of it and it wished its present speed."""
        ...


@runtime_checkable
class StreetPerception(Perception, Protocol):
    """Further questions that a town's perception answers. Distances are from the front bumper along the ego's way."""

    def gap_ahead(self) -> tuple[float, float] | None:
        """(m between the bumpers, its speed) of who or what is ahead; None without."""
        ...

    def light_ahead(self) -> tuple[SignalState, float] | None:
        """(what it shows, m to its stop line) of the next traffic light that rules the way; None without."""
        ...

    def person_ahead(self) -> float | None:
        """Distance to the nearest person on foot on the way or close to it; None without."""
        ...

    def junction_ahead(self) -> tuple[float, tuple[Turn, ...]] | None:
        """(m, ways on from the street) of the next junction with a choice of ways; None without."""
        ...

    def lane_beside(self, side: int) -> LaneId | None:
        """The lane to the right (negative: left) that the ego may change into from its own; None without."""
        ...

    def look(self) -> Observation:
        """The present instant."""
        ...

    def on_way(self, vehicle_id: int) -> tuple[float, float, float]:
        """Locate a road user by the ego's way: (m from the front bumper to its middle, negative behind it; m to the
        left of the way; m/s to the left). Raises KeyError for an id that nobody around has."""
        ...

    def crosses_at(self, vehicle_id: int) -> float | None:
        """Distance to where a road user that is beside the way will come onto it, or would from where it stands; None
        where it will not. Raises KeyError."""
        ...

    def turn_after(self, vehicle_id: int) -> Turn | None:
        """The way at the next junction that a road user ahead has taken; None while it has taken none."""
        ...

    def lane_after(self, vehicle_id: int) -> LaneId | None:
        """The lane of a road user ahead on the ego's own street; None where it is on another."""
        ...

    def is_clear(self) -> bool:
        """True if no road user that crosses the way is being let go first."""
        ...

    def place_ahead(self, name: str) -> float | None:
        """Distance to a place by its name or kind; None where it does not lie ahead on this way."""
        ...


@runtime_checkable
class Driver(Protocol):
    """A world's low-level driver: holds nothing but what its own control law needs."""

    def command(self, setpoints: Setpoints) -> Command:
        """Command for the present instant of the world."""
        ...

    def initial_setpoints(self) -> Setpoints:
        """Keep the present speed and lane: what drives when nobody asks for anything."""
        ...

    def settle(self, setpoints: Setpoints) -> Setpoints:
        """Wishes with the lane moved on where the present lane ends (route following), defaults filled in."""
        ...


@runtime_checkable
class World(Protocol):
    """A simulated or real place to drive in."""

    @property
    def engine(self) -> str:
        """Simulator that moves the vehicles, with its version; every result names it."""
        ...

    @property
    def capabilities(self) -> Capabilities:
        """Capabilities, the same before and after a reset."""
        ...

    @property
    def dt_s(self) -> float:
        """Control period."""
        ...

    def reset(self, scenario: Scenario, seed: int | None = None) -> Observation:
        """Set up a scenario; `seed` overrides the scenario's own. Raises ScenarioError if it cannot be set up."""
        ...

    def step(self, command: Command) -> Command:
        """Advance one control period; returns the command really applied. Only `driving.actuate` calls it."""
        ...

    def observe(self) -> Observation:
        """The present instant."""
        ...

    @property
    def ended(self) -> bool:
        """True if the world will not step further: crash, off the road, end of road or of time."""
        ...

    def perception(self) -> Perception:
        """Questions about the present instant."""
        ...

    def driver(self) -> Driver:
        """The low-level driver of the present trip; the same object until the next reset."""
        ...


@runtime_checkable
class MirroredWorld(World, Protocol):
    """A world whose present instant can be shown to another process, which keeps a copy of the same scenario."""

    def mirrored(self) -> bytes:
        """The present instant, without what is the same throughout a trip."""
        ...

    def mirror(self) -> WorldMirror:
        """A copy for another process, to be reset there. It is never stepped, and so needs no simulator."""
        ...


@runtime_checkable
class WorldMirror(MirroredWorld, Protocol):
    """A copy of a world that nobody steps: it is at the instants that it is shown."""

    def adopt(self, observation: bytes) -> None:
        """Be at that instant. Raises DataError if it is none of this scenario; the world then stays as it was."""
        ...


@runtime_checkable
class Stage(Protocol):
    """Lets a scenario put road users of its own on a world's roads."""

    def spawn(self, kind: AgentKind, pose: Pose, speed_mps: float = 0.0) -> int:
        """Put a road user, or with `static` a thing, at a pose of its middle; its id, as in snapshots.

        Traffic sees it and yields to it. It stands until it is driven.

        Raises:
            ScenarioError: There is no room, or the world has no such road user.
        """
        ...

    def drive(self, actor: int, pose: Pose, speed_mps: float) -> None:
        """Set the pose of a staged road user at the end of the next control period, and the speed it is shown with."""
        ...

    def remove(self, actor: int) -> None:
        """Take a road user of the stage away; nothing happens where it is gone already."""
        ...

    def force_signal(self, signal: str, state: SignalState | None) -> None:
        """Have a traffic light show a state until it is forced otherwise; None gives it back to its cycle."""
        ...
