"""The scripted expert on LaMPilot's roads: how well it drives, what limits it, and what rehearsal adds.

    python benchmarks/lampilot_expert.py --data DbLv1 [--fresh 1,2,3] [--rehearse 32] [--time 40]

Every sample is driven once with the one program of its family, in the sandbox, and scored by LaMPilot's own ruler;
samples count as often as their task has commands. Then:

* what is lost to 100 points, by cause, and what becomes of the score without the timing of passes (the numbers
  `PERIODS` and `AHEAD` at 0), which is the part of the expert that serves the metric alone;
* with --fresh, the same on scenes with other traffic (seed + k x 1,000,003 for each k). Scenes that start in a crash,
  have no vehicle where the task needs one, or ask for a gap that cannot be are counted and left out: the autopilot
  never comes closer than 6 m and a headway of 0.01 s, centre to centre, so that a wanted gap of less than 4.9 m lies
  out of reach even of the upper end of its band (130 %);
* with --rehearse K, the best of K variants as rehearsal chooses it, for every K up to this one, and so a bound of what
  a search for each sample finds; with --time N, how long a choice takes, one wish at a time, in one process and in two.
"""

from __future__ import annotations

import argparse
import os
import statistics
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

from chauffeur.bench.kernel.report import markdown
from chauffeur.bench.lampilot.expert import EXPERT, expert_program, variants
from chauffeur.bench.lampilot.rehearsal import best_of
from chauffeur.bench.lampilot.rehearse import rehearsed
from chauffeur.concept import Scenario, ScenarioError
from chauffeur.driving.episode import drive_program
from chauffeur.driving.judge.goals import DistanceGoal, make_goal
from chauffeur.driving.judge.lampilot import LampilotReferee
from chauffeur.driving.judge.metrics import ORIGIN, driving_score, points
from chauffeur.programs import UNHURRIED, Sandbox
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.dblv1 import load_dataset

STRIDE = 1_000_003
"""From one set of fresh seeds to the next."""
NEAREST_M = 4.9
MAX_S = 1000.0
KS = (1, 2, 4, 8, 16, 32, 64)
NO_TIMING = {"PERIODS": 0.0, "AHEAD": 0.0}

Row = dict[str, Any]


@dataclass(frozen=True)
class Job:
    """A scene to be driven; its family of tasks, and how many items it stands for."""

    scenario: Scenario
    family: str
    items: int


@cache
def sandbox() -> Sandbox:
    return Sandbox(UNHURRIED)


def drive(scenario: Scenario, source: str) -> Row:
    world = HighwayWorld()
    world.reset(scenario)
    referee = LampilotReferee(world, scenario)
    episode = drive_program(world, source, referee, MAX_S, record=False, sandbox=sandbox())
    row = {"success": episode.success, "steps": episode.ticks, "signals": referee.signals().as_row()}
    return row | points(row, ORIGIN.id) | {"detail": episode.causes.detail}


def spoilt(scenario: Scenario) -> str:
    """Why a scene cannot be judged, empty when it can."""
    world = HighwayWorld()
    start = world.reset(scenario)
    if start.ego.crashed or start.off_road or start.ended:
        return "start in a crash"
    try:
        goal = make_goal(world.perception(), scenario)
    except ScenarioError:
        return "have no vehicle where the task needs one"
    if isinstance(goal, DistanceGoal) and goal.target_m < NEAREST_M:
        return f"want a gap below {NEAREST_M} m"
    return ""


def expert(job: Job, changed: dict[str, float] | None = None) -> Row:
    row = drive(job.scenario, expert_program(job.scenario.goal, changed))
    return row | {"family": job.family, "items": job.items, "id": job.scenario.id, "seed": job.scenario.seed}


def fresh(job: Job) -> Row:
    why = spoilt(job.scenario)
    if why:
        return {"left_out": why}
    row = expert(job)
    # Two cars that overlap at the start are found out by the first steps, whoever drives.
    return {"left_out": "start in a crash"} if row["collision"] and row["steps"] <= 2 else row


def best_of_variants(job: Job, count: int) -> Row:
    """What rehearsal chooses among the first k variants, for each k, and how the choice of all of them drives."""
    scenario = job.scenario
    sources = variants(scenario.goal, count, 0)
    world = HighwayWorld()
    world.reset(scenario)
    choice = rehearsed(world, scenario, sources, sandbox=sandbox())
    # A try is only broken off when an earlier one is better, so that the best of the first k is known for every k.
    worths: dict[int, float] = {}
    for k in [k for k in KS if k <= count]:
        best = best_of({i: rollout for i, rollout in choice.rollouts.items() if i < k})
        assert best is not None
        worths[k] = choice.rollouts[best].worth
    row = drive(scenario, choice.source)
    return row | {"family": job.family, "items": job.items, "id": scenario.id, "worths": worths}


def weighted(rows: Sequence[Row], key: str) -> float:
    total = sum(row["items"] for row in rows)
    return sum(row[key] * row["items"] for row in rows) / total if total else 0.0


def figures(rows: Sequence[Row]) -> dict[str, float]:
    """Columns of the published table, in % and points, over items."""
    done = [row for row in rows if row["success"]]
    completion = weighted(rows, "success")
    collision = weighted(rows, "collision")
    return {
        "collision": 100 * collision,
        "completion": 100 * completion,
        **{name: weighted(done, name) for name in ("ttc", "speed_variance", "time_efficiency")},
        "score": driving_score(completion, weighted(done, "score"), collision),
        "seconds": weighted(done, "steps") / 10,
    }


