"""What the sandbox costs per control period, against the same program as a bare Python generator in the same run.

Also drives every hostile program of the tests and reports the slowest tick. Run: python benchmarks/program_tick.py
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "programs"))

from hostile import HOSTILE
from reference import BareRunner
from straight_road import StraightRoad

from chauffeur.programs import UNHURRIED, ProgramExecutor, Sandbox
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.scenarios import BUILT_IN

PROGRAM = """
def keep_gap_and_look_left():
    ego = get_ego_vehicle()
    while True:
        lane = get_lane_of(ego)
        front = detect_front_vehicle_in(lane)
        speed = get_speed_of(ego)
        if front is not None:
            set_desired_time_headway(25 / max(speed, 1.0))
        left = get_left_lane(ego)
        free = is_safe_enter(left)
        yield autopilot()
"""
"""Seven driving-API calls and one yield in each control period."""

GOAL_US = 200.0
CORE = min(os.sched_getaffinity(0))
ONE_CORE = "sandbox, host and worker on one core"
"""As the process that runs programs is set up in a drive."""


def _world() -> HighwayWorld:
    world = HighwayWorld()
    world.reset(next(scenario for scenario in BUILT_IN if scenario.id == "following"))
    return world


def _figures(samples_us: list[float]) -> dict[str, float]:
    ordered = sorted(samples_us)
    return {"p50_us": statistics.median(ordered), "p99_us": ordered[int(0.99 * len(ordered))]}


def _in_turns(ticks: dict[str, Callable[[], Any]], one_core: frozenset[str], count: int) -> dict[str, dict[str, float]]:
    """Time all variants in turns of 100 ticks, so that a busy machine is busy for all of them."""
    samples: dict[str, list[float]] = {name: [] for name in ticks}
    everywhere = os.sched_getaffinity(0)
    for _ in range(count // 100):
        for name, tick in ticks.items():
            os.sched_setaffinity(0, {CORE} if name in one_core else everywhere)
            for _ in range(10):
                tick()
            for _ in range(100):
                before = time.perf_counter()
                tick()
                samples[name].append((time.perf_counter() - before) * 1e6)
    os.sched_setaffinity(0, everywhere)
    return {name: _figures(values) for name, values in samples.items()}


def _calls(world: HighwayWorld) -> int:
    with ProgramExecutor(budget=UNHURRIED) as executor:
        executor.start(PROGRAM, world)
        executor.tick()
        return len(executor.tick().calls)


def _overhead(count: int) -> dict[str, Any]:
    world = _world()
    everywhere = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {CORE})
    with Sandbox(UNHURRIED) as pinned:
        os.sched_setaffinity(0, everywhere)
        with Sandbox(UNHURRIED, pin=False) as free:
            executors = [ProgramExecutor(sandbox=sandbox) for sandbox in (pinned, pinned, free)]
            for executor in executors:
                executor.start(PROGRAM, world)
            same, near, far = (executor.tick for executor in executors)
            ticks = {"bare generator": BareRunner(PROGRAM, world).tick, ONE_CORE: same}
            ticks |= {"sandbox, worker pinned (default)": near, "sandbox, worker anywhere": far}
            rows = _in_turns(ticks, frozenset({"bare generator", ONE_CORE}), count)
    bare = rows["bare generator"]
    for row in rows.values():
        row["over_bare_p50_us"] = row["p50_us"] - bare["p50_us"]
        row["over_bare_p99_us"] = row["p99_us"] - bare["p99_us"]
    return {"calls_per_tick": _calls(world), "ticks": count, "rows": rows}


def _start_times(count: int) -> dict[str, float]:
    world = _world()
    samples: list[float] = []
    with ProgramExecutor(budget=UNHURRIED) as executor:
        for _ in range(count):
            before = time.perf_counter()
            executor.start(PROGRAM, world)
            executor.tick()
            samples.append((time.perf_counter() - before) * 1e6)
    return _figures(samples)


def _hostile() -> dict[str, Any]:
    slowest: list[tuple[float, str]] = []
    with Sandbox() as sandbox:
        for hostile in HOSTILE:
            with ProgramExecutor(sandbox=sandbox, gate=False) as executor:
                executor.start(hostile.source, StraightRoad())
                for _ in range(4):
                    before = time.perf_counter()
                    state = executor.tick().state
                    slowest.append((time.perf_counter() - before, hostile.name))
                    if state != "running":
                        break
    slowest.sort(reverse=True)
    return {
        "programs": len(HOSTILE),
        "slowest": [{"name": name, "tick_ms": seconds * 1e3} for seconds, name in slowest[:5]],
    }


def main() -> None:
    """Measure, print a table, then the same as JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ticks", type=int, default=3000)
    ticks = parser.parse_args().ticks
    overhead = _overhead(ticks)
    report = {
        "machine": {
            "cpu": platform.processor() or platform.machine(),
            "cores": os.cpu_count(),
            "load": os.getloadavg(),
        },
        "python": platform.python_version(),
        "overhead": overhead,
        "start_and_first_tick": _start_times(200),
        "hostile": _hostile(),
    }
    print(f"{'variant':38}{'p50 us':>9}{'p99 us':>9}{'over p50':>10}{'over p99':>10}")
    for name, row in overhead["rows"].items():
        print(
            f"{name:38}{row['p50_us']:9.1f}{row['p99_us']:9.1f}"
            f"{row['over_bare_p50_us']:10.1f}{row['over_bare_p99_us']:10.1f}"
        )
    met = "met" if overhead["rows"][ONE_CORE]["over_bare_p50_us"] <= GOAL_US else "missed"
    print(f"goal: at most {GOAL_US:.0f} us per tick over bare Python, p50: {met}")
    print(f"slowest tick of {len(HOSTILE)} hostile programs: {report['hostile']['slowest'][0]['tick_ms']:.1f} ms")
    print(json.dumps(report))


if __name__ == "__main__":
    main()
