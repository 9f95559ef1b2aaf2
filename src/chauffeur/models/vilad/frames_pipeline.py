# pyright: reportMissingImports=false
"""From a set of frames to a model folder: encoder, status MLP, diffusion model and twin, figures, card.

folder/training/    states and logs of the runs
folder/model/       what `vilad-frames/FOLDER` reads
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from chauffeur.bench.kernel.report import markdown
from chauffeur.bench.openloop.conventions import CONVENTIONS, errors, fails
from chauffeur.bench.openloop.extrapolation import constant_turn_and_acceleration, constant_velocity
from chauffeur.bench.openloop.frames import SIMULATED
from chauffeur.driving.files import publish
from chauffeur.models.vilad.frames_baselines import STEPS, strangers_paths, train_status_mlp
from chauffeur.models.vilad.frames_data import FrameSet, joined, load_frames
from chauffeur.models.vilad.frames_recipe import FramesRecipe, train_frames
from chauffeur.models.vilad.frames_store import VERSION, FramesMethod, FramesModel, measured, store_frames_model
from chauffeur.models.vilad.frames_vision import VisionRecipe, plain, train_vision, views_of
from chauffeur.models.vilad.waypoints import CODES, codebook

Array = np.ndarray[Any, Any]
Told = Callable[[str, int, int], None]
"""Is told (stage, done, of how many)."""

FIGURES_HEAD: Final = (
    "method", "1 s (ST-P3)", "2 s", "3 s", "avg.", "avg. (UniAD)", "failures %", "passes",
)  # fmt: skip


VIEWS: Final = 4
"""Lights in which decoders see each training picture."""


@dataclass(frozen=True, slots=True)
class FramesPlan:
    """Settings that decide the whole pipeline.

    Attributes:
        vision: Of the encoder.
        decoder: Of the diffusion model; its twin has the same.
        codes: Of the codebook.
        status_steps: Optimiser steps of the ego-status MLP.
    """

    vision: VisionRecipe = field(default_factory=VisionRecipe)
    decoder: FramesRecipe = field(default_factory=FramesRecipe)
    codes: int = CODES
    status_steps: int = STEPS


@dataclass(frozen=True, slots=True)
class FramesLine:
    """A method's figures on a split: L2 (m) at 1, 2, 3 s and average by convention, failures in %, mean passes."""

    method: str
    l2: dict[str, tuple[float, float, float, float]]
    failures: float
    passes: float


def make_frames_model(
    data: Path, folder: Path, plan: FramesPlan, told: Told, also: Sequence[Path] = (), device: str = "cpu"
) -> tuple[Path, list[FramesLine]]:
    """Train everything, or go on in this folder; the model folder, and figures on the test split.

    Args:
        data: The set.
        folder: Of the run.
        plan: What decides it.
        told: Is told how far it is.
        also: Sets whose training split is trained on too.
        device: Where encoder and decoders are trained.

    Raises:
        ConfigError: The folder holds a run of another recipe.
        DataError: The set cannot be read.
    """
    size = plan.vision.vision.size
    train = joined([load_frames(one, "train", size) for one in (data, *also)])
    val = load_frames(data, "val", size)
    runs = folder / "training"

    def watch(stage: str, steps: int) -> Callable[[int, float, float], None]:
        return lambda step, loss, seconds: told(f"{stage}, loss {loss:.3f}, {seconds:.2f} s", step + 1, steps)

    seeing = train_vision(runs / "vision", plan.vision, train, watch("encoder", plan.vision.steps), device)
    tokens = views_of(seeing, train.pictures, VIEWS)
    off = train.futures - strangers_paths(train, plan.status_steps)
    book = codebook(off, plan.codes, plan.decoder.seed)
    decoders = {
        mode: train_frames(
            runs / mode,
            replace(plan.decoder, mode=mode),
            book,
            train,
            tokens,
            off,
            watch(mode, plan.decoder.steps),
            device,
        )
        for mode in ("vilad", "twin")
    }
    status = train_status_mlp(train, val, plan.status_steps)
    about: dict[str, Any] = {
        "version": VERSION,
        "vision": plain(plan.vision)["vision"],
        "vision_recipe": plain(plan.vision),
        "recipe": asdict(plan.decoder),
        "codes": plan.codes,
        "frames": len(train.samples),
    }
    model = FramesModel(seeing, decoders["vilad"], decoders["twin"], status, book, about)
    lines, known = figures(model, load_frames(data, "test", size), told), figures(model, val, told)
    about["figures"] = {"test": [asdict(one) for one in lines], "val": [asdict(one) for one in known]}
    target = folder / "model"
    store_frames_model(target, model)
    publish(target / "MODEL_CARD.md", card(about, lines, known).encode(), "model card")
    return target, lines


