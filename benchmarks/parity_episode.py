"""One episode of benchmarks/core_parity.py: highway-env and the compiled core side by side."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from chauffeur.concept import Scenario
from chauffeur.driving.judge.lampilot import LampilotReferee
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.core import layout as at
from highway_oracle import ReferenceWorld

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "worlds"))

from test_core import POLICIES, TOLERANCE, _Policy

__all__ = ["POLICIES", "TOLERANCE", "Episode", "compare"]

SCORES_AGREE = 1e-9

State = np.ndarray
"""(entities, 5): x, y, heading, speed, crashed; the ego first."""


@dataclass(frozen=True, slots=True)
class Episode:
    """How the two went together.

    Attributes:
        name: Sample and policy.
        steps: Steps compared.
        worst: Largest difference of a state.
        exact: Whether all states are equal to the last bit.
        judged: Whether goal, collision and scores are equal.
        crashed: Whether any vehicle crashed.
        fault: Where they parted; empty if they did not.
    """

    name: str
    steps: int
    worst: float
    exact: bool
    judged: bool
    crashed: bool
    fault: str


class _Side:
    """One world under one policy, with its referee."""

    def __init__(self, world: HighwayWorld | ReferenceWorld, scenario: Scenario, policy: str) -> None:
        self.world = world
        world.reset(scenario)
        self._policy = _Policy(policy, world, scenario.seed % 1000)
        self._driver = world.driver()
        self._wishes = self._driver.initial_setpoints()
        self._referee = LampilotReferee(world, scenario)
        self._verdict: tuple[object, ...] = ()

    def step(self) -> None:
        self._wishes = self._policy.adjust(self._driver.settle(self._wishes))
        self.world.step(self._driver.command(self._wishes))
        if not self._referee.over:
            self._referee.observe()
            self._verdict = self._referee.outcome(), self._referee.success, self._referee.collided

    def judged(self) -> tuple[tuple[object, ...], list[float]]:
        return self._verdict, [metric.value for metric in self._referee.metrics()]

    def state(self) -> State:
        if isinstance(self.world, HighwayWorld):
            core = self.world._road()
            columns = [core.floats[:, name] for name in (at.X, at.Y, at.HEADING, at.SPEED)]
            return np.column_stack([*columns, core.ints[:, at.CRASHED]])
        road, ego = self.world.scene.road, self.world.scene.ego
        entities = [ego, *(v for v in road.vehicles if v is not ego), *road.objects]
        return np.array([(*e.position, e.heading, e.speed, e.crashed) for e in entities], dtype=float)


def compare(job: tuple[Scenario, str, int]) -> Episode:
    """Drive both worlds side by side."""
    scenario, policy, most = job
    name = f"{scenario.id} {policy}"
    plain, quick = _Side(ReferenceWorld(), scenario, policy), _Side(HighwayWorld(), scenario, policy)
    worst, exact, crashed, step = 0.0, True, False, 0
    for step, (expected, found) in enumerate(_states(plain, quick, most)):
        if expected.shape != found.shape:
            return Episode(name, step, math.inf, False, False, crashed, f"other vehicles after step {step}")
        crashed = crashed or bool(expected[:, 4].any())
        difference = np.abs(expected - found)
        worst = max(worst, float(difference.max()))
        exact = exact and bool((expected == found).all())
        if not worst <= TOLERANCE:
            row, column = np.unravel_index(difference.argmax(), difference.shape)
            what = ("x", "y", "heading", "speed", "crashed")[column]
            fault = f"{what} of entity {row} by {difference.max():.1e} after step {step}"
            return Episode(name, step, worst, False, False, crashed, fault)
    verdicts, scores = zip(plain.judged(), quick.judged(), strict=True)
    judged = verdicts[0] == verdicts[1] and np.allclose(*scores, rtol=0, atol=SCORES_AGREE)
    ended = plain.world.ended == quick.world.ended
    fault = "" if judged and ended else f"judged {verdicts[0]} {scores[0]} and {verdicts[1]} {scores[1]}"
    return Episode(name, step, worst, exact, judged, crashed, fault)


def _states(plain: _Side, quick: _Side, most: int) -> Iterator[tuple[State, State]]:
    yield plain.state(), quick.state()
    for _ in range(most):
        plain.step()
        quick.step()
        yield plain.state(), quick.state()
        if plain.world.ended or quick.world.ended:
            return
