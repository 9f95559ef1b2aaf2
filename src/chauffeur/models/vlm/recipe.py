# pyright: reportMissingImports=false, reportUnknownParameterType=false
"""The compact VLM's recipe: an eye that learns to see (`seeing`), then words and gains with the eye frozen.

In the second stage each picture of a batch comes with three wishes, one a style, and answers to them; what the eye
makes of the pictures is computed once, so that a step costs no picture.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch

from chauffeur.models.train.trainer import Optimisation, fit
from chauffeur.models.vilad.recipe import packed_words
from chauffeur.models.vlm.config import VlmRecipe
from chauffeur.models.vlm.gains import GainCase, gain_table, taught_gains
from chauffeur.models.vlm.network import SIZES, CompactVlm
from chauffeur.models.vlm.scenes import PictureSet, SceneFacts
from chauffeur.models.vlm.seeing import dealt, seeing_figures, sights, train_eye
from chauffeur.models.vlm.wishes import training_wish
from chauffeur.planners.vlm.template import GIVEN, RECALLS, STYLES, TEMPLATE, GainCodebook
from chauffeur.planners.word_table import WordTable
from chauffeur.safety.gain_box import gain_box

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, slots=True)
class VlmBatch:
    """Pictures with their wishes as the network takes them.

    Attributes:
        seen: What the eye makes of the pictures, (B, SEEN, hidden).
        words: (3 B, T, width) float32; padded with zeros.
        known: Which are words, bool (3 B, T).
        rows: What to answer, int64 (3 B, L).
    """

    seen: torch.Tensor
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


def batches(
    recipe: VlmRecipe, seen: torch.Tensor, facts: Sequence[Sequence[SceneFacts]], words: WordTable
) -> Callable[[int], Iterator[VlmBatch]]:
    """Endless batches from a step on; each step's come from its own number. All pictures are seen before one again.

    Args:
        recipe: What decides the training.
        seen: What the eye makes of each variant of each picture, (variants, N, SEEN, hidden).
        facts: What is true of each.
        words: Vectors of words.
    """
    codebook = GainCodebook.of(gain_box())
    variants, many = seen.shape[:2]

    def batch(step: int) -> VlmBatch:
        rng = np.random.default_rng([recipe.seed, 17, step])
        places = [dealt(recipe.seed, (step * recipe.pictures + i), many) for i in range(recipe.pictures)]
        which = rng.integers(0, variants, len(places))
        rows: list[Array] = []
        said: list[str] = []
        for variant, place in zip(which, places, strict=True):
            for style in STYLES:
                recall = RECALLS[int(rng.integers(1, 3))] if rng.random() < recipe.remembered else RECALLS[0]
                rows.append(answer_row(facts[variant][place], style, recall, codebook))
                said.append(training_wish(style, rng))
        ids, known = packed_words(said, words)
        vectors = words.vectors(ids)
        vectors += recipe.jitter * rng.standard_normal(vectors.shape, np.float32)
        vectors *= (known & (rng.random(ids.shape) >= recipe.dropped))[..., None]
        return VlmBatch(
            seen[torch.from_numpy(which), torch.tensor(places)],
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


_WEIGHTS: Final = torch.tensor(
    [0.0 if isinstance(piece, str) or piece.name in GIVEN else 2.0 if piece.name == "style" else 1.0
     for piece in TEMPLATE.pieces]
)  # fmt: skip
"""Weight of each token's error; fixed and given ones count nothing."""


def loss_of(model: CompactVlm, batch: VlmBatch) -> torch.Tensor:
    """Mean cross-entropy of the decided tokens."""
    seen = batch.seen.repeat_interleave(len(STYLES), dim=0)
    logits = model(batch.words, batch.known, seen, batch.rows)
    found = torch.nn.functional.cross_entropy(logits.flatten(0, 1), batch.rows.flatten(), reduction="none")
    return (found.view(batch.rows.shape) * _WEIGHTS).sum() / (_WEIGHTS.sum() * len(batch.rows))


def train(
    folder: Path,
    recipe: VlmRecipe,
    pictures: PictureSet,
    words: WordTable,
    watch: Callable[[str, int, float, float], None] | None = None,
    val: PictureSet | None = None,
) -> CompactVlm:
    """Train both stages, or go on where a run in this folder stopped.

    Args:
        folder: Of the run; `eye` and `words` in it.
        recipe: What decides the training.
        pictures: To learn from.
        words: Vectors of words.
        watch: Is told (stage, step, loss, seconds).
        val: Pictures that the log tells of now and then how well they are seen.

    Raises:
        ConfigError: The folder holds a run of another recipe.
    """
    torch.manual_seed(recipe.seed)
    model = CompactVlm(SIZES[recipe.size])

    def told(stage: str) -> Callable[[int, float, float], None] | None:
        return None if watch is None else partial(watch, stage)

    train_eye(
        model,
        folder / "eye",
        recipe,
        pictures,
        told("eye"),
        None if val is None else lambda: seeing_figures(model, val),
    )
    seen, facts = sights(model, pictures, recipe.seed)
    fit(
        model,
        batches(recipe, seen, facts, words),
        lambda batch: loss_of(model, batch),
        recipe.rate_at,
        folder / "words",
        {**asdict(recipe), "gains": gain_table()["version"]},
        recipe.steps,
        Optimisation(decay=0.05, betas=(0.9, 0.98), precision="float32"),
        watch=told("words and gains"),
        every=200,
    )
    return model.eval()
