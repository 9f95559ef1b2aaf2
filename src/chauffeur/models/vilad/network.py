# pyright: reportMissingImports=false, reportUntypedBaseClass=false, reportUnknownParameterType=false
"""The ViLaD network (Fig. 16): features through connectors into a bidirectional transformer that predicts actions.

    X_input = Concat([MLP(V), C_emb])          Eq. 28: V are candidates of a scene or patches of an image
    X_t     = Concat([X_input, y_t])           y_t: the action template, some of its slots masked
    logits  = head(transformer(X_t))           of the template's places, over words and candidates

Which tokens are masked is explicit: the ids of y_t hold it. A slot that points at a candidate is scored against the
candidates: q . f(candidate), where f are its raw features and its vector after the transformer. Part of q is a sum over
the other decisions, the masked ones by their predicted shares: so a pointer that is decided in the same pass as what it
depends on still fits it, where conditional independence alone would let the two drift apart.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Final

import torch
from torch import nn

from chauffeur.models.net.connector import Connector
from chauffeur.models.net.transformer import TransformerConfig, transformer
from chauffeur.planners.vilad.template import MASK, ActionTemplate
from chauffeur.planners.vilad.unmasking import NEVER

SHARE: Final = 0.5
"""What a decision's weights are multiplied by: as many are summed up as the pattern has tokens."""
TEXT_PLACES: Final = 64
"""Positions of the words; the candidates, which have no order, share the next one, and the template follows."""


@dataclass(frozen=True, slots=True)
class ViladConfig:
    """A network.

    Attributes:
        body: The transformer; `causal` makes it the autoregressive twin.
        words: Width of a word's vector.
        scene: Width of a candidate's features (or of an image patch's).
        keys: Width of what pointers are compared in, after the transformer.
        sharp: The raw features are multiplied by this for pointers, so that a difference of metres counts.
    """

    body: TransformerConfig
    words: int
    scene: int
    keys: int = 32
    sharp: float = 16.0

    @property
    def twin(self) -> ViladConfig:
        """The autoregressive twin: same weights' shapes, same tokens, causal."""
        return replace(self, body=replace(self.body, causal=True))


