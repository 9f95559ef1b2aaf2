# pyright: reportMissingImports=false, reportUnknownParameterType=false
"""The compact VLM's recipe: each picture of a batch comes with three wishes, one a style, and answers to them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch

from chauffeur.models.train.rates import cosine_rate
from chauffeur.models.train.trainer import Optimisation, fit
from chauffeur.models.vilad.recipe import packed_words
from chauffeur.models.vlm.gains import GainCase, gain_table, taught_gains
from chauffeur.models.vlm.network import SIZES, CompactVlm
from chauffeur.models.vlm.scenes import PictureSet, SceneFacts
from chauffeur.models.vlm.wishes import training_wish
from chauffeur.planners.vilad.words import WordTable
from chauffeur.planners.vlm.template import GIVEN, RECALLS, STYLES, TEMPLATE, GainCodebook
from chauffeur.safety.gain_box import gain_box

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, slots=True)
class VlmRecipe:
    """What decides a training run.

    Attributes:
        size: One of `network.SIZES`.
        scenes: Pictures of training; each with three wishes a turn.
        steps: Optimiser steps.
        pictures: Pictures of a batch; each with three wishes.
        rate: Highest learning rate; reached after `warmup` steps, then brought down along a cosine.
        warmup: See there.
        remembered: Share of cases with earlier feedback.
        dropped, jitter: Of the words, as `vilad.parking_recipe` has them.
        seed: Of weights and batches.
    """

    size: str = "compact"
    scenes: int = 4_000
    steps: int = 1_600
    pictures: int = 20
    rate: float = 2e-3
    warmup: int = 100
    remembered: float = 0.2
    dropped: float = 0.10
    jitter: float = 0.35
    seed: int = 0

    def rate_at(self, step: int) -> float:
        """Learning rate of a step."""
        return cosine_rate(step, self.steps, self.rate, self.warmup, 0.03)


@dataclass(frozen=True, slots=True)
class VlmBatch:
    """Pictures with their wishes as the network takes them.

    Attributes:
        pixels: (B, 3, H, W) float32 in 0..1.
        words: (3 B, T, width) float32; padded with zeros.
        known: Which are words, bool (3 B, T).
        rows: What to answer, int64 (3 B, L).
    """

    pixels: torch.Tensor
    words: torch.Tensor
    known: torch.Tensor
    rows: torch.Tensor


def answer_row(facts: SceneFacts, style: str, recall: str, codebook: GainCodebook) -> Array:
    """The template's tokens for a picture and a style, int64 (L,)."""
    case = GainCase(style, facts.weather, facts.grade, facts.lead, facts.task, recall)
    values: dict[str, str | int] = {
        "task": facts.task,
        "recall": recall,
        "style": style,
        "weather": facts.weather,
        "grade": facts.grade,
        "lead": facts.lead,
        "road": facts.road,
        **codebook.tokens(taught_gains(case)),
    }
    return TEMPLATE.encode(values)


def varied(pixels: Array, rng: np.random.Generator) -> Array:
    """Pictures (B, H, W, 3) uint8 as another camera might have taken them, float32 (B, H, W, 3) in 0..1.

    Exposure, contrast, colour balance, saturation, noise, a small shift and zoom; milder than the held-out looks.
    """
    count, height, width, _ = pixels.shape
    shown = pixels.astype(np.float32) / 255.0
    moved = np.empty_like(shown)
    for place in range(count):
        zoom = float(rng.uniform(0.90, 1.04))
        rows = (np.arange(height) - height / 2) * zoom + height / 2 + rng.uniform(-3.0, 3.0)
        columns = (np.arange(width) - width / 2) * zoom + width / 2 + rng.uniform(-4.0, 4.0)
        r, c = np.clip(rows.round().astype(int), 0, height - 1), np.clip(columns.round().astype(int), 0, width - 1)
        moved[place] = shown[place][r][:, c]

    def draw(low: float, high: float, channels: int = 1) -> Array:
        return rng.uniform(low, high, (count, 1, 1, channels)).astype(np.float32)

    grey = moved.mean(axis=3, keepdims=True)
    moved = grey + (moved - grey) * draw(0.6, 1.3)
    moved = (moved - 0.45) * draw(0.88, 1.12) + 0.45
    moved = moved * draw(0.84, 1.18) * draw(0.94, 1.06, 3)
    moved += rng.standard_normal(moved.shape, np.float32) * draw(0.0, 0.02)
    return np.clip(moved, 0.0, 1.0)


