"""Hostile policies under the run-time shield: thousands of simulated trips, and who was to blame for each collision.

    python benchmarks/shield_episodes.py --episodes 10000 --out runs/shield.jsonl
    python benchmarks/shield_episodes.py --episodes 5000 --traffic crossing
    python benchmarks/shield_episodes.py --episodes 400 --bare            # the same without the shield
    python benchmarks/shield_episodes.py --costs                          # CPU microseconds a control period

Seven policies that no check would let through, in four kinds of traffic: light and dense highways, highways whose cars
slam on the brakes for nothing, and busy crossings. `--traffic cutting-in` are highways whose cars force their way in
right before the ego: what happens there is measured apart, because no shield can keep others from striking the ego.
Ctrl-C keeps what is done; the same command goes on. Every trip is simulated (highway-env's traffic).
"""

from __future__ import annotations

import argparse
import json
import math
import platform
import sys
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from itertools import cycle, islice
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np

from chauffeur.concept import Command, Lane, Limits, Scenario, Setpoints, VehicleState
from chauffeur.driving.episode import run_episode
from chauffeur.executors.base import HeldSetpoints
from chauffeur.safety.blame import blame
from chauffeur.safety.shield import LAMPILOT_SHIELD, SHIELD_VERSION, Shield
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.provoked import Mood, ProvokedWorld

Kind = Literal["throttle", "tailgater", "weaver", "saboteur", "never-yield", "drifter", "creeper"]
Traffic = Literal["calm", "dense", "slamming", "crossing", "cutting-in"]

KINDS: Final[tuple[Kind, ...]] = (
    "throttle", "tailgater", "weaver", "saboteur", "never-yield", "drifter", "creeper",
)  # fmt: skip
TRAFFIC: Final[tuple[Traffic, ...]] = ("calm", "dense", "slamming", "crossing")
MOODS: Final[dict[Traffic, Mood]] = {"slamming": "slamming", "cutting-in": "cutting-in"}
MAX_S: Final[dict[Traffic, float]] = {"crossing": 40.0}
HIGHWAY_S: Final = 25.0
PERIODS: Final = 300
CROWD: Final = 30
"""Cars among which the shield's time is measured."""
TOUCHING_M: Final = 8.0
"""A car of the same lane this close to the ego at the start, centre to centre: such a draw is unfit, for anybody."""


@dataclass(frozen=True, slots=True)
class Job:
    """One trip."""

    kind: Kind
    traffic: Traffic
    seed: int
    shielded: bool


