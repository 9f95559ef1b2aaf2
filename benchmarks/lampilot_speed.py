"""How fast LaMPilot-Bench is driven: LaMPilot's own code, highway-env and our worlds, on one machine in one run.

    python benchmarks/lampilot_speed.py [--peer DIR] [--data DIR]

`--peer DIR` is a checkout of LaMPilot (public repository PurdueDigitalTwin/LaMPilot); `--peer-python` an interpreter
with what it needs, where this one lacks it (lampilot_peer.py). Without it, plain highway-env, set up as LaMPilot sets
it up, stands in: same physics, its history and its unread observation included, but neither its gym wrappers nor its
second reset. `--data DIR` holds DbLv1 task files; without it the checkout's own are taken, or the built-in scenes.

Both sides drive the same samples with the same driver or the same programs, in turns, and every episode must end alike
(steps, success, collision); episodes that do not are counted. Figures are CPU seconds unless they say wall, our
sandbox's worker processes included; medians of `--repeats`; compilation and imports are not in them, and shown apart.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import platform
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

from chauffeur.bench.kernel.engine import LocalEngine
from chauffeur.bench.kernel.report import markdown
from chauffeur.bench.kernel.store import Row, RowStore
from chauffeur.bench.lampilot import rollout
from chauffeur.bench.lampilot.rollout import RolloutJob, roll_out
from chauffeur.worlds.highway import HighwayWorld
from highway_oracle import ReferenceWorld
from speed.scenes import COMMANDS, Sample, as_many, load_samples, plan
from speed.shares import CORE, HARNESS, RESET, SANDBOX, Shares
from speed.sides import Clock, Drive, Peer, PlainWorld, cpu_seconds, drive_idm, drive_job, forget, median, on_one_core

STEPPING_GOAL = 150.0
PROGRAMS_GOAL = 50.0
WHOLE_EPISODES = 4900
WHOLE_GOAL_S = 120.0
ALL = "all"
WRITING = f"{HARNESS}: rows to disk"
COMPILED, QUICKER = "compiled", "reference (quicker highway-env)"
_CROWDS = (10, 30, 50, 70, 90)
_CROWD_STEPS = 100

Drives = dict[str, list[tuple[str, Drive]]]
"""By side: (road, drive) of every sample."""


@dataclass(frozen=True, slots=True)
class Bench:
    """What is measured, and with what.

    Attributes:
        samples: Everything there is.
        mix: Every n-th of it.
        peer: LaMPilot's own code, if there is a checkout.
        repeats, slow_repeats: How often we and the slow sides drive the same episode.
        steps: Longest episode of the IDM baseline.
        most: Episodes of the largest run.
    """

    samples: list[Sample]
    mix: list[Sample]
    peer: Peer | None
    repeats: int
    slow_repeats: int
    steps: int
    most: int

    @property
    def origin(self) -> str:
        """Who the others are compared with."""
        return "plain highway-env" if self.peer is None else "LaMPilot's own code"


def start_up(bench: Bench) -> None:
    """What a process pays before its first step."""
    del bench
    text = (
        "import time; cpu, wall = time.process_time(), time.perf_counter()\n"
        "from chauffeur.concept import Command\n"
        "from chauffeur.worlds.highway import HighwayWorld\n"
        "from chauffeur.worlds.highway.scenarios import BUILT_IN\n"
        "read = time.process_time() - cpu, time.perf_counter() - wall\n"
        "for scenario in BUILT_IN:\n"
        "    world = HighwayWorld(); world.reset(scenario)\n"
        "    world.driver().command(world.driver().settle(world.driver().initial_setpoints()))\n"
        "    world.step(Command(0.0, 0.0)); world.observe()\n"
        "print(*read, time.process_time() - cpu, time.perf_counter() - wall)\n"
    )
    lines = []
    with tempfile.TemporaryDirectory() as cache:
        for name in ("first ever on a machine: kernels are compiled", "later: kernels come from the cache"):
            done = subprocess.run(
                [sys.executable, "-c", text],
                env={**os.environ, "XDG_CACHE_HOME": cache},
                capture_output=True,
                text=True,
                check=True,
            )
            lines.append([name, *(f"{float(value):.1f}" for value in done.stdout.split())])
    table("Start of a process", ("", "imports, CPU s", "wall s", "until the first steps, CPU s", "wall s"), lines)


def stepping(bench: Bench) -> None:
    """The IDM baseline with the referee (the origin: its evaluator) looking at every step."""
    slow: dict[str, Callable[[Sample], Drive]] = {
        bench.origin: lambda sample: drive_idm(PlainWorld(), sample.scenario, bench.steps)
    }
    if bench.peer is not None:
        peer = bench.peer
        slow = {bench.origin: lambda sample: peer.drive(sample.scenario, steps=bench.steps)}
    slow[QUICKER] = lambda sample: drive_idm(ReferenceWorld(), sample.scenario, bench.steps)
    drives: Drives = {name: [] for name in (*slow, COMPILED)}
    for sample in bench.mix:
        fast = []
        for name, drive in slow.items():
            drives[name].append((sample.road, median([drive(sample) for _ in range(bench.slow_repeats)])))
            # ours in turns with the others, so that a busy machine is busy for all
            fast += [drive_idm(HighwayWorld(), sample.scenario, bench.steps) for _ in range(bench.repeats)]
        drives[COMPILED].append((sample.road, median(fast)))
    lines = []
    for road in _roads(drives[COMPILED]):
        ours = _of(road, drives[COMPILED])
        rates = {name: _rate(_of(road, found)) for name, found in drives.items()}
        lines.append(
            [
                road,
                str(len(ours)),
                f"{statistics.fmean(drive.vehicles for drive in ours):.0f}",
                str(sum(drive.steps for drive in ours)),
                *(f"{rate:,.0f}" for rate in rates.values()),
                f"{rates[COMPILED] / rates[bench.origin]:,.0f}",
            ]
        )
    header = ("Road", "episodes", "vehicles, mean", "steps", *(f"{name}, steps/CPU s" for name in drives), "ratio")
    table(f"Stepping: IDM ego, referee each step, at most {bench.steps / 10:.0f} s an episode", header, lines)
    _alike(drives, bench.origin)
    _goal("stepping over the mix", float(lines[-1][-1].replace(",", "")), STEPPING_GOAL)


def programs(bench: Bench) -> None:
    """Whole runs with the same programs: executed by LaMPilot's `exec`, and in our sandbox."""
    planned = plan([(sample, 0) for sample in bench.mix])
    drives: Drives = {COMPILED: []}
    if bench.peer is not None:
        drives[bench.origin] = []

    def work() -> None:
        for one in planned:
            road, scenario = one.sample.road, one.sample.scenario
            if bench.peer is not None:
                text = one.for_the_peer
                slow = [bench.peer.drive(scenario, program=text) for _ in range(bench.slow_repeats)]
                drives[bench.origin].append((road, median(slow)))
            drives[COMPILED].append((road, median([drive_job(one.job) for _ in range(bench.repeats)])))

    drive_job(planned[0].job)  # opens the sandbox
    on_one_core(work)
    lines = []
    for road in _roads(drives[COMPILED]):
        ours = _of(road, drives[COMPILED])
        steps = sum(drive.steps for drive in ours) / len(ours)
        reset, run = _mean(ours, "reset"), _mean(ours, "run")
        cells = [f"{steps:.0f}", f"{reset * 1e3:.1f}", f"{run * 1e3:.1f}", f"{run / steps * 1e6:.0f}"]
        if bench.peer is not None:
            theirs = _of(road, drives[bench.origin])
            cells += [f"{_mean(theirs, 'reset') * 1e3:.0f}", f"{_mean(theirs, 'run') * 1e3:,.0f}"]
            for clock, sharing in ((0, 1), (0, COMMANDS), (1, COMMANDS)):
                whole = _mean(theirs, "reset", clock) + _mean(theirs, "run", clock)
                cells.append(f"{whole / (_mean(ours, 'reset', clock) / sharing + _mean(ours, 'run', clock)):.0f}")
        lines.append([road, str(len(ours)), *cells])
    header = ["Road", "episodes", "steps an episode", "reset, ms", "run, ms", "run, us/step"]
    if bench.peer is not None:
        header += ["LaMPilot's reset, ms", "its run, ms", "ratio, each its own reset"]
        header += [f"ratio, {COMMANDS} commands share ours", "the same by wall time"]
    table("Whole runs of the on-board planner's programs, CPU time an episode", header, lines)
    if bench.peer is None:
        print("(There is no checkout to compare with: highway-env has no runtime for programs.)")
        return
    _alike(drives, bench.origin)
    _goal("whole runs, each with its own reset", float(lines[-1][-3]), PROGRAMS_GOAL)


