"""Executors, each driving one kind of policy, and their base.

Every control period goes the same way, in simulated time, in real time and in benchmarks:

    tick = executor.tick()                          what the policy asks for in this period
    held = ...                                      its set-points as limits, or a fallback level, leave them
    command = executor.step(observation, held)      what the controllers make of them, for the one door to the actuator
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal, Protocol, runtime_checkable

from chauffeur.concept import (
    ApiCall,
    ChauffeurError,
    Command,
    Limits,
    Observation,
    ProgramState,
    Setpoints,
    VehicleState,
)
from chauffeur.geometry import Polyline
from chauffeur.worlds.base import World
from chauffeur.worlds.path_follower import Chassis

ExecutorStatus = Literal["running", "finished"]


@runtime_checkable
class KnowsChassis(Protocol):
    """A world that tells the size and the axles of its ego."""

    @property
    def chassis(self) -> Chassis: ...


class SetManoeuvre(Protocol):
    """A path that is to be driven and at what speed: what the motion planning layer hands to the controllers."""

    @property
    def path(self) -> Polyline: ...
    @property
    def speed_mps(self) -> float: ...
    @property
    def goal_m(self) -> float | None: ...


@runtime_checkable
class SetsManoeuvre(Protocol):
    """A world in which it is set what is driven, and a policy sets how."""

    @property
    def manoeuvre(self) -> SetManoeuvre: ...


class PolicyTick(Protocol):
    """Output of a policy in one control period."""

    @property
    def setpoints(self) -> Setpoints: ...
    @property
    def state(self) -> ProgramState: ...
    @property
    def line(self) -> int | None: ...
    @property
    def said(self) -> tuple[str, ...]: ...
    @property
    def calls(self) -> tuple[ApiCall, ...]: ...
    @property
    def error(self) -> ChauffeurError | None: ...


class RunningPolicy(Protocol):
    """A policy bound to a world, asked once per control period."""

    def tick(self) -> PolicyTick:
        """Set-points for this period. Never raises for the policy's own faults; they come as `state` and `error`."""
        ...


@dataclass(frozen=True, slots=True)
class HeldSetpoints:
    """A period in which set-points stand, with no program behind them."""

    setpoints: Setpoints
    state: ProgramState = "none"
    line: int | None = None
    said: tuple[str, ...] = ()
    calls: tuple[ApiCall, ...] = ()
    error: ChauffeurError | None = None


@runtime_checkable
class Executor(RunningPolicy, Protocol):
    """Drives one policy at a time. It never steps a world: commands go through the one door to the actuator."""

    def start(self, policy: Any, observation: Observation, limits: Limits, origin: VehicleState | None = None) -> None:
        """Take over a checked policy of its kind. One that cannot be driven leaves what was driven before as it was.

        Args:
            policy: Of its kind.
            observation: The present instant.
            limits: Of the person and the operator.
            origin: The ego when the policy was made, from which its lane or its waypoints count; default as it is now.

        Raises:
            ScenarioError: It cannot be driven here.
        """
        ...

    def step(self, observation: Observation, held: Setpoints | None = None) -> Command:
        """The command for one control period.

        Args:
            observation: The present instant.
            held: Set-points to keep to; None for the policy's own. They may hold the policy back, never drive it on.
                Without a `tick` in this period they are a fallback level's, whose lane holds too.
        """
        ...

    def close(self) -> None:
        """Give back what it holds; may be called twice."""
        ...

    @property
    def setpoints(self) -> Setpoints:
        """Set-points of this period, for limits, screen and record."""
        ...

    @property
    def status(self) -> ExecutorStatus:
        """`running` while there is more to drive, then `finished`."""
        ...

    @property
    def notes(self) -> tuple[tuple[float, str], ...]:
        """Messages to the passenger, as (time s, text)."""
        ...


class ExecutorBase:
    """Base of executors: set-points, status and notes. They aim in `_aim`, and command in `step`."""

    def __init__(self, world: World) -> None:
        """Args: the world, which is looked at and never stepped."""
        self._world = world
        self._limits = Limits()
        self._setpoints = Setpoints()
        self._status: ExecutorStatus = "running"
        self._notes: list[tuple[float, str]] = []
        self._told = 0

    @property
    def setpoints(self) -> Setpoints:
        return self._setpoints

    @property
    def status(self) -> ExecutorStatus:
        return self._status

    @property
    def notes(self) -> tuple[tuple[float, str], ...]:
        return tuple(self._notes)

    def tick(self) -> PolicyTick:
        self._aim(self._world.observe())
        new, self._told = self.notes[self._told :], len(self.notes)
        return HeldSetpoints(self._setpoints, state=self._status, said=tuple(text for _, text in new))

    def close(self) -> None:
        """See Executor."""

    def _aim(self, observation: Observation) -> None:
        """Have `_setpoints` be those of an instant."""
        raise NotImplementedError

    def _hold(self, held: Setpoints | None) -> float:
        """Have the set-points kept to others, where there are any; the speed to drive then, m/s."""
        own = self._setpoints.target_speed_mps or 0.0
        if held is not None:
            most = held.target_speed_mps
            own = own if most is None else min(own, most)
            self._setpoints = replace(self._setpoints, target_speed_mps=own, time_headway_s=held.time_headway_s)
        return own


class DriverLed(ExecutorBase):
    """A policy that states set-points alone, which the world's own driver follows."""

    def __init__(self, world: World, policy: RunningPolicy | None = None) -> None:
        """Args: the world; who states the set-points, None for nobody: what is then goes on."""
        super().__init__(world)
        self._policy = policy

    def tick(self) -> PolicyTick:
        tick = HeldSetpoints(self._world.driver().initial_setpoints()) if self._policy is None else self._policy.tick()
        self._setpoints = tick.setpoints
        self._status = "finished" if tick.state == "finished" else "running"
        return tick

    def step(self, observation: Observation, held: Setpoints | None = None) -> Command:
        del observation
        driver = self._world.driver()
        return driver.command(driver.settle(self.tick().setpoints) if held is None else held)
