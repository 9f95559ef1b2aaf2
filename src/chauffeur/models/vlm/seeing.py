# pyright: reportMissingImports=false, reportUnknownParameterType=false
"""The first stage of the compact VLM's training: the eye learns what is in a picture, before any words.

Taught from gains and wishes alone an eye of this size found weather, and neither lead vehicle nor road: both move the
gains by next to nothing. Here it is told what is there (weather, grade, lead vehicle, road), and which cells of the
picture vehicles, and the lead vehicle, cover.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from torch.nn.functional import binary_cross_entropy_with_logits, cross_entropy

from chauffeur.models.train.rates import cosine_rate
from chauffeur.models.train.trainer import Optimisation, fit
from chauffeur.models.vlm.config import VlmRecipe
from chauffeur.models.vlm.network import CompactVlm
from chauffeur.models.vlm.scenes import PictureSet, SceneFacts
from chauffeur.planners.vlm.template import SIGHTS

Array = np.ndarray[Any, Any]

_CELLS_SHARE: Final = 6.0
"""Of the cells' loss: most are empty, and their mean is small."""
_WARMUP: Final = 80
_MIRRORED: Final = {"bend_left": "bend_right", "bend_right": "bend_left", "straight": "straight"}
_LUMA: Final = np.array((0.299, 0.587, 0.114), np.float32)
_VARIANTS: Final = 2
"""Of each picture in the second stage: as it is, and mirrored, each varied once."""


def varied(pixels: Array, rng: np.random.Generator) -> Array:
    """Pictures (B, H, W, 3) uint8 as another camera, in another street, might have taken them, float32 in 0..1.

    A small shift and zoom; exposure, tone curve, contrast, colour balance, hue, saturation, vignette, noise: each on
    its own, none as the held-out looks have it.
    """
    count, height, width, _ = pixels.shape
    found = np.empty(pixels.shape, np.float32)
    levels = np.arange(256, dtype=np.float32)[:, None] / 255.0
    y, x = np.mgrid[-1.0 : 1.0 : height * 1j, -1.0 : 1.0 : width * 1j]
    away = (0.5 * (x * x + y * y)).astype(np.float32)[..., None]
    for place in range(count):
        zoom = float(rng.uniform(0.92, 1.04))
        rows = (np.arange(height) - height / 2) * zoom + height / 2 + rng.uniform(-4.0, 4.0)
        columns = (np.arange(width) - width / 2) * zoom + width / 2 + rng.uniform(-6.0, 6.0)
        r, c = np.clip(rows.round().astype(int), 0, height - 1), np.clip(columns.round().astype(int), 0, width - 1)
        curve = levels ** np.exp(rng.uniform(-0.25, 0.25)) * np.exp(rng.uniform(-0.30, 0.30))
        curve = (curve - 0.45) * rng.uniform(0.82, 1.20) + 0.45
        curve = (curve * rng.uniform(0.90, 1.10, 3)).astype(np.float32)
        shown = pixels[place][r[:, None], c]
        shown = np.stack([curve[:, channel][shown[..., channel]] for channel in range(3)], axis=-1)
        shown = shown @ _colour_matrix(float(rng.uniform(-0.5, 0.5)), float(rng.uniform(0.5, 1.4)))
        shown *= 1.0 - np.float32(rng.uniform(0.0, 0.25)) * away
        shown += np.float32(rng.uniform(0.0, 0.022)) * rng.standard_normal(shown.shape, np.float32)
        found[place] = shown
    return np.clip(found, 0.0, 1.0, out=found)


def _colour_matrix(hue_rad: float, saturation: float) -> Array:
    """Turns hues about the grey axis and stretches them from it, (3, 3), for rows of pixels."""
    axis = np.full(3, 1.0 / np.sqrt(3.0))
    cross = np.array(((0.0, -axis[2], axis[1]), (axis[2], 0.0, -axis[0]), (-axis[1], axis[0], 0.0)))
    turn = np.eye(3) + np.sin(hue_rad) * cross + (1.0 - np.cos(hue_rad)) * (cross @ cross)
    grey = np.outer(np.ones(3), _LUMA)
    return ((grey + saturation * (np.eye(3) - grey)) @ turn).T.astype(np.float32)


def mirrored(facts: SceneFacts) -> SceneFacts:
    """Facts of a mirrored picture."""
    return replace(facts, road=_MIRRORED[facts.road])


def dealt(seed: int, number: int, many: int) -> int:
    """Picture of a place in the endless row of epochs, each in an order of its own."""
    epoch, place = divmod(number, many)
    return int(_order(seed, epoch, many)[place])


_orders: dict[tuple[int, int, int], Array] = {}


def _order(seed: int, epoch: int, many: int) -> Array:
    key = (seed, epoch, many)
    if key not in _orders:
        _orders.clear()
        _orders[key] = np.random.default_rng([seed, 19, epoch]).permutation(many)
    return _orders[key]


def sights_of(facts: SceneFacts) -> list[int]:
    """Classes of each of `SIGHTS`."""
    return [words.index(getattr(facts, name)) for name, words in SIGHTS.items()]


