# pyright: reportMissingImports=false, reportUnknownParameterType=false
"""The frames recipe: tokens of a front picture, own motion and the command, to six waypoints by masked diffusion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
import torch
from torch.nn import functional

from chauffeur.foreign.waypoints import FUTURE
from chauffeur.models.net.transformer import TransformerConfig
from chauffeur.models.train.rates import cosine_rate
from chauffeur.models.train.trainer import Optimisation, fit
from chauffeur.models.vilad.decoding import Twin, Uncached
from chauffeur.models.vilad.frames_data import EGO_WIDTH, FrameSet
from chauffeur.models.vilad.frames_vision import batches
from chauffeur.models.vilad.losses import Noise, masked
from chauffeur.models.vilad.network import Vilad, ViladConfig
from chauffeur.models.vilad.waypoints import WaypointCodebook
from chauffeur.planners.vilad.template import MASK
from chauffeur.planners.vilad.unmasking import NEVER, Decided, Unmasking, distribution, unmask, unmask_many
from chauffeur.planners.word_table import SHIPPED_WORDS, WIDTH, load_words

Array = np.ndarray[Any, Any]
FramesMode = Literal["vilad", "twin"]

MOST_WORDS: Final = 8
PROMPT: Final = 1 + MOST_WORDS
"""Vectors of the textual context: own motion, then the command's words, padded with zeros."""
ONE_PASS: Final = Unmasking(steps=1, tau=0.5, base="maskable")
"""Algorithm 2 with Sps = 1. What is measured is the median of a slot's own distribution, and a slot that is decided
after others is narrowed to one of the futures that could come: one pass is both the fastest and the closest."""


@dataclass(frozen=True, slots=True)
class FramesRecipe:
    """Settings that decide a training run.

    Attributes:
        mode: Masked diffusion, or the autoregressive twin of the same size and data.
        hidden, layers, heads, inner: The transformer.
        steps, batch, rate: The rate falls as a cosine.
        full: Share of samples with every waypoint masked (`losses.Noise`).
        soft_m: A true waypoint's weight is spread over codes nearby: deviation at 0.5 s, growing with time.
        dropped: Share of a picture's numbers that are hidden.
        jitter: Noise added to what is known of own motion.
        seed: Of everything.
    """

    mode: FramesMode = "vilad"
    hidden: int = 128
    layers: int = 2
    heads: int = 4
    inner: int = 256
    steps: int = 500
    batch: int = 64
    rate: float = 1.5e-3
    full: float = 0.5
    soft_m: float = 0.15
    dropped: float = 0.3
    jitter: float = 0.03
    seed: int = 0

    def rate_at(self, step: int) -> float:
        """Learning rate of a step."""
        return cosine_rate(step, self.steps, self.rate, 100, 0.02)

    def config(self, width: int) -> ViladConfig:
        """The network over picture tokens of a width."""
        body = TransformerConfig(self.hidden, self.layers, self.heads, self.heads, self.inner, causal=False)
        config = ViladConfig(body, WIDTH, width, keys=4)
        return config.twin if self.mode == "twin" else config


def prompts(ego: Array, commands: list[str]) -> torch.Tensor:
    """The textual context of each frame, (n, PROMPT, WIDTH).

    Args:
        ego: `frames_data.ego_features`, (n, EGO_WIDTH).
        commands: What the navigation says.
    """
    words = load_words(SHIPPED_WORDS)
    found = np.zeros((len(commands), PROMPT, WIDTH), np.float32)
    found[:, 0, :EGO_WIDTH] = ego
    known: dict[str, Array] = {}
    for line, command in enumerate(commands):
        if command not in known:
            known[command] = words.vectors(words.tokens(command))[:MOST_WORDS] if command else np.zeros((0, WIDTH))
        found[line, 1 : 1 + len(known[command])] = known[command]
    return torch.from_numpy(found)


def soft_targets(book: WaypointCodebook, off: Array, soft_m: float) -> Array:
    """Weights of the codes of each displacement (n, FUTURE, 2), (n, FUTURE, codes), float32: a Gaussian round it."""
    away = np.linalg.norm(off[:, :, None] - book.centres[None], axis=-1)
    near = away.min(axis=-1, keepdims=True)
    deviation = soft_m * np.arange(1, FUTURE + 1)[None, :, None]
    raised = np.exp(-0.5 * ((away**2 - near**2) / deviation**2))
    return (raised / raised.sum(axis=-1, keepdims=True)).astype(np.float32)


