# pyright: reportMissingImports=false, reportUntypedBaseClass=false, reportUntypedFunctionDecorator=false, reportUnknownParameterType=false
"""From a trained network to what ships: an ONNX graph with int8 weights and its tokenizer; and for `transformers`."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any

import torch
from torch import nn

from chauffeur.models.onboard.training import Network
from chauffeur.planners.onboard.prompt import CONTEXT, DRAFT, HISTORY, REPLY, WISH

CHAT_TEMPLATE = (
    "{%- for m in messages if m['role'] == 'system' %}{% set ns = m['content'] %}{% endfor -%}"
    f"{CONTEXT}unknown{HISTORY}{WISH}"
    "{{ (messages | selectattr('role', 'equalto', 'user') | list | last)['content'] | lower | trim }}"
    f"{DRAFT}{REPLY}"
)
"""For servers of the exported model: the last user message is the wish, and nobody drafts."""


class Stepped(nn.Module):
    """The network as a function of new tokens and the keys and values of earlier ones; only the last logits come out.

    Written out, because it is what is exported; a test holds it to `transformers`' own forward pass.
    """

    def __init__(self, model: Network) -> None:
        super().__init__()
        self.body = model.model
        self.head = nn.Linear(model.config.hidden_size, model.config.vocab_size, bias=False)
        # A copy: one tensor used both ways confuses the exporter.
        self.head.weight = nn.Parameter(model.lm_head.weight.detach().clone())
        config: Any = model.config
        self.heads, self.kv_heads = config.num_attention_heads, config.num_key_value_heads
        self.width = config.hidden_size // config.num_attention_heads
        theta = float(config.rope_parameters["rope_theta"]) if hasattr(config, "rope_parameters") else 10000.0
        frequency = 1.0 / (theta ** (torch.arange(0, self.width, 2, dtype=torch.float32) / self.width))
        self.frequency: Any = nn.Buffer(frequency, persistent=False)

    def forward(
        self, ids: torch.Tensor, keys: torch.Tensor, values: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """(logits (1, vocabulary), keys, values) of ids (1, new); keys, values (layers, 1, kv heads, past, width)."""
        new, past = ids.shape[1], keys.shape[3]
        places = torch.arange(new, device=ids.device) + past
        angles = places.float()[:, None] * self.frequency[None, :]
        angles = torch.cat((angles, angles), dim=-1)
        cos, sin = angles.cos()[None, None], angles.sin()[None, None]
        seen = torch.arange(past + new, device=ids.device)[None, :] <= places[:, None]
        blocked = torch.where(seen, 0.0, -1e9)[None, None]
        hidden = self.body.embed_tokens(ids)
        all_keys: list[torch.Tensor] = []
        all_values: list[torch.Tensor] = []
        for index, layer in enumerate(self.body.layers):
            attention: Any = layer.self_attn
            x = layer.input_layernorm(hidden)
            q = attention.q_proj(x).view(1, new, self.heads, self.width).transpose(1, 2)
            k = attention.k_proj(x).view(1, new, self.kv_heads, self.width).transpose(1, 2)
            v = attention.v_proj(x).view(1, new, self.kv_heads, self.width).transpose(1, 2)
            q, k = q * cos + _turned(q) * sin, k * cos + _turned(k) * sin
            k = torch.cat((keys[index], k), dim=2)
            v = torch.cat((values[index], v), dim=2)
            all_keys.append(k)
            all_values.append(v)
            share = self.heads // self.kv_heads
            wide_k, wide_v = k.repeat_interleave(share, dim=1), v.repeat_interleave(share, dim=1)
            weights = torch.softmax(q @ wide_k.transpose(2, 3) / self.width**0.5 + blocked, dim=-1)
            mixed = (weights @ wide_v).transpose(1, 2).reshape(1, new, self.heads * self.width)
            hidden = hidden + attention.o_proj(mixed)
            hidden = hidden + layer.mlp(layer.post_attention_layernorm(hidden))
        last = self.body.norm(hidden[:, -1])
        return self.head(last), torch.stack(all_keys), torch.stack(all_values)


def _turned(x: torch.Tensor) -> torch.Tensor:
    first, second = x.chunk(2, dim=-1)
    return torch.cat((-second, first), dim=-1)


def export(model: Network, tokenizer: Any, folder: Path, about: Mapping[str, Any], *, int8: bool = True) -> Path:
    """Write `model.onnx`, `tokenizer.json` and `model.json` for the runtime.

    Args:
        model: The trained network.
        tokenizer: A `tokenizers.Tokenizer`.
        folder: Where to.
        about: What `model.json` is to say: version, questions, reasons, how it was made.
        int8: Whether weights become int8.
    """
    import onnx
    from onnxruntime.quantization import QuantType, quantize_dynamic

    folder.mkdir(parents=True, exist_ok=True)
    model = deepcopy(model).to("cpu").float().eval()
    step = Stepped(model).eval()
    config: Any = model.config
    shape = (config.num_hidden_layers, 1, config.num_key_value_heads, 4, step.width)
    example = (torch.zeros((1, 5), dtype=torch.int64), torch.zeros(shape), torch.zeros(shape))
    new, past = torch.export.Dim("new", min=1, max=512), torch.export.Dim("past", min=0, max=512)
    with tempfile.TemporaryDirectory() as scratch:
        plain = Path(scratch) / "plain.onnx"
        torch.onnx.export(
            step,
            example,
            str(plain),
            input_names=["ids", "keys", "values"],
            output_names=["logits", "new_keys", "new_values"],
            dynamic_shapes=({1: new}, {3: past}, {3: past}),
            dynamo=True,
            external_data=False,
            verbose=False,
        )
        graph = onnx.load(str(plain))
        del graph.graph.value_info[:]  # the exporter's shapes of inner values contradict those of transposed weights
        onnx.save(graph, str(plain))
        target = folder / "model.onnx"
        if int8:
            quantize_dynamic(
                str(plain), str(target), op_types_to_quantize=["MatMul"], weight_type=QuantType.QInt8, per_channel=True
            )
        else:
            target.write_bytes(plain.read_bytes())
    tokenizer.save(str(folder / "tokenizer.json"))
    (folder / "model.json").write_text(json.dumps(dict(about), indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return folder


def export_transformers(model: Network, tokenizer: Any, folder: Path) -> Path:
    """Write the model as any `transformers` checkpoint: weights in bfloat16, tokenizer, chat template."""
    from transformers import PreTrainedTokenizerFast

    from chauffeur.planners.onboard.prompt import END

    folder.mkdir(parents=True, exist_ok=True)
    wrapped = PreTrainedTokenizerFast(tokenizer_object=tokenizer, eos_token=END, pad_token=END)
    wrapped.chat_template = CHAT_TEMPLATE
    wrapped.save_pretrained(folder)
    deepcopy(model).to(torch.bfloat16).save_pretrained(folder)
    return folder
