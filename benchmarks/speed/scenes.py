"""What is driven: samples of the benchmark, or the built-in scenes where there are none, and programs for them."""

from __future__ import annotations

import asyncio
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from chauffeur.bench.kernel.pipeline import context_adapter, describe_scene
from chauffeur.bench.lampilot.rollout import RolloutJob
from chauffeur.concept import LAMPILOT_LIMITS, ChauffeurError, Instruction, PlanRequest, Program, Scenario
from chauffeur.driving.judge.lampilot import LampilotReferee
from chauffeur.planners.meaning import MeaningPlanner
from chauffeur.planners.prompts import build_system_message
from chauffeur.programs.gate import check_source
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.dblv1 import load_dataset
from chauffeur.worlds.highway.scenarios import BUILT_IN

COMMANDS = 10
"""Commands a sample has in the benchmark: 490 samples make 4,900 items."""
_FRESH = 1_000_003
_BUILT_IN_GOALS: dict[str, dict[str, Any]] = {
    "overtake": {"type": "OvertakeEval", "direction": "left"},
    "following": {"type": "ACCEvalbyDistance", "rel_distance": 10},
    "cruise": {"type": "ACCEvalbySpeed", "speed": 25},
    "left-lane": {"type": "LaneChangeEval", "direction": "right"},
    "emergency-lane": {"type": "PullOverEval"},
    "intersection": {"type": "IntersectionEval", "direction": ["il1", "o1", 0]},
    "quiet-intersection": {"type": "IntersectionEval", "direction": ["il2", "o2", 0]},
}


@dataclass(frozen=True, slots=True)
class Sample:
    """A scenario with the words that may be said in it."""

    scenario: Scenario
    commands: tuple[str, ...]

    @property
    def road(self) -> str:
        """LaMPilot's name of its road."""
        return str(self.scenario.config["type"])


@dataclass(frozen=True, slots=True)
class Planned:
    """A sample with the program the on-board planner wrote for one of its commands."""

    sample: Sample
    job: RolloutJob
    source: str

    @property
    def for_the_peer(self) -> str:
        """The text as LaMPilot executes it: its last line makes the policy."""
        return f"{self.source}\npolicy = {check_source(self.source).main}()"


def load_samples(data: Path | None) -> list[Sample]:
    """All samples of a DbLv1 folder (or of the folder that holds `DbLv1-dev`); the built-in scenes without one."""
    if data is None:
        return [Sample(replace(s, goal=_BUILT_IN_GOALS[s.id]), (s.wish,)) for s in BUILT_IN]
    if not (data / "config_list.txt").is_file() and (data / "DbLv1-dev").is_dir():
        data /= "DbLv1-dev"
    dataset = load_dataset(data)
    return [Sample(sample, task.commands) for task in dataset.tasks for sample in task.samples]


def plan(samples: list[tuple[Sample, int]]) -> list[Planned]:
    """Programs of the on-board planner for (sample, number of the command); what it declines is left out."""
    planner, system = MeaningPlanner(), build_system_message("few-shot", limits=LAMPILOT_LIMITS)
    contexts: dict[str, Any] = {}
    found: list[Planned] = []
    for sample, number in samples:
        scenario = sample.scenario
        if scenario.id not in contexts:
            contexts[scenario.id] = context_adapter.validate_python(describe_scene(scenario)["context"])
        words = Instruction(sample.commands[number % len(sample.commands)])
        made = asyncio.run(planner.plan(PlanRequest(words, contexts[scenario.id], system, limits=LAMPILOT_LIMITS)))
        if isinstance(made.policy, Program):
            job = RolloutJob(f"{scenario.id}_c{number}", scenario, "", asdict(made), LAMPILOT_LIMITS)
            found.append(Planned(sample, job, made.policy.source))
    return found


def as_many(samples: list[Sample], most: int) -> list[tuple[Sample, int]]:
    """(sample, command) pairs with ten commands a sample, as the whole benchmark has, up to `most`.

    Where there are too few samples, the same situations are set up again under other seeds (those in which the goal
    makes no sense are left out); where a sample has fewer than ten commands, some are said twice. Each pair is driven.
    """
    enough = list(samples)
    for turn in range(1, 100):
        if len(enough) * COMMANDS >= most:
            break
        for sample in samples:
            old = sample.scenario
            fresh = replace(old, id=f"{old.id}r{turn}", seed=old.seed + turn * _FRESH)
            if _makes_sense(fresh):
                enough.append(replace(sample, scenario=fresh))
            if len(enough) * COMMANDS >= most:
                break
    return [(sample, number) for sample in enough for number in range(COMMANDS)][:most]


def _makes_sense(scenario: Scenario) -> bool:
    world = HighwayWorld()
    try:
        world.reset(scenario)
        LampilotReferee(world, scenario)
    except ChauffeurError:
        return False
    return not world.ended
