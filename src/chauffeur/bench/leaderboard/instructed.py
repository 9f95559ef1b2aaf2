"""A planner at the wheel of a route (paper, Sec. IV-B): told by words where to go, answering with driving programs.

The planner gets the navigation instruction for where the car is, and the situation in words; no route, no coordinates.
Its program is checked, runs in the sandbox, and sets speed, lane and way; the world's driver follows. A new instruction
is given whenever the manoeuvre before is done, and after the program failed or the car stood for long. The car does not
wait for an answer: planning takes simulated time, and until the answer has come the last checked program drives on.
"""

from __future__ import annotations

import asyncio
import statistics
import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np

from chauffeur.bench.lampilot.policy_aid import offer
from chauffeur.bench.leaderboard.ways import PlannedRoute
from chauffeur.concept import (
    ChauffeurError,
    Command,
    Context,
    Instruction,
    LaneId,
    Limits,
    Observation,
    Plan,
    Program,
    Setpoints,
    SystemMessage,
)
from chauffeur.describe import describe
from chauffeur.describe.navigation import NOW_M, NavigationInstruction, Navigator
from chauffeur.driving.actuate import set_points
from chauffeur.driving.fallback import keep_lane_and_gap
from chauffeur.driving.planning import checked, screened_request
from chauffeur.geometry import Route
from chauffeur.memory.policies import PolicyRepository
from chauffeur.planners.base import Planner
from chauffeur.planners.prompts import build_system_message
from chauffeur.planners.registry import make_planner
from chauffeur.programs import ProgramExecutor
from chauffeur.programs.sandbox import UNHURRIED
from chauffeur.safety.checks import DRIVE_CHECKS
from chauffeur.worlds.base import World
from chauffeur.worlds.town.pack import MapPack

SETTINGS: Final = ("zero-shot", "few-shot", "human-feedback")
STOOD_S: Final = 45.0
"""A car that has stood for so long is told again."""
AGAIN_S: Final = 10.0
"""An instruction for which there is no program to drive is told again after so long."""


@dataclass(frozen=True, slots=True)
class PlannerSpec:
    """Which planner drives, and how it is asked. Values only: it travels to worker processes.

    Attributes:
        name: As the registry knows it.
        setting: zero-shot, few-shot or human-feedback.
        repository: Folder of the policy repository of human-feedback; empty for none.
        digest: Of its programs.
        latency_s: What a plan takes in simulated time; None takes what it really took.
        options: Further settings of the planner.
    """

    name: str
    setting: str = "few-shot"
    repository: str = ""
    digest: str = ""
    latency_s: float | None = None
    options: tuple[tuple[str, Any], ...] = ()

    @property
    def parts(self) -> tuple[Any, ...]:
        """Settings that decide its results."""
        return (self.name, self.setting, self.digest, self.latency_s)


def navigator_of(town: MapPack, route: Route) -> Navigator:
    """The giver of navigation instructions along a route of a town."""
    signals = [signal for group in town.signals for signal in group.signals(0.0)]
    return Navigator(town.road, route, signals, town.signs, town.places)


@lru_cache(maxsize=4)
def _planner(spec: PlannerSpec) -> Planner:
    return make_planner(spec.name, **dict(spec.options))


@lru_cache(maxsize=4)
def _repository(folder: str) -> PolicyRepository:
    return PolicyRepository(Path(folder))


def system_for(
    setting: str, repository: PolicyRepository | None, words: str, context: Context, limits: Limits
) -> SystemMessage:
    """S for an instruction in a town: with the programs of a repository that are nearest, or with examples, or bare."""
    if setting == "human-feedback" and repository is not None:
        return offer(repository, words, context.situation.world, limits, chain_of_thought=True)[0]
    examples = "few-shot" if setting == "few-shot" else "zero-shot"
    return build_system_message(examples, limits=limits, chain_of_thought=True, vocabulary="town")


@dataclass(slots=True)
class PlanningTally:
    """Outcome of planning on a route.

    Attributes:
        asked: Plans asked for.
        driven: Programs that took the wheel.
        declined: The planner declined.
        refused: The checks refused, or there was no program.
        failed: The planner gave no plan, or a program failed while it drove.
        latencies_s: Of every plan, in simulated time.
        reasons: Why, the last few.
    """

    asked: int = 0
    driven: int = 0
    declined: int = 0
    refused: int = 0
    failed: int = 0
    latencies_s: list[float] = field(default_factory=list[float])
    reasons: list[str] = field(default_factory=list[str])

    def note(self, reason: str) -> None:
        """Remember why something was not driven."""
        self.reasons = [*self.reasons[-4:], reason[:160]]

    def row(self) -> Mapping[str, Any]:
        """As columns."""
        return {
            "plans": self.asked,
            "plans_driven": self.driven,
            "plans_declined": self.declined,
            "plans_refused": self.refused,
            "plans_failed": self.failed,
            "plan_latency_s": round(statistics.fmean(self.latencies_s), 3) if self.latencies_s else None,
            "plan_reasons": "; ".join(self.reasons),
        }


