"""The three times to collision on highway-env's objects: the oracle of `core.signals`, written independently of it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from chauffeur.control import guard_zero
from highway_oracle.traffic import StopSign


def ttc_along(ego: Any, vehicles: list[Any]) -> float:
    """LaMPilot's: centre gap along the ego's lane over the closing speed, least over all vehicles, s; -1 for none.

    Lateral distance is not looked at, and a vehicle with exactly the ego's speed is skipped.
    """
    speed, heading, lane = float(ego.speed), float(ego.heading), ego.lane
    own_s = lane.local_coordinates(ego.position)[0]
    ttc = -1.0
    for other in vehicles:
        if other is ego or speed == other.speed:
            continue
        distance = lane.local_coordinates(other.position)[0] - own_s
        time = distance / guard_zero(speed - other.speed * math.cos(other.heading - heading))
        if time >= 0:
            ttc = min(ttc, time) if ttc > 0 else time
    return float(ttc)


def ttc_plane(ego: Any, vehicles: list[Any]) -> float:
    """Paper Eq. 1 and 2: least positive time to the closest approach of two centres, s; -1 for none."""
    times: list[float] = []
    for other in vehicles:
        relative = ego.velocity - other.velocity
        square = float(relative @ relative)
        if other is not ego and square >= 1e-12:
            times.append(-float((ego.position - other.position) @ relative) / square)
    return min((t for t in times if t > 0), default=-1.0)


def ttc_lane(ego: Any, entities: list[Any]) -> float:
    """Bumper to bumper with what shares the ego's lane or its width, s; -1 for none, 0 on contact."""
    lane = ego.lane
    own_s, own_r = lane.local_coordinates(ego.position)
    axis = np.array([np.cos(lane.heading_at(own_s)), np.sin(lane.heading_at(own_s))])
    times: list[float] = []
    for other in entities:
        if other is ego or isinstance(other, StopSign):
            continue
        s, r = lane.local_coordinates(other.position)
        overlaps = abs(r - own_r) < (ego.WIDTH + other.WIDTH) / 2
        if not (overlaps or other.lane_index == ego.lane_index) or not lane.on_lane(other.position, s, r, margin=1):
            continue
        free = abs(s - own_s) - (ego.LENGTH + other.LENGTH) / 2
        closing = float((ego.velocity - other.velocity) @ axis) * (1 if s > own_s else -1)
        if free <= 0:
            if overlaps:
                return 0.0
        elif closing > 1e-6:
            times.append(free / closing)
    return min(times, default=-1.0)