_MIRRORED: Final = {"bend_left": "bend_right", "bend_right": "bend_left", "straight": "straight"}


def batches(recipe: VlmRecipe, pictures: PictureSet, words: WordTable) -> Callable[[int], Iterator[VlmBatch]]:
    """Endless batches from a step on; each step's come from its own number. All pictures are seen before one again."""
    codebook = GainCodebook.of(gain_box())
    many = len(pictures)

    def batch(step: int) -> VlmBatch:
        rng = np.random.default_rng([recipe.seed, 17, step])
        places = [_dealt(recipe.seed, (step * recipe.pictures + i), many) for i in range(recipe.pictures)]
        shown = varied(pictures.pixels[places], rng)
        rows: list[Array] = []
        said: list[str] = []
        for row, place in enumerate(places):
            facts = pictures.facts[place]
            if rng.random() < 0.5:
                shown[row] = shown[row][:, ::-1]
                facts = SceneFacts(**{**asdict(facts), "road": _MIRRORED[facts.road]})
            for style in STYLES:
                recall = RECALLS[int(rng.integers(1, 3))] if rng.random() < recipe.remembered else RECALLS[0]
                rows.append(answer_row(facts, style, recall, codebook))
                said.append(training_wish(style, rng))
        ids, known = packed_words(said, words)
        vectors = words.vectors(ids)
        vectors += recipe.jitter * rng.standard_normal(vectors.shape, np.float32)
        vectors *= (known & (rng.random(ids.shape) >= recipe.dropped))[..., None]
        return VlmBatch(
            torch.from_numpy(shown).permute(0, 3, 1, 2).contiguous(),
            torch.from_numpy(vectors),
            torch.from_numpy(known),
            torch.from_numpy(np.stack(rows)),
        )

    def from_step(first: int) -> Iterator[VlmBatch]:
        step = first
        while True:
            yield batch(step)
            step += 1

    return from_step


def _dealt(seed: int, number: int, many: int) -> int:
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


_WEIGHTS: Final = torch.tensor(
    [0.0 if isinstance(piece, str) or piece.name in GIVEN else 2.0 if piece.name == "style" else 1.0
     for piece in TEMPLATE.pieces]
)  # fmt: skip
"""What each token's error counts; fixed and given ones count nothing."""


def loss_of(model: CompactVlm, batch: VlmBatch) -> torch.Tensor:
    """Mean cross-entropy of the decided tokens."""
    seen = model.seen(batch.pixels).repeat_interleave(len(STYLES), dim=0)
    logits = model(batch.words, batch.known, seen, batch.rows)
    found = torch.nn.functional.cross_entropy(logits.flatten(0, 1), batch.rows.flatten(), reduction="none")
    return (found.view(batch.rows.shape) * _WEIGHTS).sum() / (_WEIGHTS.sum() * len(batch.rows))


def train(
    folder: Path,
    recipe: VlmRecipe,
    pictures: PictureSet,
    words: WordTable,
    watch: Callable[[int, float, float], None] | None = None,
    evaluate: Callable[[CompactVlm], dict[str, float]] | None = None,
    every: int = 200,
) -> CompactVlm:
    """Train, or go on where a run in this folder stopped.

    Raises:
        ConfigError: The folder holds a run of another recipe.
    """
    torch.manual_seed(recipe.seed)
    model = CompactVlm(SIZES[recipe.size])
    fit(
        model,
        batches(recipe, pictures, words),
        lambda batch: loss_of(model, batch),
        recipe.rate_at,
        folder,
        {**asdict(recipe), "gains": gain_table()["version"]},
        recipe.steps,
        Optimisation(decay=0.05, betas=(0.9, 0.98), precision="float32"),
        evaluate=None if evaluate is None else lambda: evaluate(model),
        watch=watch,
        every=every,
    )
    return model.eval()