def picture_batches(recipe: VlmRecipe, pictures: PictureSet) -> Callable[[int], Iterator[tuple[torch.Tensor, ...]]]:
    """Endless batches from a step on: pixels (B, H, W, 3) float32, classes of `SIGHTS` (B, 4) int64, and cells
    (B, 2, *CELLS), 0 to 1."""
    plain = np.array([sights_of(facts) for facts in pictures.facts])
    turned = np.array([sights_of(mirrored(facts)) for facts in pictures.facts])

    def batch(step: int) -> tuple[torch.Tensor, ...]:
        rng = np.random.default_rng([recipe.seed, 29, step])
        count = recipe.seen_pictures
        places = [dealt(recipe.seed, step * count + i, len(pictures)) for i in range(count)]
        shown, cells = varied(pictures.pixels[places], rng), pictures.cells[places].astype(np.float32) / 255.0
        flips = rng.random(count) < 0.5
        shown[flips], cells[flips] = shown[flips][:, :, ::-1], cells[flips][..., ::-1]
        wanted = np.where(flips[:, None], turned[places], plain[places])
        return torch.from_numpy(shown), torch.from_numpy(wanted), torch.from_numpy(cells)

    def from_step(first: int) -> Iterator[tuple[torch.Tensor, ...]]:
        step = first
        while True:
            yield batch(step)
            step += 1

    return from_step


def seeing_loss(model: CompactVlm, batch: tuple[torch.Tensor, ...]) -> torch.Tensor:
    """Cross-entropy of what is seen, and of the cells; a cell counts as covered where a fifth of it is."""
    pixels, wanted, cells = batch
    found, covered = model.perceived(pixels)
    sights = sum((cross_entropy(logits, wanted[:, place]) for place, logits in enumerate(found)), pixels.new_zeros(()))
    return sights + _CELLS_SHARE * binary_cross_entropy_with_logits(covered, (5.0 * cells).clamp(max=1.0))


def train_eye(
    model: CompactVlm,
    folder: Path,
    recipe: VlmRecipe,
    pictures: PictureSet,
    watch: Callable[[int, float, float], None] | None = None,
    evaluate: Callable[[], dict[str, float]] | None = None,
) -> None:
    """Train the eye in place, or go on where a run in this folder stopped; then freeze it.

    Raises:
        ConfigError: The folder holds a run of another recipe.
    """
    parts = (model.eye, model.glance, model.covered, model.taught)
    model.requires_grad_(False)
    for part in parts:
        part.requires_grad_(True)
    fit(
        model,
        picture_batches(recipe, pictures),
        lambda batch: seeing_loss(model, batch),
        lambda step: cosine_rate(step, recipe.seeing_steps, recipe.seeing_rate, _WARMUP, 0.02),
        folder,
        recipe.seeing(),
        recipe.seeing_steps,
        Optimisation(decay=0.05, betas=(0.9, 0.98), precision="float32"),
        evaluate=evaluate,
        watch=watch,
        every=400,
    )
    model.requires_grad_(True)
    for part in parts:
        part.requires_grad_(False)


@torch.inference_mode()
def sights(
    model: CompactVlm, pictures: PictureSet, seed: int
) -> tuple[torch.Tensor, tuple[tuple[SceneFacts, ...], ...]]:
    """Features from the frozen eye for every picture, varied: (_VARIANTS, N, SEEN, hidden); and the facts of each."""
    model.eval()
    found: list[torch.Tensor] = []
    for variant in range(_VARIANTS):
        rng = np.random.default_rng([seed, 31, variant])
        tokens: list[torch.Tensor] = []
        for start in range(0, len(pictures), 50):
            shown = varied(pictures.pixels[start : start + 50], rng)
            shown = shown[:, :, ::-1].copy() if variant % 2 else shown
            tokens.append(model.seen(torch.from_numpy(shown)))
        found.append(torch.cat(tokens))
    model.train()
    return torch.stack(found), (pictures.facts, tuple(mirrored(facts) for facts in pictures.facts))


@torch.inference_mode()
def seeing_figures(model: CompactVlm, pictures: PictureSet, *, vary: bool = False) -> dict[str, float]:
    """Percent right of each of `SIGHTS`; with `vary` on pictures as other cameras might have taken them."""
    was = model.training
    model.eval()
    rng = np.random.default_rng(37)
    right: dict[str, list[bool]] = {name: [] for name in SIGHTS}
    for start in range(0, len(pictures), 50):
        part = pictures.pixels[start : start + 50]
        shown = torch.from_numpy(varied(part, rng) if vary else part)
        logits, _ = model.perceived(shown)
        for place, name in enumerate(SIGHTS):
            best = logits[place].argmax(dim=1).tolist()
            wanted = [sights_of(facts)[place] for facts in pictures.facts[start : start + 50]]
            right[name] += [a == b for a, b in zip(best, wanted, strict=True)]
    model.train(was)
    return {name: 100.0 * float(np.mean(hits)) for name, hits in right.items()}
