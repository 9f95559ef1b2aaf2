# pyright: reportMissingImports=false, reportUnknownParameterType=false
"""Masked diffusion as it is trained: the forward process of Eq. 29 and the objective of Eq. 30; and the twin's loss."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch.nn import functional

from chauffeur.planners.vilad.template import MASK
from chauffeur.planners.vilad.unmasking import NEVER


@dataclass(frozen=True, slots=True)
class Noise:
    """Masking of tokens in training.

    Attributes:
        least: Smallest noise level t; the paper's U(0, 1) with 0.001 against a division by nothing.
        full: Share of the samples with t = 1. Of a sample that is partly masked the rest of a decision leaks the
            answer; only a fully masked one has to decide (facts: two to four times the success at equal compute).
        fixed_pattern: Whether only action tokens are masked (ViLaD-Opt); otherwise every token of y_0 is
            (plain masked-diffusion fine-tuning, ViLaD-SFT).
    """

    least: float = 1e-3
    full: float = 0.0
    fixed_pattern: bool = True


def masked(
    rows: torch.Tensor, maskable: torch.Tensor, noise: Noise, generator: torch.Generator
) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """q(y_t | y_0), Eq. 29: (y_t (B, L), which tokens are masked (B, L), t (B,)).

    Args:
        rows: y_0, (B, L).
        maskable: Action tokens, bool (L,).
        noise: How.
        generator: Of the draws.
    """
    batch, length = rows.shape
    t = torch.rand(batch, generator=generator) * (1.0 - noise.least) + noise.least  # t ~ U(least, 1)
    t = torch.where(torch.rand(batch, generator=generator) < noise.full, torch.ones(()), t).to(rows.device)
    drawn = torch.rand((batch, length), generator=generator).to(rows.device) < t[:, None]  # each token by itself
    if noise.fixed_pattern:
        drawn = drawn & maskable
    return torch.where(drawn, torch.full_like(rows, MASK), rows), drawn, t


def diffusion_loss(
    logits: torch.Tensor, rows: torch.Tensor, hidden: torch.Tensor, t: torch.Tensor, allowed: torch.Tensor, many: int
) -> torch.Tensor:
    """L(theta) = -1/t sum_i 1[y_t^i = M] log p(y_0^i | X_t), Eq. 30, a token: divided by the maskable tokens and B.

    Args:
        logits: (B, L, V).
        rows: y_0, (B, L).
        hidden: Which tokens are masked, bool (B, L).
        t: Noise levels (B,).
        allowed: Which token may stand where, bool (L, V).
        many: Maskable tokens of a row.
    """
    kept = torch.where(allowed, logits.float(), torch.full((), NEVER, device=logits.device))
    wrong = functional.cross_entropy(kept.flatten(0, 1), rows.flatten(), reduction="none").view_as(rows)
    return ((wrong * hidden).sum(dim=1) / t).mean() / many


def next_token_loss(
    logits: torch.Tensor, rows: torch.Tensor, maskable: torch.Tensor, allowed: torch.Tensor
) -> torch.Tensor:
    """The twin's: mean -log p(y^i | X, y^<i) over action tokens; arguments as above."""
    kept = torch.where(allowed, logits.float(), torch.full((), NEVER, device=logits.device))
    wrong = functional.cross_entropy(kept.flatten(0, 1), rows.flatten(), reduction="none").view_as(rows)
    return (wrong * maskable).sum(dim=1).mean() / int(maskable.sum())
