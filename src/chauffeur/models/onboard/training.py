# pyright: reportMissingImports=false, reportUntypedBaseClass=false, reportUntypedFunctionDecorator=false, reportUnknownParameterType=false
"""Training the on-board model: next-token loss on the replies, resumable, the same from the same seed.

The architecture is `transformers`' Llama, small; the loop is plain PyTorch, on CPU cores (bfloat16) or one GPU.
"""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass, replace
from itertools import count
from pathlib import Path
from typing import Any, Final, cast

import numpy as np
import torch
from torch.nn import functional
from torch.nn.attention import SDPBackend, sdpa_kernel

from chauffeur.concept import ConfigError
from chauffeur.models.net.transformer import Network, TransformerConfig, language_model
from chauffeur.models.onboard.packed import Array, Packed
from chauffeur.models.onboard.tokens import Blanks
from chauffeur.models.train.trainer import Optimisation, fit

LENGTHS: Final = (32, 40, 48, 56, 64, 80, 96, 128, 192, 320, 512)
"""Tokens an example is padded to."""
ROWS: Final = 256
"""The loss is taken of a multiple of so many tokens."""
COMPILED_FROM: Final = 2_000
"""Steps of a run from which fused kernels pay."""


@dataclass(frozen=True, slots=True)
class Size:
    """Shape of the network."""

    hidden: int
    layers: int
    heads: int
    kv_heads: int
    inner: int


SIZES: Final = {
    "tiny": Size(64, 2, 2, 1, 128),
    "small": Size(192, 6, 3, 1, 512),
    "medium": Size(256, 6, 4, 2, 640),
    "large": Size(384, 10, 6, 2, 1024),
}
"""`small` trains in an hour on two cores: 2.9 M parameters; `medium` has 4.6 M, `large`, for a GPU, 15 M."""


@dataclass(frozen=True, slots=True)
class Recipe:
    """Settings that decide a training run.

    Attributes:
        size: One of SIZES.
        steps: Optimiser steps.
        batch_tokens: Tokens a step, padding included.
        rate: Highest learning rate.
        warmup: Steps until it is reached; then it falls along a cosine.
        decay: Weight decay.
        blanked: Share of a wish's words that are blanked, in half of the examples: so that no template is learned by
            one word, and the draft is listened to.
        seed: Of weights and order.
        more: Steps of a second round after `steps`: the rate rises once more, to half its height, and falls again
            (warm restart, Loshchilov and Hutter 2017); it goes on from a finished first round.
        blanked_more: `blanked` in the second round, where the templates' words are known well.
        base: The finished run whose weights it begins with ("version/data"); empty to begin from nothing.
    """

    size: str = "small"
    steps: int = 6000
    batch_tokens: int = 4096
    rate: float = 2e-3
    warmup: int = 200
    decay: float = 0.05
    blanked: float = 0.15
    seed: int = 0
    more: int = 0
    blanked_more: float = 0.25
    base: str = ""

    @classmethod
    def onwards(cls, base: str, size: str, steps: int, seed: int) -> Recipe:
        """Training a finished network on, with other data: at the rate and the blanking of a second round."""
        plain = cls()
        return cls(size, steps, rate=plain.rate / 2.0, blanked=plain.blanked_more, seed=seed, base=base)

    @property
    def all_steps(self) -> int:
        """Of both rounds."""
        return self.steps + self.more

    def goes_on_from(self, stored: dict[str, Any], step: int) -> bool:
        """True if a run's stored state is one of this recipe, or of its first round when that is finished."""
        first = asdict(replace(self, more=0))
        return stored == asdict(self) or (step == self.steps and first | stored == first)


def network(size: Size, vocabulary: int, end: int) -> Network:
    """An untrained network. Weights come from torch's global generator."""
    config = TransformerConfig(
        size.hidden, size.layers, size.heads, size.kv_heads, size.inner, vocabulary=vocabulary, end=end
    )
    return language_model(config)