def grouped(rows: Iterable[Row]) -> list[tuple[str, list[Row]]]:
    groups: dict[str, list[Row]] = defaultdict(list)
    for row in rows:
        groups[row["family"]].append(row)
    return [*groups.items(), ("all", [row for group in groups.values() for row in group])]


def table(rows: Sequence[Row]) -> str:
    header = ("Family", "Scenes", "collision", "completion", "TTC", "SV", "TE", "driving score", "s")
    lines: list[list[str]] = []
    for family, group in grouped(rows):
        f = figures(group)
        names = ("collision", "completion", "ttc", "speed_variance", "time_efficiency", "score", "seconds")
        lines.append([family, str(len(group)), *(f"{f[name]:.1f}" for name in names)])
    return markdown(header, lines)


def losses(rows: Sequence[Row], without: Sequence[Row]) -> str:
    """Points to 100 by cause, and what the timing of passes is worth."""
    plain = dict(grouped(without))
    lines: list[list[str]] = []
    for family, group in grouped(rows):
        f = figures(group)
        share = f["completion"] / 100
        parts = (
            100 * (1 - share),
            share * 0.5 * (100 - f["ttc"]),
            share * 0.3 * (100 - f["speed_variance"]),
            share * 0.2 * (100 - f["time_efficiency"]),
            f["score"] - figures(plain[family])["score"],
        )
        lines.append([family, *(f"{part:.1f}" for part in parts)])
    return markdown(("Family", "not completed", "TTC", "SV", "TE", "gained by timing passes"), lines)


def rehearsal_table(rows: Sequence[Row]) -> str:
    ks = list(rows[0]["worths"])
    lines: list[list[str]] = []
    for family, group in grouped(rows):
        total = sum(row["items"] for row in group)
        lines.append([family, *(f"{sum(row['worths'][k] * row['items'] for row in group) / total:.1f}" for k in ks)])
    return markdown(("Family", *(f"K={k}" for k in ks)), lines)


def times(jobs: Sequence[Job], count: int) -> str:
    """Seconds a choice takes; each scene's reset and the workers' start are paid before."""
    found: list[float] = []
    for job in jobs:
        sources = variants(job.scenario.goal, count, 0)
        lasted = 0.0
        for _ in range(2):
            begin = time.perf_counter()
            world = HighwayWorld()
            world.reset(job.scenario)
            rehearsed(world, job.scenario, sources, sandbox=sandbox())
            lasted = time.perf_counter() - begin
        found.append(lasted)
    found.sort()
    nine = found[min(len(found) - 1, round(0.95 * len(found)))]
    line = ["one process", str(len(found)), f"{statistics.median(found):.2f}", f"{nine:.2f}", f"{found[-1]:.2f}"]
    return markdown((f"K={count}", "Wishes", "median s", "95 % s", "longest s"), [line])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--fresh", default="", help="sets of fresh seeds, e.g. 1,2,3")
    parser.add_argument("--rehearse", type=int, default=0, help="variants to choose among")
    parser.add_argument("--time", type=int, default=0, help="scenes to time a choice on")
    parser.add_argument("--step", type=int, default=1, help="only every so manieth scene")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    arguments = parser.parse_args()
    dev = [
        Job(sample, "".join(c for c in task.name if not c.isdigit()), len(task.commands))
        for task in load_dataset(arguments.data).tasks
        for sample in task.samples
    ][:: arguments.step]
    with ProcessPoolExecutor(arguments.workers) as pool:

        def run(work: Callable[[Job], Row], jobs: Sequence[Job]) -> list[Row]:
            return list(pool.map(work, jobs, chunksize=2))

        rows = run(expert, dev)
        print(f"## {EXPERT} on {arguments.data.name}: {len(rows)} scenes, {sum(r['items'] for r in rows)} items\n")
        print(table(rows))
        print("\nPoints lost to 100, by cause\n")
        print(losses(rows, run(partial(expert, changed=NO_TIMING), dev)))
        for row in rows:
            if not row["success"] or row["collision"]:
                print(f"\nnot completed: {row['id']} {row['detail']}", end="")
        sets = [int(k) for k in arguments.fresh.split(",") if k]
        if sets:
            moved = [
                replace(j, scenario=replace(j.scenario, seed=j.scenario.seed + k * STRIDE)) for k in sets for j in dev
            ]
            found = run(fresh, moved)
            left_out = Counter(row["left_out"] for row in found if "left_out" in row)
            valid = [row for row in found if "left_out" not in row]
            print(f"\n\n## On fresh seeds (sets {arguments.fresh}): {len(valid)} valid scenes\n")
            print(table(valid))
            print("\nLeft out: " + ", ".join(f"{count} that {why}" for why, count in left_out.items()) + ".")
            for row in valid:
                if not row["success"] or row["collision"]:
                    print(f"not completed: {row['id']} seed {row['seed']} {row['detail']}")
        if arguments.rehearse:
            chosen = run(partial(best_of_variants, count=arguments.rehearse), dev)
            print(f"\n## Rehearsal: the best of K variants (foresees the simulator's traffic)\n\n{table(chosen)}\n")
            print(rehearsal_table(chosen))
    if arguments.time:
        some = dev[:: max(1, len(dev) // arguments.time)]
        print(f"\n## Time of a choice\n\n{times(some, arguments.rehearse or 32)}")


if __name__ == "__main__":
    main()
