"""Traffic that misbehaves on purpose: for proving what protects the ego, not for scoring it.

The cars stay highway-env's own, with their bounds of acceleration and steering; only what they want is disturbed, at
random moments drawn from a generator that is passed in.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from chauffeur.concept import Command, Observation, Scenario
from chauffeur.worlds.base import EGO
from chauffeur.worlds.highway.core import layout as at
from chauffeur.worlds.highway.world import HighwayWorld

Mood = Literal["calm", "slamming", "cutting-in"]

_SLAM_S = 2.0
_EVERY_S = 2.0
"""Mean time between two provocations of a car close to the ego."""
_NEAR_M = 60.0


class ProvokedWorld(HighwayWorld):
    """A highway world some of whose cars brake for nothing, or move over right before the ego."""

    def __init__(self, mood: Mood, rng: np.random.Generator) -> None:
        super().__init__()
        self._mood = mood
        self._rng = rng
        self._slamming: dict[int, tuple[int, float]] = {}

    def reset(self, scenario: Scenario, seed: int | None = None) -> Observation:
        """As the highway world's."""
        self._slamming.clear()
        return super().reset(scenario, seed)

    def step(self, command: Command) -> Command:
        """Provoke, then advance one control period."""
        if self._mood == "slamming":
            self._slam()
        elif self._mood == "cutting-in":
            self._cut_in()
        return super().step(command)

    def _near(self) -> list[int]:
        """Cars close to the ego whose turn it is."""
        core = self._road()
        x = core.floats[EGO, at.X]
        near = [i for i in range(1, core.vehicles) if abs(core.floats[i, at.X] - x) < _NEAR_M]
        return [i for i in near if self._rng.random() < self.dt_s / _EVERY_S]

    def _slam(self) -> None:
        core = self._road()
        for car, (left, before) in list(self._slamming.items()):
            if left > 0:
                self._slamming[car] = left - 1, before
            else:
                core.floats[car, at.TARGET_SPEED] = before
                del self._slamming[car]
        for car in self._near():
            if car not in self._slamming:
                self._slamming[car] = round(_SLAM_S / self.dt_s), float(core.floats[car, at.TARGET_SPEED])
                core.floats[car, at.TARGET_SPEED] = 0.0

    def _cut_in(self) -> None:
        core = self._road()
        for car in self._near():
            ahead = core.floats[car, at.X] > core.floats[EGO, at.X]
            same_road = (
                core.road.traits[core.ints[car, at.LANE], at.ROAD] == core.road.traits[core.ints[EGO, at.LANE], at.ROAD]
            )
            if ahead and same_road:
                core.ints[car, at.TARGET_LANE] = core.ints[EGO, at.LANE]
