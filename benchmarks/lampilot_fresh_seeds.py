"""A planner on LaMPilot's roads and tasks with traffic it was never tuned on.

    python benchmarks/lampilot_fresh_seeds.py --data DbLv1 [--planner onboard] [--offset 1000003] [--step 1]

Every sample's seed is moved by the offset and one of the task's commands is used. Scenes that cannot be judged (no
vehicle ahead) or start in a crash are counted and left out: the origin's seeds were picked by hand so that none does.
"""

from __future__ import annotations

import argparse
import asyncio
import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, replace
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from chauffeur.bench.kernel.pipeline import context_adapter, describe_scene
from chauffeur.bench.kernel.report import fill, markdown
from chauffeur.bench.lampilot.families import family_of
from chauffeur.bench.lampilot.report import FAMILY_TABLE
from chauffeur.bench.lampilot.rollout import RolloutJob, roll_out
from chauffeur.concept import LAMPILOT_LIMITS, Instruction, PlanRequest, Scenario, SystemMessage
from chauffeur.driving.judge.metrics import ORIGIN, points
from chauffeur.planners.base import Planner
from chauffeur.planners.registry import make_planner
from chauffeur.worlds.highway.dblv1 import load_dataset


@cache
def planner_of(spec: str) -> Planner:
    return make_planner(spec)


def drive(job: tuple[Scenario, str, str]) -> dict[str, Any]:
    scenario, command, spec = job
    described = describe_scene(scenario)
    if described["error"]:
        return {"sample": scenario.id, "outcome": "not_driven"}
    context = context_adapter.validate_python(described["context"])
    request = PlanRequest(Instruction(command), context, SystemMessage(""), limits=LAMPILOT_LIMITS)
    plan = asyncio.run(planner_of(spec).plan(request))
    return roll_out(RolloutJob("", scenario, "", asdict(plan), LAMPILOT_LIMITS))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--planner", default="onboard")
    parser.add_argument("--offset", type=int, default=1_000_003)
    parser.add_argument("--step", type=int, default=1)
    arguments = parser.parse_args()
    jobs = [
        (replace(sample, seed=sample.seed + arguments.offset), task.commands[i % len(task.commands)], arguments.planner)
        for task in load_dataset(arguments.data).tasks
        for i, sample in enumerate(task.samples)
    ][:: arguments.step]
    with ProcessPoolExecutor(os.cpu_count(), mp_context=get_context("spawn")) as pool:
        rows = list(pool.map(drive, jobs, chunksize=2))
    judged = [row | points(row, ORIGIN.id) for row in rows if row["outcome"] != "not_driven"]
    crashed = [row for row in judged if row["collision"] and row["steps"] <= 2]
    valid = [row | {"family": family_of(row["sample"])} for row in judged if row not in crashed]
    table = fill(FAMILY_TABLE, valid)
    print(markdown(table.header, table.cells))
    print(
        f"\nLeft out: {len(rows) - len(judged)} without the vehicle their task is about, "
        f"{len(crashed)} that start in a crash."
    )
    for row in valid:
        if not row["success"]:
            print(f"{row['sample']}: {row['outcome']} {row['detail'][:100]}")


if __name__ == "__main__":
    main()
