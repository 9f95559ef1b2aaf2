"""Scenes whose questions can be answered from the colour of the front view: the least a network must learn."""

from __future__ import annotations

from typing import Any

import numpy as np

from chauffeur.bench.nuplanqa.questions import PREAMBLE, VqaItem
from chauffeur.bench.nuplanqa.scenes.facts import Fact
from chauffeur.bench.nuplanqa.scenes.wording import phrase
from chauffeur.camera import nuplan_rig
from chauffeur.models.bev_llm.recipe import QaTensors
from chauffeur.models.bev_llm.views import FRONT_VIEWS, VIEWS, view_cameras

LIGHTS = ("red", "yellow", "green", "none")
SIZE = (32, 48)


def tiny_split(scenes: int = 12) -> QaTensors:
    """All views of noise and the front ones of the instant before; the front ones now have the colour of the light."""
    rng = np.random.default_rng(0)
    paints = np.array([(220, 30, 30), (220, 220, 30), (30, 220, 30), (90, 90, 90)], np.uint8)
    now = rng.integers(0, 255, (scenes, len(VIEWS), 3, *SIZE), dtype=np.uint8)
    past = rng.integers(0, 255, (scenes, 1, FRONT_VIEWS, 3, *SIZE), dtype=np.uint8)
    found: list[tuple[VqaItem, ...]] = []
    truth: list[dict[str, Any]] = []
    for row in range(scenes):
        light = LIGHTS[row % 4]
        now[row, :FRONT_VIEWS] = paints[row % 4][:, None, None]
        question, options, answer, _ = phrase(Fact("light", "", light), "steady", "train", rng)
        item = VqaItem(
            str(row), f"{row:016x}", "", "Traffic Light", "train", PREAMBLE, (1.0,) * 5, (0.0,) * 5,
            question, options, answer,
        )  # fmt: skip
        found.append((item, item))
        users = [("car", 10.0, 0.0, True), ("bus", 500.0, 0.0, True)]
        truth.append({"motion": "steady", "lead": [10.0, -2.0], "facts": [["light", "", light]], "users": users})
    cameras = view_cameras(
        nuplan_rig(48, 32).only("CAM_F0", "CAM_L0", "CAM_R0", "CAM_L2", "CAM_R2", "CAM_B0").cameras, SIZE
    )
    motion, speeds = np.zeros((scenes, 2, 3), np.float32), np.ones((scenes, 2), np.float32)
    return QaTensors(now, past, motion, tuple(truth), speeds, tuple(found), cameras)
