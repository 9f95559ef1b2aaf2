# pyright: reportMissingImports=false, reportUntypedBaseClass=false, reportUnknownParameterType=false
"""The compact VLM: words, then the style, then what the picture holds, then what is seen and the gains; causal.

    [words] wish task recall style [sights] see weather grade lead road gains kp ki kd wl wh ws

Each token is predicted from those before it. The style stands before the picture, so that how somebody wants to be
driven is read from their words alone; scene and gains stand after it. The transformer is the stack's Llama, words come
in through its connector (paper Fig. 11), the picture through an encoder of the stack and a `Glance`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final

import torch
from torch import nn

from chauffeur.models.net.connector import Connector
from chauffeur.models.net.transformer import TransformerConfig, transformer
from chauffeur.models.net.vision import VisionConfig, vision
from chauffeur.planners.camera_faults import CELLS, HEIGHT, WIDTH
from chauffeur.planners.vlm.template import HEARD, SIGHTS, TEMPLATE
from chauffeur.planners.word_table import MOST_PIECES
from chauffeur.planners.word_table import WIDTH as WORD_WIDTH

FREE: Final = 2
"""Sights that are taught nothing but the answers."""
SEEN: Final = len(SIGHTS) + FREE
"""Tokens of a picture."""
_FORGOTTEN: Final = 0.1
"""Share of the glance's inputs that are dropped in training."""
_FORBIDDEN: Final = -1e4


@dataclass(frozen=True, slots=True)
class VlmConfig:
    """Shape of the network.

    Attributes:
        body: The transformer; causal.
        eye: The vision encoder; a token for each of `CELLS`.
        glance: Numbers kept of each cell, and of all cells together.
    """

    body: TransformerConfig
    eye: VisionConfig = field(default_factory=lambda: VisionConfig(size=(HEIGHT, WIDTH), channels=(24, 48, 96), stem=4))
    glance: tuple[int, int] = (16, 192)


SIZES: Final = {
    "tiny": VlmConfig(
        TransformerConfig(16, 1, 2, 2, 32, positions=160),
        VisionConfig(size=(HEIGHT, WIDTH), channels=(4, 8, 8), stem=4),
        (4, 16),
    ),
    "compact": VlmConfig(TransformerConfig(96, 3, 4, 4, 192, positions=160)),
    "large": VlmConfig(
        TransformerConfig(256, 6, 8, 8, 512, positions=160),
        VisionConfig(size=(HEIGHT, WIDTH), channels=(48, 96, 192), stem=4),
        (24, 384),
    ),
}


class Glance(nn.Module):
    """All cells of a picture at once, as a few tokens: a weight of its own for every place.

    The camera is fixed to the car, so the lane ahead shows in the same place of every picture. Attention has to find
    that out from nothing, and did not from 4,000 pictures; one matrix over all places does (as in BEV-LLM's gist).
    """

    def __init__(self, width: int, kept: int, inner: int, hidden: int) -> None:
        """Args: numbers of a cell's features, of what is kept of them, of all cells together, of a token."""
        super().__init__()
        self.cell = nn.Linear(width, kept)
        self.all = nn.Linear(CELLS[0] * CELLS[1] * kept, inner)
        self.out = nn.Sequential(
            nn.LayerNorm(inner), nn.GELU(), nn.Dropout(_FORGOTTEN), nn.Linear(inner, SEEN * hidden)
        )

    def forward(self, features: torch.Tensor) -> torch.Tensor:
        """(B, cells, width) to (B, SEEN, hidden)."""
        kept = nn.functional.gelu(self.cell(features)).flatten(1)
        whole = self.all(nn.functional.dropout(kept, _FORGOTTEN, self.training))
        return self.out(whole).unflatten(1, (SEEN, -1))


class CompactVlm(nn.Module):
    """Predicts the tokens of `planners.vlm.template.TEMPLATE`."""

    def __init__(self, config: VlmConfig) -> None:
        """Untrained. Weights come from torch's global generator."""
        super().__init__()
        self.config = config
        hidden = config.body.hidden
        self.eye: Any = vision(config.eye)
        self.glance = Glance(self.eye.width, *config.glance, hidden)
        self.covered = nn.Linear(self.eye.width, 2)
        self.taught = nn.ModuleList(nn.Linear(hidden, len(words)) for words in SIGHTS.values())
        self.words = Connector(WORD_WIDTH, hidden)
        self.tokens = nn.Embedding(TEMPLATE.size, hidden)
        self.body: Any = transformer(config.body)
        self.head = nn.Linear(hidden, TEMPLATE.size)
        barred = torch.where(torch.from_numpy(TEMPLATE.allowed()), 0.0, _FORBIDDEN)
        self.barred: Any = nn.Buffer(barred, persistent=False)
        nn.init.normal_(self.tokens.weight, std=0.5)

    def seen(self, pixels: torch.Tensor) -> torch.Tensor:
        """Vectors of pictures (B, HEIGHT, WIDTH, 3), uint8 or 0..1: (B, SEEN, hidden)."""
        return self.glance(self.eye(pixels))

    def perceived(self, pixels: torch.Tensor) -> tuple[list[torch.Tensor], torch.Tensor]:
        """Targets of the eye before any words: logits of each of `SIGHTS`, (B, words) each, and of how much of each
        cell vehicles, and the lead vehicle, cover, (B, 2, *CELLS)."""
        features = self.eye(pixels)
        tokens = self.glance(features)
        covered = self.covered(features).transpose(1, 2).unflatten(2, CELLS)
        return [head(tokens[:, place]) for place, head in enumerate(self.taught)], covered

    def sequence(self, words: torch.Tensor, seen: torch.Tensor, rows: torch.Tensor) -> torch.Tensor:
        """All vectors in their order, (B, T + L + SEEN, hidden)."""
        tokens = self.tokens(rows)
        return torch.cat((self.words(words), tokens[:, :HEARD], seen, tokens[:, HEARD:]), dim=1)

    def positions(self, words: int) -> torch.Tensor:
        """Places (N,) of words, tokens heard, sights, and tokens written; all but the words have fixed ones."""
        rest = torch.arange(TEMPLATE.length + SEEN) + MOST_PIECES
        return torch.cat((torch.arange(words), rest))

    def scored(self, hidden: torch.Tensor, words: int) -> torch.Tensor:
        """Logits (B, L, size) of each template token, from the vector before it; the first two rows mean nothing."""
        after = words + HEARD + SEEN
        own = torch.cat((hidden[:, words : words + HEARD], hidden[:, after:]), dim=1)
        return self.head(torch.cat((own[:, :1], own[:, :-1]), dim=1)) + self.barred

    def forward(self, words: torch.Tensor, known: torch.Tensor, seen: torch.Tensor, rows: torch.Tensor) -> torch.Tensor:
        """Logits (B, L, size).

        Args:
            words: Vectors of the words (B, T, WORD_WIDTH).
            known: Which of them are words, not padding; bool (B, T).
            seen: Of `seen`, (B, SEEN, hidden).
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
