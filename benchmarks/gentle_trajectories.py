"""Gentle trajectories, checked and then driven without a safety filter: what passes must end on the road, its own way.

    python benchmarks/gentle_trajectories.py --count 112 --first 70000

Four kinds, at places drawn in towns and on open roads without anybody else: the lane kept, a lane change to a side
whether or not there is a lane, a weave, a slow drift to a side. The judge is that of `hostile_steering`: it unites the
outlines of lanes as polygons and knows nothing of the check. Refused although all of the planned outline lies on lanes
of its own direction counts as refused wrongly. All simulated.
"""

from __future__ import annotations

import argparse
import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Final, Literal

import numpy as np
import shapely

from chauffeur.concept import Limits, Observation, Trajectory
from chauffeur.driving.actuate import actuate
from chauffeur.executors.trajectory import TrajectoryExecutor
from chauffeur.geometry import Polyline, Pose, joined, wrap_to_pi
from chauffeur.safety.trajectories import trajectory_faults
from hostile_steering import Judge, Place, rectangle, scenario, world_of

Kind = Literal["keep", "change", "weave", "drift"]
KINDS: Final[tuple[Kind, ...]] = ("keep", "change", "weave", "drift")
PERIOD_S: Final = 0.5
WAYPOINTS: Final = 12
SETTLES_S: Final = 5.0
"""Driven on for so long after the last waypoint, to a stand."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of one trajectory."""

    kind: Kind
    refused: str
    off_m: float
    oncoming_s: float
    fits: bool
    """Whether all of the planned outline lies on lanes of its own direction, by polygons."""


def planned(kind: Kind, seen: Observation, rng: np.random.Generator) -> Trajectory:
    """Waypoints beside the middle of the lane and those after it, at an even speed that comes gently from the ego's."""
    ego, road = seen.ego, seen.road
    lanes = [lane.centre for lane in road.ahead(ego.lane or road.lanes[0].id)]
    line: Polyline = joined(lanes[:8])
    here = line.nearest(ego.x_m, ego.y_m)
    wanted, speed = float(rng.uniform(3.0, 8.0)), ego.speed_mps
    side, size = float(rng.choice([-1.0, 1.0])), float(rng.uniform(0.2, 1.6))
    waves, pose, at = float(rng.uniform(15.0, 40.0)), Pose(ego.x_m, ego.y_m, ego.heading_rad), 0.0
    points: list[tuple[float, float]] = []
    for _ in range(WAYPOINTS):
        speed += max(-0.7, min(0.7, wanted - speed))
        at += speed * PERIOD_S
        share = min(1.0, at / 30.0)
        aside = {
            "keep": 0.0,
            "change": side * 3.5 * share**3 * (10.0 - 15.0 * share + 6.0 * share**2),
            "weave": size * math.sin(2.0 * math.pi * at / waves) * min(1.0, at / 8.0),
            "drift": side * size * 2.0 * min(1.0, at / 45.0) ** 2 * 1.5,
        }[kind]
        points.append(pose.sees(*line.at(here + at).place(0.0, aside)))
    return Trajectory(tuple(points), PERIOD_S)


def fits(judge: Judge, trajectory: Trajectory, seen: Observation) -> bool:
    """Whether the outline stays on asphalt and off oncoming lanes, straight from waypoint to waypoint."""
    ego = seen.ego
    start = Pose(ego.x_m, ego.y_m, ego.heading_rad)
    places = [start.place(*point) for point in ((0.0, 0.0), *trajectory.waypoints_m)]
    own = judge.own_ground(ego.heading_rad)
    for (ax, ay), (bx, by) in pairwise(places):
        if math.dist((ax, ay), (bx, by)) < 0.5:
            continue
        heading = math.atan2(by - ay, bx - ax)
        if abs(wrap_to_pi(heading - ego.heading_rad)) > math.radians(60.0):
            own = judge.own_ground(heading)
        for share in (0.0, 0.5, 1.0):
            body = replace(ego, x_m=ax + share * (bx - ax), y_m=ay + share * (by - ay), heading_rad=heading)
            if shapely.area(shapely.difference(rectangle(body), own)) > 0.05:
                return False
    return True


def outcome(kind: Kind, place: Place, seed: int) -> Outcome:
    """Plan, check, and drive where it passes."""
    rng = np.random.default_rng([seed, KINDS.index(kind), 3])
    world = world_of(place)
    scene = scenario(place, seed)
    if place == "town":
        scene = replace(scene, config={**scene.config, "vehicles": 0, "people": 0})
    else:
        street: dict[str, Any] = {**scene.config["street"], "things": ()}
        scene = replace(scene, config={**scene.config, "street": street, "weather": "sunny"})
    seen = world.reset(scene)
    try:
        judge = Judge(seen.road)
        trajectory = planned(kind, seen, rng)
        fitting = fits(judge, trajectory, seen)
        faults = [fault.reason for fault in trajectory_faults(trajectory, seen)]
        if faults:
            return Outcome(kind, " ".join(faults), 0.0, 0.0, fitting)
        executor = TrajectoryExecutor(world)
        executor.start(trajectory, seen, Limits())
        while not world.ended and seen.time_s < WAYPOINTS * PERIOD_S + SETTLES_S:
            actuate(world, seen, executor.step(seen), None, None)
            seen = world.observe()
            judge.look(seen, world.dt_s)
        return Outcome(kind, "", max(judge.off, float(seen.off_road)), judge.oncoming_s, fitting)
    finally:
        if place == "town":
            world.close()  # type: ignore[attr-defined]


def outcomes(count: int, first: int) -> Iterator[Outcome]:
    """Every kind alike, in towns and on open roads by turns."""
    for number in range(count):
        seed = first + number // (2 * len(KINDS))
        yield outcome(KINDS[number % len(KINDS)], ("town", "open-road")[number // len(KINDS) % 2], seed)  # type: ignore[arg-type]


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=112)
    parser.add_argument("--first", type=int, default=70_000, help="first seed")
    given = parser.parse_args()
    rows = list(outcomes(given.count, given.first))
    print(
        "| trajectory | planned | passed | of these off the road | in the oncoming lane | refused | refused wrongly |"
    )
    print("|---|---:|---:|---:|---:|---:|---:|")
    for kind in (*KINDS, "all"):
        own = [row for row in rows if kind in ("all", row.kind)]
        passed = [row for row in own if not row.refused]
        wrongly = [row for row in own if row.refused and row.fits]
        off, against = sum(row.off_m > 0.0 for row in passed), sum(row.oncoming_s > 0.0 for row in passed)
        print(
            f"| {kind} | {len(own)} | {len(passed)} | {off} | {against} | {len(own) - len(passed)} | {len(wrongly)} |"
        )
    for reason, times in Counter(row.refused for row in rows if row.refused and row.fits).items():
        print(f"refused wrongly, {times}: {reason}")


if __name__ == "__main__":
    main()
