"""Drives `Parameters` (Talk2Drive, paper Eq. 15): by pure pursuit, and in a town through the town's own driver."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from chauffeur.concept import Command, Limits, Observation, Parameters, ScenarioError, Setpoints, Turn, VehicleState
from chauffeur.executors.base import DriverLed, ExecutorBase, HeldSetpoints, PolicyTick
from chauffeur.executors.pursuit import ParametersDriver, number
from chauffeur.geometry.road_graph import TURNS
from chauffeur.worlds.base import World
from chauffeur.worlds.places import TownPlaces

_ROUNDED_MPS: Final = 0.02
"""Planners say the limit in hundredths of a metre a second, and may have cut it off."""


def parameters_executor(world: World) -> PursuitExecutor | TownSetPoints:
    """Executor of parameters for a world; its `route` is what is left of theirs."""
    return TownSetPoints(world) if isinstance(world, TownPlaces) else PursuitExecutor(world)


class PursuitExecutor(ExecutorBase):
    """Pure pursuit along the lanes, or onto a spot. There is no program to run, and so none that finishes."""

    def __init__(self, world: World) -> None:
        """Args: the world."""
        super().__init__(world)
        self._driver: ParametersDriver | None = None
        self._aimed = -1

    def start(
        self, policy: Parameters, observation: Observation, limits: Limits, origin: VehicleState | None = None
    ) -> None:
        """See Executor; where the way stays the same, what has begun of it goes on."""
        del observation
        lane = None if origin is None else origin.lane
        self._limits = limits
        if self._driver is None or not self._driver.retune(policy, lane):
            self._driver = ParametersDriver(self._world, policy, limits=limits, origin=lane)
            self._told = 0

    def tick(self) -> PolicyTick:
        said = super().tick().said
        return HeldSetpoints(self._setpoints, said=said)

    def step(self, observation: Observation, held: Setpoints | None = None) -> Command:
        driver = self._driving()
        if held is None:
            self._aim(observation)
        elif observation.tick != self._aimed:
            self._setpoints = driver.held_to(held)
        return driver.command(self._hold(held), self._setpoints.time_headway_s)

    @property
    def notes(self) -> tuple[tuple[float, str], ...]:
        return () if self._driver is None else self._driver.notes

    @property
    def route(self) -> str:
        """The route: name of the spot that is headed for, or what the policy said."""
        driver = self._driving()
        return driver.route if driver.spot is None else driver.spot.name

    def _aim(self, observation: Observation) -> None:
        self._setpoints, self._aimed = self._driving().setpoints(), observation.tick

    def _driving(self) -> ParametersDriver:
        if self._driver is None:
            raise ScenarioError("Nothing is driven yet.", hint="Call start(policy, observation, limits) first.")
        return self._driver


class TownSetPoints(DriverLed):
    """Set-points of parameters for a town's own driver: speed, lane and route.

    A target at the limit of the lane where it was planned is one for the limit, wherever the way leads.
    """

    def __init__(self, world: World) -> None:
        """Args: a town."""
        super().__init__(world)
        self._policy_mps, self._free = 0.0, False
        self._lane: str | None = None
        self._turn: Turn | None = None
        self._place = ""

    def start(
        self, policy: Parameters, observation: Observation, limits: Limits, origin: VehicleState | None = None
    ) -> None:
        turn: Turn | None = next((one for one in TURNS if one == policy.route), None)
        place = "" if turn is not None else policy.route
        if place and not (place == self._place and self._status == "running"):
            self._town.head_for(place)
        self._place, self._status = place, "running"
        here = (observation.ego if origin is None else origin).lane
        beside = None if here is None else observation.road.neighbour(here, policy.lane)
        self._lane, self._turn = beside if policy.lane else None, turn
        sign = 0.0 if here is None else self._world.perception().speed_limit(here)
        self._policy_mps, self._limits = number(policy.target_speed_mps, 0.0), limits
        self._free = self._policy_mps >= sign - _ROUNDED_MPS

    def tick(self) -> HeldSetpoints:
        driver = self._world.driver()
        here = self._world.observe().ego.lane
        sign = 0.0 if here is None else self._world.perception().speed_limit(here)
        most = self._limits.most_mps(sign)
        speed = min(sign, most) if self._free else min(self._policy_mps, most)
        if self._place and self._town.reached() == self._place:
            self._status = "finished"
        if self._status == "finished":
            speed = 0.0  # there, until something else is wished
        settled = driver.settle(replace(driver.initial_setpoints(), turn=self._turn))
        self._turn = settled.turn  # a turn that is taken is not taken again at the next junction
        self._setpoints = replace(settled, target_speed_mps=speed, target_lane=self._lane)
        return HeldSetpoints(self._setpoints, state="finished" if self._status == "finished" else "none")

    @property
    def route(self) -> str:
        """The place it goes to, or the turn that is still to be taken."""
        return self._place or self._turn or ""

    @property
    def _town(self) -> TownPlaces:
        assert isinstance(self._world, TownPlaces)
        return self._world
