"""Records of a scene: pictures, the published metadata, visible road users, and the ground truth."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from chauffeur.bench.nuplanqa.scenes.facts import Seen, facts_of
from chauffeur.bench.nuplanqa.scenes.scene import SAMPLES, STEP_S, QaScene
from chauffeur.camera import Camera, CameraImages, Rig
from chauffeur.concept.scene import Observation
from chauffeur.driving.files import publish

LEAST_SHARE: Final = 0.35
"""Share of a road user that must be unhidden in the picture that shows it best."""
GLIMPSED_PX: Final = 24.0
"""Pixels of the front picture, at 448 px across, from which a lead vehicle too small to ask about is taught."""


def save_pictures(folder: Path, token: str, taken: CameraImages) -> None:
    """Write the pictures of an instant where `calibrated` says."""
    from PIL import Image

    (folder / "part_0").mkdir(parents=True, exist_ok=True)
    for camera, image in zip(taken.cameras, taken.images, strict=True):
        # Colours at full resolution: a lamp is two or three pixels.
        Image.fromarray(image.pixels()).save(folder / _picture(token, camera.name), "JPEG", quality=92, subsampling=0)


def calibrated(token: str, cameras: Sequence[Camera], instant: Observation) -> dict[str, Any]:
    """Paths of an instant's pictures, their calibration, and the ego's pose: keys of the published metadata."""
    cams = {
        camera.name: {
            "data_path": _picture(token, camera.name),
            "sensor2ego_translation": list(camera.position_m),
            "sensor2ego_rotation": list(camera.quaternion),
            "cam_intrinsic": camera.intrinsics.tolist(),
        }
        for camera in cameras
    }
    return {"cams": cams, "ego_pose": _pose(instant)}


def made_out(taken: CameraImages) -> frozenset[int | str]:
    """Ids of the road users and lights that at least one picture shows large and free enough to be told apart."""
    found: set[int | str] = set()
    for truth in taken.truth:
        height, width = truth.instances.shape
        least = max(4.0, 12.0 * width * height / (112.0 * 64.0))
        for one in truth.sightings:
            lamp = one.instance.source == "signal"
            if one.pixels >= (least / 3.0 if lamp else least) and one.visibility >= LEAST_SHARE:
                found.add(one.instance.id)
    return frozenset(found)


def glimpsed_in(taken: CameraImages) -> frozenset[int | str]:
    """Ids of the road users that the front picture shows as something at least."""
    front = taken.truth[0]
    least = GLIMPSED_PX * (front.instances.shape[1] / 448.0) ** 2
    return frozenset(
        one.instance.id
        for one in front.sightings
        if one.instance.source == "agent" and one.pixels >= least and one.visibility >= LEAST_SHARE
    )


def metadata_of(scene: QaScene, rig: Rig, rendered: Sequence[int]) -> dict[str, Any]:
    """Metadata of the rendered instants of a scene, with the keys of the published file."""
    found: dict[str, Any] = {}
    for place, number in enumerate(rendered):
        token = instant_token(scene.token, number)
        found[token] = {
            **calibrated(token, rig.cameras, scene.instants[number]),
            "frame_idx": number,
            "timestamp": round(number * STEP_S * 1e6),
            "scene_token": scene.token,
            "scenario": scene.scene_type,
            "traffic_light": [] if scene.light is None else [scene.light],
            "prev": instant_token(scene.token, rendered[place - 1]) if place else "",
            "next": instant_token(scene.token, rendered[place + 1]) if number + 1 < SAMPLES else "",
        }
    return found


def truth_of(scene: QaScene, seen: Seen, glimpsed: Seen, rig: Rig) -> dict[str, Any]:
    """Targets that a network may be taught besides the questions: classes of all families, and who is where.

    Road users are (kind, x, y, whether they can be made out), in the frame of the rig: x forward, y left, m. Of the
    lead vehicle: how far ahead, centre to centre, m, and how much faster than the ego it is, m/s; nothing where it
    cannot be made out, and an empty list for none. A lead vehicle too far to be asked about is taught all the same.
    """
    lead = scene.lead
    facts = [[fact.family, fact.side, fact.value] for fact in facts_of(scene, seen, asked=False)]
    told: list[float] | None = None if "lead" in scene.unclear else []
    if lead is not None and told is not None:
        shown = lead.id in glimpsed
        faster = next(one.speed_mps for one in scene.now.others if one.id == lead.id) - scene.now.ego.speed_mps
        told = [round(lead.ahead_m, 2), round(faster, 2)] if shown else None
        if shown and not any(family == "ahead" for family, _, _ in facts):
            facts.append(["ahead", "", lead.kind])
    return {
        "motion": scene.motion,
        "fast": scene.fast,
        "source": scene.source,
        "lead": told,
        "facts": facts,
        "users": truth_of_users(scene.now, glimpsed, rig),
    }


def truth_of_users(observation: Observation, seen: Seen, rig: Rig) -> list[tuple[str, float, float, bool]]:
    """Road users as (kind, x, y, whether they can be made out), in the frame of the rig."""
    ego = observation.ego
    c, s = math.cos(ego.heading_rad), math.sin(ego.heading_rad)
    users: list[tuple[str, float, float, bool]] = []
    for one in observation.others:
        dx, dy = one.x_m - ego.x_m, one.y_m - ego.y_m
        x, y = c * dx + s * dy - rig.origin_ahead_m, c * dy - s * dx
        users.append((one.kind, round(x, 2), round(y, 2), one.id in seen))
    return users


def _pose(instant: Observation) -> dict[str, float]:
    ego = instant.ego
    return {
        "x": ego.x_m,
        "y": ego.y_m,
        "z": 0.0,
        "qw": math.cos(ego.heading_rad / 2.0),
        "qx": 0.0,
        "qy": 0.0,
        "qz": math.sin(ego.heading_rad / 2.0),
        "vx": ego.speed_mps,
        "acceleration_x": ego.acceleration_mps2,
    }


def instant_token(token: str, number: int) -> str:
    """Token of an instant of a scene; the present one's is the scene's own."""
    if number == SAMPLES - 1:
        return token
    return hashlib.sha256(f"{token} {number}".encode()).hexdigest()[:16]


def _picture(token: str, camera: str) -> str:
    return f"part_0/{token}_{camera}.jpg"


def write_json(path: Path, value: Any) -> None:
    """Write a file of a set."""
    path.parent.mkdir(parents=True, exist_ok=True)
    publish(path, (json.dumps(value, ensure_ascii=False) + "\n").encode(), "data set")