def figures(model: FramesModel, frames: FrameSet, told: Told) -> list[FramesLine]:
    """All methods on a split: ours, those that see no picture, and ours with black pictures."""
    asked: tuple[tuple[str, FramesMethod, bool], ...] = (
        ("ViLaD", "vilad", False),
        ("autoregressive twin", "twin", False),
        ("ViLaD, black pictures", "vilad", True),
        ("encoder's own head (regression)", "regression", False),
        ("ego-status MLP", "status", False),
    )
    lines: list[FramesLine] = []
    for done, (name, method, black) in enumerate(asked, start=1):
        found, passes = measured(model, method, frames, black=black)
        lines.append(line_of(name, found, frames.futures, passes))
        told("test split", done, len(asked) + 2)
    for name, rule in (
        ("constant turn rate and acceleration", constant_turn_and_acceleration),
        ("constant velocity", constant_velocity),
    ):
        lines.append(line_of(name, np.stack([rule(one) for one in frames.histories]), frames.futures, 0.0))
    return lines


def line_of(name: str, found: Array, truth: Array, passes: float) -> FramesLine:
    """Figures of waypoints (n, 6, 2), all failures counted."""
    l2: dict[str, tuple[float, float, float, float]] = {}
    for convention in CONVENTIONS:
        each = [errors(one, true, convention) for one, true in zip(found, truth, strict=True)]
        columns = [[float(getattr(one, part)) for one in each] for part in ("at_1s", "at_2s", "at_3s", "average")]
        first, second, third, average = (round(float(np.mean(column)), 4) for column in columns)
        l2[convention] = (first, second, third, average)
    broken = 100.0 * float(np.mean([fails(one, true) for one, true in zip(found, truth, strict=True)]))
    return FramesLine(name, l2, broken, passes)


def cells_of(one: FramesLine) -> tuple[str, ...]:
    """A line under `FIGURES_HEAD`."""
    values = (*one.l2["stp3"], one.l2["uniad"][3], one.failures)
    return (one.method, *(f"{value:.2f}" for value in values), f"{one.passes:.1f}" if one.passes else "")


def card(about: dict[str, Any], lines: list[FramesLine], known: list[FramesLine]) -> str:
    """The model card, with the figures of the test split and of the validation split."""
    unseen, seen = (markdown(FIGURES_HEAD, [cells_of(one) for one in split]) for split in (lines, known))
    recipe = about["recipe"]
    return f"""# Model card: {about["version"]}

Front picture, own motion over 2 s and a navigation command to waypoints over 3 s, by masked diffusion over a codebook
(ViLaD, paper Sec. VII), with its autoregressive twin and the baselines that see nothing.

- **Data**: {about["frames"]:,} training frames. {SIMULATED}
- **Encoder**: strided convolutions, trained on the training frames to tell what the simulator knows of them and where
  the car went, {about["vision_recipe"]["steps"]:,} steps of {about["vision_recipe"]["batch"]}; then frozen. Both
  decoders read its tokens.
- **Decoders**: {recipe["layers"]} layers of {recipe["hidden"]}, {recipe["steps"]:,} steps of {recipe["batch"]}.
- **Test split**: a town, trips and seeds that are in no other split. L2 in m, failures counted.

{unseen}

- **Validation split**: trips and seeds of its own, through the training towns; the ego-status MLP's state was chosen on
  it, nothing else was.

{seen}

- Open loop: how the model imitates the worlds' own drivers, not how it would drive. Frames are chosen by what happens
  next, so these figures are no figures of natural driving, and none of nuScenes.
"""