def vehicles(bench: Bench) -> None:
    """Cost of a step by the number of vehicles, on the multi-lane highway."""
    base = next(s for s in [*bench.samples, *load_samples(None)] if s.road == "dt-highway-v0").scenario
    ego = {"speed": 25, "start_lane_index": ["a", "b", 1], "start_position": [105, 0]}
    road = {"type": "dt-highway-v0", "num_lanes": 5, "stage_length": [2000], "vehicles_density": 2.0}
    lines = []
    for count in _CROWDS:
        scenario = replace(base, id=f"crowd-{count}", config={**road, "vehicles_count": count, "ego_vehicle": ego})
        if bench.peer is None:
            slow = drive_idm(PlainWorld(), scenario, _CROWD_STEPS)
        else:
            slow = bench.peer.drive(scenario, steps=_CROWD_STEPS)
        quicker = drive_idm(ReferenceWorld(), scenario, _CROWD_STEPS)
        fast = median([drive_idm(HighwayWorld(), scenario, _CROWD_STEPS) for _ in range(3 * bench.repeats)])
        kernel = statistics.median(_kernel_us(scenario, fast.steps) for _ in range(3 * bench.repeats))
        lines.append(
            [
                str(count),
                str(fast.steps),
                *(f"{drive.run[0] / drive.steps * 1e6:,.0f}" for drive in (slow, quicker, fast)),
                f"{kernel:.0f}",
                f"{slow.run[0] / fast.run[0]:.0f}",
            ]
        )
    header = (
        "Other vehicles",
        "steps",
        f"{bench.origin}, us/step",
        f"{QUICKER}, us/step",
        "compiled, us/step",
        "its core alone",
        "ratio",
    )
    table("Cost of a step by the number of vehicles: five lanes, IDM ego, referee each step", header, lines)


