# pyright: reportMissingImports=false, reportUnknownParameterType=false
"""An exported checkpoint as one GGUF file, for llama.cpp and what is built on it.

Source: the GGUF specification and the `gguf` package of llama.cpp, which writes it. This repository's own network
is converted and no other (`transformers`' Llama with the tokenizer of `models.onboard.tokens`): for those llama.cpp has
a converter.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chauffeur.concept import DataError, MissingExtraError
from chauffeur.concept.extras import install_command

PRE_TOKENIZER: Final = "smollm"
"""llama.cpp's name for what the tokenizer does first: each digit alone, then words as GPT-2 cuts them."""

_NORMAL, _CONTROL, _OWN, _UNUSED = 1, 3, 4, 5
"""Kinds of token in GGUF."""
_NAMES: Final = {
    "self_attn.q_proj": "attn_q",
    "self_attn.k_proj": "attn_k",
    "self_attn.v_proj": "attn_v",
    "self_attn.o_proj": "attn_output",
    "mlp.gate_proj": "ffn_gate",
    "mlp.up_proj": "ffn_up",
    "mlp.down_proj": "ffn_down",
    "input_layernorm": "attn_norm",
    "post_attention_layernorm": "ffn_norm",
}


def to_gguf(checkpoint: Path, target: Path, *, eight_bit: bool = False) -> Path:
    """Write a checkpoint as GGUF.

    Args:
        checkpoint: Folder that `export_transformers` wrote.
        target: File to write.
        eight_bit: Whether matrices become Q8_0; else they are kept as 16-bit floats.

    Raises:
        DataError: The folder holds no such checkpoint.
        MissingExtraError: `gguf` or `safetensors` is not installed.
    """
    try:
        import gguf
        from safetensors import SafetensorError
        from safetensors.torch import load_file
    except ImportError as error:
        raise MissingExtraError(f"GGUF needs {error.name}.", hint=f"Run: {install_command('models')} gguf") from error
    try:
        config: dict[str, Any] = json.loads((checkpoint / "config.json").read_text(encoding="utf-8"))
        tokenizer: dict[str, Any] = json.loads((checkpoint / "tokenizer.json").read_text(encoding="utf-8"))
        template = (checkpoint / "chat_template.jinja").read_text(encoding="utf-8")
        weights = load_file(checkpoint / "model.safetensors")
    except (OSError, ValueError, SafetensorError) as error:
        raise DataError(
            f"{checkpoint} holds no exported checkpoint: {error}",
            hint="Give the `transformers` folder of a run of `chauffeur model train onboard`.",
        ) from error
    if config.get("model_type") != "llama" or config.get("attention_bias") or not config.get("tie_word_embeddings"):
        raise DataError(
            f"{checkpoint} is another kind of network.",
            hint="llama.cpp's own converter, convert_hf_to_gguf.py, may do.",
        )
    heads, kv_heads = config["num_attention_heads"], config["num_key_value_heads"]
    writer = gguf.GGUFWriter(str(target), "llama")
    writer.add_name("chauffeur-onboard")
    writer.add_context_length(config["max_position_embeddings"])
    writer.add_embedding_length(config["hidden_size"])
    writer.add_block_count(config["num_hidden_layers"])
    writer.add_feed_forward_length(config["intermediate_size"])
    writer.add_head_count(heads)
    writer.add_head_count_kv(kv_heads)
    writer.add_key_length(config["head_dim"])
    writer.add_value_length(config["head_dim"])
    writer.add_rope_dimension_count(config["head_dim"])
    writer.add_rope_freq_base(config["rope_parameters"]["rope_theta"])
    writer.add_layer_norm_rms_eps(config["rms_norm_eps"])
    writer.add_vocab_size(config["vocab_size"])
    kind = gguf.LlamaFileType.MOSTLY_Q8_0 if eight_bit else gguf.LlamaFileType.MOSTLY_F16
    writer.add_file_type(kind)
    _add_tokenizer(writer, tokenizer, config, template)
    for name, tensor in weights.items():
        array: NDArray[np.float32] = tensor.float().numpy()
        if name.endswith("q_proj.weight"):
            array = interleaved(array, heads)
        elif name.endswith("k_proj.weight"):
            array = interleaved(array, kv_heads)
        if array.ndim == 1:  # norms stay whole
            writer.add_tensor(_gguf_name(name), array)
        elif eight_bit:
            q8 = gguf.GGMLQuantizationType.Q8_0
            writer.add_tensor(_gguf_name(name), gguf.quants.quantize(array, q8), raw_dtype=q8)
        else:
            writer.add_tensor(_gguf_name(name), array.astype(np.float16))
    target.parent.mkdir(parents=True, exist_ok=True)
    writer.write_header_to_file()
    writer.write_kv_data_to_file()
    writer.write_tensors_to_file()
    writer.close()
    return target


def interleaved(weight: NDArray[np.float32], heads: int) -> NDArray[np.float32]:
    """Rows of a query or key matrix as llama.cpp turns them: pairs beside each other, not half a head apart.

    Args:
        weight: (heads * width, hidden).
        heads: How many.
    """
    rows, hidden = weight.shape
    return weight.reshape(heads, 2, rows // heads // 2, hidden).swapaxes(1, 2).reshape(rows, hidden)


def _gguf_name(name: str) -> str:
    """A tensor's name in GGUF."""
    if name == "model.embed_tokens.weight":
        return "token_embd.weight"
    if name == "model.norm.weight":
        return "output_norm.weight"
    layer, part = name.removeprefix("model.layers.").removesuffix(".weight").split(".", 1)
    return f"blk.{layer}.{_NAMES[part]}.weight"


def _add_tokenizer(writer: Any, tokenizer: dict[str, Any], config: dict[str, Any], template: str) -> None:
    size: int = config["vocab_size"]
    tokens = [f"[unused{i}]" for i in range(size)]
    kinds = [_UNUSED] * size
    for token, place in tokenizer["model"]["vocab"].items():
        tokens[place], kinds[place] = token, _NORMAL
    for added in tokenizer["added_tokens"]:
        tokens[added["id"]], kinds[added["id"]] = added["content"], _CONTROL if added["special"] else _OWN
    writer.add_tokenizer_model("gpt2")
    writer.add_tokenizer_pre(PRE_TOKENIZER)
    writer.add_token_list(tokens)
    writer.add_token_types(kinds)
    writer.add_token_merges(
        [pair if isinstance(pair, str) else " ".join(pair) for pair in tokenizer["model"]["merges"]]
    )
    writer.add_eos_token_id(config["eos_token_id"])
    writer.add_pad_token_id(config["pad_token_id"])
    writer.add_add_bos_token(False)
    writer.add_chat_template(template)
