"""A world with the scenarios of a route: sets them off where the ego passes their triggers, and lets them go on."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from chauffeur.bench.leaderboard.behaviours import SWITCHES_LIGHTS, Behaviour, Lights, reached, set_off
from chauffeur.bench.leaderboard.track import RouteTrack
from chauffeur.bench.leaderboard.triggers import Placed
from chauffeur.concept import Command, Observation, Scenario, ScenarioError
from chauffeur.worlds.base import Driver, Perception, Stage, World


class StagedWorld(World, Stage, Protocol):
    """A world that has a stage."""


class ScenarioWorld:
    """A world under way on a route, with its scenarios. It is reset already, and stepped like the world itself.

    Attributes:
        triggered: Scenarios that were set off, by number of their type.
        unplaceable: Why others could not be.
    """

    def __init__(self, world: StagedWorld, track: RouteTrack, placed: Sequence[Placed], seed: int) -> None:
        """Take over a world that was just reset."""
        self.capabilities = world.capabilities
        self._world = world
        self._track = track
        self._waiting = list(placed)
        self._running: list[Behaviour] = []
        self._rng = np.random.default_rng([seed, 1])
        self.triggered: list[int] = []
        self.unplaceable: list[str] = []

    @property
    def engine(self) -> str:
        return self._world.engine

    @property
    def dt_s(self) -> float:
        return self._world.dt_s

    @property
    def ended(self) -> bool:
        return self._world.ended

    def reset(self, scenario: Scenario, seed: int | None = None) -> Observation:
        """A route is driven once. Raises ScenarioError."""
        del seed
        raise ScenarioError(f"{scenario.id} is under way.", hint="Make another one for another drive.")

    def observe(self) -> Observation:
        return self._world.observe()

    def perception(self) -> Perception:
        return self._world.perception()

    def driver(self) -> Driver:
        return self._world.driver()

    def step(self, command: Command) -> Command:
        """See World; scenarios disturb the command and act before the world goes on."""
        now = self._world.observe()
        for placed in [one for one in self._waiting if reached(one, now)]:
            if placed.trigger.scenario in SWITCHES_LIGHTS and any(isinstance(one, Lights) for one in self._running):
                continue  # two at one junction would set its lights against each other
            self._waiting.remove(placed)
            try:
                self._running.append(set_off(placed, self._track, now.road, self._world, self._rng))
                self.triggered.append(placed.trigger.scenario)
            except ScenarioError as error:
                self.unplaceable.append(f"Scenario{placed.trigger.scenario}: {error}")
        for behaviour in self._running:
            behaviour.update(now)
            added = behaviour.disturbance
            if added is not None:
                command = Command(
                    command.acceleration_mps2 + added.acceleration_mps2, command.steering_rad + added.steering_rad
                )
        self._running = [one for one in self._running if not one.done]
        return self._world.step(command)
