"""Settings of a training run of the compact VLM."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from chauffeur.models.train.rates import cosine_rate


@dataclass(frozen=True, slots=True)
class VlmRecipe:
    """Settings that decide a training run.

    Attributes:
        size: One of `network.SIZES`.
        scenes: Pictures of training; each with three wishes a turn.
        seeing_steps, seen_pictures, seeing_rate: Optimiser steps of the eye, pictures of its batches, and its highest
            learning rate.
        steps: Optimiser steps of words and gains.
        pictures: Pictures of a batch; each with three wishes.
        rate: Highest learning rate; reached after `warmup` steps, then brought down along a cosine.
        warmup: See there.
        remembered: Share of cases with earlier feedback.
        dropped, jitter: Of the words, as `vilad.parking_recipe` has them.
        seed: Of weights and batches.
    """

    size: str = "compact"
    scenes: int = 6_000
    seeing_steps: int = 2_000
    seen_pictures: int = 16
    seeing_rate: float = 2e-3
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

    def seeing(self) -> dict[str, Any]:
        """Settings that decide the eye's training."""
        names = ("size", "scenes", "seeing_steps", "seen_pictures", "seeing_rate", "seed")
        return {name: getattr(self, name) for name in names}
