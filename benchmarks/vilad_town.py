"""ViLaD's short drives in towns: drawn places, commands in held-out words, checks, filter, closed loop.

    python benchmarks/vilad_town.py --places 20 --split phrasing

Success is to stand within 2 m of where the command's ideal drive ends there (0.8 m across). Planner and network are
those that ship; they were trained on a proving ground's streets alone, and no town was seen in training. All simulated.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import time
from collections import Counter
from pathlib import Path
from statistics import median
from typing import Any, Final

import numpy as np

from chauffeur.concept import Instruction, Limits, PlanRequest, Scenario, Street, SystemMessage, Trajectory
from chauffeur.describe.dispatch import describe
from chauffeur.driving.episode import drive_policy
from chauffeur.driving.judge.choice import RED_S
from chauffeur.driving.planning import checked
from chauffeur.geometry import Pose
from chauffeur.models.vilad.driving_words import drive_command
from chauffeur.planners.vilad import ViladPlanner
from chauffeur.planners.vilad.driving import DriveGoal, goal, reference
from chauffeur.planners.vilad.driving_planning import trajectory_of
from chauffeur.worlds.town import TownWorld
from chauffeur.worlds.town.library import load
from chauffeur.worlds.track import StreetReferee, end_of

TOWNS: Final = ("Gridford", "Oldbridge", "Northport")
BEFORE_M: Final = (12.0, 45.0)
"""Places lie so far before the end of their lane, where there is something to be asked for."""
MAX_S: Final = 150.0


def place(town: str, number: int, seed: int) -> Scenario:
    """A lane with a junction at its end, and a place before it."""
    rng = np.random.default_rng([seed, TOWNS.index(town), number])
    road = load(town).road
    lanes = [one for one in road.lanes if one.kind == "driving" and not one.junction and one.length_m > 50.0]
    lane = lanes[int(rng.integers(len(lanes)))]
    start = [lane.id, round(lane.length_m - float(rng.uniform(*BEFORE_M)), 1)]
    config = {"town": town, "start": start, "vehicles": 25, "people": 20, "duration_s": MAX_S + 10.0}
    return Scenario(f"{town}-{number}", "town", config, int(rng.integers(1 << 30)))


def command(street: Street, split: Any, rng: np.random.Generator) -> tuple[str, dict[str, str]]:
    """Words of a split for something that can be done on a street, and what they ask for."""
    while True:
        said = drive_command(rng, split)
        if isinstance(goal(street, said.asked), DriveGoal):
            return said.text, dict(said.asked)


def driven(planner: ViladPlanner, scene: Scenario, split: Any, seed: int) -> dict[str, Any]:
    """One command at one place."""
    world = TownWorld()
    observation = world.reset(scene)
    row: dict[str, Any] = {"place": scene.id}
    try:
        context = describe(observation)
        if context.street is None:
            return row | {"outcome": "no street"}
        text, asked = command(context.street, split, np.random.default_rng([seed, scene.seed]))
        limits = Limits()
        begun = time.perf_counter()
        plan = asyncio.run(planner.plan(PlanRequest(Instruction(text), context, SystemMessage(""), limits=limits)))
        row |= {"wish": text, "latency_s": time.perf_counter() - begun}
        found = checked(plan, observation, limits)
        if found.refusal or not isinstance(plan.policy, Trajectory):
            return row | {"outcome": "declined" if plan.policy is None else "refused", "why": found.refusal}
        limit = context.situation.speed_limit_mps
        ideal = trajectory_of(context.street, reference(context.street, asked), limits, limit)
        ego = observation.ego
        end = end_of(ideal, Pose(ego.x_m, ego.y_m, ego.heading_rad))
        episode = drive_policy(world, plan.policy, StreetReferee(world, end, waits_s=RED_S), MAX_S, limits)
        outcome = episode.outcome if episode.outcome in ("collision", "off_road") else "wrong place"
        return row | {"outcome": "done" if episode.success else outcome, "interventions": episode.interventions}
    finally:
        world.close()


def main() -> None:
    """Drive all places and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--places", type=int, default=20, help="a town")
    parser.add_argument("--split", default="phrasing", help="seen, composition, phrasing or vocabulary")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", default="", help="JSON lines of all drives")
    given = parser.parse_args()
    planner, rows = ViladPlanner(), list[dict[str, Any]]()
    for town in TOWNS:
        own = [driven(planner, place(town, n, given.seed), given.split, given.seed) for n in range(given.places)]
        rows += own
        latencies = [row["latency_s"] for row in own if "latency_s" in row]
        print(town, dict(Counter(row["outcome"] for row in own)), f"{1e3 * median(latencies):.0f} ms in the median")
    print("all", dict(Counter(row["outcome"] for row in rows)), "of", len(rows))
    if given.out:
        Path(given.out).write_text("".join(json.dumps(row) + "\n" for row in rows), encoding="utf-8")


if __name__ == "__main__":
    main()
