# pyright: reportMissingImports=false, reportUntypedBaseClass=false, reportUnknownParameterType=false
"""The small vision encoder learns to see before anything is decided: what SigLIP brings along from its own training.

It is trained on frames to tell what the simulator knows of a picture (gap and speed of the vehicle ahead, way to the
next halt and junction) and where the car went. Then it is frozen; its tokens are computed once and feed the diffusion
model and its twin alike, so that both see the same. The head stays beside them as a baseline: a picture, regressed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from torch import nn

from chauffeur.bench.openloop.driving import COMMANDS
from chauffeur.foreign.waypoints import FUTURE
from chauffeur.models.net.vision import VisionConfig, VisionEncoder, vision
from chauffeur.models.train.trainer import Optimisation, fit
from chauffeur.models.vilad.frames_data import EGO_WIDTH, FrameSet
from chauffeur.models.vilad.waypoints import displacements

Array = np.ndarray[Any, Any]

SAID: Final = tuple(COMMANDS.values())
STATUS_WIDTH: Final = EGO_WIDTH + len(SAID)
KNOWN: Final = 4
SEEN_TOKENS: Final = 4
SEEN_WIDTH: Final = 32
_WEIGHT: Final = 4.0
"""Of what the simulator knows, against metres of waypoints."""


@dataclass(frozen=True, slots=True)
class VisionRecipe:
    """Settings that decide the encoder's training.

    Attributes:
        vision: The encoder.
        steps, batch, rate, seed: As everywhere; the rate falls as a cosine.
    """

    vision: VisionConfig = field(default_factory=lambda: VisionConfig("small", (96, 160), (32, 64, 96, 128), stem=4))
    steps: int = 1000
    batch: int = 32
    rate: float = 1.5e-3
    seed: int = 0

    def rate_at(self, step: int) -> float:
        """Learning rate of a step."""
        warm = min(1.0, (step + 1) / 100.0)
        return self.rate * warm * (0.02 + 0.98 * 0.5 * (1.0 + float(np.cos(np.pi * step / self.steps))))


def status(frames: FrameSet) -> Array:
    """Inputs known without a picture, (n, STATUS_WIDTH): own motion, and which of the commands it is."""
    said = np.zeros((len(frames.samples), len(SAID)), np.float32)
    for line, command in enumerate(frames.commands):
        if command in SAID:
            said[line, SAID.index(command)] = 1.0
    return np.concatenate((frames.ego, said), axis=1)


class StatusHead(nn.Module):
    """Waypoints, as displacements from constant velocity, from what is known without a picture: the ego-status MLP.

    With `seen` numbers of a picture beside that it is the head of the encoder's training.
    """

    def __init__(self, seen: int = 0, hidden: int = 256) -> None:
        """Args: numbers of the picture; width. Weights come from torch's global generator."""
        super().__init__()
        self.body = nn.Sequential(
            nn.Linear(STATUS_WIDTH + seen, hidden), nn.GELU(), nn.Linear(hidden, hidden), nn.GELU()
        )
        self.waypoints = nn.Linear(hidden, 2 * FUTURE)

    def forward(self, known: torch.Tensor) -> torch.Tensor:
        """(B, STATUS_WIDTH + seen) to (B, FUTURE, 2), m."""
        return self.waypoints(self.body(known)).view(-1, FUTURE, 2)