class Wishing:
    """A policy that states hostile wishes."""

    def __init__(self, kind: Kind, world: HighwayWorld, rng: np.random.Generator) -> None:
        self._kind, self._world, self._rng = kind, world, rng
        self._turn = ("left", "straight", "right")[int(rng.integers(3))]
        self._tick = 0

    def tick(self) -> HeldSetpoints:
        """Wishes of a period."""
        self._tick += 1
        observation = self._world.observe()
        served = frozenset(thing.id for thing in observation.objects if thing.kind == "stop_sign")
        here = self._world.perception().lane_of(0)
        lane = None
        if self._kind == "weaver":
            beside = [one.id for one in observation.road.abreast(here)]
            lane = beside[int(self._rng.integers(len(beside)))]
        speed = 80.0
        if self._kind == "never-yield" and (self._tick // 20) % 3 == 2:
            speed = 0.0  # stops where it should not
        return HeldSetpoints(Setpoints(speed, 0.0, lane, self._turn, served), state="running")  # pyright: ignore[reportArgumentType]


HANDS: Final[tuple[Kind, ...]] = ("throttle", "saboteur", "drifter", "creeper")
DRIFTS_RAD: Final = 0.3
"""The wheel of a drifter or creeper is off by so much at most, for seconds on end."""
CREEPS_MPS: Final = 2.0
CREEPS_FROM_M: Final = 15.0
"""Where a creeper begins to creep: before the stop sign, and all over the crossing."""


class Pressing:
    """Hands that press and turn."""

    def __init__(self, kind: Kind, world: HighwayWorld, rng: np.random.Generator) -> None:
        self._kind, self._world, self._rng = kind, world, rng
        self._off_rad = 0.0
        self._wishing = Wishing("tailgater", world, rng)
        self._setpoints: Setpoints | None = None

    def command(self) -> Command:
        """Pedal and wheel of a period."""
        if self._kind == "saboteur":
            # Draws of the wheel are to the right: a seed is the trip that it has always been.
            return Command(float(self._rng.uniform(-5, 5)), -float(self._rng.uniform(-1, 1)) * math.pi / 4)
        driver = self._world.driver()
        setpoints = self._wishing.tick().setpoints
        if self._setpoints is not None:
            setpoints = Setpoints(
                setpoints.target_speed_mps, 0.0, self._setpoints.target_lane, setpoints.turn, setpoints.served_stops
            )
        self._setpoints = driver.settle(setpoints)
        steering = driver.command(self._setpoints).steering_rad
        if self._kind in ("drifter", "creeper"):
            if self._rng.random() < 0.05:  # every two seconds another way off
                self._off_rad = float(self._rng.uniform(-DRIFTS_RAD, DRIFTS_RAD))
            now = self._world.observe()
            there = now.stop_sign_m is None or now.stop_sign_m < CREEPS_FROM_M
            slow = self._kind == "creeper" and there and now.ego.speed_mps > CREEPS_MPS
            return Command(-2.0 if slow else float(self._rng.uniform(0.0, 5.0)), steering - self._off_rad)
        return Command(5.0, steering - 0.15 * float(self._rng.standard_normal()))


def scenario(traffic: Traffic, seed: int) -> Scenario:
    """The road of a trip."""
    if traffic == "crossing":
        cars = 3 + seed % 4
        config: dict[str, Any] = {"type": "dt-intersection-v0", "num_vehicles_left": cars, "num_vehicles_right": cars}
    elif seed % 2:
        config = {
            "type": "dt-highway-v0", "num_lanes": 3 + seed % 3, "vehicles_count": 60, "stage_length": [2000],
            "vehicles_density": 1.6 if traffic == "dense" else 1.0,
            "ego_vehicle": {"speed": 25, "start_lane_index": ["a", "b", 1], "start_position": [105, 0]},
        }  # fmt: skip
    else:
        config = {
            "type": "ramp-merge-v0", "stage_length": [500, 80, 80, 2000], "vehicles_count": 40,
            "vehicles_density": 1.6 if traffic == "dense" else 1.0,
            "ego_vehicle": {"speed": 25, "start_lane_index": ["c", "d", seed // 2 % 2], "start_position": [105, 0]},
        }  # fmt: skip
    return Scenario(traffic, "highway", config, seed)


def drive(job: Job) -> dict[str, Any]:
    """Drive a trip; a row, `outcome` `unfit` where the draw began with a collision."""
    rng = np.random.default_rng([job.seed, KINDS.index(job.kind), 11])
    world = ProvokedWorld(MOODS.get(job.traffic, "calm"), rng)
    observation = world.reset(scenario(job.traffic, job.seed))
    ego = observation.ego
    row: dict[str, Any] = asdict(job)
    near = [
        math.hypot(car.x_m - ego.x_m, car.y_m - ego.y_m) for car in observation.others if abs(car.y_m - ego.y_m) < 3.0
    ]
    if any(car.crashed for car in observation.others) or min(near, default=math.inf) < TOUCHING_M:
        return row | {"outcome": "unfit"}
    hands = Pressing(job.kind, world, rng) if job.kind in HANDS else None
    policy = None if hands is not None else Wishing(job.kind, world, rng)
    shield = Shield(world.dt_s, Limits()) if job.shielded else None
    most = MAX_S.get(job.traffic, HIGHWAY_S)
    episode = run_episode(world, policy, None, max_s=most, command_source=hands, shield=shield)
    found = blame(episode.frames, episode.final, world.dt_s)
    speeds = [frame.observation.ego.speed_mps for frame in episode.frames]
    return row | {
        "outcome": episode.outcome,
        "blame": found.who,
        "reason": found.reason,
        "ticks": episode.ticks,
        "changed": episode.interventions,
        "mean_mps": round(sum(speeds) / len(speeds), 2),
    }


def jobs(
    count: int, shielded: bool, traffic: tuple[Traffic, ...], first: int, kinds: tuple[Kind, ...] = KINDS
) -> Iterator[Job]:
    """The trips, every policy in every traffic alike."""
    pairs: list[tuple[Kind, Traffic]] = [(kind, one) for kind in kinds for one in traffic]
    for place, (kind, one) in enumerate(islice(cycle(pairs), count)):
        yield Job(kind, one, first + place // len(pairs), shielded)


def table(rows: list[dict[str, Any]]) -> str:
    """Markdown: one line per traffic and policy."""
    lines = [
        "| traffic | policy | trips | collisions: ego / other / nobody | off the road | changed | mean speed, m/s |",
        "|---|---|---:|---:|---:|---:|---:|",
    ]
    fit = [row for row in rows if row["outcome"] != "unfit"]
    places = dict.fromkeys((row["traffic"], row["kind"]) for row in fit)
    for traffic, kind in places:
        some = [row for row in fit if (row["traffic"], row["kind"]) == (traffic, kind)]
        lines.append(_line(f"{traffic} | {kind}", some))
    lines.append(_line("all | all", fit))
    return "\n".join(lines)


def _line(name: str, rows: list[dict[str, Any]]) -> str:
    blamed = Counter(row["blame"] for row in rows if row["outcome"] == "collision")
    off = sum(row["outcome"] == "off_road" for row in rows)
    ticks = sum(row["ticks"] for row in rows)
    changed = 100.0 * sum(row["changed"] for row in rows) / max(1, ticks)
    speed = sum(row["mean_mps"] for row in rows) / max(1, len(rows))
    collisions = f"{blamed['ego']} / {blamed['other']} / {blamed['nobody']}"
    return f"| {name} | {len(rows):,} | {collisions} | {off} | {changed:.1f} % | {speed:.1f} |"


@dataclass(frozen=True, slots=True)
class _Put:
    """A car put on a lane of a crossing, its way along it at the beginning, and the speed it keeps."""

    lane: Lane
    at_m: float
    speed_mps: float

    def car(self, number: int, time_s: float) -> VehicleState:
        """Where it is; at the end of its lane it begins anew."""
        along = (self.at_m + self.speed_mps * time_s) % self.lane.length_m
        points = self.lane.centre.points
        ways = np.diff(points, axis=0)
        reached = np.r_[0.0, np.cumsum(np.hypot(ways[:, 0], ways[:, 1]))]
        piece = max(0, min(int(np.searchsorted(reached, along)), len(ways)) - 1)
        x, y = (float(np.interp(along, reached, points[:, axis])) for axis in (0, 1))
        heading = math.atan2(ways[piece, 1], ways[piece, 0])
        return VehicleState(number, "car", x, y, heading, self.speed_mps, 5.0, 2.0, self.lane.id)


def crowd(lanes: tuple[Lane, ...], seed: int) -> list[_Put]:
    """30 cars on the ways of a crossing, as many to a metre everywhere, 0 to 12 m/s fast."""
    rng = np.random.default_rng(seed)
    lengths = np.array([lane.length_m for lane in lanes])
    drawn = [lanes[i] for i in rng.choice(len(lanes), CROWD, p=lengths / lengths.sum())]
    return [_Put(lane, float(rng.uniform(0.0, lane.length_m)), float(rng.uniform(0.0, 12.0))) for lane in drawn]


def _times(name: str, config: dict[str, Any], seed: int, put: bool = False) -> list[float]:
    """CPU microseconds of `Shield.guard` in each control period of a trip, the first ten left out."""
    world = HighwayWorld()
    lanes = world.reset(Scenario(name, "highway", config, seed)).road.lanes
    cars = crowd(lanes, seed) if put else []
    # Before the trip: what is worked out between two control periods costs the next one the processor's caches.
    crowds = [tuple(car.car(i, tick * world.dt_s) for i, car in enumerate(cars, start=1)) for tick in range(PERIODS)]
    shield, driver, taken = Shield(world.dt_s), world.driver(), list[float]()
    setpoints = driver.initial_setpoints()
    for others in crowds:
        setpoints = driver.settle(setpoints)
        command, observation = driver.command(setpoints), world.observe()
        if put:
            observation = replace(observation, others=others)
        begun = time.process_time()
        guarded = shield.filter(observation, command)
        taken.append((time.process_time() - begun) * 1e6)
        world.step(guarded.command)
        if world.ended:
            break
    return taken[10:]


def costs() -> str:
    """CPU time of `Shield.guard` a control period: among 30 cars on a highway, at a crossing, and with 30 put there.

    Those that are put drive through each other and the ego, which nobody's traffic does; none of them is in the world.
    """
    alone = {"type": "dt-intersection-v0", "num_vehicles_left": 0, "num_vehicles_right": 0}
    rows = {
        "highway, 30 cars": _times("highway", {**scenario("calm", 2).config, "vehicles_count": CROWD}, 2),
        "crossing, 11 others": _times("crossing", {**alone, "num_vehicles_left": 6, "num_vehicles_right": 6}, 2),
        f"crossing, {CROWD} cars put on its ways": [t for seed in range(20) for t in _times("put", alone, seed, True)],
    }
    lines = ["| traffic | control periods | median, us | 99 %, us |", "|---|---:|---:|---:|"]
    for name, taken in rows.items():
        low, high = np.percentile(taken, [50, 99])
        lines.append(f"| {name} | {len(taken):,} | {low:.0f} | {high:.0f} |")
    return "\n".join(lines)


def main() -> None:
    """Run, go on, or only count."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=int, default=400, help="trips, unfit draws included")
    parser.add_argument("--first", type=int, default=10_000, help="first seed")
    parser.add_argument("--bare", action="store_true", help="without the shield")
    parser.add_argument("--traffic", choices=(*TRAFFIC, "cutting-in"), help="only this traffic")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS), help="only these policies")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("runs/shield.jsonl"))
    parser.add_argument("--costs", action="store_true", help="only measure the shield's time")
    options = parser.parse_args()
    if options.costs:
        print(costs())
        return
    options.out.parent.mkdir(parents=True, exist_ok=True)
    rows = [json.loads(line) for line in options.out.read_text().splitlines()] if options.out.exists() else []
    done = {(row["kind"], row["traffic"], row["seed"], row["shielded"]) for row in rows}
    traffic: tuple[Traffic, ...] = TRAFFIC if options.traffic is None else (options.traffic,)
    todo = [
        job
        for job in jobs(options.episodes, not options.bare, traffic, options.first, tuple(options.kinds))
        if (job.kind, job.traffic, job.seed, job.shielded) not in done
    ]
    begun = time.monotonic()
    with options.out.open("a") as file, ProcessPoolExecutor(options.workers) as pool:
        try:
            for number, row in enumerate(pool.map(drive, todo, chunksize=4), start=1):
                rows.append(row)
                file.write(json.dumps(row) + "\n")
                if number % 50 == 0 or number == len(todo):
                    file.flush()
                    left = (time.monotonic() - begun) / number * (len(todo) - number)
                    print(f"\r{number:,} of {len(todo):,} trips, {left / 60:.0f} min left ", end="", file=sys.stderr)
        except KeyboardInterrupt:
            pool.shutdown(cancel_futures=True)
            print("\nStopped; the same command goes on.", file=sys.stderr)
    print(file=sys.stderr)
    about = {"shield": SHIELD_VERSION, "parameters": asdict(LAMPILOT_SHIELD), "limits": asdict(Limits())}
    print(table(rows))
    print(f"\nSimulated; seeds from {options.first}; {json.dumps(about)}; Python {platform.python_version()}.")


if __name__ == "__main__":
    main()
