# pyright: reportMissingImports=false, reportUntypedBaseClass=false, reportUnknownParameterType=false
"""The compact VLM: words, then the style, then the picture's patches, then what is seen and the gains; causal.

    [words] wish task recall style [patches] see weather grade lead road gains kp ki kd wl wh ws

Each token is predicted from those before it. The style stands before the picture, so that how somebody wants to be
driven is read from their words alone; scene and gains stand after it. The transformer is the stack's Llama, words and
patches come in through its connectors (paper Fig. 11).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Final

import torch
from torch import nn

from chauffeur.models.net.connector import Connector
from chauffeur.models.net.transformer import TransformerConfig, transformer
from chauffeur.planners.vilad.words import MOST_PIECES
from chauffeur.planners.vilad.words import WIDTH as WORD_WIDTH
from chauffeur.planners.vlm.pictures import HEIGHT, WIDTH
from chauffeur.planners.vlm.template import HEARD, TEMPLATE

PATCHES: Final = (HEIGHT // 16) * (WIDTH // 16)
_FORBIDDEN: Final = -1e4


@dataclass(frozen=True, slots=True)
class VlmConfig:
    """Shape of the network.

    Attributes:
        body: The transformer; causal.
        channels: Of the encoder's four stages.
    """

    body: TransformerConfig
    channels: tuple[int, ...] = (16, 32, 64, 96)


SIZES: Final = {
    "tiny": VlmConfig(TransformerConfig(16, 1, 2, 2, 32, positions=160), (4, 8, 8, 8)),
    "compact": VlmConfig(TransformerConfig(96, 3, 4, 4, 192, positions=160)),
    "large": VlmConfig(TransformerConfig(256, 6, 8, 8, 512, positions=160), (32, 64, 128, 256)),
}


class SeatEncoder(nn.Module):
    """Four strided convolutions: (B, 3, HEIGHT, WIDTH) in 0..1 to patches (B, PATCHES, channels[-1])."""

    def __init__(self, channels: tuple[int, ...]) -> None:
        """Args: channels of the stages."""
        super().__init__()
        self.stages = nn.ModuleList(
            nn.Sequential(
                nn.Conv2d(before, after, 5 if place == 0 else 3, 2, 2 if place == 0 else 1),
                nn.GroupNorm(4, after),
                nn.GELU(),
            )
            for place, (before, after) in enumerate(pairwise((3, *channels)))
        )

    def forward(self, pixels: torch.Tensor) -> torch.Tensor:
        """See the class."""
        x = pixels - 0.45
        for stage in self.stages:
            x = stage(x)
        return x.flatten(2).transpose(1, 2)


class CompactVlm(nn.Module):
    """Predicts the tokens of `planners.vlm.template.TEMPLATE`."""

    def __init__(self, config: VlmConfig) -> None:
        """Untrained. Weights come from torch's global generator."""
        super().__init__()
        self.config = config
        hidden = config.body.hidden
        self.eye = SeatEncoder(config.channels)
        self.patches = Connector(config.channels[-1], hidden)
        self.places = nn.Parameter(torch.randn(PATCHES, hidden) * 0.1)
        self.words = Connector(WORD_WIDTH, hidden)
        self.tokens = nn.Embedding(TEMPLATE.size, hidden)
        self.body: Any = transformer(config.body)
        self.head = nn.Linear(hidden, TEMPLATE.size)
        barred = torch.where(torch.from_numpy(TEMPLATE.allowed()), 0.0, _FORBIDDEN)
        self.barred: Any = nn.Buffer(barred, persistent=False)
        nn.init.normal_(self.tokens.weight, std=0.5)

    def seen(self, pixels: torch.Tensor) -> torch.Tensor:
        """Vectors of a picture's patches, (B, PATCHES, hidden)."""
        return self.patches(self.eye(pixels)) + self.places

    def sequence(self, words: torch.Tensor, seen: torch.Tensor, rows: torch.Tensor) -> torch.Tensor:
        """All vectors in their order, (B, T + L + PATCHES, hidden)."""
        tokens = self.tokens(rows)
        return torch.cat((self.words(words), tokens[:, :HEARD], seen, tokens[:, HEARD:]), dim=1)

    def positions(self, words: int) -> torch.Tensor:
        """Places (N,) of words, tokens heard, patches, and tokens written; all but the words have fixed ones."""
        rest = torch.arange(TEMPLATE.length + PATCHES) + MOST_PIECES
        return torch.cat((torch.arange(words), rest))

    def scored(self, hidden: torch.Tensor, words: int) -> torch.Tensor:
        """Logits (B, L, size) of each template token, from the vector before it; the first two rows mean nothing."""
        after = words + HEARD + PATCHES
        own = torch.cat((hidden[:, words : words + HEARD], hidden[:, after:]), dim=1)
        return self.head(torch.cat((own[:, :1], own[:, :-1]), dim=1)) + self.barred

    def forward(self, words: torch.Tensor, known: torch.Tensor, seen: torch.Tensor, rows: torch.Tensor) -> torch.Tensor:
        """Logits (B, L, size).

        Args:
            words: Vectors of the words (B, T, WORD_WIDTH).
            known: Which of them are words, not padding; bool (B, T).
            seen: Of `seen`, (B, PATCHES, hidden).
            rows: The template's tokens, int64 (B, L).
        """
        count = words.shape[1]
        vectors = self.sequence(words, seen, rows)
        mask = torch.cat((known, known.new_ones((len(known), vectors.shape[1] - count))), dim=1)
        hidden = self.body(
            inputs_embeds=vectors,
            attention_mask=mask,
            position_ids=self.positions(count).to(vectors.device)[None],
            use_cache=False,
        ).last_hidden_state
        return self.scored(hidden, count)