def train_frames(
    folder: Path,
    recipe: FramesRecipe,
    book: WaypointCodebook,
    frames: FrameSet,
    tokens: torch.Tensor,
    off: Array,
    watch: Callable[[int, float, float], None] | None = None,
    device: str = "cpu",
) -> Vilad:
    """Train, or go on in this folder; the mean of the weights, on the CPU.

    Args:
        folder: Of the run.
        recipe: What decides it.
        book: Of the waypoints.
        frames: The training split.
        tokens: Of its pictures, each in several lights, (views, n, T, width).
        off: Of its true waypoints from the expected ones, (n, FUTURE, 2).
        watch: Is told (step, loss, seconds).
        device: Where it is trained.

    Raises:
        ConfigError: The folder holds a run of another recipe.
    """
    torch.manual_seed(recipe.seed)
    template = book.template
    model = Vilad(recipe.config(tokens.shape[3]), template).to(device)
    words = prompts(frames.ego, frames.commands)
    codes = book.nearest(off)
    rows = torch.from_numpy(np.tile(template.canvas, (len(codes), 1)))
    maskable = torch.from_numpy(template.maskable)
    places = maskable.to(device)
    rows[:, maskable] = torch.from_numpy(codes) + book.first
    soft = torch.from_numpy(soft_targets(book, off, recipe.soft_m))
    codes_at = slice(book.first, book.first + book.codes)
    known = torch.ones((recipe.batch, PROMPT), dtype=torch.bool)
    noise = Noise(0.1, recipe.full)

    def loss(drawn: tuple[int, torch.Tensor]) -> torch.Tensor:
        step, chosen = drawn
        generator = torch.Generator().manual_seed(recipe.seed * 1_000_003 + step)
        seen = tokens[torch.randint(len(tokens), (len(chosen),), generator=generator), chosen]
        seen = seen * (torch.rand(seen.shape, generator=generator) >= recipe.dropped)
        told = words[chosen]
        told[:, 0, :EGO_WIDTH] += recipe.jitter * torch.randn((len(chosen), EGO_WIDTH), generator=generator)
        own = rows[chosen]
        many = known[: len(chosen)]
        if recipe.mode == "twin":
            hidden, t = maskable.expand(len(own), -1), torch.ones(len(own))
        else:
            own, hidden, t = masked(own, maskable, noise, generator)
        logits = model(*(one.to(device) for one in (told, many, seen, own)))
        wanted, counted = soft[chosen].to(device), (hidden[:, maskable] / t[:, None]).to(device)
        wrong = -(wanted * functional.log_softmax(logits[:, places, codes_at], dim=-1)).sum(dim=-1)
        return (wrong * counted).sum(dim=1).mean() / FUTURE  # Eq. 30, soft targets

    mean = fit(
        model,
        batches(len(codes), recipe.batch, recipe.seed),
        loss,
        recipe.rate_at,
        folder,
        asdict(recipe) | {"codes": book.codes, "round": "ego-status MLP"},
        recipe.steps,
        Optimisation(ema=0.995, precision="float32"),
        watch=watch,
        save_s=30.0,
    )
    assert isinstance(mean, Vilad)
    return mean.cpu().eval()


@dataclass(frozen=True, slots=True)
class PlannedPath:
    """Waypoints of a frame.

    Attributes:
        waypoints: (FUTURE, 2), m, ego frame.
        decided: Tokens, their order, passes.
    """

    waypoints: Array
    decided: Decided


class _Told:
    """A bound network that keeps each slot's distribution as it was when the slot was decided."""

    def __init__(self, bound: Uncached) -> None:
        self._bound, self.logits = bound, list[Array]()

    def __call__(self, row: Array) -> Array:
        self.logits.append(self._bound(row))
        return self.logits[-1]


