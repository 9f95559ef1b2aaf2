"""Scenes of this evaluation: seven kinds of situation on highway, intersection and parking lot.

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
"""Overall wants of a passenger (paper Tab. VIII and IX; `pace` is the speed in a lot, Tab. X)."""
Ground = Literal["highway", "intersection", "parking"]

_TASKS: Final[dict[Task, tuple[Ground, str, tuple[Aim, ...], float, tuple[int, ...]]]] = {
    "overtake": ("highway", "overtake", ("overtake",), 30.0, (1609, 1825, 2442, 2751)),
    "follow": ("highway", "follow", ("follow",), 30.0, (2622, 2649, 2751, 2768)),
    "right_lane": ("highway", "right lane", ("right_lane",), 30.0, (3842, 4513, 5090, 5337)),
    "yield": ("intersection", "yield", ("yield",), 45.0, (4000, 4001, 4002, 4003)),
    "go": ("intersection", "not yield", ("go",), 45.0, (5000, 5001, 5002, 5003)),
    "park": ("parking", "park", ("park.nearest", "park.stadium", "park.exit"), 90.0, (6000, 6001, 6002, 6003)),
    "pace": ("parking", "speed in the lot", ("pace.faster", "pace.slower"), 30.0, (7000, 7001, 7002, 7003)),
}
"""Ground, words, aims, simulated time of a trip at most in s, and seeds of each task. Few scenes, many people: what
differs between people is what is measured, and their drives can be shared."""

TASKS: Final[tuple[Task, ...]] = tuple(_TASKS)
GROUND_OF: Final[dict[Task, Ground]] = {task: row[0] for task, row in _TASKS.items()}
TASK_WORDS: Final = {task: row[1] for task, row in _TASKS.items()}
AIMS: Final = {task: row[2] for task, row in _TASKS.items()}
DRIVE_S: Final = {task: row[3] for task, row in _TASKS.items()}
_SEEDS: Final = {task: row[4] for task, row in _TASKS.items()}


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
