"""Driven samples written as nuScenes' tables, so that one reader serves both."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from chauffeur.bench.openloop.nuscenes import CAMERA, MARKS, OpenLoopMark
from chauffeur.driving.files import publish
from chauffeur.foreign.waypoints import STEP_S

if TYPE_CHECKING:
    from chauffeur.camera import Camera


@dataclass(frozen=True, slots=True)
class DrivenSample:
    """A key frame.

    Attributes:
        x_m, y_m, heading_rad: Of the rear axle's middle, world frame.
        mark: (command, kind, place) where it is asked about: its picture exists then.
    """

    x_m: float
    y_m: float
    heading_rad: float
    mark: tuple[str, str, str] | None = None


@dataclass(frozen=True, slots=True)
class DrivenScene:
    """Key frames at 2 Hz, one after the other, and what is said of them."""

    name: str
    description: str
    samples: tuple[DrivenSample, ...]


def token_of(*parts: object) -> str:
    """A token, 32 hexadecimal digits, of what it names."""
    return hashlib.sha256(" ".join(map(str, parts)).encode()).hexdigest()[:32]


def sample_token(scene: str, place: int) -> str:
    """Token of a key frame of a scene."""
    return token_of(scene, "sample", place)


def picture_file(scene: str, place: int) -> str:
    """Path of its picture, below the root."""
    return f"samples/{CAMERA}/{sample_token(scene, place)}.jpg"


def write_tables(root: Path, version: str, scenes: Sequence[DrivenScene], camera: Camera) -> Path:
    """Write the six tables and the marks of a version; their folder. Raises DataError: a file cannot be written.

    Args:
        root: Folder of the set; pictures are written by who renders them, at `picture_file`.
        version: E.g. `v1.0-train`.
        scenes: What was driven.
        camera: The front camera; its vehicle frame begins at the rear axle.
    """
    tables: dict[str, list[dict[str, Any]]] = {name: [] for name in ("scene", "sample", "sample_data", "ego_pose")}
    sensor, calibrated = token_of("sensor", CAMERA), token_of("calibrated", camera.position_m, camera.focal_px)
    tables["sensor"] = [{"token": sensor, "channel": CAMERA, "modality": "camera"}]
    tables["calibrated_sensor"] = [
        {
            "token": calibrated,
            "sensor_token": sensor,
            "translation": list(camera.position_m),
            "rotation": list(camera.quaternion),
            "camera_intrinsic": camera.intrinsics.tolist(),
        }
    ]
    marks: list[OpenLoopMark] = []
    for scene in scenes:
        many = len(scene.samples)
        tokens = [sample_token(scene.name, i) for i in range(many)]
        owner = token_of(scene.name, "scene")
        tables["scene"].append(
            {
                "token": owner,
                "name": scene.name,
                "description": scene.description,
                "nbr_samples": many,
                "first_sample_token": tokens[0],
                "last_sample_token": tokens[-1],
                "log_token": "",
            }
        )
        for i, one in enumerate(scene.samples):
            stamp = round(i * STEP_S * 1e6)
            before, after = tokens[i - 1] if i else "", tokens[i + 1] if i + 1 < many else ""
            pose = token_of(scene.name, "pose", i)
            half = one.heading_rad / 2.0
            rotation = [math.cos(half), 0.0, 0.0, math.sin(half)]
            translation = [round(one.x_m, 4), round(one.y_m, 4), 0.0]
            tables["ego_pose"].append(
                {"token": pose, "timestamp": stamp, "rotation": rotation, "translation": translation}
            )
            tables["sample"].append(
                {"token": tokens[i], "timestamp": stamp, "prev": before, "next": after, "scene_token": owner}
            )
            tables["sample_data"].append(
                {
                    "token": token_of(scene.name, "data", i),
                    "sample_token": tokens[i],
                    "ego_pose_token": pose,
                    "calibrated_sensor_token": calibrated,
                    "timestamp": stamp,
                    "fileformat": "jpg",
                    "is_key_frame": True,
                    "height": camera.height,
                    "width": camera.width,
                    "filename": picture_file(scene.name, i),
                    "prev": "",
                    "next": "",
                }
            )
            if one.mark is not None:
                marks.append(OpenLoopMark(tokens[i], *one.mark))
    folder = root / version
    folder.mkdir(parents=True, exist_ok=True)
    for name, rows in tables.items():
        publish(folder / f"{name}.json", json.dumps(rows).encode(), f"table {name}")
    publish(folder / MARKS, json.dumps([asdict(one) for one in marks]).encode(), "marks")
    return folder
