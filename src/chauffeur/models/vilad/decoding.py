# pyright: reportMissingImports=false, reportUnknownParameterType=false
"""Decoding with and without caches: the diffusion model and its autoregressive twin, one prompt at a time.

All of them run the same written-out layers, so a cache that is refreshed at every step gives the same bits as none.

`Uncached`        every pass sees prompt and template (X_t of Algorithm 2).
`PrefixCached`    keys and values of the prompt are kept for some passes (Fast-dLLM's prefix cache, Wu et al. 2025).
`AdaptiveCached`  prompt and response are refreshed at intervals of their own; in between only the response tokens whose
                  values changed most are computed anew (dLLM-Cache, Liu et al. 2025).
`twin`            left to right, with or without the usual cache of keys and values.

Bidirectional keys of the prompt depend on the template, so these caches are approximations; the twin's is exact.

Networks stay where they are and in their own precision: rows go to the model's device, logits come back as float32
numpy. On an accelerator attention and normalisation are one kernel each (`fused`), so "the same bits" holds on the CPU,
"the same but for rounding" there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from chauffeur.models.net.transformer import attended, attended_fused, projected, rotary
from chauffeur.models.vilad.network import Vilad
from chauffeur.planners.vilad.template import ActionTemplate
from chauffeur.planners.vilad.unmasking import NEVER, Decided, distribution

Array = np.ndarray[Any, Any]


@dataclass(slots=True)
class _Kept:
    """A layer's state: keys and values (1, heads, N, width), and what it added to the template's vectors."""

    keys: torch.Tensor
    values: torch.Tensor
    attended: torch.Tensor
    fed: torch.Tensor


class Uncached:
    """A network with its prompt bound; every pass sees everything. A `Predict` of `planners.vilad.unmasking`."""

    def __init__(self, model: Vilad, words: torch.Tensor, scene: torch.Tensor, length: int) -> None:
        """Args: the network, in evaluation mode; words (1, T, width); candidates (1, S, width); L."""
        weight = model.tokens.weight
        self._device, dtype = weight.device, weight.dtype
        words, scene = words.to(self._device, dtype), scene.to(self._device, dtype)
        self._model, self._scene = model, scene
        self._config = model.config.body
        with torch.no_grad():
            self._prompt = model.prompt(words, scene)
        self._words = words.shape[1]
        self._many = self._prompt.shape[1]
        self._length = length
        places = model.places(words.shape[1], scene.shape[1], length).to(self._device)
        angles = rotary(self._config.head_width, self._config.rope_theta, places)  # in float32, rounded once
        self._cos, self._sin = (one[None, None].to(dtype) for one in angles)
        self._total = self._many + length
        after = torch.ones((self._total, self._total), dtype=torch.bool, device=self._device).triu(1)
        none = torch.zeros(after.shape, dtype=dtype, device=self._device)
        self._blocked = none.masked_fill(after, NEVER) if self._config.causal else None
        self._candidates = scene[:, :0]
        self.fused = self._device.type != "cpu"
        self.passes = 0
        self.tokens = 0

    @torch.no_grad()
    def __call__(self, row: Array) -> Array:
        """Logits (L, V) of y_t (L,)."""
        return self.run_pass(row, self._plain)

    def run_pass(self, row: Array, compute: Callable[..., torch.Tensor], *given: int) -> Array:
        """One forward pass: `compute(rows, *given)` of y_t as (1, L) on the model's device; logits (n, V), float32.

        Computations read nothing of `rows` but its values, and leave what they keep in tensors that the next one reads.
        So who overrides this may record them and replay them, told apart by their names and what is given.
        """
        self.passes += 1
        return compute(torch.from_numpy(row)[None].to(self._device), *given)[0].float().cpu().numpy()

    def _plain(self, rows: torch.Tensor) -> torch.Tensor:
        hidden, _ = self._whole(rows)
        return self._scored(hidden[:, -self._length :], rows)

    def _whole(self, rows: torch.Tensor) -> tuple[torch.Tensor, list[_Kept]]:
        """Vectors of prompt and template after the transformer, and what each layer leaves."""
        own = self._model.embedded(rows, self._scene)
        hidden = torch.cat((self._prompt, own), dim=1)
        self.tokens += hidden.shape[1]
        kept: list[_Kept] = []
        for layer in self._model.layers:
            hidden, left = self._layer(layer, hidden, self._cos, self._sin)
            kept.append(left)
        hidden = self._normed(self._model.body.norm, hidden)
        self._candidates = hidden[:, self._words : self._many]
        return hidden, kept

    def _layer(
        self, layer: Any, hidden: torch.Tensor, cos: torch.Tensor, sin: torch.Tensor
    ) -> tuple[torch.Tensor, _Kept]:
        config = self._config
        normed = self._normed(layer.input_layernorm, hidden)
        q, k, v = projected(layer.self_attn, normed, config.heads, config.kv_heads, cos, sin)
        added = layer.self_attn.o_proj(self._attended(q, k, v, 0))
        hidden = hidden + added
        fed = layer.mlp(self._normed(layer.post_attention_layernorm, hidden))
        begin = self._many
        return hidden + fed, _Kept(k, v, added[:, begin:], fed[:, begin:])

    def _attended(self, q: torch.Tensor, k: torch.Tensor, v: torch.Tensor, first: int) -> torch.Tensor:
        """Attention to all keys, or of the causal twin from place `first` on to those that stand before."""
        many, seen = q.shape[2], k.shape[2]
        blocked = None if self._blocked is None else self._blocked[first : first + many, :seen]
        if not self.fused:
            return attended(q, k, v, blocked)
        causal = blocked is not None and many == seen
        return attended_fused(q, k, v, None if causal or many == 1 else blocked, causal=causal)

    def _normed(self, norm: Any, hidden: torch.Tensor) -> torch.Tensor:
        if not self.fused:
            return norm(hidden)
        return torch.nn.functional.rms_norm(hidden, hidden.shape[-1:], norm.weight, self._config.epsilon)

    def _some(self, rows: torch.Tensor, places: slice, kept: list[_Kept]) -> torch.Tensor:
        """Vectors (1, n, hidden) of some of the template's tokens, all others' keys and values as they are kept.

        What is computed takes the place of what was kept.
        """
        model, config = self._model, self._config
        hidden = model.embedded(rows, self._scene)[:, places]
        self.tokens += hidden.shape[1]
        where = slice(self._many + places.start, self._many + places.stop)
        cos, sin = self._cos[:, :, where], self._sin[:, :, where]
        for layer, left in zip(model.layers, kept, strict=True):
            normed = self._normed(layer.input_layernorm, hidden)
            q, k, v = projected(layer.self_attn, normed, config.heads, config.kv_heads, cos, sin)
            left.keys[:, :, where], left.values[:, :, where] = k, v
            added = layer.self_attn.o_proj(self._attended(q, left.keys, left.values, where.start))
            hidden = hidden + added
            fed = layer.mlp(self._normed(layer.post_attention_layernorm, hidden))
            hidden = hidden + fed
            left.attended[:, places], left.fed[:, places] = added, fed
        return self._normed(model.body.norm, hidden)

    def _scored(self, hidden: torch.Tensor, rows: torch.Tensor, first: int = 0) -> torch.Tensor:
        return self._model.scored(hidden, self._scene, self._candidates, rows, first)


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
        return self.run_pass(row, self._fresh if fresh else self._response)

    def _fresh(self, rows: torch.Tensor) -> torch.Tensor:
        hidden, self._kept = self._whole(rows)
        return self._scored(hidden[:, -self._length :], rows)

    def _response(self, rows: torch.Tensor) -> torch.Tensor:
        return self._scored(self._some(rows, slice(0, self._length), self._kept), rows)


@dataclass(frozen=True, slots=True)
class Refresh:
    """Refresh intervals of dLLM-Cache.

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
            return self.run_pass(row, self._fresh)
        return self.run_pass(row, self._response if call % self._refresh.response == 0 else self._partly)

    def _fresh(self, rows: torch.Tensor) -> torch.Tensor:
        hidden, self._kept = self._whole(rows)
        return self._scored(hidden[:, -self._length :], rows)

    def _response(self, rows: torch.Tensor) -> torch.Tensor:
        return self._scored(self._some(rows, slice(0, self._length), self._kept), rows)

    def _partly(self, rows: torch.Tensor) -> torch.Tensor:
        return self._scored(self._changed(rows), rows)

    def _changed(self, rows: torch.Tensor) -> torch.Tensor:
        model, config, begin = self._model, self._config, self._many
        count = max(1, round(self._refresh.ratio * self._length))
        hidden = model.embedded(rows, self._scene)
        self.tokens += count
        cos, sin = self._cos[:, :, begin:], self._sin[:, :, begin:]
        for layer, left in zip(model.layers, self._kept, strict=True):
            normed = self._normed(layer.input_layernorm, hidden)
            values = layer.self_attn.v_proj(normed)
            before = left.values[:, :, begin:].transpose(1, 2).flatten(2)
            alike = torch.nn.functional.cosine_similarity(values, before, dim=-1)[0]
            chosen = torch.sort(alike.argsort(stable=True)[:count]).values
            some = normed[:, chosen]
            q, k, v = projected(
                layer.self_attn, some, config.heads, config.kv_heads, cos[:, :, chosen], sin[:, :, chosen]
            )
            left.keys[:, :, begin + chosen], left.values[:, :, begin + chosen] = k, v
            left.attended[:, chosen] = layer.self_attn.o_proj(self._attended(q, left.keys, left.values, begin))
            hidden = hidden + left.attended
            left.fed[:, chosen] = layer.mlp(self._normed(layer.post_attention_layernorm, hidden[:, chosen]))
            hidden = hidden + left.fed
        return self._normed(model.body.norm, hidden)


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
        done = -1  # tokens of the template whose keys are kept; -1 where not even the prompt's are
        for place in range(len(row)):
            if skip and not template.maskable[place]:
                continue
            told = self.told(row, place, done, keep=cached)
            done = place if cached else -1
            logits = np.where(allowed[place], told, NEVER)
            if template.maskable[place]:
                row[place] = int(logits.argmax())
                order[place] = self.passes - before
                sure[place] = float(distribution(logits)[row[place]])
        return Decided(row, order, sure, self.passes - before)

    def told(self, row: Array, place: int, done: int, *, keep: bool) -> Array:
        """Logits (V,) of a place. Keys and values of `done` tokens of the template are kept; below 0 none are, yet."""
        if done < 0:
            return self.run_pass(row, self._part, place, int(keep))[0]
        return self.run_pass(row, self._more, place, done)[0]

    def _part(self, rows: torch.Tensor, place: int, keep: int) -> torch.Tensor:
        """All that stands before a place. What is kept of it lies where there is room for the rest of the template."""
        own = self._model.embedded(rows[:, :place], self._scene)
        hidden = torch.cat((self._prompt, own), dim=1)
        many = hidden.shape[1]
        self.tokens += many
        self._kept: list[torch.Tensor] = []  # of each layer, (2, 1, heads, N, width)
        for layer in self._model.layers:
            hidden, left = self._layer(layer, hidden, self._cos[:, :, :many], self._sin[:, :, :many])
            if keep:
                room = left.keys.new_empty((2, *left.keys.shape[:2], self._total, left.keys.shape[3]))
                room[0, :, :, :many], room[1, :, :, :many] = left.keys, left.values
                self._kept.append(room)
        hidden = self._normed(self._model.body.norm, hidden)
        self._candidates = hidden[:, self._words : self._many]
        return self._scored(hidden[:, -1:], rows, place)

    def _more(self, rows: torch.Tensor, place: int, done: int) -> torch.Tensor:
        """The tokens from `done` to a place, after those that are kept."""
        model, config = self._model, self._config
        hidden = model.embedded(rows[:, done:place], self._scene, done)
        self.tokens += hidden.shape[1]
        where = slice(self._many + done, self._many + place)
        cos, sin = self._cos[:, :, where], self._sin[:, :, where]
        for layer, room in zip(model.layers, self._kept, strict=True):
            normed = self._normed(layer.input_layernorm, hidden)
            q, k, v = projected(layer.self_attn, normed, config.heads, config.kv_heads, cos, sin)
            room[0, :, :, where], room[1, :, :, where] = k, v
            keys, values = room[:, :, :, : where.stop]
            hidden = hidden + layer.self_attn.o_proj(self._attended(q, keys, values, where.start))
            hidden = hidden + layer.mlp(self._normed(layer.post_attention_layernorm, hidden))
        return self._scored(self._normed(model.body.norm, hidden)[:, -1:], rows, place)
