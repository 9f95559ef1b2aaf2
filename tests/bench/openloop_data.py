"""A small data set in nuScenes' file format: three scenes, tables as nuScenes names them, grey pictures."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from PIL import Image

from chauffeur.bench.kernel.calls import Patience
from chauffeur.bench.kernel.run import Effort
from chauffeur.concept import Usage
from chauffeur.planners.base import Prose
from small_run import Inline

EFFORT = Effort(workers=1, engine=Inline, patience=Patience(attempts=2, base_s=0.001))


class Scripted:
    """Answers by a function of the last text; keeps what it was asked."""

    id = model = "scripted"

    def __init__(self, answer: Callable[[str], str]) -> None:
        self.answer, self.seen = answer, list[Any]()

    async def write(self, messages: Sequence[Any]) -> Prose:
        self.seen.append(messages)
        content = messages[-1]["content"]
        text = content if isinstance(content, str) else content[-1]["text"]
        return Prose(self.answer(text), whole=True, model="scripted", usage=Usage())


ROTATION = 0.7
"""World heading of the first scene: nothing may depend on it being zero."""


def quaternion(yaw: float) -> list[float]:
    return [math.cos(yaw / 2.0), 0.0, 0.0, math.sin(yaw / 2.0)]


def straight(steps: int, speed: float, yaw: float) -> list[tuple[float, float, float]]:
    return [
        (100.0 + 0.5 * speed * i * math.cos(yaw), 40.0 + 0.5 * speed * i * math.sin(yaw), yaw) for i in range(steps)
    ]


def circle(steps: int, speed: float, radius: float) -> list[tuple[float, float, float]]:
    turned = [0.5 * speed * i / radius for i in range(steps)]
    return [(radius * math.sin(a), radius * (1.0 - math.cos(a)), a) for a in turned]


def braking(steps: int, speed: float) -> list[tuple[float, float, float]]:
    x, found = 0.0, []
    for i in range(steps):
        found.append((x, 0.0, 0.0))
        x += 0.5 * max(0.0, speed - 4.0 * max(0, i - 4) * 0.5)
    return found


SCENES = {
    "scene-0001": straight(13, 8.0, ROTATION),
    "scene-0002": circle(12, 6.0, 15.0),
    "scene-0003": braking(8, 10.0),  # ends 1.5 s after its first sample that counts
}


def write_nuscenes(root: Path, version: str = "v1.0-mini") -> Path:
    """The six tables that planning reads, a LIDAR beside the camera, and pictures; the root."""
    tables: dict[str, list[dict[str, Any]]] = {
        "sensor": [
            {"token": "s-cam", "channel": "CAM_FRONT", "modality": "camera"},
            {"token": "s-lid", "channel": "LIDAR_TOP", "modality": "lidar"},
        ],
        "calibrated_sensor": [
            {"token": "c-cam", "sensor_token": "s-cam", "translation": [1.7, 0, 1.5], "rotation": [1, 0, 0, 0],
             "camera_intrinsic": [[1266, 0, 816], [0, 1266, 491], [0, 0, 1]]},
            {"token": "c-lid", "sensor_token": "s-lid", "translation": [0.9, 0, 1.8], "rotation": [1, 0, 0, 0],
             "camera_intrinsic": []},
        ],
        "scene": [], "sample": [], "sample_data": [], "ego_pose": [],
    }  # fmt: skip
    (root / "samples" / "CAM_FRONT").mkdir(parents=True)
    for name, poses in SCENES.items():
        tokens = [f"{name}-{i}" for i in range(len(poses))]
        tables["scene"].append(
            {"token": f"t-{name}", "name": name, "first_sample_token": tokens[0], "last_sample_token": tokens[-1],
             "nbr_samples": len(tokens), "log_token": "log", "description": "test"}
        )  # fmt: skip
        for i, (x, y, yaw) in enumerate(poses):
            after = tokens[i + 1] if i + 1 < len(tokens) else ""
            tables["sample"].append(
                {"token": tokens[i], "timestamp": 500_000 * i, "prev": tokens[i - 1] if i else "", "next": after,
                 "scene_token": f"t-{name}"}
            )  # fmt: skip
            file = f"samples/CAM_FRONT/{tokens[i]}.jpg"
            Image.new("RGB", (64, 36), (90, 90, 90 + i)).save(root / file)
            for sensor, key, filename in (
                ("c-cam", True, file), ("c-cam", False, f"sweeps/{tokens[i]}.jpg"), ("c-lid", True, "x.bin"),
            ):  # fmt: skip
                token = f"{tokens[i]}-{sensor}-{key}"
                pose = (x, y, yaw) if sensor == "c-cam" and key else (x + 50.0, y, yaw)  # only one is the right one
                tables["ego_pose"].append(
                    {"token": token, "timestamp": 500_000 * i, "translation": [*pose[:2], 0.0],
                     "rotation": quaternion(pose[2])}
                )  # fmt: skip
                tables["sample_data"].append(
                    {"token": token, "sample_token": tokens[i], "ego_pose_token": token, "is_key_frame": key,
                     "calibrated_sensor_token": sensor, "filename": filename, "fileformat": "jpg"}
                )  # fmt: skip
    (root / version).mkdir()
    for name, rows in tables.items():
        (root / version / f"{name}.json").write_text(json.dumps(rows))
    return root
