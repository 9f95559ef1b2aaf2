"""Roads and traffic for each kind of scene: DbLv1 `env` mappings.

Ranges follow LaMPilot's own samples, widened where its samples are few. What is wished on a road is drawn once its
traffic has been looked at (`fitting`, `beyond`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

Generator = np.random.Generator
Env = dict[str, Any]


def draw_road(kind: str, rng: Generator) -> Env:
    """A DbLv1 `env` mapping for a kind. KeyError for an unknown kind."""
    for names, drawer in _ROADS:
        if kind.startswith(names):
            return drawer(kind, rng)
    raise KeyError(kind)


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


def _following(kind: str, rng: Generator) -> Env:
    """Dense enough that somebody drives ahead."""
    del kind
    return _dense(rng, (0.35, 0.9))


def _gap_wider(kind: str, rng: Generator) -> Env:
    """So dense that whoever is ahead is near."""
    del kind
    return _dense(rng, (0.5, 0.9))


def _dense(rng: Generator, density: tuple[float, float]) -> Env:
    env = _merge(rng, (0, 0), density, 1)
    # A car takes about 43 m of road at density 1, and the ego enters some 700 m down the road.
    least = round(26 * float(env["vehicles_density"]))
    return env | {"vehicles_count": whole(rng, max(14, least), 78)}


def _cruising(kind: str, rng: Generator) -> Env:
    """Thin traffic mostly, dense now and then."""
    del kind
    return _merge(rng, (10, 40), (0.1, 0.3) if rng.random() < 0.6 else (0.3, 0.85), 1)


def _lane_change(kind: str, rng: Generator) -> Env:
    lane = 0 if kind.startswith("right") else 1
    return _merge(rng, (30, 80), (0.1, 0.9), lane)


def _overtaking(kind: str, rng: Generator) -> Env:
    """Somebody ahead, and room beside."""
    env = _dense(rng, (0.2, 0.8))
    lane = 0 if kind.startswith("right") else 1
    env["ego_vehicle"] |= {"speed": whole(rng, 25, 40), "start_lane_index": ["c", "d", lane]}
    return env


def _shoulder(kind: str, rng: Generator, lanes: tuple[int, int] = (3, 6)) -> Env:
    del kind
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


def _shoulder_behind_somebody(kind: str, rng: Generator) -> Env:
    """At least two lanes to the left of the shoulder, the ego not in the leftmost."""
    env = _shoulder(kind, rng, (3, 5))
    env["vehicles_count"] = whole(rng, 30, 90)
    env["vehicles_density"] = round(float(rng.uniform(0.5, 1.2)), 3)
    env["ego_vehicle"]["start_lane_index"][2] = whole(rng, 1, env["num_lanes"] - 2)
    return env


def _middle_lane(kind: str, rng: Generator) -> Env:
    """Lanes on both sides of the ego, and no shoulder next to it."""
    env = _shoulder(kind, rng, (4, 6))
    env["ego_vehicle"]["start_lane_index"][2] = whole(rng, 1, env["num_lanes"] - 3)
    return env


def _crossing(kind: str, rng: Generator) -> Env:
    del kind
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


def _any_road(kind: str, rng: Generator) -> Env:
    return (_following, _shoulder, _crossing)[whole(rng, 0, 2)](kind, rng)


def _edge_lane(kind: str, rng: Generator) -> Env:
    """Either lane of the two-lane highway: beyond one side of the ego there is none."""
    del kind
    return _merge(rng, (14, 70), (0.1, 0.9), whole(rng, 0, 1))


_ROADS: tuple[tuple[tuple[str, ...], Callable[[str, Generator], Env]], ...] = (
    (("dec_abs_dis", "dec_rel_dis"), _following),
    (("inc_abs_dis", "inc_rel_dis"), _gap_wider),
    (("dec_abs_speed", "inc_abs_speed", "dec_rel_speed", "inc_rel_speed"), _cruising),
    (("left_lc", "right_lc"), _lane_change),
    (("left_overtake", "right_overtake"), _overtaking),
    (("pull_over", "hint1_pull_over", "hint2_pull_over", "hint3_pull_over"), _shoulder),
    (("go_straight", "turn_left", "turn_right", "steps_speed_turn", "refuse_sign"), _crossing),
    (("hint1_slower", "hint2_slower", "hint3_slower"), _cruising),
    (("hint",), _following),
    (("steps_overtake_pull_over",), _shoulder_behind_somebody),
    (("steps_lane_speed", "steps_speed_lane"), _lane_change),
    (("steps",), _following),
    (("refuse_no_lane",), _edge_lane),
    (("refuse_no_lead", "refuse_no_gap", "refuse_speed", "ask_amount"), _cruising),
    (("refuse_no_shoulder", "refuse_no_junction", "refuse_gap"), _following),
    (("refuse_danger",), _any_road),
    (("ask_side",), _middle_lane),
)
