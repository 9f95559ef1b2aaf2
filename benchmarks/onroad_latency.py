"""From the words of a wish to every node of a ROS 1 vehicle having them: the on-board planner, real `rospy` nodes.

    python benchmarks/onroad_latency.py --wishes 30

Needs Debian's ROS 1 (`apt-get install ros-core python3-rospy ...`, see tests/worlds/ros_debian.py). `roscore` and two
`rospy` subscribers run on loopback, where `waypoint_replanner` and `pure_pursuit` would; no vehicle is there. Each wish
is a new one of a session with memory, and with an audit log or without. `delivered`: every receiver was handed the
newest message. The last row ends when a callback of the `rospy` node runs with it, by the clock of the same machine.
"""

from __future__ import annotations

import argparse
import asyncio
import statistics
import sys
import tempfile
import time
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "worlds"))

import ros_debian as debian
import ros_graph as ros

from chauffeur.concept import PersonId
from chauffeur.drive.onroad import OnRoadAnswer, VehicleSession, open_recorder
from chauffeur.memory.vault import VaultMemory
from chauffeur.planners.registry import make_planner
from chauffeur.worlds.ros.factory import open_vehicle
from chauffeur.worlds.ros.settings import read_settings

WISHES = ("Drive at {} km/h.", "No more than {} km/h, please.", "Set the speed to {} km/h.", "Please go {} km/h.")


def row(name: str, seconds: list[float]) -> str:
    """Median, 95 % and worst, in ms."""
    ordered = sorted(seconds)
    high = ordered[min(len(ordered) - 1, round(0.95 * len(ordered)))]
    return f"| {name} | {1e3 * statistics.median(ordered):.1f} | {1e3 * high:.1f} | {1e3 * ordered[-1]:.1f} |"


async def measure(folder: Path, wishes: int, *, audited: bool) -> list[tuple[OnRoadAnswer, float, float]]:
    """Answers, and for each the time from the wish to the node's callback, and this process's CPU time for it."""
    port = ros.free_port()
    file = folder / "vehicle.toml"
    file.write_text(
        f'interface = "ros1"\n[limits]\nmax_speed_mps = 15.0\n[ros1]\nmaster = "http://{ros.HOST}:{port}"\n'
    )
    settings, found = read_settings(file), []
    packages = debian.make_packages(folder / "ros")
    with (
        debian.roscore(packages, port),
        debian.rospy_node(debian.LISTENER, packages, port, "pure_pursuit", "follower"),
        debian.rospy_node(debian.LISTENER, packages, port, "waypoint_replanner", "replanner") as node,
        open_recorder(folder / "audit.jsonl", file, "ros1", dry_run=False) as books,
    ):
        car = open_vehicle(settings)
        try:
            async with VehicleSession(
                car,
                settings,
                make_planner("talk2drive"),
                person=PersonId("ana"),
                memory=VaultMemory(folder / "home"),
                books=books if audited else None,
            ) as road:
                await road.reached(20.0)
                await road.ask("Drive at 12 km/h.")  # opens the profile, and warms what is made once
                for number in range(wishes):
                    begun, spent, before = time.time(), time.process_time(), len(node.got)
                    answer = await road.ask(WISHES[number % len(WISHES)].format(15 + number))
                    spent = time.process_time() - spent
                    assert answer.status == "delivered", answer
                    await asyncio.to_thread(ros.eventually, lambda seen=before: len(node.got) > seen)
                    found.append((answer, node.got[-1]["came"] - begun, spent))
                    await asyncio.sleep(0.05)
        finally:
            car.close()
    return found


def main() -> None:
    """Measure, and print rows for benchmarks/RESULTS.md."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--wishes", type=int, default=30)
    options = parser.parse_args()
    if why := debian.missing():
        raise SystemExit(why)
    for audited in (True, False):
        with tempfile.TemporaryDirectory() as folder:
            found = asyncio.run(measure(Path(folder), options.wishes, audited=audited))
        print(f"{len(found)} wishes, {'with' if audited else 'without'} an audit log (ms)")
        print("| | median | 95 % | worst |\n|---|---|---|---|")
        print(row("context, memory, planning and checks", [one.plan_s for one, _, _ in found]))
        print(row("apply to delivered", [one.confirmed_s for one, _, _ in found if one.confirmed_s is not None]))
        print(row("wish to delivered", [one.took_s for one, _, _ in found]))
        print(row("wish to the rospy callback", [arrived for _, arrived, _ in found]))
        print(row("CPU of this process, memory's writing included", [spent for _, _, spent in found]))


if __name__ == "__main__":
    main()
