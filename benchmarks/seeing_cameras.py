"""Planning from pictures against planning from the world's own state, on LaMPilot's scenes.

    python benchmarks/seeing_cameras.py --data DbLv1-dev [--planner onboard] [--network FOLDER] [--offset 0]

One sample and one command of each task; turns are left out, as the network was taught none. Each is planned twice: from
the state, and from what BEV-LLM sees in six rendered pictures; checks, driving and judgement are the same. Told as
well: how often it was right about whether anybody is ahead within 60 m (one that it sees farther away counts as
nobody), and how far off its distance was.
"""

from __future__ import annotations

import argparse
import asyncio
from dataclasses import asdict, replace
from pathlib import Path
from statistics import median
from typing import Any

from chauffeur.bench.lampilot.rollout import RolloutJob, roll_out
from chauffeur.camera import make_renderer
from chauffeur.concept import LAMPILOT_LIMITS, Context, Instruction, PlanRequest, Scenario, SystemMessage
from chauffeur.describe.traffic import describe_with_traffic
from chauffeur.describe.vision import CameraDescriptor, SceneAnswers
from chauffeur.driving.episode import make_world
from chauffeur.driving.judge.metrics import ORIGIN, points
from chauffeur.models.bev_llm.seeing import BevLlmReader
from chauffeur.planners.base import Planner
from chauffeur.planners.registry import make_planner
from chauffeur.worlds.highway.dblv1 import load_dataset

TURNS = ("turn_left", "turn_right", "go_straight")
NEAR_M = 60.0


def driven(scenario: Scenario, command: str, context: Context, planner: Planner) -> dict[str, Any]:
    """The row of a scene, planned from a context."""
    request = PlanRequest(Instruction(command), context, SystemMessage(""), limits=LAMPILOT_LIMITS)
    plan = asyncio.run(planner.plan(request))
    row = roll_out(RolloutJob("", scenario, "", asdict(plan), LAMPILOT_LIMITS))
    return row | points(row, ORIGIN.id)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--planner", default="onboard")
    parser.add_argument("--network", type=Path, default=None)
    parser.add_argument("--offset", type=int, default=0)
    arguments = parser.parse_args()
    planner = make_planner(arguments.planner)
    told: list[SceneAnswers] = []
    looks = CameraDescriptor(BevLlmReader(arguments.network), make_renderer(), told=told.append)
    done = {"state": 0, "cameras": 0}
    ahead_right, off_m, scenes = 0, list[float](), 0
    for task in load_dataset(arguments.data).tasks:
        sample = task.samples[0]
        if any(turn in sample.id for turn in TURNS):
            continue
        scenario = replace(sample, seed=sample.seed + arguments.offset)
        world = make_world(scenario)
        observation = world.reset(scenario)
        contexts = {"state": describe_with_traffic(observation), "cameras": looks(observation)}
        answers, lead = told[-1], observation.front
        gap = None
        if lead is not None:
            other = next(one for one in observation.others if one.id == lead.vehicle)
            gap = ((other.x_m - observation.ego.x_m) ** 2 + (other.y_m - observation.ego.y_m) ** 2) ** 0.5
        near = gap is not None and gap <= NEAR_M
        said_near = answers.ahead is not None and answers.ahead_m <= NEAR_M
        scenes += 1
        ahead_right += said_near == near
        if near and gap is not None and said_near:
            off_m.append(abs(answers.ahead_m - gap))
        cells: list[str] = []
        for how, context in contexts.items():
            row = driven(scenario, task.commands[0], context, planner)
            done[how] += bool(row["success"])
            cells.append(f"{how}: {'done' if row['success'] else row['outcome']}")
        there = "nobody" if gap is None else f"{gap:.0f} m"
        said = "nobody" if answers.ahead is None else f"{answers.ahead} {answers.ahead_m:.0f} m"
        print(f"{sample.id}: {', '.join(cells)}; ahead {there}, seen {said}", flush=True)
    print(f"\nDone: {done['state']} of {scenes} from the state, {done['cameras']} from cameras.")
    print(f"Whether anybody is ahead within {NEAR_M:g} m: right in {ahead_right} of {scenes}.")
    if off_m:
        print(f"Distance, where both say so ({len(off_m)} scenes): {median(off_m):.1f} m off in the median.")


if __name__ == "__main__":
    main()
