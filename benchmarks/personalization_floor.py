"""How few simulated passengers could take over if every word were understood and nothing known of the person.

    python benchmarks/personalization_floor.py [--passengers 100] [--seed 1] [--workers 2]

For each scene of `chauffeur bench personalization`, parameters are driven on a grid of target speeds with the manoeuvre
that was meant (at level III also without it), and judged by every passenger on five equally likely days. The least
share of takeovers over the grid is what a planner of parameters can reach that sees the scene, knows the aim and has to
choose one speed for everybody. Simulated passengers in simulated drives.
"""

from __future__ import annotations

import argparse
import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from statistics import NormalDist, fmean
from typing import Final, Literal

import numpy as np

from chauffeur.bench.personalization.population import draw_passengers
from chauffeur.bench.personalization.ride import ride_policy, usual
from chauffeur.bench.personalization.sayings import LEVELS, Aim, Level
from chauffeur.bench.personalization.scenes import AIMS, GROUND_OF, Task, scenes_of
from chauffeur.bench.personalization.takeover import Mood, judge
from chauffeur.concept import Limits
from chauffeur.describe import describe
from chauffeur.driving.episode import make_world

TASKS: Final[tuple[Task, ...]] = ("overtake", "follow", "right_lane", "yield", "go", "park")
SHARES: Final = tuple(round(float(share), 2) for share in np.arange(0.6, 1.101, 0.05))
"""Target speeds, as shares of the limit. Far slower ones are another matter: whoever crawls is always held up."""
DAYS: Final = tuple(NormalDist().inv_cdf((day + 0.5) / 5) for day in range(5))
_LANE: Final[dict[Task, Literal[-1, 0, 1]]] = {"overtake": -1, "right_lane": 1}


@dataclass(frozen=True)
class Best:
    """The least that was found of a scene and an aim, and with which speed and lane."""

    task: Task
    level: Level
    takeovers: float
    share: float
    lane: int


def least(job: tuple[Task, int, Aim, int, int]) -> list[Best]:
    """The best single choice for everybody at each level of directness."""
    task, index, aim, count, seed = job
    scene = scenes_of(task)[index]
    people = draw_passengers(count, seed)
    world = make_world(scene)
    limit = describe(world.reset(scene)).situation.speed_limit_mps
    lanes: list[Literal[-1, 0, 1]] = sorted({_LANE.get(task, 0), 0})
    place = aim.partition(".")[2]
    found: dict[Level, Best] = {}
    for lane in lanes:
        for share in SHARES:
            trace = ride_policy(usual(task, round(share * limit, 2), lane, place), task, scene, Limits())
            for level in LEVELS:
                if level != "III" and lane != _LANE.get(task, 0):
                    continue
                takes = fmean(
                    judge(trace, one, Mood(task, aim, level, 1.0 + one.noise * day)).takes_over
                    for one in people
                    for day in DAYS
                )
                if level not in found or takes < found[level].takeovers:
                    found[level] = Best(task, level, takes, share, lane)
    return list(found.values())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--passengers", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    given = parser.parse_args()
    jobs = [
        (task, index, aim, given.passengers, given.seed)
        for task in TASKS
        for index in range(len(scenes_of(task)))
        for aim in AIMS[task]
    ]
    with ProcessPoolExecutor(given.workers, mp_context=get_context("spawn")) as pool:
        best = [one for part in pool.map(least, jobs) for one in part]
    print("| | I | II | III | speed, share of the limit |\n|---|---:|---:|---:|---|")
    for task in TASKS:
        _row(task, [one for one in best if one.task == task])
    for ground in ("highway", "intersection", "parking"):
        _row(f"**{ground}**", [one for one in best if GROUND_OF[one.task] == ground])


def _row(name: str, best: list[Best]) -> None:
    cells = [f"{100.0 * fmean(one.takeovers for one in best if one.level == level):.1f} %" for level in LEVELS]
    shares = [one.share for one in best]
    print(f"| {name} | {' | '.join(cells)} | {min(shares):.2f} to {max(shares):.2f} |", flush=True)


if __name__ == "__main__":
    main()
