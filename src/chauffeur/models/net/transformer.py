# pyright: reportMissingImports=false, reportUntypedBaseClass=false, reportUnknownParameterType=false
"""The one transformer: `transformers`' Llama, causal or bidirectional, from 100 thousand to billions of weights."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import torch
from torch import nn

Network = Any
"""A module of `transformers`: untyped, because it need not be installed where this is checked."""


@dataclass(frozen=True, slots=True)
class TransformerConfig:
    """Shape of a transformer.

    Attributes:
        hidden, layers, heads, kv_heads, inner: As Llama has them.
        vocabulary: Tokens of its own table; 1 where only vectors are fed.
        causal: Whether a token sees only what stands before it; otherwise all see all (masked diffusion).
        positions: Longest sequence.
        rope_theta: Base of the rotary angles.
        tied: Whether the output shares the input's table.
        end: Token that ends and pads a text; None for none.
        epsilon: Of the normalisation.
    """

    hidden: int
    layers: int
    heads: int
    kv_heads: int
    inner: int
    vocabulary: int = 1
    causal: bool = True
    positions: int = 512
    rope_theta: float = 10_000.0
    tied: bool = True
    end: int | None = None
    epsilon: float = 1e-5

    @property
    def head_width(self) -> int:
        """Numbers of a head's key."""
        return self.hidden // self.heads


def _llama(config: TransformerConfig) -> Any:
    from transformers import LlamaConfig

    made: Any = LlamaConfig(
        vocab_size=config.vocabulary,
        hidden_size=config.hidden,
        intermediate_size=config.inner,
        num_hidden_layers=config.layers,
        num_attention_heads=config.heads,
        num_key_value_heads=config.kv_heads,
        max_position_embeddings=config.positions,
        tie_word_embeddings=config.tied,
        bos_token_id=None,
        eos_token_id=config.end,
        pad_token_id=config.end,
        rms_norm_eps=config.epsilon,
        rope_parameters={"rope_type": "default", "rope_theta": config.rope_theta},
    )
    if not config.causal:
        made.is_causal = False  # honoured by transformers' masks, and kept in config.json
    return made


def language_model(config: TransformerConfig) -> Network:
    """An untrained `LlamaForCausalLM`. Weights come from torch's global generator."""
    from transformers import LlamaForCausalLM

    return LlamaForCausalLM(_llama(config))


def transformer(config: TransformerConfig) -> Network:
    """An untrained `LlamaModel`, for sequences of vectors. Weights come from torch's global generator."""
    from transformers import LlamaModel

    return LlamaModel(_llama(config))


def rotary(width: int, theta: float, places: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """(cos, sin) of the rotary angles of places (N,); each (N, width)."""
    frequency = 1.0 / (theta ** (torch.arange(0, width, 2, dtype=torch.float32, device=places.device) / width))
    angles = places.float()[:, None] * frequency[None, :]
    angles = torch.cat((angles, angles), dim=-1)
    return angles.cos(), angles.sin()


def turned(x: torch.Tensor) -> torch.Tensor:
    """Halves of the last axis exchanged, the first with its sign changed: what the sine is multiplied with."""
    first, second = x.chunk(2, dim=-1)
    return torch.cat((-second, first), dim=-1)


def projected(
    attention: Any, x: torch.Tensor, heads: int, kv_heads: int, cos: torch.Tensor, sin: torch.Tensor
) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Queries, keys and values, (B, heads, N, width), of a layer's input (B, N, hidden), turned to their places."""
    batch, many = x.shape[0], x.shape[1]
    q = attention.q_proj(x).view(batch, many, heads, -1).transpose(1, 2)
    k = attention.k_proj(x).view(batch, many, kv_heads, -1).transpose(1, 2)
    v = attention.v_proj(x).view(batch, many, kv_heads, -1).transpose(1, 2)
    return q * cos + turned(q) * sin, k * cos + turned(k) * sin, v


def attended(q: torch.Tensor, k: torch.Tensor, v: torch.Tensor, blocked: torch.Tensor | None = None) -> torch.Tensor:
    """Attention of queries (B, heads, N, width) to keys and values (B, kv heads, M, width); (B, N, heads * width).

    Args:
        q, k, v: As `projected` gives them.
        blocked: Added to the scores, e.g. -1e9 where one may not look; None for nothing.
    """
    share = q.shape[1] // k.shape[1]
    if share > 1:
        k, v = k.repeat_interleave(share, dim=1), v.repeat_interleave(share, dim=1)
    scores = q @ k.transpose(2, 3) / q.shape[-1] ** 0.5
    weights = torch.softmax(scores if blocked is None else scores + blocked, dim=-1)
    return (weights @ v).transpose(1, 2).reshape(q.shape[0], q.shape[2], -1)


def attended_fused(
    q: torch.Tensor, k: torch.Tensor, v: torch.Tensor, blocked: torch.Tensor | None = None, *, causal: bool = False
) -> torch.Tensor:
    """`attended` in one kernel that never writes the scores down: what pays on an accelerator. Rounds otherwise.

    Args:
        q, k, v, blocked: As there; a mask has the type of the queries.
        causal: Whether query i sees keys 0 to i alone; as many queries as keys, and no mask.
    """
    share = q.shape[1] // k.shape[1]
    if share > 1:
        k, v = k.repeat_interleave(share, dim=1), v.repeat_interleave(share, dim=1)
    found = nn.functional.scaled_dot_product_attention(q, k, v, attn_mask=blocked, is_causal=causal)
    return found.transpose(1, 2).reshape(q.shape[0], q.shape[2], -1)


def parameter_count(module: nn.Module) -> int:
    """Weights of a module, shared ones once."""
    return sum(parameter.numel() for parameter in module.parameters())
