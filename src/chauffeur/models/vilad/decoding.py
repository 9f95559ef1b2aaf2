# pyright: reportMissingImports=false, reportUnknownParameterType=false
"""Decoding with and without caches: the diffusion model and its autoregressive twin, one prompt at a time.

All of them run the same written-out layers, so a cache that is refreshed at every step gives the same bits as none.

`Uncached`        every pass sees prompt and template (X_t of Algorithm 2).
`PrefixCached`    keys and values of the prompt are kept for some passes (Fast-dLLM's prefix cache, Wu et al. 2025).
`BlockCached`     those of all other blocks too; the template is decided block after block (its dual cache).
`AdaptiveCached`  prompt and response are refreshed at intervals of their own; in between only the response tokens whose
                  values changed most are computed anew (dLLM-Cache, Liu et al. 2025).
`twin`            left to right, with or without the usual cache of keys and values.

Bidirectional keys of the prompt depend on the template, so these caches are approximations; the twin's is exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from chauffeur.models.net.transformer import attended, projected, rotary
from chauffeur.models.vilad.network import Vilad
from chauffeur.planners.vilad.template import MASK, ActionTemplate
from chauffeur.planners.vilad.unmasking import NEVER, Decided, Unmasking, distribution, unmask

Array = np.ndarray[Any, Any]


@dataclass(slots=True)
class _Kept:
    """What a layer leaves behind: keys and values (1, heads, N, width), and what it added to the template's vectors."""

    keys: torch.Tensor
    values: torch.Tensor
    attended: torch.Tensor
    fed: torch.Tensor


class Uncached:
    """A network with its prompt bound; every pass sees everything. A `Predict` of `planners.vilad.unmasking`."""

    def __init__(self, model: Vilad, words: torch.Tensor, scene: torch.Tensor, length: int) -> None:
        """Args: the network, in evaluation mode; words (1, T, width); candidates (1, S, width); L."""
        self._model, self._scene = model, scene
        self._config = model.config.body
        with torch.no_grad():
            self._prompt = model.prompt(words, scene)
        self._words = words.shape[1]
        self._many = self._prompt.shape[1]
        self._length = length
        angles = rotary(
            self._config.head_width, self._config.rope_theta, model.places(words.shape[1], scene.shape[1], length)
        )
        self._cos, self._sin = (one[None, None] for one in angles)
        total = self._many + length
        after = torch.ones((total, total), dtype=torch.bool).triu(1)
        self._blocked = torch.zeros((total, total)).masked_fill(after, NEVER) if self._config.causal else None
        self._candidates = torch.zeros(0)
        self.passes = 0
        self.tokens = 0

    @torch.no_grad()
    def __call__(self, row: Array) -> Array:
        """Logits (L, V) of y_t (L,)."""
        hidden, _ = self._whole(row)
        return self._scored(hidden[:, -self._length :], row)

    def _whole(self, row: Array) -> tuple[torch.Tensor, list[_Kept]]:
        """Vectors of prompt and template after the transformer, and what each layer leaves."""
        own = self._model.embedded(torch.from_numpy(row)[None], self._scene)
        hidden = torch.cat((self._prompt, own), dim=1)
        self._count(hidden.shape[1])
        kept: list[_Kept] = []
        for layer in self._model.layers:
            hidden, left = self._layer(layer, hidden, self._cos, self._sin)
            kept.append(left)
        hidden = self._model.body.norm(hidden)
        self._candidates = hidden[:, self._words : self._many]
        return hidden, kept

    def _layer(
        self, layer: Any, hidden: torch.Tensor, cos: torch.Tensor, sin: torch.Tensor
    ) -> tuple[torch.Tensor, _Kept]:
        config = self._config
        normed = layer.input_layernorm(hidden)
        q, k, v = projected(layer.self_attn, normed, config.heads, config.kv_heads, cos, sin)
        many = hidden.shape[1]
        blocked = None if self._blocked is None else self._blocked[:many, :many]
        added = layer.self_attn.o_proj(attended(q, k, v, blocked))
        hidden = hidden + added
        fed = layer.mlp(layer.post_attention_layernorm(hidden))
        begin = self._many
        return hidden + fed, _Kept(k, v, added[:, begin:], fed[:, begin:])

    def _some(self, row: Array, places: slice, kept: list[_Kept]) -> torch.Tensor:
        """Vectors (1, n, hidden) of some of the template's tokens, all others' keys and values as they are kept.

        What is computed takes the place of what was kept.
        """
        model, config = self._model, self._config
        hidden = model.embedded(torch.from_numpy(row)[None], self._scene)[:, places]
        self._count(hidden.shape[1])
        where = slice(self._many + places.start, self._many + places.stop)
        cos, sin = self._cos[:, :, where], self._sin[:, :, where]
        for layer, left in zip(model.layers, kept, strict=True):
            normed = layer.input_layernorm(hidden)
            q, k, v = projected(layer.self_attn, normed, config.heads, config.kv_heads, cos, sin)
            left.keys[:, :, where], left.values[:, :, where] = k, v
            added = layer.self_attn.o_proj(attended(q, left.keys, left.values))
            hidden = hidden + added
            fed = layer.mlp(layer.post_attention_layernorm(hidden))
            hidden = hidden + fed
            left.attended[:, places], left.fed[:, places] = added, fed
        return model.body.norm(hidden)

    def _scored(self, hidden: torch.Tensor, row: Array, first: int = 0) -> Array:
        rows = torch.from_numpy(row)[None]
        logits: torch.Tensor = self._model.scored(hidden, self._scene, self._candidates, rows, first)
        return logits[0].float().numpy()

    def _count(self, tokens: int) -> None:
        self.passes += 1
        self.tokens += tokens