def _kernel_us(scenario: Any, steps: int) -> float:
    world = HighwayWorld()
    world.reset(scenario)
    core = world._road()  # the core without anything around it
    begun = time.process_time()
    for _ in range(steps):
        core.advance(0.0, 0.0)
    return (time.process_time() - begun) / steps * 1e6


def episodes(bench: Bench) -> None:
    """Whole runs on all cores by their number: processes, sandboxes and resets included, planning not."""
    begun = time.process_time()
    planned = plan(as_many(bench.samples, bench.most))
    planning = time.process_time() - begun
    jobs = [one.job for one in planned]
    lines = []
    for count in sorted({n for n in (1, 10, 100, 1000) if n < len(jobs)} | {len(jobs)}):
        rows, wall, cpu = _run(jobs[:count])
        driven = [row for row in rows if not row["infra_failed"]]
        samples = len({row["sample"] for row in rows})
        lines.append(
            [
                f"{count:,}",
                f"{samples:,}",
                f"{sum(row['steps'] for row in rows):,}",
                f"{wall:.1f}",
                f"{cpu:.1f}",
                f"{cpu / count * 1e3:.0f}",
                f"{count / wall:.1f}",
                str(len(rows) - len(driven)),
            ]
        )
    header = ("Episodes", "samples", "steps", "wall s", "CPU s", "CPU ms/episode", "episodes/s", "not driven")
    cores = os.cpu_count() or 1
    title = f"Runs of sandboxed programs by their number, on {cores} cores, the start of the processes included"
    table(title, header, lines)
    print(f"Planning {len(jobs):,} items beforehand took {planning:.1f} CPU s, descriptions of the scenes included.")
    if len(jobs) == WHOLE_EPISODES:
        wall, load = float(lines[-1][3]), os.getloadavg()[0]
        met = "met" if wall < WHOLE_GOAL_S else "missed"
        print(
            f"Goal, {WHOLE_EPISODES:,} episodes: under {WHOLE_GOAL_S:.0f} s on 2 idle cores: {wall:.0f} s, {met}",
            end="",
        )
        print(f" on {cores} cores under load {load:.1f}.")


