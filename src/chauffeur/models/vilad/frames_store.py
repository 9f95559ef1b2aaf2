# pyright: reportMissingImports=false, reportUnknownParameterType=false
"""A trained frames model on disk, and how it is asked: encoder, codebook, diffusion model and twin, status MLP.

folder/vision.safetensors, status.safetensors     encoder with its head, ego-status MLP
folder/vilad.safetensors, twin.safetensors        the decoders over its tokens
folder/codebook.npz, model.json, MODEL_CARD.md
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal, get_args
from zipfile import BadZipFile

import numpy as np
import torch

from chauffeur.bench.openloop.extrapolation import constant_velocity
from chauffeur.concept import DataError
from chauffeur.driving.files import publish
from chauffeur.models.net.vision import VisionConfig
from chauffeur.models.vilad.frames_baselines import expected_paths
from chauffeur.models.vilad.frames_data import FrameSet, ego_features
from chauffeur.models.vilad.frames_recipe import ONE_PASS, FramesRecipe, plan_path, plan_paths, prompts
from chauffeur.models.vilad.frames_vision import SAID, SEEN_WIDTH, SeeingHead, StatusHead, regressed, tokens_of
from chauffeur.models.vilad.network import Vilad
from chauffeur.models.vilad.waypoints import WaypointCodebook
from chauffeur.planners.vilad.unmasking import Unmasking

Array = np.ndarray[Any, Any]
FramesMethod = Literal["vilad", "twin", "regression", "status"]
METHODS: Final = get_args(FramesMethod)
OWN: Final = Path(__file__).parent / "weights" / "frames"
"""The model that ships."""
VERSION: Final = "vilad-frames-v2"
"""Of what is stored: codes of the first were displacements from constant velocity."""


@dataclass(frozen=True)
class FramesModel:
    """Everything that was trained on one set of frames.

    Attributes:
        vision: Encoder with the head of its own training.
        vilad, twin: Decoders over its tokens, round the paths that the MLP expects.
        status: Ego-status MLP.
        book: Of the waypoints.
        about: What `model.json` says.
    """

    vision: SeeingHead
    vilad: Vilad
    twin: Vilad
    status: StatusHead
    book: WaypointCodebook
    about: Mapping[str, Any]

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) of the pictures."""
        height, width = self.about["vision"]["size"]
        return int(height), int(width)

    @torch.no_grad()
    def waypoints(
        self,
        method: FramesMethod,
        history: Array,
        command: str,
        picture: Array,
        how: Unmasking = ONE_PASS,
    ) -> tuple[Array, int]:
        """Waypoints (6, 2) of a frame, and forward passes of the decoder.

        Args:
            method: Whose.
            history: (5, 3).
            command: What the navigation says.
            picture: (H, W, 3) uint8.
            how: Rule of the unmasking.
        """
        ego = ego_features(history)
        said = np.zeros((1, len(SAID)), np.float32)
        if command in SAID:
            said[0, SAID.index(command)] = 1.0
        known = torch.from_numpy(np.concatenate((ego[None], said), axis=1))
        if method == "regression":
            off, _ = self.vision(torch.from_numpy(np.ascontiguousarray(picture[None])), known)
        else:
            off = self.status(known)
        path = constant_velocity(history) + off[0].numpy()
        if method in ("status", "regression"):
            return path, 1
        model = self.vilad if method == "vilad" else self.twin
        tokens = tokens_of(self.vision, picture[None])
        planned = plan_path(model, self.book, path, prompts(ego[None], [command]), tokens, how)
        return planned.waypoints, planned.decided.passes


def store_frames_model(folder: Path, model: FramesModel, *, half: bool = False) -> None:
    """Write it, or half the bits of it: float16, as what ships. Raises DataError: a file cannot be written."""
    from safetensors.torch import save_file

    folder.mkdir(parents=True, exist_ok=True)
    for name in ("vision", "vilad", "twin", "status"):
        state: dict[str, torch.Tensor] = getattr(model, name).state_dict()
        kept = {key: (value.half() if half else value).contiguous() for key, value in state.items()}
        save_file(kept, folder / f"{name}.safetensors")
    np.savez_compressed(folder / "codebook.npz", centres=model.book.centres.astype(np.float32))
    publish(folder / "model.json", (json.dumps(dict(model.about), indent=1) + "\n").encode(), "model's facts")


def load_frames_model(folder: Path) -> FramesModel:
    """Read what `store_frames_model` wrote. Raises DataError: there is none, or it is damaged."""
    from safetensors import SafetensorError
    from safetensors.torch import load_file

    try:
        about: dict[str, Any] = json.loads((folder / "model.json").read_text(encoding="utf-8"))
        with np.load(folder / "codebook.npz", allow_pickle=False) as held:
            book = WaypointCodebook(held["centres"].astype(np.float64))
        config = vision_config(about["vision"])
        seeing, status = SeeingHead(config), StatusHead()
        parts: dict[str, Any] = {"vision": seeing, "status": status}
        for mode in ("vilad", "twin"):
            recipe = FramesRecipe(**about["recipe"] | {"mode": mode})
            parts[mode] = Vilad(recipe.config(SEEN_WIDTH), book.template)
        for name, module in parts.items():
            module.load_state_dict(load_file(folder / f"{name}.safetensors"))
            module.eval()
    except (OSError, ValueError, KeyError, TypeError, RuntimeError, SafetensorError, BadZipFile) as error:
        raise DataError(
            f"{folder} holds no frames model that can be read: {error}.",
            hint="Train one: chauffeur model train vilad-frames",
        ) from error
    if about["version"] != VERSION:
        raise DataError(
            f"{folder} is {about['version']}, not {VERSION}.", hint="Train it again: model train vilad-frames"
        )
    return FramesModel(parts["vision"], parts["vilad"], parts["twin"], parts["status"], book, about)


def vision_config(plain: Mapping[str, Any]) -> VisionConfig:
    """A configuration from its plain values."""
    height, width = plain["size"]
    return VisionConfig(
        plain["kind"], (int(height), int(width)), tuple(int(one) for one in plain["channels"]), int(plain["stem"])
    )


def measured(
    model: FramesModel, method: FramesMethod, frames: FrameSet, how: Unmasking = ONE_PASS, *, black: bool = False
) -> tuple[Array, float]:
    """Waypoints (n, 6, 2) of a set, and mean passes; `black` shows black pictures in place of the real ones."""
    if method == "status":
        return expected_paths(model.status, frames), 1.0
    if method == "regression":
        return np.stack([constant_velocity(one) for one in frames.histories]) + regressed(model.vision, frames), 1.0
    if black:
        tokens = tokens_of(model.vision, np.zeros_like(frames.pictures[:1])).expand(len(frames.samples), -1, -1)
    else:
        tokens = tokens_of(model.vision, frames.pictures)
    decoder = model.vilad if method == "vilad" else model.twin
    expected = expected_paths(model.status, frames)
    paths = plan_paths(decoder, model.book, expected, prompts(frames.ego, frames.commands), tokens, how)
    return np.stack([one.waypoints for one in paths]), float(np.mean([one.decided.passes for one in paths]))