class PrefixCached(Uncached):
    """Keys and values of the prompt are refreshed every `interval` passes."""

    def __init__(
        self, model: Vilad, words: torch.Tensor, scene: torch.Tensor, length: int, interval: int = 1_000_000
    ) -> None:
        """Args: as `Uncached`; passes between two refreshes, 1 for no cache at all."""
        super().__init__(model, words, scene, length)
        self._interval = interval
        self._kept: list[_Kept] = []
        self._calls = 0

    @torch.no_grad()
    def __call__(self, row: Array) -> Array:
        """Logits (L, V) of y_t (L,)."""
        fresh = self._calls % self._interval == 0
        self._calls += 1
        if fresh:
            hidden, self._kept = self._whole(row)
            return self._scored(hidden[:, -self._length :], row)
        return self._scored(self._some(row, slice(0, self._length), self._kept), row)


class BlockCached(Uncached):
    """Blocks of the template one after the other, keys and values of everything else kept within a block."""

    @torch.no_grad()
    def decide(self, template: ActionTemplate, allowed: Array, how: Unmasking, block: int) -> Decided:
        """Decide a template in blocks of so many tokens; the first pass of each sees everything.

        Args:
            template: What.
            allowed: Bool (L, V).
            how: How, in each block: Sps is for a block.
            block: Tokens of a block.
        """
        row = template.canvas.copy()
        order, sure = np.zeros(len(row), np.int64), np.ones(len(row))
        before = self.passes
        for start in range(0, len(row), block):
            places = slice(start, min(start + block, len(row)))
            if not (row[places] == MASK).any():
                continue
            begun = self.passes
            predict = self._bound(row, places)
            found = unmask(predict, row[places].copy(), allowed[places], how)
            row[places] = found.row
            order[places] = np.where(found.order > 0, found.order + begun - before, 0)
            sure[places] = found.confidence
        return Decided(row, order, sure, self.passes - before)

    def _bound(self, row: Array, places: slice) -> Any:
        kept: list[_Kept] = []

        def predict(part: Array) -> Array:
            whole = row.copy()
            whole[places] = part
            if not kept:
                hidden, found = self._whole(whole)
                kept.extend(found)
                begin = self._many
                return self._scored(hidden[:, begin + places.start : begin + places.stop], whole, places.start)
            return self._scored(self._some(whole, places, kept), whole, places.start)

        return predict


@dataclass(frozen=True, slots=True)
class Refresh:
    """How often dLLM-Cache computes anew.

    Attributes:
        prompt: Passes between two refreshes of the prompt.
        response: The same of the response.
        ratio: Share of the response's tokens that is computed in between: those whose values changed most.
    """

    prompt: int = 25
    response: int = 7
    ratio: float = 0.25


