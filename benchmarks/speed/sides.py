"""Who drives: LaMPilot's own code in a process of its own, highway-env under our scenes, and our worlds."""

from __future__ import annotations

import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from chauffeur.bench.lampilot.rollout import RolloutJob, roll_out
from chauffeur.concept import Command, Observation, Scenario
from chauffeur.driving.episode import run_episode
from chauffeur.driving.judge.lampilot import LampilotReferee
from chauffeur.programs.gate import _judged
from chauffeur.programs.rewrite import _prepared
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway import world as compiled
from highway_oracle import ReferenceWorld
from highway_oracle.plain import plain_highway_env

_PEER_SCRIPT = Path(__file__).resolve().parents[1] / "lampilot_peer.py"
_PROCESS_CLOCK = 2
"""Of another process's clock id on Linux: CPU time as the scheduler counts it, threads that ended included."""


def cpu_seconds() -> float:
    """CPU time of this process, of its children that ended and of those that run (the sandbox's workers)."""
    ended = resource.getrusage(resource.RUSAGE_CHILDREN)
    total = time.process_time() + ended.ru_utime + ended.ru_stime
    for thread in Path("/proc/self/task").glob("*/children"):
        for pid in thread.read_text().split():
            total += time.clock_gettime((~int(pid) << 3) | _PROCESS_CLOCK)
    return total


class Clock:
    """CPU and wall seconds since it was made, the sandbox's workers included."""

    def __init__(self) -> None:
        self._cpu, self._wall = cpu_seconds(), time.perf_counter()

    def read(self) -> tuple[float, float]:
        """(CPU, wall)."""
        wall = time.perf_counter() - self._wall
        return cpu_seconds() - self._cpu, wall


@dataclass(frozen=True, slots=True)
class Drive:
    """One episode: (CPU, wall) seconds of set-up and drive, control periods, and how it ended."""

    reset: tuple[float, float]
    run: tuple[float, float]
    steps: int
    vehicles: int
    success: bool
    collision: bool

    @property
    def end(self) -> tuple[int, bool, bool]:
        """What must be the same whoever drives."""
        return self.steps, self.success, self.collision


def median(drives: list[Drive]) -> Drive:
    """The same episode driven several times, with the median of its times."""
    first = drives[0]
    assert all(drive.end == first.end for drive in drives), "the same episode ended in two ways"
    reset, run = (
        tuple(statistics.median(getattr(drive, part)[k] for drive in drives) for k in (0, 1))
        for part in ("reset", "run")
    )
    return Drive(reset, run, first.steps, first.vehicles, first.success, first.collision)


class Peer:
    """LaMPilot's own code, by benchmarks/lampilot_peer.py."""

    def __init__(self, folder: Path, python: str) -> None:
        """Start the process; `python` is an interpreter with what LaMPilot needs."""
        self._errors = tempfile.TemporaryFile("w+")  # noqa: SIM115 - closed with the process
        self._process = subprocess.Popen(
            [python, str(_PEER_SCRIPT), str(folder.resolve())],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            text=True,
        )

    def drive(self, scenario: Scenario, *, program: str = "", steps: int | None = None) -> Drive:
        """One episode, at most `steps` long, by its IDM or by a program's text."""
        sample = {"env": scenario.config, "eval": scenario.goal, "seed": scenario.seed}
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        try:
            self._process.stdin.write(json.dumps({"sample": sample, "program": program, "steps": steps}) + "\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            self._give_up()
        line = self._process.stdout.readline()
        if not line:
            self._give_up()
        answer = json.loads(line)
        return Drive(**{**answer, "reset": tuple(answer["reset"]), "run": tuple(answer["run"])})

    def _give_up(self) -> None:
        self._process.wait()
        self._errors.seek(0)
        sys.exit("LaMPilot's code cannot be driven:\n" + "".join(self._errors.readlines()[-15:]))

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait()
        self._errors.close()


class PlainWorld(ReferenceWorld):
    """highway-env as LaMPilot sets it up: its own classes, 30 states of history a vehicle, and the observation that a
    Gymnasium environment makes in every step, whoever reads it. Stands in for LaMPilot where there is no checkout."""

    def reset(self, scenario: Scenario, seed: int | None = None) -> Observation:
        """See ReferenceWorld."""
        from highway_env.envs.common.observation import KinematicObservation  # and pandas with it

        with plain_highway_env(record_history=True):
            observation = super().reset(scenario, seed)
        scene = self.scene
        options: dict[str, Any] = {}
        if scene.kind == "intersection":
            ranges = {"x": [-100, 100], "y": [-100, 100], "vx": [-20, 20], "vy": [-20, 20]}
            features = ["presence", "x", "y", "vx", "vy", "long_off", "lat_off", "ang_off"]
            options = {"features": features, "features_range": ranges, "vehicles_count": 10, "absolute": True}
        environment: Any = SimpleNamespace(road=scene.road, vehicle=scene.ego, PERCEPTION_DISTANCE=200.0)
        self._observation = KinematicObservation(environment, **options)
        return observation

    def step(self, command: Command) -> Command:
        """See ReferenceWorld."""
        applied = super().step(command)
        self._observation.observe()
        return applied


def drive_idm(world: HighwayWorld | ReferenceWorld, scenario: Scenario, steps: int | None) -> Drive:
    """An episode of the IDM baseline through the control loop of a drive, with the benchmark's referee."""
    forget()
    clock = Clock()
    world.reset(scenario)
    reset = clock.read()
    referee = LampilotReferee(world, scenario)
    clock = Clock()
    episode = run_episode(world, None, referee, max_s=1000.0 if steps is None else steps / 10, record=False)
    run = clock.read()
    vehicles = 1 + len(episode.final.others)
    return Drive(reset, run, episode.ticks, vehicles, referee.success, referee.collided)


def drive_job(job: RolloutJob) -> Drive:
    """An episode as a run of the benchmark drives it: checks, sandbox, control loop, row. `reset` is that of a sample
    that was not driven before; the drive itself starts from what that left. The program is read and judged anew."""
    forget()
    clock = Clock()
    world = HighwayWorld()
    observation = world.reset(job.scenario)
    reset = clock.read()
    clock = Clock()
    row = roll_out(job)
    run = clock.read()
    signals = row["signals"]
    if signals is None:
        sys.exit(f"{job.key} was not driven: {row['detail']}")
    collision = signals["crashed"] or signals["off_road"]
    return Drive(reset, run, row["steps"], 1 + len(observation.others), row["success"], collision)


def forget() -> None:
    """Drive as if for the first time: no start situation, no judged program is remembered."""
    compiled._starts.clear()
    _judged.cache_clear()
    _prepared.cache_clear()


def on_one_core(work: Callable[[], None]) -> None:
    """Do it on one core, as the processes of a run do: a program and its host take turns."""
    if not hasattr(os, "sched_setaffinity"):
        work()
        return
    everywhere = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(everywhere)})
    try:
        work()
    finally:
        os.sched_setaffinity(0, everywhere)