def batches(data: Packed, tokens: int, rng: np.random.Generator) -> Iterator[Array]:
    """Endless batches of example numbers in random order, each of one of a few shapes.

    Matrix kernels are made for a shape, and making one costs more than a step: so lengths are rounded up to a few, and
    every batch of a length has the same number of rows. The few examples that fill no batch wait for the next round.
    """
    lengths = np.diff(data.starts)
    rounded = np.array([next(size for size in LENGTHS if size >= length) for length in lengths])
    while True:
        order = rng.permutation(len(data))
        pool: list[Array] = []
        for length in LENGTHS:
            same = order[rounded[order] == length]
            rows = max(1, tokens // length)
            pool += [same[i : i + rows] for i in range(0, len(same) - rows + 1, rows)]
            if 0 < len(same) < rows:
                pool.append(np.resize(same, rows))
        for place in rng.permutation(len(pool)):
            yield pool[place]


def collate(data: Packed, which: Array, pad: int) -> tuple[torch.Tensor, torch.Tensor]:
    """(tokens, targets), both (batch, one of LENGTHS); targets are -100 outside the replies."""
    rows = [data.tokens[data.starts[i] : data.starts[i + 1]].astype(np.int64) for i in which]
    longest = next(size for size in LENGTHS if size >= max(len(row) for row in rows))
    ids = np.full((len(rows), longest + 1), pad, np.int64)
    targets = np.full((len(rows), longest + 1), -100, np.int64)
    for line, (row, i) in enumerate(zip(rows, which, strict=True)):
        ids[line, : len(row)] = row
        begin = int(data.replies[i])
        targets[line, begin : len(row)] = row[begin:]
    return torch.from_numpy(ids[:, :-1]), torch.from_numpy(targets[:, 1:])


def blank(ids: torch.Tensor, blanks: Blanks, share: float, rng: np.random.Generator) -> None:
    """Blank a share of the wishes' words in half of a batch's rows (in place); numbers stay."""
    rows: Array = ids.numpy()
    opened = np.cumsum(rows == blanks.wish, axis=1) > np.cumsum(rows == blanks.draft, axis=1)
    words = opened & (rows != blanks.wish) & ~np.isin(rows, list(blanks.kept))
    chosen = rng.random(rows.shape) < share * (rng.random((len(rows), 1)) < 0.5)
    rows[words & chosen] = blanks.blank


def loss_of(model: Network, ids: torch.Tensor, targets: torch.Tensor, body: Network | None = None) -> torch.Tensor:
    """Mean loss over the replies' tokens; only for them are words weighed, two thirds of a row being prompt.

    Args:
        model: A `LlamaForCausalLM`.
        ids, targets: As `collate` gives them.
        body: Its compiled body, where there is one.
    """
    hidden = (model.model if body is None else body)(input_ids=ids, use_cache=False).last_hidden_state.flatten(0, 1)
    wanted = targets.flatten()
    kept = (wanted != -100).nonzero().squeeze(1)
    spare = -len(kept) % ROWS  # row 0, without a target: kernels are made for a few shapes
    rows = functional.pad(kept, (0, spare))
    labels = functional.pad(wanted[kept], (0, spare), value=-100)
    return functional.cross_entropy(model.lm_head(hidden[rows]).float(), labels, ignore_index=-100)


def compiled_body(model: Network) -> Network | None:
    """The network's body as fused kernels, where there is a compiler; they round differently in the last bits."""
    if shutil.which("g++") is None:
        return None
    torch._dynamo.config.recompile_limit = 2 * len(LENGTHS)  # pyright: ignore[reportPrivateUsage]
    return torch.compile(model.model, dynamic=False)


def rate_at(step: int, recipe: Recipe) -> float:
    """Learning rate of a step."""
    highest, steps = recipe.rate, recipe.steps
    if step >= steps:
        highest, steps, step = recipe.rate / 2.0, recipe.more, step - steps
    if step < recipe.warmup:
        return highest * (step + 1) / recipe.warmup
    share = (step - recipe.warmup) / max(1, steps - recipe.warmup)
    return highest * (0.02 + 0.98 * 0.5 * (1.0 + math.cos(math.pi * min(1.0, share))))


def train(
    data: Packed,
    folder: Path,
    recipe: Recipe,
    *,
    vocabulary: int,
    end: int,
    blanks: Blanks | None = None,
    held_back: Packed | None = None,
    watch: Callable[[int, float, float], None] | None = None,
    device: str = "",
    save_s: float = 120.0,
    begin: dict[str, torch.Tensor] | None = None,
) -> Network:
    """Train, or go on where a run in this folder stopped.

    Args:
        data: Training examples.
        folder: Where the run keeps its state (`state.pt`) and log (`log.jsonl`).
        recipe: What decides the run.
        vocabulary, end: Size of the vocabulary, token that ends a reply.
        blanks: Tokens for blanking; None for none.
        held_back: Validation examples, looked at from time to time.
        watch: Called after each step with (step, loss, tokens per second).
        device: `cpu`, `cuda`; empty for the best at hand.
        save_s: Seconds between two saves.
        begin: Weights to begin with; None for new ones.

    Raises:
        ConfigError: The folder holds a run of another recipe.
    """
    where = torch.device(device or ("cuda" if torch.cuda.is_available() else "cpu"))
    torch.manual_seed(recipe.seed)
    model: Any = network(SIZES[recipe.size], vocabulary, end).to(where)
    if begin is not None:
        model.load_state_dict(begin)
    # Making kernels for all lengths takes some minutes, a step then three quarters of its time.
    body = compiled_body(model) if recipe.all_steps >= COMPILED_FROM else None
    # The flash kernels are for long rows; of these, plain products are the faster.
    attention = [SDPBackend.MATH] if where.type == "cpu" else [SDPBackend.FLASH_ATTENTION, SDPBackend.MATH]
    tokens = 0

    def fed(first: int) -> Iterator[tuple[torch.Tensor, torch.Tensor]]:
        nonlocal tokens
        feed = batches(data, recipe.batch_tokens, np.random.default_rng([recipe.seed, 1]))
        for _ in range(first):  # the order is the seed's; what was seen is passed over
            next(feed)
        for step in count(first):
            ids, targets = collate(data, next(feed), end)
            if blanks is not None:
                share = recipe.blanked if step < recipe.steps else recipe.blanked_more
                blank(ids, blanks, share, np.random.default_rng([recipe.seed, 2, step]))
            tokens = ids.numel()
            yield ids.to(where), targets.to(where)

    def weighed(batch: tuple[torch.Tensor, torch.Tensor]) -> torch.Tensor:
        ids, targets = batch
        return loss_of(model, ids, targets, body)

    def attending() -> AbstractContextManager[object]:
        return cast("AbstractContextManager[object]", sdpa_kernel(attention))

    fit(
        model,
        fed,
        weighed,
        lambda step: rate_at(step, recipe),
        folder,
        asdict(recipe),
        recipe.all_steps,
        Optimisation(decay=recipe.decay, precision="bfloat16"),
        continues=recipe.goes_on_from,
        evaluate=None
        if held_back is None
        else lambda: {"held_back": evaluate_loss(model, held_back, recipe.batch_tokens, end)},
        watch=None if watch is None else lambda step, loss, seconds: watch(step, loss, tokens / seconds),
        save_s=save_s,
        around=attending,
    )
    return model


def finished(folder: Path) -> tuple[Recipe, dict[str, torch.Tensor]]:
    """(recipe, weights) of a finished run's state.

    Raises:
        ConfigError: There is none, or it is not finished.
    """
    hint = "--base is the folder of a finished run of `chauffeur model train onboard`."
    try:
        state: dict[str, Any] = torch.load(folder / "state.pt", map_location="cpu", weights_only=True)
    except OSError as error:
        raise ConfigError(f"{folder} holds no training run.", hint=hint) from error
    recipe = Recipe(**state["recipe"])
    if int(state["step"]) < recipe.all_steps:
        raise ConfigError(f"The training run in {folder} is not finished.", hint=hint)
    return recipe, state["model"]


@torch.no_grad()
def evaluate_loss(model: Network, data: Packed, tokens: int, pad: int, most: int = 2048) -> float:
    """Mean loss a reply token over (the first `most` of) some examples."""
    model.eval()
    where = next(model.parameters()).device
    total = seen = 0.0
    feed = batches(data, tokens, np.random.default_rng(0))
    for _ in range(max(1, most * 60 // tokens)):
        ids, targets = collate(data, next(feed), pad)
        with torch.autocast(where.type, torch.bfloat16):
            loss = loss_of(model, ids.to(where), targets.to(where))
        number = float((targets != -100).sum())
        total += float(loss) * number
        seen += number
    model.train()
    return total / max(1.0, seen)
