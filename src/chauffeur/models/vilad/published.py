# pyright: reportMissingImports=false, reportUnknownParameterType=false
"""Published masked-diffusion weights in our transformer: LLaDA and LLaDA-V, SMDM; and causal models turned into one.

All of them are a Llama that attends both ways, under other names. No code of a checkpoint is run.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any, Final

import torch

from chauffeur.concept import DataError
from chauffeur.models.net.transformer import Network, TransformerConfig, language_model

LLADA_MASK: Final = 126_336
"""Token id of [M] in LLaDA, LLaDA-1.5 and LLaDA-V (vocabulary of 126,464)."""
SMDM_MASK: Final = 32_000
"""The same in SMDM: one after TinyLlama's vocabulary."""

_LLADA_PARTS: Final[Mapping[str, str]] = {
    "q_proj": "self_attn.q_proj",
    "k_proj": "self_attn.k_proj",
    "v_proj": "self_attn.v_proj",
    "attn_out": "self_attn.o_proj",
    "ff_proj": "mlp.gate_proj",
    "up_proj": "mlp.up_proj",
    "ff_out": "mlp.down_proj",
    "attn_norm": "input_layernorm",
    "ff_norm": "post_attention_layernorm",
}
_LLADA_WHOLE: Final[Mapping[str, str]] = {
    "model.transformer.wte.weight": "model.embed_tokens.weight",
    "model.transformer.ln_f.weight": "model.norm.weight",
    "model.transformer.ff_out.weight": "lm_head.weight",
    "model.mm_projector.0.weight": "connector.first.weight",
    "model.mm_projector.0.bias": "connector.first.bias",
    "model.mm_projector.2.weight": "connector.second.weight",
    "model.mm_projector.2.bias": "connector.second.bias",
}
_SMDM_PARTS: Final[Mapping[str, str]] = {
    "norm_1": "input_layernorm",
    "norm_2": "post_attention_layernorm",
    "attn.proj": "self_attn.o_proj",
    "mlp.swiglu.w1": "mlp.gate_proj",
    "mlp.swiglu.w2": "mlp.up_proj",
    "mlp.swiglu.w3": "mlp.down_proj",
}
_SMDM_WHOLE: Final[Mapping[str, str]] = {
    "transformer.wte.weight": "model.embed_tokens.weight",
    "transformer.ln_f.weight": "model.norm.weight",
    "lm_head.weight": "lm_head.weight",
}
_BLOCK: Final = re.compile(r"model\.transformer\.blocks\.(\d+)\.(\w+)\.weight")
_LIT_BLOCK: Final = re.compile(r"transformer\.h\.(\d+)\.([\w.]+)\.weight")

Tensors = dict[str, torch.Tensor]


def from_llada(tensors: Mapping[str, torch.Tensor]) -> Tensors:
    """Weights of LLaDA or LLaDA-V under the names of a `LlamaForCausalLM`; the connector's as `connector.*`.

    The vision tower of LLaDA-V (`model.vision_tower.*`) is SigLIP, which `transformers` reads by itself: left out.

    Raises:
        DataError: A tensor has a name that the family does not have.
    """
    found: Tensors = {}
    for name, tensor in tensors.items():
        block = _BLOCK.fullmatch(name)
        if name.startswith("model.vision_tower."):
            continue
        if block is not None and block[2] in _LLADA_PARTS:
            found[f"model.layers.{block[1]}.{_LLADA_PARTS[block[2]]}.weight"] = tensor
        elif name in _LLADA_WHOLE:
            found[_LLADA_WHOLE[name]] = tensor
        else:
            raise DataError(f"No LLaDA checkpoint has a tensor {name!r}.")
    return found