class Vilad(nn.Module):
    """Predicts the masked tokens of a template; causal, the next one."""

    def __init__(self, config: ViladConfig, template: ActionTemplate) -> None:
        """Untrained, for the decisions of a template. Weights come from torch's global generator."""
        super().__init__()
        self.config, self.template = config, template
        hidden, self.size = config.body.hidden, template.size
        self.words = Connector(config.words, hidden)
        self.scene = Connector(config.scene, hidden)
        self.tokens = nn.Embedding(template.length * template.size, hidden)
        self.body: Any = transformer(config.body)
        self.head = nn.Linear(hidden, template.size)
        self.query = nn.Linear(hidden, config.scene + config.keys)
        self.keys = nn.Linear(hidden, config.keys, bias=False)
        self.decided = nn.Embedding(template.length * template.size, config.scene)
        self.may: Any = nn.Buffer(torch.from_numpy(template.allowed()), persistent=False)
        nn.init.normal_(self.tokens.weight, std=0.5)
        nn.init.normal_(self.decided.weight, std=0.01)

    @property
    def layers(self) -> Iterator[Any]:
        """The transformer's layers."""
        return iter(self.body.layers)

    def prompt(self, words: torch.Tensor, scene: torch.Tensor) -> torch.Tensor:
        """X_input (Eq. 28) of words (B, T, words) and candidates (B, S, scene): (B, T + S, hidden)."""
        return torch.cat((self.words(words), self.scene(scene)), dim=1)

    def embedded(self, rows: torch.Tensor, scene: torch.Tensor, first: int = 0) -> torch.Tensor:
        """Vectors (B, n, hidden) of tokens (B, n) of y_t, from a place on.

        A word has another vector in each slot: what "near" says of the lift is nothing that it says of the exit. A
        token that points has its candidate's.
        """
        size = self.size
        pointed = (rows - size).clamp(min=0)
        features = torch.gather(scene, 1, pointed[..., None].expand(-1, -1, scene.shape[2]))
        places = torch.arange(rows.shape[1], device=rows.device) + first
        own = self.tokens(places * size + rows.clamp(max=size - 1))
        return torch.where((rows >= size)[..., None], self.scene(features), own)

    def places(self, words: int, candidates: int, length: int) -> torch.Tensor:
        """Positions (N,) of words, candidates and template."""
        after = torch.arange(length) + TEXT_PLACES + 1
        return torch.cat((torch.arange(words), torch.full((candidates,), TEXT_PLACES), after))

    def scored(
        self, hidden: torch.Tensor, raw: torch.Tensor, candidates: torch.Tensor, rows: torch.Tensor, first: int = 0
    ) -> torch.Tensor:
        """Logits (B, n, size + S) of a run of the template's tokens.

        Args:
            hidden: Their vectors after the transformer (B, n, hidden).
            raw, candidates: Features (B, S, scene) and vectors (B, S, hidden) of the candidates.
            rows: y_t, whole, (B, L).
            first: Where the run begins.
        """
        query = self.query(hidden)
        width = self.config.scene
        words = self.head(hidden)
        asked = query[..., :width] + self._decisions(words, rows, first)
        direct = asked @ (raw * self.config.sharp).transpose(1, 2)
        deep = query[..., width:] @ self.keys(candidates).transpose(1, 2) / self.config.keys**0.5
        return torch.cat((words, direct + deep), dim=-1)

    def _decisions(self, words: torch.Tensor, rows: torch.Tensor, first: int) -> torch.Tensor:
        """What the template's decisions ask of a candidate: (B, 1 or n, scene)."""
        size, length, many = self.size, rows.shape[1], words.shape[1]
        table = self.decided.weight.view(self.template.length, size, -1)[:length]
        known = nn.functional.one_hot(rows.clamp(max=size - 1), size).to(words.dtype) * (rows < size)[..., None]
        if self.config.body.causal:  # only what stands before
            own = torch.einsum("blw,lwf->blf", known, table)
            return SHARE * (own.cumsum(dim=1) - own)[:, first : first + many]
        guessed = torch.zeros_like(known)
        may = self.may[first : first + many]
        shares = torch.softmax(words.masked_fill(~may, NEVER), dim=-1) * may.any(dim=1)[:, None]
        guessed = torch.cat((guessed[:, :first], shares, guessed[:, first + many :]), dim=1)
        known = torch.where((rows == MASK)[..., None], guessed, known)
        return SHARE * torch.einsum("blw,lwf->bf", known, table)[:, None]

    def forward(
        self, words: torch.Tensor, known: torch.Tensor, scene: torch.Tensor, rows: torch.Tensor
    ) -> torch.Tensor:
        """Logits (B, L, size + S).

        Args:
            words: Vectors of the words (B, T, words).
            known: Which of them are words, not padding; bool (B, T).
            scene: Candidates (B, S, scene).
            rows: y_t, int64 (B, L).
        """
        count, many, length = words.shape[1], scene.shape[1], rows.shape[1]
        vectors = torch.cat((self.prompt(words, scene), self.embedded(rows, scene)), dim=1)
        places = self.places(count, many, length).to(vectors.device)
        seen = torch.cat((known, known.new_ones((len(known), many + length))), dim=1)
        hidden = self.body(
            inputs_embeds=vectors, attention_mask=seen, position_ids=places[None], use_cache=False
        ).last_hidden_state
        begin = count + many - int(self.config.body.causal)  # a causal vector predicts what follows it
        own = hidden[:, begin : begin + length]
        return self.scored(own, scene, hidden[:, count : count + many], rows)


SIZES: Final = {
    "tiny": TransformerConfig(48, 2, 2, 2, 96, causal=False),
    "lot": TransformerConfig(128, 3, 4, 4, 256, causal=False),
    "3M": TransformerConfig(192, 6, 6, 6, 512, causal=False),
    "10M": TransformerConfig(320, 8, 5, 5, 864, causal=False),
    "30M": TransformerConfig(512, 10, 8, 8, 1376, causal=False),
    "91M": TransformerConfig(768, 13, 12, 12, 2048, causal=False),
    "170M": TransformerConfig(960, 16, 15, 15, 2560, causal=False, positions=2048),
    "8B": TransformerConfig(4096, 32, 32, 32, 12288, causal=False, positions=4096, rope_theta=500_000.0),
}
"""Shapes from a parking lot's to LLaDA-V's."""
