# pyright: reportUntypedBaseClass=false
"""From features of any kind (image patches, words, candidates of a scene) to the transformer's space."""

from __future__ import annotations

import torch
from torch import nn


class Connector(nn.Module):
    """The two-layer MLP of Eq. 28: MLP(V), with GELU between."""

    def __init__(self, width: int, hidden: int) -> None:
        """Args: numbers of a feature; of the transformer's vectors."""
        super().__init__()
        self.first = nn.Linear(width, hidden)
        self.second = nn.Linear(hidden, hidden)

    def forward(self, features: torch.Tensor) -> torch.Tensor:
        """(..., width) to (..., hidden)."""
        return self.second(nn.functional.gelu(self.first(features)))