class InstructedDriver:
    """Drives a route as a planner says that is told instructions. A context manager: it holds a sandbox."""

    def __init__(
        self,
        world: World,
        planned: PlannedRoute,
        town: MapPack,
        spec: PlannerSpec,
        seed: int,
        *,
        planner: Planner | None = None,
        limits: Limits | None = None,
    ) -> None:
        """Take the wheel of a world just reset, without a goal of its own.

        Args:
            world: To drive in.
            planned: The route, for the one who gives instructions and for nobody else.
            town: Lights, signs and places that instructions name.
            spec: Which planner.
            seed: Of the choice of words.
            planner: Takes the place of the one that `spec` names.
            limits: Bounds of programs and set-points.
        """
        self._navigator = navigator_of(town, planned.route)
        self._world, self._spec, self._limits = world, spec, limits or Limits()
        self._planner = planner or _planner(spec)
        self._rng = np.random.default_rng([seed, 2])
        self._executor = ProgramExecutor(budget=UNHURRIED)
        self._runner = asyncio.Runner()
        self._setpoints = replace(world.driver().initial_setpoints(), target_speed_mps=0.0)
        self._station, self._stage = 0.0, -1
        self._pending: tuple[float, Plan] | None = None
        self._again_s = float("inf")
        self._stood_s = 0.0
        self._driving = False
        self.aim: LaneId | None = None
        self.tally = PlanningTally()
        self.told: list[tuple[float, NavigationInstruction]] = []

    @property
    def setpoints(self) -> Setpoints:
        """Demand of the program at this instant."""
        return self._setpoints

    def close(self) -> None:
        """End the program and the sandbox."""
        self._executor.close()
        self._runner.close()

    def command(self, observation: Observation) -> Command:
        now = observation.time_s
        station = self._navigator.station_of(observation, self._station)
        if station is not None:
            self._station = station
        self._stood_s = self._stood_s + self._world.dt_s if observation.ego.speed_mps < 0.1 else 0.0
        stage = self._navigator.stage_of(self._station)
        waits = self._pending is not None or self._turning(observation)
        if not waits and (stage != self._stage or now >= self._again_s or self._stood_s > STOOD_S):
            self._stage, self._again_s, self._stood_s = stage, float("inf"), 0.0
            self._ask(observation)
        if self._pending is not None and now >= self._pending[0]:
            self._take(self._pending[1], observation)
            self._pending = None
        setpoints = self._setpoints
        if self._driving:
            tick = self._executor.tick()
            setpoints = tick.setpoints
            if tick.error is not None:
                self.tally.failed += 1
                self.tally.note(str(tick.error))
                self._driving, self._again_s = False, now + AGAIN_S
                setpoints = keep_lane_and_gap(setpoints, observation.ego.speed_mps, observation.ego.lane)
        driver = self._world.driver()
        setpoints, _ = set_points(self._world, observation, driver.settle(setpoints), self._limits)
        self._setpoints, self.aim = setpoints, setpoints.target_lane
        return driver.command(setpoints)

    def _turning(self, observation: Observation) -> bool:
        """True if the manoeuvre before is still being done: in a junction, with nothing to be done next that near."""
        lane = observation.road.get(observation.ego.lane)
        if lane is None or not lane.junction or self._stage < 0 or self._stood_s > STOOD_S:
            return False
        return all(not 0.0 < at - self._station <= NOW_M for at, _, _ in self._navigator.junctions)

    def _ask(self, observation: Observation) -> None:
        said = self._navigator.instruction(self._station, self._rng)
        self.told.append((observation.time_s, said))
        self.tally.asked += 1
        context = describe(observation)
        held = _repository(self._spec.repository) if self._spec.repository else None
        system = system_for(self._spec.setting, held, said.text, context, self._limits)
        instruction = Instruction(said.text, source="benchmark")
        request = screened_request(instruction, context, system, limits=self._limits)
        began = time.perf_counter()
        try:
            plan = self._runner.run(self._planner.plan(request))
        except ChauffeurError as error:
            self.tally.failed += 1
            self.tally.note(str(error))
            self._again_s = observation.time_s + AGAIN_S
            return
        took = time.perf_counter() - began if self._spec.latency_s is None else self._spec.latency_s
        self.tally.latencies_s.append(took)
        self._pending = observation.time_s + took, plan

    def _take(self, plan: Plan, observation: Observation) -> None:
        """Hand the wheel to a plan's program, if the checks let it pass as things are now."""
        refusal = checked(plan, observation, self._limits, DRIVE_CHECKS).refusal
        if not refusal and not isinstance(plan.policy, Program):
            refusal = "The planner gave no program."
        if refusal:
            if plan.refusal and plan.intent != "unusable":
                self.tally.declined += 1
            else:
                self.tally.refused += 1
            self.tally.note(refusal)
            self._again_s = observation.time_s + AGAIN_S
            return
        assert isinstance(plan.policy, Program)
        # A wish for a way or a lane was of the instruction before.
        held: Setpoints = replace(self._setpoints, turn=None, target_lane=observation.ego.lane)
        self._executor.start(plan.policy.source, self._world, setpoints=held, library=plan.policy.library)
        self._driving = True
        self.tally.driven += 1