def from_smdm(tensors: Mapping[str, torch.Tensor], heads: int, groups: int) -> Tensors:
    """Weights of SMDM (lit-gpt's layout) under the names of a `LlamaForCausalLM`.

    Args:
        tensors: As stored, without the prefix of a wrapper.
        heads: Attention heads.
        groups: Query groups (heads of keys): queries, key and value of a group lie together in one matrix.

    Raises:
        DataError: A tensor has a name that the family does not have, or a shape that does not fit the heads.
    """
    found: Tensors = {}
    for name, tensor in tensors.items():
        block = _LIT_BLOCK.fullmatch(name)
        if block is not None and block[2] == "attn.attn":
            layer = f"model.layers.{block[1]}.self_attn"
            for part, matrix in zip("qkv", _unfused(tensor, heads, groups), strict=True):
                found[f"{layer}.{part}_proj.weight"] = matrix
        elif block is not None and block[2] in _SMDM_PARTS:
            found[f"model.layers.{block[1]}.{_SMDM_PARTS[block[2]]}.weight"] = tensor
        elif name in _SMDM_WHOLE:
            found[_SMDM_WHOLE[name]] = tensor
        else:
            raise DataError(f"No SMDM checkpoint has a tensor {name!r}.")
    return found


def _unfused(fused: torch.Tensor, heads: int, groups: int) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    each = heads // groups
    if fused.shape[0] % (groups * (each + 2)):
        raise DataError(f"A matrix of {fused.shape[0]} rows is not that of {heads} heads in {groups} groups.")
    parts = fused.view(groups, each + 2, -1, fused.shape[1])
    q, k, v = parts[:, :each], parts[:, each : each + 1], parts[:, each + 1 :]
    return q.reshape(-1, fused.shape[1]), k.reshape(-1, fused.shape[1]), v.reshape(-1, fused.shape[1])


def load_published(config: TransformerConfig, tensors: Mapping[str, torch.Tensor]) -> tuple[Network, Tensors]:
    """(a bidirectional `LlamaForCausalLM` with these weights, what is not its own: the connector's).

    Args:
        config: Its shape; `causal` has to be False.
        tensors: As `from_llada` or `from_smdm` gives them.

    Raises:
        DataError: Weights are missing, or do not fit the shape.
    """
    if config.causal:
        raise DataError("A masked-diffusion model attends both ways.", hint="Set causal=False.")
    model = language_model(config)
    own = {name: tensor for name, tensor in tensors.items() if not name.startswith("connector.")}
    try:
        missing, unexpected = model.load_state_dict(own, strict=False)
    except RuntimeError as error:
        raise DataError(f"The checkpoint does not fit the shape: {error}.") from error
    left = [name for name in missing if not (config.tied and name == "lm_head.weight")]
    if left or unexpected:
        raise DataError(f"The checkpoint lacks {', '.join(left) or 'nothing'}, and has too much: {unexpected}.")
    return model, {name: tensor for name, tensor in tensors.items() if name.startswith("connector.")}


def to_masked_diffusion(causal: Network) -> tuple[Network, int]:
    """(a causal `LlamaForCausalLM` that attends both ways, token id of its [M]); to be trained on.

    [M] is a new word; it begins as the mean of all others. A causal vector predicts the word after it, and what it
    learned is kept by leaving that so: read the result through `response_logits(..., shifted=True)` (as Dream does).
    """
    from copy import deepcopy

    model = deepcopy(causal)
    mask = int(model.config.vocab_size)
    model.resize_token_embeddings(mask + 1, mean_resizing=False)
    with torch.no_grad():
        for table in {id(one): one for one in (model.get_input_embeddings(), model.get_output_embeddings())}.values():
            table.weight[mask] = table.weight[:mask].mean(dim=0)
    model.config.is_causal = False
    for layer in model.model.layers:
        layer.self_attn.is_causal = False
    return model, mask


def response_logits(
    model: Network, prompt: torch.Tensor, mask: int, *, shifted: bool = False
) -> Callable[[torch.Tensor], torch.Tensor]:
    """Logits (L, vocabulary) of a response (L,) behind a prompt (T,): what Algorithm 2 asks of a language model.

    Args:
        model: Bidirectional.
        prompt: Token ids.
        mask: Id of [M], which is never predicted.
        shifted: Whether the logits of a token are those of the vector before it.
    """

    @torch.no_grad()
    def logits(response: torch.Tensor) -> torch.Tensor:
        ids = torch.cat((prompt, response))[None]
        found = model(input_ids=ids, use_cache=False).logits[0]
        begin = len(prompt) - int(shifted)
        own: Any = found[begin : begin + len(response)].clone()
        own[:, mask] = float("-inf")
        return own

    return logits
