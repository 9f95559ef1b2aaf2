"""Rehearsal on the benchmark: the judge that knows LaMPilot's ruler, and the programs to choose from."""

from __future__ import annotations

import atexit
import math
import multiprocessing
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from multiprocessing.sharedctypes import Synchronized
from typing import Any, Self

from chauffeur.bench.lampilot.expert import variants
from chauffeur.bench.lampilot.goals import DistanceGoal, OvertakeGoal, SpeedGoal
from chauffeur.bench.lampilot.goals_more import make_any_goal
from chauffeur.bench.lampilot.metrics import (
    ANY_STOP_M,
    COLLISION_WEIGHT,
    ORIGIN,
    SPEED_STD_FULL_MPS,
    TIME_LIMIT_S,
    WEIGHTS,
    points,
)
from chauffeur.bench.lampilot.referee import GoalJudge
from chauffeur.concept import Scenario
from chauffeur.drive.rehearsal import RehearsedChoice, Rollout, best_choice, rehearse, tries
from chauffeur.programs import UNHURRIED, Sandbox
from chauffeur.programs.variants import perturbed
from chauffeur.programs.workers import on_core
from chauffeur.worlds.highway import HighwayWorld, RoadPerception

MAX_TRY_S = 70.0
"""Longest try: goals with a limit of their own have 60 s."""

_PASS_S = 0.11
"""A car that is passed is at most a control period away just before, and to overtake is to pass."""
_EVERY_TICKS = 5
"""How often a try's ceiling is computed."""


class OriginJudge(GoalJudge):
    """What a trip is worth under LaMPilot's own ruler, collisions included, while it is driven."""

    def __init__(self, road: RoadPerception, scenario: Scenario) -> None:
        super().__init__(road, make_any_goal(road, scenario))
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
        """What the trip adds to 100 times the driving score of a run, per item."""
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
        left_s = self._goal.left_s(self._steps / 10) if isinstance(self._goal, SpeedGoal | DistanceGoal) else 0.0
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
    place = unhurried_sandbox() if sandbox is None else sandbox
    return rehearse(
        world, sources, _judges(scenario), sandbox=place, max_s=MAX_TRY_S, library=library, stop_zone_m=ANY_STOP_M
    )


def _judges(scenario: Scenario) -> Callable[[HighwayWorld], OriginJudge]:
    return lambda copy: OriginJudge(copy.perception(), scenario)


@cache
def unhurried_sandbox() -> Sandbox:
    """One pool of warm workers for all programs of this process that are tried, not driven."""
    sandbox = Sandbox(UNHURRIED)
    atexit.register(sandbox.close)
    return sandbox


class Crew:
    """Processes that rehearse one wish together, so that it has all cores. Use it as a context manager.

    A benchmark run does not need it: its workers have a sample each.
    """

    def __init__(self, helpers: int | None = None) -> None:
        """Start helper processes beside this one. Raises OSError when none can be started.

        Args:
            helpers: How many; None for one on each further core.
        """
        cores = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else [None]
        if helpers is None:
            helpers = len(cores) - 1
        context = multiprocessing.get_context("spawn")
        self._core = cores[0]
        self._desk = _Desk(context.Value("i", 0), context.Value("d", -math.inf))
        self._pools = [
            ProcessPoolExecutor(
                1, mp_context=context, initializer=_join, initargs=(self._desk, cores[(1 + i) % len(cores)])
            )
            for i in range(helpers)
        ]
        with on_core(self._core):  # a host and its sandbox take turns: on two cores they would wait for each other
            self._sandbox = Sandbox(UNHURRIED)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc_info: object) -> None:
        self._sandbox.close()
        for pool in self._pools:
            pool.shutdown(cancel_futures=True)

    def rehearsed(self, scenario: Scenario, sources: Sequence[str], *, library: str = "") -> RehearsedChoice:
        """As `rehearsed`, for a trip that begins where the scenario does; the choice is the same."""
        self._desk.clear()
        others = [pool.submit(_share, scenario, sources, library) for pool in self._pools]
        with on_core(self._core):
            rollouts = _tries(self._desk, scenario, sources, library, self._sandbox)
        for other in others:
            rollouts |= other.result()
        return best_choice(sources, dict(sorted(rollouts.items())))


class _Desk:
    """What a crew shares: which candidate is next, and how good the best one was."""

    def __init__(self, tickets: Synchronized[int], worth: Synchronized[float]) -> None:
        self._tickets = tickets
        self._worth = worth

    def clear(self) -> None:
        """A new wish."""
        self._tickets.value = 0
        self._worth.value = -math.inf

    def places(self, count: int) -> Iterator[int]:
        """Candidates that nobody has begun, one after the other."""
        while True:
            with self._tickets.get_lock():
                place = self._tickets.value
                self._tickets.value = place + 1
            if place >= count:
                return
            yield place

    @property
    def best(self) -> float:
        return self._worth.value

    def tell(self, worth: float) -> None:
        with self._worth.get_lock():
            self._worth.value = max(self._worth.value, worth)


_joined: list[_Desk] = []
"""The desk of the crew that this process belongs to."""


def _join(desk: _Desk, core: int | None) -> None:
    _joined.append(desk)
    if core is not None:
        os.sched_setaffinity(0, {core})
    unhurried_sandbox()


def _share(scenario: Scenario, sources: Sequence[str], library: str) -> Mapping[int, Rollout]:
    return _tries(_joined[0], scenario, sources, library, unhurried_sandbox())


def _tries(
    desk: _Desk, scenario: Scenario, sources: Sequence[str], library: str, sandbox: Sandbox
) -> dict[int, Rollout]:
    """What this process finds out."""
    world = HighwayWorld()
    world.reset(scenario)
    return tries(
        world,
        sources,
        _judges(scenario),
        desk.places(len(sources)),
        sandbox=sandbox,
        max_s=MAX_TRY_S,
        library=library,
        stop_zone_m=ANY_STOP_M,
        board=desk,
    )