class SeeingHead(nn.Module):
    """Encoder, a few tokens that hold what it saw, and heads for what it is trained on.

    The tokens are few and narrow on purpose: some thousand pictures of four towns are soon known by heart.
    """

    def __init__(self, config: VisionConfig) -> None:
        """Args: the encoder. Weights come from torch's global generator."""
        super().__init__()
        self.encoder: VisionEncoder = vision(config)
        self.narrow = nn.Linear(self.encoder.width, 32)
        self.gather = nn.Linear(32 * self.encoder.tokens, SEEN_TOKENS * SEEN_WIDTH)
        self.norm = nn.LayerNorm(SEEN_WIDTH)
        self.drop = nn.Dropout(0.1)
        self.head = StatusHead(SEEN_TOKENS * SEEN_WIDTH)
        self.known = nn.Linear(SEEN_TOKENS * SEEN_WIDTH, KNOWN)

    def see(self, pictures: torch.Tensor) -> torch.Tensor:
        """Tokens (B, SEEN_TOKENS, SEEN_WIDTH) of pictures (B, H, W, 3): what the decoders read."""
        features = self.drop(nn.functional.gelu(self.narrow(self.encoder(pictures))).flatten(1))
        return self.norm(self.gather(features).view(-1, SEEN_TOKENS, SEEN_WIDTH))

    def forward(self, pictures: torch.Tensor, said: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Displacements (B, FUTURE, 2), m, and what is known (B, KNOWN), of pictures and statuses (B, STATUS_WIDTH)."""
        seen = self.see(pictures).flatten(1)
        return self.head(torch.cat((said, seen), dim=1)), self.known(seen)


def l2(found: torch.Tensor, truth: torch.Tensor) -> torch.Tensor:
    """Mean distance of waypoints (B, FUTURE, 2), m: what is measured in the end."""
    return ((found - truth).square().sum(dim=-1) + 1e-4).sqrt().mean()


def disturbed(pictures: torch.Tensor, generator: torch.Generator) -> torch.Tensor:
    """Pictures (B, H, W, 3) uint8 as floats 0..1, in another light, a few pixels aside."""
    batch, device = len(pictures), pictures.device
    light = (0.8 + 0.4 * torch.rand((batch, 1, 1, 3), generator=generator)).to(device)
    down, right = (int(v) for v in torch.randint(-2, 3, (2,), generator=generator))
    moved = torch.roll(pictures.float() / 255.0, (down, right), (1, 2))
    return (moved * light + 0.02 * torch.randn((batch, 1, 1, 3), generator=generator).to(device)).clamp(0.0, 1.0)


def batches(count: int, batch: int, seed: int) -> Callable[[int], Iterator[tuple[int, torch.Tensor]]]:
    """Endless (step, rows) of a set; each step's come from its own number."""

    def from_step(first: int) -> Iterator[tuple[int, torch.Tensor]]:
        each = max(1, count // batch)
        step = first
        while True:
            epoch, place = divmod(step, each)
            order = np.random.default_rng([seed, 19, epoch]).permutation(count)
            yield step, torch.from_numpy(order[place * batch : (place + 1) * batch])
            step += 1

    return from_step


def train_vision(
    folder: Path,
    recipe: VisionRecipe,
    frames: FrameSet,
    watch: Callable[[int, float, float], None] | None = None,
    device: str = "cpu",
) -> SeeingHead:
    """Train the encoder on a device, or go on in this folder; it is given back on the CPU.

    Raises:
        ConfigError: The folder holds a run of another recipe.
    """
    torch.manual_seed(recipe.seed)
    model = SeeingHead(recipe.vision).to(device)
    pictures, said = torch.from_numpy(frames.pictures).to(device), torch.from_numpy(status(frames)).to(device)
    truth = torch.from_numpy(displacements(frames.histories, frames.futures)).float().to(device)
    known = torch.from_numpy(frames.known).to(device)

    def loss(drawn: tuple[int, torch.Tensor]) -> torch.Tensor:
        step, rows = drawn[0], drawn[1].to(device)
        generator = torch.Generator().manual_seed(recipe.seed * 1_000_003 + step)
        found, told = model(disturbed(pictures[rows], generator), said[rows])
        there = ~torch.isnan(known[rows])
        off = torch.where(there, told - torch.nan_to_num(known[rows]), torch.zeros((), device=device)).abs()
        return l2(found, truth[rows]) + _WEIGHT * off.mean()

    mean = fit(
        model,
        batches(len(frames.samples), recipe.batch, recipe.seed),
        loss,
        recipe.rate_at,
        folder,
        plain(recipe),
        recipe.steps,
        Optimisation(ema=0.99, precision="float32"),
        watch=watch,
        save_s=30.0,
    )
    assert isinstance(mean, SeeingHead)
    return mean.cpu().eval()


def plain(recipe: VisionRecipe) -> dict[str, Any]:
    """A recipe as plain values."""
    held = asdict(recipe)
    held["vision"] = {name: list(v) if isinstance(v, tuple) else v for name, v in held["vision"].items()}
    return held


@torch.no_grad()
def tokens_of(model: SeeingHead, pictures: Array, batch: int = 64) -> torch.Tensor:
    """Tokens (n, SEEN_TOKENS, SEEN_WIDTH) of pictures (n, H, W, 3), computed once."""
    held = torch.from_numpy(pictures)
    return torch.cat([model.see(held[i : i + batch]) for i in range(0, len(held), batch)])


@torch.no_grad()
def views_of(model: SeeingHead, pictures: Array, views: int, seed: int = 0, batch: int = 64) -> torch.Tensor:
    """Tokens of pictures as they are and in other lights, (views, n, SEEN_TOKENS, SEEN_WIDTH): a decoder that knew one
    view of each by heart would read less out of a new picture."""
    generator = torch.Generator().manual_seed(seed)
    held = torch.from_numpy(pictures)
    found = [tokens_of(model, pictures, batch)]
    for _ in range(views - 1):
        parts = [model.see(disturbed(held[i : i + batch], generator)) for i in range(0, len(held), batch)]
        found.append(torch.cat(parts))
    return torch.stack(found)


@torch.no_grad()
def regressed(model: SeeingHead, frames: FrameSet, batch: int = 64) -> Array:
    """Displacements (n, FUTURE, 2) that the head of the encoder's own training gives."""
    held, said = torch.from_numpy(frames.pictures), torch.from_numpy(status(frames))
    parts = [model(held[i : i + batch], said[i : i + batch])[0] for i in range(0, len(held), batch)]
    return torch.cat(parts).numpy()
