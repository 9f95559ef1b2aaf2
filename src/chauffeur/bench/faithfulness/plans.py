"""Programs of our own for the generated cases: wishes over simulated scenes, planned by what their acts mean."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Final

import numpy as np

from chauffeur.concept import LAMPILOT_LIMITS, Situation
from chauffeur.describe import describe
from chauffeur.driving.episode import make_world
from chauffeur.planners.onboard.choose import choose
from chauffeur.planners.onboard.exemplars import Filled, program_of
from chauffeur.planners.onboard.options import Chosen, Declined
from chauffeur.planners.onboard.personal import Leaning
from chauffeur.planners.onboard.understand import meanings_said
from chauffeur.safety.faithfulness import FactSurroundings
from chauffeur.worlds.highway.scenarios import BUILT_IN

SEEDS_A_SCENE: Final = 8
"""Starts of each built-in scenario."""

WISHES: Final = (
    "Drive at {mps} m/s.", "Set the speed to {kmh} km/h.", "Drive {mph} mph.", "Go {few} mph faster.",
    "Drive {few} m/s faster.", "Go {few} m/s slower.", "Drive {tens} km/h slower.", "Faster.", "A bit faster.",
    "Slower.", "A bit slower.", "Much slower.", "Never above {mph} mph.", "Drive at the speed limit.",
    "Keep a gap of {gap} metres to the car ahead.", "Close up by {few} m.", "Drop back by {tens} m.",
    "Get closer to the car ahead.", "Leave more room to the car ahead.", "Change to the left lane.",
    "Change to the right lane.", "Change to the left lane when it is safe.",
    "Change to the right lane when it is clear.",
    "Overtake the car ahead on the left.", "Overtake the car ahead on the right.",
    "Overtake the car ahead on the left and come back.", "Overtake the car ahead on the right and come back.",
    "Turn left.", "Turn right.", "Go straight on.", "Pull over.", "Stop at the stop sign.", "Stay in this lane.",
    "Keep everything as it is.", "I am in a hurry.", "Drive carefully.",
    "Change to the left lane and then drive at {mps} m/s.", "Drive at {mps} m/s and then change to the left lane.",
    "Change to the right lane and then slow down to {kmh} km/h.",
    "Slow down to {kmh} km/h and then change to the right lane.",
    "Overtake the car ahead on the left and then drive at {mps} m/s.",
    "Drive at {mph} mph and then overtake on the left.",
)  # fmt: skip
"""Wishes, as templates."""


@dataclass(frozen=True, slots=True)
class PlanStart:
    """A simulated scene at its first instant."""

    scenario: str
    seed: int
    situation: Situation
    where: FactSurroundings


@dataclass(frozen=True, slots=True)
class PlannedCase:
    """A wish, planned.

    Attributes:
        wish: Its words.
        start: Where.
        steps: What was chosen, in order.
    """

    wish: str
    start: PlanStart
    steps: tuple[Chosen, ...]

    @property
    def intent(self) -> str:
        """Tags of the steps."""
        return "+".join(step.intent for step in self.steps)

    @property
    def program(self) -> str:
        """The program's text."""
        return program_of([step.filled for step in self.steps])


@cache
def starts() -> tuple[PlanStart, ...]:
    """Scenes, the same in every run."""
    found: list[PlanStart] = []
    for scenario in BUILT_IN:
        for offset in range(SEEDS_A_SCENE):
            seed = scenario.seed + offset
            observation = make_world(scenario).reset(scenario, seed)
            found.append(
                PlanStart(scenario.id, seed, describe(observation).situation, FactSurroundings.of(observation))
            )
    return tuple(found)


def draw(rng: np.random.Generator) -> PlannedCase:
    """A wish that can be planned, over a scene."""
    scenes = starts()
    while True:
        start = scenes[rng.integers(len(scenes))]
        wish = WISHES[rng.integers(len(WISHES))].format(
            mps=int(rng.integers(14, 32)), kmh=5 * int(rng.integers(10, 23)), mph=5 * int(rng.integers(7, 14)),
            few=int(rng.integers(3, 9)), tens=5 * int(rng.integers(2, 5)), gap=5 * int(rng.integers(4, 12)),
        )  # fmt: skip
        planned = plan(wish, start)
        if planned is not None:
            return planned


def plan(wish: str, start: PlanStart) -> PlannedCase | None:
    """A wish over a scene; None where the planner declines."""
    meanings = meanings_said(wish)
    if not meanings:
        return None
    choice = choose(meanings, start.situation, LAMPILOT_LIMITS, lambda _: Leaning())
    return None if isinstance(choice, Declined) else PlannedCase(wish, start, choice.steps)


def refilled(step: Chosen, number: str, value: float, exemplar: str = "") -> Chosen:
    """A step with another number, and with another exemplar if one is named."""
    filled = Filled(exemplar or step.filled.id, {**step.filled.numbers, number: value})
    return replace(step, filled=filled)


def program(steps: Sequence[Chosen]) -> str:
    """The program of some steps."""
    return program_of([step.filled for step in steps])