class AdaptiveCached(Uncached):
    """dLLM-Cache: long intervals for the prompt, partial updates of the response guided by how similar values stay."""

    def __init__(
        self, model: Vilad, words: torch.Tensor, scene: torch.Tensor, length: int, refresh: Refresh | None = None
    ) -> None:
        """Args: as `Uncached`; how often to compute anew (LLaDA-V's values by default)."""
        super().__init__(model, words, scene, length)
        self._refresh = refresh or Refresh()
        self._kept: list[_Kept] = []
        self._calls = 0

    @torch.no_grad()
    def __call__(self, row: Array) -> Array:
        """Logits (L, V) of y_t (L,)."""
        call, self._calls = self._calls, self._calls + 1
        if call % self._refresh.prompt == 0:
            hidden, self._kept = self._whole(row)
            return self._scored(hidden[:, -self._length :], row)
        if call % self._refresh.response == 0:
            return self._scored(self._some(row, slice(0, self._length), self._kept), row)
        return self._scored(self._changed(row), row)

    def _changed(self, row: Array) -> torch.Tensor:
        model, config, begin = self._model, self._config, self._many
        count = max(1, round(self._refresh.ratio * self._length))
        hidden = model.embedded(torch.from_numpy(row)[None], self._scene)
        self._count(count)
        cos, sin = self._cos[:, :, begin:], self._sin[:, :, begin:]
        for layer, left in zip(model.layers, self._kept, strict=True):
            normed = layer.input_layernorm(hidden)
            values = layer.self_attn.v_proj(normed)
            before = left.values[:, :, begin:].transpose(1, 2).flatten(2)
            alike = torch.nn.functional.cosine_similarity(values, before, dim=-1)[0]
            chosen = torch.sort(alike.argsort(stable=True)[:count]).values
            some = normed[:, chosen]
            q, k, v = projected(
                layer.self_attn, some, config.heads, config.kv_heads, cos[:, :, chosen], sin[:, :, chosen]
            )
            left.keys[:, :, begin + chosen], left.values[:, :, begin + chosen] = k, v
            left.attended[:, chosen] = layer.self_attn.o_proj(attended(q, left.keys, left.values))
            hidden = hidden + left.attended
            left.fed[:, chosen] = layer.mlp(layer.post_attention_layernorm(hidden[:, chosen]))
            hidden = hidden + left.fed
        return model.body.norm(hidden)


class Twin(Uncached):
    """The autoregressive twin: the template from left to right, held to the words that may stand there."""

    @torch.no_grad()
    def decide(self, template: ActionTemplate, allowed: Array, *, cached: bool = True, skip: bool = False) -> Decided:
        """Decide a template greedily.

        Args:
            template: What.
            allowed: Bool (L, V).
            cached: Whether keys and values are kept, which changes nothing but the time.
            skip: Whether tokens of the fixed pattern are fed along with the next decision instead of one by one: a
                grammar's fast-forward. Without it every token costs a pass, as in the paper's comparison.
        """
        row = template.canvas.copy()
        order, sure = np.zeros(len(row), np.int64), np.ones(len(row))
        before = self.passes
        kept: list[_Kept] = []
        done = 0  # tokens of the template whose keys are kept
        for place in range(len(row)):
            if skip and not template.maskable[place]:
                continue
            if not cached or not kept:
                hidden, found = self._part(row[:place])
                kept = found if cached else []
            else:
                hidden = self._more(row[done:place], done, kept)
            done = place
            logits = np.where(allowed[place], self._scored(hidden[:, -1:], row, place)[0], NEVER)
            if template.maskable[place]:
                row[place] = int(logits.argmax())
                order[place] = self.passes - before
                sure[place] = float(distribution(logits)[row[place]])
        return Decided(row, order, sure, self.passes - before)

    def _part(self, row: Array) -> tuple[torch.Tensor, list[_Kept]]:
        own = self._model.embedded(torch.from_numpy(row)[None], self._scene)
        hidden = torch.cat((self._prompt, own), dim=1)
        many = hidden.shape[1]
        self._count(many)
        kept: list[_Kept] = []
        for layer in self._model.layers:
            hidden, left = self._layer(layer, hidden, self._cos[:, :, :many], self._sin[:, :, :many])
            kept.append(left)
        hidden = self._model.body.norm(hidden)
        self._candidates = hidden[:, self._words : self._many]
        return hidden, kept

    def _more(self, row: Array, done: int, kept: list[_Kept]) -> torch.Tensor:
        model, config = self._model, self._config
        hidden = model.embedded(torch.from_numpy(row)[None], self._scene, done)
        self._count(hidden.shape[1])
        start, stop = self._many + done, self._many + done + hidden.shape[1]
        cos, sin = self._cos[:, :, start:stop], self._sin[:, :, start:stop]
        blocked = None if self._blocked is None else self._blocked[start:stop, :stop]
        for layer, left in zip(model.layers, kept, strict=True):
            normed = layer.input_layernorm(hidden)
            q, k, v = projected(layer.self_attn, normed, config.heads, config.kv_heads, cos, sin)
            left.keys, left.values = torch.cat((left.keys, k), dim=2), torch.cat((left.values, v), dim=2)
            hidden = hidden + layer.self_attn.o_proj(attended(q, left.keys, left.values, blocked))
            hidden = hidden + layer.mlp(layer.post_attention_layernorm(hidden))
        return model.body.norm(hidden)
