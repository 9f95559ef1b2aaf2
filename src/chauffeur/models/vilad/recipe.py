# pyright: reportMissingImports=false, reportUnknownParameterType=false
"""Shared parts of ViLaD recipes: commands and fresh scenes without end, the fixed pattern, the objective, the run.

A recipe of a task is a `ViladTask` (what is said, in what scene, and what the right answer is) over this.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, Literal, Protocol

import numpy as np
import torch

from chauffeur.concept import ConfigError
from chauffeur.models.train.trainer import Optimisation, fit, stored
from chauffeur.models.vilad.export import exported_weights
from chauffeur.models.vilad.losses import Noise, diffusion_loss, masked, next_token_loss
from chauffeur.models.vilad.network import SIZES, Vilad, ViladConfig
from chauffeur.planners.vilad.template import ActionTemplate
from chauffeur.planners.word_table import WIDTH, WordTable

Array = np.ndarray[Any, Any]
Mode = Literal["fixed", "plain", "twin"]


@dataclass(frozen=True, slots=True)
class ViladRecipe:
    """Settings that decide a training run.

    Attributes:
        size: One of `network.SIZES`.
        mode: `fixed` pattern training (the paper's best), `plain` masked diffusion without it, or the autoregressive
            `twin` of the same size and data.
        steps: Optimiser steps.
        batch: Commands a step.
        rate: Highest learning rate; reached after `warmup` steps, kept, and brought down over the last `cooling` share.
        warmup: See there.
        cooling: See there.
        full, least: See `losses.Noise`.
        dropped: Share of the words' pieces that are hidden, so that no phrase hangs on one word.
        jitter: Noise added to the words' vectors, in their own deviation, so that words nearby mean the same.
        seed: Of weights and data.
        base: Version of the model whose reading of words training begins with; empty for none.
    """

    size: str = "lot"
    mode: Mode = "fixed"
    steps: int = 1_200
    batch: int = 32
    rate: float = 1.5e-3
    warmup: int = 200
    cooling: float = 0.25
    full: float = 0.5
    least: float = 0.1
    dropped: float = 0.08
    jitter: float = 0.35
    seed: int = 0
    base: str = ""

    def rate_at(self, step: int) -> float:
        """Learning rate of a step."""
        if step < self.warmup:
            return self.rate * (step + 1) / self.warmup
        left = (self.steps - step) / max(1.0, self.cooling * self.steps)
        return self.rate * max(0.02, min(1.0, left))


class HasText(Protocol):
    """A command in words."""

    @property
    def text(self) -> str: ...


class ViladTask(Protocol):
    """Task that a recipe learns."""

    @property
    def template(self) -> ActionTemplate:
        """The pattern of its answers."""
        ...

    @property
    def width(self) -> int:
        """Numbers by which a candidate is described."""
        ...

    def command(self, rng: np.random.Generator) -> HasText:
        """A command of the training split."""
        ...

    def answered(self, rng: np.random.Generator, said: Sequence[Any]) -> tuple[Array, Array]:
        """(candidates (B, S, width) float32, y_0 (B, L) int64) of commands, each in a fresh scene."""
        ...


@dataclass(frozen=True, slots=True)
class ViladBatch:
    """Commands and scenes as the network takes them.

    Attributes:
        words: (B, T, WIDTH) float32; padded with zeros.
        known: Which are words, bool (B, T).
        scene: (B, S, width) float32.
        rows: y_0, int64 (B, L).
        step: Whose it is.
    """

    words: torch.Tensor
    known: torch.Tensor
    scene: torch.Tensor
    rows: torch.Tensor
    step: int


def packed_words(texts: list[str], words: WordTable) -> tuple[Array, Array]:
    """(ids (n, longest), which are words (n, longest)) of texts."""
    tokens = [words.tokens(text) for text in texts]
    longest = max(len(one) for one in tokens)
    ids = np.zeros((len(texts), longest), np.int64)
    known = np.zeros((len(texts), longest), np.bool_)
    for line, one in enumerate(tokens):
        ids[line, : len(one)], known[line, : len(one)] = one, True
    return ids, known


def batches(task: ViladTask, recipe: ViladRecipe, words: WordTable) -> Callable[[int], Iterator[ViladBatch]]:
    """Endless batches from a step on; each step's come from its own number.

    Commands of four steps are drawn together and dealt out by length: padding costs as much as words do.
    """

    def from_step(first: int) -> Iterator[ViladBatch]:
        step = first
        while True:
            group, own = divmod(step, _TOGETHER)
            dealt = _dealt(task, recipe, words, group)
            for turn in range(own, _TOGETHER):
                yield _batch(task, recipe, words, dealt[turn], group * _TOGETHER + turn)
            step = (group + 1) * _TOGETHER

    return from_step


_TOGETHER: Final = 4


def _dealt(task: ViladTask, recipe: ViladRecipe, words: WordTable, group: int) -> list[list[HasText]]:
    rng = np.random.default_rng([recipe.seed, 3, group])
    said = [task.command(rng) for _ in range(_TOGETHER * recipe.batch)]
    said.sort(key=lambda one: len(words.tokens(one.text)))
    parts = [said[i * recipe.batch : (i + 1) * recipe.batch] for i in range(_TOGETHER)]
    return [parts[int(i)] for i in rng.permutation(_TOGETHER)]


def _batch(task: ViladTask, recipe: ViladRecipe, words: WordTable, said: list[HasText], step: int) -> ViladBatch:
    rng = np.random.default_rng([recipe.seed, 5, step])
    scenes, rows = task.answered(rng, said)
    ids, known = packed_words([one.text for one in said], words)
    vectors = words.vectors(ids)
    vectors += recipe.jitter * rng.standard_normal(vectors.shape, np.float32)
    vectors *= (known & (rng.random(ids.shape) >= recipe.dropped))[..., None]
    return ViladBatch(
        torch.from_numpy(vectors), torch.from_numpy(known), torch.from_numpy(scenes), torch.from_numpy(rows), step
    )


def network(task: ViladTask, recipe: ViladRecipe) -> Vilad:
    """An untrained network of a recipe."""
    config = ViladConfig(SIZES[recipe.size], WIDTH, task.width)
    return Vilad(config.twin if recipe.mode == "twin" else config, task.template)


def loss_of(model: Vilad, recipe: ViladRecipe, batch: ViladBatch) -> torch.Tensor:
    """Eq. 30 of a batch, or the twin's loss."""
    template = model.template
    maskable = torch.from_numpy(template.maskable)
    if recipe.mode == "twin":
        allowed = torch.from_numpy(template.allowed(batch.scene.shape[1]))
        logits = model(batch.words, batch.known, batch.scene, batch.rows)
        return next_token_loss(logits, batch.rows, maskable, allowed)
    generator = torch.Generator().manual_seed(recipe.seed * 1_000_003 + batch.step)
    noise = Noise(recipe.least, recipe.full, recipe.mode == "fixed")
    rows, hidden, t = masked(batch.rows, maskable, noise, generator)
    logits = model(batch.words, batch.known, batch.scene, rows)
    if recipe.mode == "fixed":
        allowed = torch.from_numpy(template.allowed(batch.scene.shape[1]))
        many = int(maskable.sum())
    else:  # nothing is known of the pattern: any word, any candidate, anywhere
        allowed = torch.ones((template.length, logits.shape[-1]), dtype=torch.bool)
        many = template.length
    return diffusion_loss(logits, batch.rows, hidden, t, allowed, many)


def train(
    folder: Path,
    task: ViladTask,
    recipe: ViladRecipe,
    words: WordTable,
    watch: Callable[[int, float, float], None] | None = None,
    evaluate: Callable[[Vilad], dict[str, float]] | None = None,
    base: Path | None = None,
) -> Vilad:
    """Train, or go on in this folder; the mean of the weights.

    Args:
        folder: Of the run.
        task: What is learned.
        recipe: How.
        words: Vectors of words.
        watch: Is told of each step.
        evaluate: Gives metrics now and then.
        base: Folder of a run on another task, of the same size: its connector of words and its transformer are where
            training begins.

    Raises:
        ConfigError: The folder holds a run of another recipe, or the base no run of this size.
    """
    torch.manual_seed(recipe.seed)
    model = network(task, recipe)
    if base is not None:
        _take_over(model, base)
    mean = fit(
        model,
        batches(task, recipe, words),
        lambda batch: loss_of(model, recipe, batch),
        recipe.rate_at,
        folder,
        asdict(recipe),
        recipe.steps,
        Optimisation(ema=0.998, precision="float32"),
        evaluate=None if evaluate is None else lambda: evaluate(model),
        watch=watch,
        continues=continues(recipe),
    )
    assert isinstance(mean, Vilad)
    return mean


def _take_over(model: Vilad, base: Path) -> None:
    """All of a run or of a network that ships, if it learned this task; of another's, how words are connected and the
    transformer: its reading."""
    state = stored(base)
    if state is not None:
        given = state["mean"]
    elif (base / "model.onnx").exists():
        given = exported_weights(base, model.config.body.layers)
    else:
        raise ConfigError(f"{base} holds no run to begin with.", hint="Give a folder with `state.pt` or `model.onnx`.")
    own = model.state_dict()
    fits = {name for name, value in given.items() if name in own and own[name].shape == value.shape}
    if any(name.startswith(_READING) for name in given.keys() - fits):
        raise ConfigError(f"The run in {base} is of another size.", hint="Begin with one of the same --size.")
    same = len(fits) == len(given)
    held = {name: value for name, value in given.items() if same or name.startswith(_READING)}
    model.load_state_dict(held, strict=False)


_READING: Final = ("words.", "body.")


def continues(recipe: ViladRecipe) -> Callable[[dict[str, Any], int], bool]:
    """Check if a stored run may go on as this recipe: the same, or with other steps as long as no rate differs yet."""

    def fine(stored: dict[str, Any], step: int) -> bool:
        if stored | {"steps": recipe.steps} != asdict(recipe):
            return False
        return stored["steps"] == recipe.steps or step <= (1.0 - recipe.cooling) * min(stored["steps"], recipe.steps)

    return fine
