"""Where the wishes of this evaluation are driven: seven kinds of situation on highway, intersection and parking lot.

The seeds were chosen by what the first instant shows (a slower car 42 m to 50 m ahead, at its own speed, with a free
lane beside it; room on the right; traffic that crosses), never by what a planner makes of it;
`tests/bench/test_personalization_scenes.py` looks again. A car that begins with a shorter gap than its cruise control
keeps brakes hard in the first second, whatever anybody says, so no scene begins that way.
"""

from __future__ import annotations

from typing import Any, Final, Literal

from chauffeur.bench.personalization.sayings import Aim
from chauffeur.concept import Scenario

Task = Literal["overtake", "follow", "right_lane", "yield", "go", "park", "pace"]
"""What a passenger wants on the whole (paper Tab. VIII and IX; `pace` is the speed in a lot, Tab. X)."""
Ground = Literal["highway", "intersection", "parking"]

TASKS: Final[tuple[Task, ...]] = ("overtake", "follow", "right_lane", "yield", "go", "park", "pace")
GROUND_OF: Final[dict[Task, Ground]] = {
    "overtake": "highway",
    "follow": "highway",
    "right_lane": "highway",
    "yield": "intersection",
    "go": "intersection",
    "park": "parking",
    "pace": "parking",
}
TASK_WORDS: Final[dict[Task, str]] = {
    "overtake": "overtake",
    "follow": "follow",
    "right_lane": "right lane",
    "yield": "yield",
    "go": "not yield",
    "park": "park",
    "pace": "speed in the lot",
}
AIMS: Final[dict[Task, tuple[Aim, ...]]] = {
    "overtake": ("overtake",),
    "follow": ("follow",),
    "right_lane": ("right_lane",),
    "yield": ("yield",),
    "go": ("go",),
    "park": ("park.nearest", "park.stadium", "park.exit"),
    "pace": ("pace.faster", "pace.slower"),
}
DRIVE_S: Final[dict[Task, float]] = {
    "overtake": 30.0,
    "follow": 30.0,
    "right_lane": 30.0,
    "yield": 45.0,
    "go": 45.0,
    "park": 90.0,
    "pace": 30.0,
}
"""Simulated time of a trip at most."""

_SEEDS: Final[dict[Task, tuple[int, ...]]] = {
    "overtake": (1609, 1825, 2442, 2751),
    "follow": (2622, 2649, 2751, 2768),
    "right_lane": (3842, 4513, 5090, 5337),
    "yield": (4000, 4001, 4002, 4003),
    "go": (5000, 5001, 5002, 5003),
    "park": (6000, 6001, 6002, 6003),
    "pace": (7000, 7001, 7002, 7003),
}
"""Few scenes, many people: what differs between people is what is measured, and their drives can be shared."""


def scenes_of(task: Task) -> tuple[Scenario, ...]:
    """The scenes of a task, always in the same order."""
    return tuple(_scene(task, index, seed) for index, seed in enumerate(_SEEDS[task]))


def _scene(task: Task, index: int, seed: int) -> Scenario:
    ground = GROUND_OF[task]
    world = "parking" if ground == "parking" else "highway"
    return Scenario(f"personal-{task}-{index + 1}", world, _config(task, index), seed)


def _config(task: Task, index: int) -> dict[str, Any]:
    match task:
        case "overtake":
            return _highway(lane=1, count=10, density=0.5)
        case "follow":
            return _highway(lane=1, count=18, density=0.5)
        case "right_lane":
            return _highway(lane=0, count=12 if index > 1 else 18, density=0.5)
        case "yield":
            count = 3 if index % 2 == 0 else 5
            return {"type": "dt-intersection-v0", "num_vehicles_left": count, "num_vehicles_right": count}
        case "go":
            return {"type": "dt-intersection-v0", "num_vehicles_left": index % 2, "num_vehicles_right": 0}
        case "park":
            return {"taken": 0.6, "cars": index % 2, "walkers": index % 3}
        case "pace":  # too slow and too fast for most, so that whoever asks has a reason to
            return {"taken": 0.6, "cars": index // 2, "walkers": index % 3, "ego_speed": (2.0, 4.0)[index % 2]}


def _highway(*, lane: int, count: int, density: float) -> dict[str, Any]:
    return {
        "type": "ramp-merge-v0",
        "stage_length": [500, 80, 80, 2000],
        "vehicles_count": count,
        "vehicles_density": density,
        "ego_vehicle": {"speed": 25, "start_lane_index": ["c", "d", lane], "start_position": [105, 0]},
    }
