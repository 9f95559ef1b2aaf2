"""Roads and traffic for each kind of scene: DbLv1 `env` mappings.

Ranges follow LaMPilot's own samples, widened where its samples are few. What is wished on a road is drawn once its
traffic has been looked at (`wish_sampler`, `beyond`); `kinds` says which road belongs to which kind.
"""

from __future__ import annotations

from typing import Any

import numpy as np

Generator = np.random.Generator
Env = dict[str, Any]


def whole(rng: Generator, low: int, high: int) -> int:
    """A whole number from `low` to `high`, both included."""
    return int(rng.integers(low, high + 1))


def _merge(rng: Generator, count: tuple[int, int], density: tuple[float, float], lane: int) -> Env:
    return {
        "type": "ramp-merge-v0",
        "vehicles_count": whole(rng, *count),
        "vehicles_density": round(float(rng.uniform(*density)), 3),
        "stage_length": [500, 80, 80, 2000],
        "ego_vehicle": {
            "speed": 25,
            "start_lane_index": ["c", "d", lane],
            "start_position": [whole(rng, 90, 160), 0],
        },
    }


def dense(rng: Generator, density: tuple[float, float] = (0.35, 0.9)) -> Env:
    """Dense enough that there is a lead vehicle."""
    env = _merge(rng, (0, 0), density, 1)
    # A car takes about 43 m of road at density 1, and the ego enters some 700 m down the road.
    least = round(26 * float(env["vehicles_density"]))
    return env | {"vehicles_count": whole(rng, max(14, least), 78)}


def near_lead(rng: Generator) -> Env:
    """So dense that the lead vehicle is near."""
    return dense(rng, (0.5, 0.9))


def cruising(rng: Generator) -> Env:
    """Thin traffic mostly, dense now and then."""
    return _merge(rng, (10, 40), (0.1, 0.3) if rng.random() < 0.6 else (0.3, 0.85), 1)


def right_lane(rng: Generator, lane: int = 1) -> Env:
    """Two lanes, the ego in the right one."""
    return _merge(rng, (30, 80), (0.1, 0.9), lane)


def left_lane(rng: Generator) -> Env:
    """Two lanes, the ego in the left one."""
    return right_lane(rng, 0)


def right_lane_behind_lead(rng: Generator, lane: int = 1) -> Env:
    """Two lanes, the ego in the right one behind a vehicle, with room beside."""
    env = dense(rng, (0.2, 0.8))
    env["ego_vehicle"] |= {"speed": whole(rng, 25, 40), "start_lane_index": ["c", "d", lane]}
    return env


def left_lane_behind_lead(rng: Generator) -> Env:
    """The same with the ego in the left lane."""
    return right_lane_behind_lead(rng, 0)


def shoulder(rng: Generator, lanes: tuple[int, int] = (3, 6)) -> Env:
    """A highway with an emergency lane on the right."""
    num = whole(rng, *lanes)
    return {
        "type": "dt-highway-v0",
        "vehicles_count": whole(rng, 10, 90),
        "num_lanes": num,
        "vehicles_density": round(float(rng.uniform(0.1, 0.8)), 3),
        "stage_length": [2000],
        "ego_vehicle": {
            "speed": 25,
            "start_lane_index": ["a", "b", whole(rng, max(0, num - 4), num - 2)],
            "start_position": [whole(rng, 90, 160), 0],
        },
    }


def shoulder_behind_traffic(rng: Generator) -> Env:
    """At least two lanes to the left of the shoulder, the ego not in the leftmost."""
    env = shoulder(rng, (3, 5))
    env["vehicles_count"] = whole(rng, 30, 90)
    env["vehicles_density"] = round(float(rng.uniform(0.5, 1.2)), 3)
    env["ego_vehicle"]["start_lane_index"][2] = whole(rng, 1, env["num_lanes"] - 2)
    return env


def middle_lane(rng: Generator) -> Env:
    """Lanes on both sides of the ego, and no shoulder next to it."""
    env = shoulder(rng, (4, 6))
    env["ego_vehicle"]["start_lane_index"][2] = whole(rng, 1, env["num_lanes"] - 3)
    return env


def crossing(rng: Generator) -> Env:
    """The four-way crossing, with traffic from both sides."""
    env: Env = {
        "type": "dt-intersection-v0",
        "num_vehicles_right": whole(rng, 1, 8),
        "num_vehicles_left": whole(rng, 1, 8),
    }
    if rng.random() < 0.3:
        for side in ("left", "right"):
            env[f"spawn_probability_{side}"] = round(float(rng.uniform(0.3, 1.0)), 2)
    if rng.random() < 0.3:
        for side in ("left", "right"):
            env[f"position_deviation_{side}"] = round(float(rng.uniform(0.1, 2.0)), 2)
            env[f"speed_deviation_{side}"] = round(float(rng.uniform(0.2, 1.0)), 2)
    return env


def any_road(rng: Generator) -> Env:
    """One of the three roads."""
    return (dense, shoulder, crossing)[whole(rng, 0, 2)](rng)


def edge_lane(rng: Generator) -> Env:
    """Either lane of the two-lane highway: beyond one side of the ego there is none."""
    return _merge(rng, (14, 70), (0.1, 0.9), whole(rng, 0, 1))
