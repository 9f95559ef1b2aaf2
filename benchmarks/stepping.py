"""Our stepping of LaMPilot's roads against the plain highway-env package, same scenes, same run.

    python benchmarks/stepping.py

The plain side is highway-env's own road, lane and vehicle classes under the same world; the results of both are equal
to the bit (tests/worlds/test_traffic.py). No observation is computed on either side.
"""

from __future__ import annotations

import time
from unittest.mock import patch

from highway_env.road.lane import StraightLane
from highway_env.road.regulation import RegulatedRoad
from highway_env.road.road import Road, RoadNetwork
from highway_env.vehicle.dynamics import BicycleVehicle

from chauffeur.bench.lampilot.report import markdown
from chauffeur.concept import Scenario
from chauffeur.worlds.highway import HighwayWorld, roads
from chauffeur.worlds.highway.scenarios import BUILT_IN

STEPS = 150


class PlainNetwork(RoadNetwork):
    def freeze(self) -> None:
        pass


class PlainRoad(Road):
    def forget_instant(self) -> None:
        pass


class PlainRegulatedRoad(RegulatedRoad):
    def forget_instant(self) -> None:
        pass


class PlainDynamicEgo(BicycleVehicle):
    MAX_SPEED = 15.0


PLAIN = {
    "AxisLane": StraightLane,
    "FastNetwork": PlainNetwork,
    "FastRoad": PlainRoad,
    "FastRegulatedRoad": PlainRegulatedRoad,
    "DynamicEgo": PlainDynamicEgo,
}


def cpu_seconds(scenario: Scenario) -> tuple[float, int]:
    """CPU time of STEPS steps after the reset, and the number of vehicles."""
    world = HighwayWorld()
    world.reset(scenario)
    driver = world.driver()
    wishes = driver.initial_wishes()
    start = time.process_time()
    for _ in range(STEPS):
        wishes = driver.settle(wishes)
        world.step(driver.command(wishes))
    return time.process_time() - start, len(world.scene.road.vehicles)


def main() -> None:
    lines = []
    for scenario in BUILT_IN:
        if scenario.id not in ("overtake", "following", "emergency-lane", "intersection"):
            continue
        ours = min(cpu_seconds(scenario)[0] for _ in range(3))
        with patch.multiple(roads, **PLAIN):
            plain, vehicles = min(cpu_seconds(scenario) for _ in range(3))
        rates = [f"{STEPS / plain:.0f}", f"{STEPS / ours:.0f}", f"{plain / ours:.1f}"]
        lines.append([scenario.id, str(vehicles), *rates])
    header = ("Scene", "Vehicles", "plain highway-env, steps/CPU s", "ours, steps/CPU s", "ratio")
    print(markdown(header, lines))


if __name__ == "__main__":
    main()