class _ToldTwin(Twin):
    """The twin, which keeps the logits of every place as it came to it."""

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self.logits: dict[int, Array] = {}

    def told(self, row: Array, place: int, done: int, *, keep: bool) -> Array:
        self.logits[place] = super().told(row, place, done, keep=keep)
        return self.logits[place]


def plan_path(
    model: Vilad,
    book: WaypointCodebook,
    expected: Array,
    words: torch.Tensor,
    tokens: torch.Tensor,
    how: Unmasking = ONE_PASS,
) -> PlannedPath:
    """Waypoints of one frame, by Algorithm 2, or by the twin from left to right with its cache.

    Args:
        model: Trained; a causal one is the twin.
        book: Of the waypoints.
        expected: Where own motion and command lead, (FUTURE, 2).
        words: (1, PROMPT, WIDTH).
        tokens: Of the picture, (1, T, width).
        how: Rule, bound and steps; of no meaning to the twin.
    """
    template = book.template
    allowed = template.allowed(tokens.shape[1])
    places = np.flatnonzero(template.maskable)
    if model.config.body.causal:
        twin = _ToldTwin(model, words, tokens, template.length)
        decided = twin.decide(template, allowed, cached=True)
        held = np.stack([twin.logits[int(place)] for place in places])
    else:
        told = _Told(Uncached(model, words, tokens, template.length))
        decided = unmask(told, template.canvas, allowed, how)
        held = np.stack([told.logits[decided.order[place] - 1][place] for place in places])
    shares = distribution(np.where(allowed[places], held, NEVER))[:, book.first : book.first + book.codes]
    return PlannedPath(book.waypoints(expected, shares), decided)


@torch.no_grad()
def plan_paths(
    model: Vilad,
    book: WaypointCodebook,
    expected: Array,
    words: torch.Tensor,
    tokens: torch.Tensor,
    how: Unmasking = ONE_PASS,
    batch: int = 64,
) -> list[PlannedPath]:
    """`plan_path` of many frames, a batch at a time: the same tokens in fewer calls.

    Args:
        model: Trained; a causal one is the twin.
        book: Of the waypoints.
        expected: Where own motion and command lead, (n, FUTURE, 2).
        words: (n, PROMPT, WIDTH).
        tokens: Of the pictures, (n, T, width).
        how: Rule, bound and steps; of no meaning to the twin.
        batch: Frames at a time.
    """
    found: list[PlannedPath] = []
    for start in range(0, len(expected), batch):
        own = slice(start, start + batch)
        found += _plan_batch(model, book, expected[own], words[own], tokens[own], how)
    return found


def _plan_batch(
    model: Vilad, book: WaypointCodebook, expected: Array, words: torch.Tensor, tokens: torch.Tensor, how: Unmasking
) -> list[PlannedPath]:
    template, many = book.template, len(expected)
    allowed = template.allowed(tokens.shape[1])
    places = np.flatnonzero(template.maskable)
    known = torch.ones((many, words.shape[1]), dtype=torch.bool)
    held = np.zeros((many, len(template.pieces), allowed.shape[1]))

    def predict(rows: Array, which: Array) -> Array:
        """Logits of some of the batch; those of places that are still masked are kept as the latest word on them."""
        chosen = torch.from_numpy(which)
        logits = model(words[chosen], known[chosen], tokens[chosen], torch.from_numpy(rows)).float().numpy()
        still = rows == MASK
        held[which] = np.where(still[..., None], logits, held[which])
        return logits

    canvas = np.tile(template.canvas, (many, 1))
    if model.config.body.causal:
        order = np.zeros(canvas.shape, np.int64)
        for place in places:
            logits = predict(canvas, np.arange(many))[:, place]
            canvas[:, place] = np.where(allowed[place], logits, NEVER).argmax(axis=-1)
            order[:, place] = place + 1
        ones = np.ones(len(template.pieces))
        decided = [Decided(canvas[i], order[i], ones, len(template.pieces)) for i in range(many)]
    else:
        decided = unmask_many(predict, canvas, np.tile(allowed, (many, 1, 1)), how)
    shares = distribution(np.where(allowed[places], held[:, places], NEVER))[..., book.first : book.first + book.codes]
    return [PlannedPath(book.waypoints(expected[i], shares[i]), decided[i]) for i in range(many)]