def _run(jobs: list[RolloutJob]) -> tuple[list[Row], float, float]:
    async def work() -> list[Row]:
        engine = LocalEngine(os.cpu_count() or 1)
        await engine.start()
        try:
            return await asyncio.gather(*(engine.run(roll_out, job, near=job.scenario.id) for job in jobs))
        finally:
            engine.close(now=False)

    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    wall = time.perf_counter()
    own = time.process_time()
    rows = asyncio.run(work())
    wall, own = time.perf_counter() - wall, time.process_time() - own
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return rows, wall, own + after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def shares(bench: Bench) -> None:
    """Wall time of a typical run by what it goes into: each sample of the mix under ten commands."""
    planned = plan(as_many(bench.mix, COMMANDS * len(bench.mix)))
    rows: list[Row] = []
    bare: list[float] = []
    wall: list[Shares] = []
    cpu: list[Shares] = []

    def drive_all() -> list[Row]:
        forget()
        return [rollout.roll_out(one.job) for one in planned]

    def work() -> None:
        for _ in range(max(2, bench.repeats // 2)):
            begun = time.perf_counter()
            rows[:] = drive_all()
            bare.append(time.perf_counter() - begun)
            wall.append(Shares())
            with wall[-1].watching():
                drive_all()
            cpu.append(Shares(time.process_time))
            begun, begun_here = cpu_seconds(), time.process_time()
            with cpu[-1].watching():
                drive_all()
            cpu[-1].seconds[SANDBOX] += cpu_seconds() - begun - (time.process_time() - begun_here)  # its workers

    rollout.roll_out(planned[0].job)  # opens the sandbox
    on_one_core(work)
    seconds, worked = (
        {label: statistics.median(one.seconds[label] for one in found) for label in found[0].seconds}
        for found in (wall, cpu)
    )
    timers = sum(seconds.values()) / statistics.median(bare) - 1.0
    seconds[WRITING], worked[WRITING] = _writing(rows)
    for one in (seconds, worked):
        one[HARNESS] = sum(value for label, value in one.items() if label.startswith(HARNESS))
    main = (SANDBOX, CORE, RESET, HARNESS)
    rest = sorted((label for label in seconds if label not in main), key=seconds.__getitem__, reverse=True)
    seconds[ALL], worked[ALL] = (sum(one[label] for label in main) for one in (seconds, worked))
    steps = sum(row["steps"] for row in rows)
    lines = [
        [
            label,
            f"{seconds[label] / seconds[ALL]:.1%}",
            *(f"{one[label] / steps * 1e6:.1f}" for one in (seconds, worked)),
            *(f"{one[label] / len(rows) * 1e3:.2f}" for one in (seconds, worked)),
        ]
        for label in (*main, ALL, *rest)
    ]
    title = f"Where the time goes: {len(rows)} episodes of {len(bench.mix)} samples, {steps:,} steps, one process"
    header = ("", "share of wall", "wall us/step", "CPU us/step", "wall ms/episode", "CPU ms/episode")
    table(title, header, lines)
    print(f"The timers slowed the run by {timers:.0%}. {COMMANDS} commands share a sample's reset.")


def _writing(rows: list[Row]) -> tuple[float, float]:
    with tempfile.TemporaryDirectory() as folder:
        store = RowStore(Path(folder) / "rollout.jsonl", "key")
        clock = Clock()
        for row in rows:
            store.append(row)
        cpu, wall = clock.read()
        store.close()
    return wall, cpu


def table(title: str, header: Iterable[str], lines: list[list[str]]) -> None:
    """A Markdown table under its title."""
    print(f"\n### {title}\n\n{markdown(header, lines)}", flush=True)


def _roads(found: list[tuple[str, Drive]]) -> list[str]:
    return [*dict.fromkeys(road for road, _ in found), ALL]


def _of(road: str, found: list[tuple[str, Drive]]) -> list[Drive]:
    return [drive for where, drive in found if road in (where, ALL)]


def _rate(drives: list[Drive]) -> float:
    return sum(drive.steps for drive in drives) / sum(drive.run[0] for drive in drives)


def _mean(drives: list[Drive], part: str, clock: int = 0) -> float:
    return statistics.fmean(getattr(drive, part)[clock] for drive in drives)


def _alike(drives: Drives, origin: str) -> None:
    for name, found in drives.items():
        if name != origin:
            same = sum(mine.end == other.end for (_, mine), (_, other) in zip(found, drives[origin], strict=True))
            print(f"{same} of {len(found)} episodes end as by {origin} (steps, success, collision): {name}.")


def _goal(what: str, ratio: float, goal: float) -> None:
    print(f"Goal, {what}: at least {goal:.0f} times: {ratio:,.0f}, {'met' if ratio >= goal else 'missed'}.")


PARTS: dict[str, Callable[[Bench], None]] = {
    "start": start_up,
    "stepping": stepping,
    "programs": programs,
    "vehicles": vehicles,
    "episodes": episodes,
    "shares": shares,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--peer", type=Path, help="checkout of LaMPilot")
    parser.add_argument("--peer-python", default=sys.executable, help="interpreter that can import it")
    parser.add_argument("--data", type=Path, help="folder of DbLv1 task files, or the one that holds DbLv1-dev")
    parser.add_argument("--every", type=int, default=14, help="the mix is every n-th sample")
    parser.add_argument("--repeats", type=int, default=5, help="how often our side drives an episode")
    parser.add_argument("--slow-repeats", type=int, default=1, help="how often the slow sides do")
    parser.add_argument("--seconds", type=float, default=30.0, help="longest simulated episode of the IDM baseline")
    parser.add_argument("--most", type=int, default=WHOLE_EPISODES, help="episodes of the largest run")
    parser.add_argument("--parts", default=",".join(PARTS), help="what to measure")
    chosen = parser.parse_args()
    data = chosen.data
    if data is None and chosen.peer is not None:
        data = chosen.peer / "projects" / "lampilot" / "configs" / "DbLv1"
    samples = load_samples(data)
    peer = None if chosen.peer is None else Peer(chosen.peer, chosen.peer_python)
    bench = Bench(
        samples,
        samples[:: chosen.every] if data is not None else samples,
        peer,
        chosen.repeats,
        chosen.slow_repeats,
        round(chosen.seconds * 10),
        chosen.most,
    )
    print(f"{_processor()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f} at the start; ", end="")
    names = ("chauffeur", "numpy", "numba", "highway-env", "pydantic-monty")
    print(", ".join(f"{name} {version(name)}" for name in names), f"Python {platform.python_version()}", sep=", ")
    print(f"{len(bench.mix)} samples of {len(samples)}; ours {bench.repeats} times, others {bench.slow_repeats}.")
    drive_idm(HighwayWorld(), bench.mix[0].scenario, 10)  # kernels are loaded, nothing of it is counted
    if peer is not None:
        peer.drive(bench.mix[0].scenario, steps=1)
    for part in chosen.parts.split(","):
        PARTS[part](bench)
    if peer is not None:
        peer.close()
    print(f"\nLoad {os.getloadavg()[0]:.1f} at the end.")


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


if __name__ == "__main__":
    main()
