"""Rehearsal on the benchmark: the judge that knows LaMPilot's ruler, and the programs to choose from."""

from __future__ import annotations

import atexit
import math
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from chauffeur.bench.lampilot.expert import variants
from chauffeur.bench.lampilot.rehearsal import RehearsedChoice, rehearse
from chauffeur.concept import Scenario
from chauffeur.driving.judge.goals import HeldGoal, OvertakeGoal, make_goal
from chauffeur.driving.judge.lampilot import GoalJudge
from chauffeur.driving.judge.metrics import (
    ANY_STOP_M,
    COLLISION_WEIGHT,
    ORIGIN,
    SPEED_STD_FULL_MPS,
    TIME_LIMIT_S,
    WEIGHTS,
    points,
)
from chauffeur.programs import UNHURRIED, Sandbox
from chauffeur.programs.variants import perturbed
from chauffeur.worlds.highway import HighwayWorld, RoadPerception

MAX_TRY_S = 70.0
"""Longest try: goals with a limit of their own have 60 s."""

_PASS_S = 0.11
"""A car that is passed is at most a control period away just before, and to overtake is to pass."""
_EVERY_TICKS = 5
"""Ticks between two computations of a try's ceiling."""


class OriginJudge(GoalJudge):
    """Worth of a trip under LaMPilot's own ruler, collisions included, while it is driven."""

    def __init__(self, road: RoadPerception, scenario: Scenario) -> None:
        super().__init__(road, make_goal(road, scenario))
        self._steps = 0
        self._mean = self._squares = 0.0
        self._least_s = math.inf
        self._inevitable_s = _PASS_S if isinstance(self._goal, OvertakeGoal) else math.inf
        self._ceiling = math.inf

    def observe(self) -> None:
        """Look at the instant after a control period."""
        now = self._road.instant()
        self._steps += 1
        off = now.speed_mps - self._mean
        self._mean += off / self._steps
        self._squares += off * (now.speed_mps - self._mean)
        if 0 < now.ttc_along_s < self._least_s:
            self._least_s = now.ttc_along_s
        self._ruling = self._goal.rule(self._steps / 10, now)
        if self._steps % _EVERY_TICKS == 0:
            self._ceiling = self._highest()

    @property
    def worth(self) -> float:
        """Contribution of the trip to 100 times the driving score of a run, per item."""
        return self._score_after(self._steps, self._least_s) * self.success - COLLISION_WEIGHT * self.collided

    @property
    def ceiling(self) -> float:
        """The score if the goal were reached at the best moment, at the mean speed, without another conflict."""
        return self._ceiling

    def _highest(self) -> float:
        # More steps at the mean speed lower the standard deviation and cost time; in between lies a best number.
        per_mps = WEIGHTS["speed_variance"] * 100.0 / SPEED_STD_FULL_MPS
        per_step = WEIGHTS["time_efficiency"] * 100.0 / (TIME_LIMIT_S * 10.0)
        best = (per_mps * math.sqrt(self._squares) / (2.0 * per_step)) ** (2.0 / 3.0)
        left_s = self._goal.left_s(self._steps / 10) if isinstance(self._goal, HeldGoal) else 0.0
        least = self._steps + math.floor(10.0 * left_s)
        ttc_s = min(self._least_s, self._inevitable_s)
        return max(self._score_after(max(least, round_(best)), ttc_s) for round_ in (math.floor, math.ceil))

    def _score_after(self, steps: int, least_ttc_s: float) -> float:
        """Score of a success after so many steps, the speeds so far and from now on their mean driven."""
        signals = {
            "steps": steps,
            "ttc_along_s": least_ttc_s if math.isfinite(least_ttc_s) else None,
            "speed_std_mps": math.sqrt(self._squares / max(1, steps)),
            "crashed": False,
            "off_road": False,
            "stop_speed_mps": None,
            "ttc_lane_s": None,
            "fault": "",
        }
        return float(points({"success": True, "signals": signals}, ORIGIN.id)["score"])


def candidates(goal: Mapping[str, Any], count: int, seed: int, source: str = "") -> list[str]:
    """Programs to rehearse: a planner's program and variants of its numbers, or the expert's where there is none.

    Raises:
        ScenarioError: The expert is asked for and has no program for the goal.
    """
    return perturbed(source, count, seed) if source else variants(goal, count, seed)


def rehearsed(
    world: HighwayWorld,
    scenario: Scenario,
    sources: Sequence[str],
    *,
    library: str = "",
    sandbox: Sandbox | None = None,
) -> RehearsedChoice:
    """The program to drive from the world's present instant, chosen by LaMPilot's own ruler.

    Args:
        world: Where the trip is to begin; it stays as it is.
        scenario: The sample, whose goal is judged.
        sources: Program texts, likely ones first.
        library: Helper functions they may call.
        sandbox: Where they run; None for one that this module keeps for the process.

    Raises:
        ScenarioError: The scenario's goal cannot be judged here.
        SandboxError: No worker can be had.
    """
    return rehearse(
        world,
        sources,
        lambda copy: OriginJudge(copy.perception(), scenario),
        sandbox=unhurried_sandbox() if sandbox is None else sandbox,
        max_s=MAX_TRY_S,
        library=library,
        stop_zone_m=ANY_STOP_M,
    )


@cache
def unhurried_sandbox() -> Sandbox:
    """One pool of warm workers for all programs of this process that are tried, not driven."""
    sandbox = Sandbox(UNHURRIED)
    atexit.register(sandbox.close)
    return sandbox
