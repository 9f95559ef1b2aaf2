"""A world in one file: a straight road of 600 m, a car ahead, and a driver that follows it.

    [project.entry-points."chauffeur.worlds"]
    one-lane = "one_lane:OneLane"

`chauffeur check world one_lane` says whether it keeps the contract.
"""

import math
from dataclasses import replace

from chauffeur.concept import (
    Capabilities,
    Command,
    Lane,
    Lead,
    Observation,
    RoadGraph,
    ScenarioError,
    VehicleState,
)
from chauffeur.geometry import Polyline
from chauffeur.worlds.over_graph import LaneDriver, ObservedPerception

LANE = Lane("road", Polyline.of([(0.0, 0.0), (600.0, 0.0)]), 4.0, 20.0)
ROAD = RoadGraph((LANE,))


class OneLane:
    engine = "one lane 1"
    dt_s = 0.1
    capabilities = Capabilities(roads=("highway",), policies=("program", "parameters"))

    def __init__(self):
        self.now, self.eyes = None, ObservedPerception(self.observe)
        self.hands = LaneDriver(self.observe, self.eyes)

    @property
    def ended(self):
        return self.observe().ended

    def perception(self):
        return self.eyes

    def driver(self):
        return self.hands

    def reset(self, scenario, seed=None):
        ego = VehicleState(0, "car", 10.0, 0.0, 0.0, 15.0, 5.0, 2.0, "road")
        ahead = replace(ego, id=1, x_m=50.0 + (scenario.seed if seed is None else seed) % 30, speed_mps=10.0)
        self.now = Observation(0.0, 0, "highway", ego, (ahead,), (), ROAD, None, None, False, False)
        self.step(Command(0.0, 0.0), 0.0)  # who is ahead
        return self.now

    def observe(self):
        if self.now is None:
            raise ScenarioError("The world has no scenario yet.", hint="Call reset(scenario) first.")
        return self.now

    def step(self, command, dt_s=0.1):
        if not math.isfinite(command.acceleration_mps2 + command.steering_rad):
            raise ValueError(f"A command must be finite numbers, not {command}.")
        applied = Command(max(-8.0, min(3.0, command.acceleration_mps2)), max(-0.5, min(0.5, command.steering_rad)))
        now, tick = self.observe(), self.observe().tick + (dt_s > 0.0)
        car, ego = now.others[0], now.ego
        speed = max(0.0, ego.speed_mps + applied.acceleration_mps2 * dt_s)
        heading = ego.heading_rad + speed * math.tan(applied.steering_rad) / 2.8 * dt_s
        x, y = ego.x_m + speed * math.cos(heading) * dt_s, ego.y_m + speed * math.sin(heading) * dt_s
        car = replace(car, x_m=car.x_m + car.speed_mps * dt_s)
        crashed, off = abs(car.x_m - x) < 5.0 and abs(car.y_m - y) < 2.0, abs(y) > 2.0
        ego = replace(ego, x_m=x, y_m=y, heading_rad=heading, speed_mps=speed, crashed=crashed)
        front = Lead(1, car.x_m - x, car.speed_mps) if car.x_m > x else None
        ended = crashed or off or x > 595.0
        self.now = Observation(tick * self.dt_s, tick, "highway", ego, (car,), (), ROAD, front, None, off, ended)
        return applied
