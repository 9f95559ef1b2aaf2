# pyright: reportMissingImports=false, reportUntypedBaseClass=false, reportUntypedFunctionDecorator=false, reportUnknownParameterType=false
"""From a trained network to what ships: an ONNX graph with int8 weights and its tokenizer; and for `transformers`."""

from __future__ import annotations

import json
from collections.abc import Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any

import torch
from torch import nn

from chauffeur.models.export.onnx_graph import write_graph
from chauffeur.models.net.transformer import Network, attended, projected, rotary
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
        self.theta = theta

    def forward(
        self, ids: torch.Tensor, keys: torch.Tensor, values: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """(logits (1, vocabulary), keys, values) of ids (1, new); keys, values (layers, 1, kv heads, past, width)."""
        new, past = ids.shape[1], keys.shape[3]
        places = torch.arange(new, device=ids.device) + past
        cos, sin = (one[None, None] for one in rotary(self.width, self.theta, places))
        seen = torch.arange(past + new, device=ids.device)[None, :] <= places[:, None]
        blocked = torch.where(seen, 0.0, -1e9)[None, None]
        hidden = self.body.embed_tokens(ids)
        all_keys: list[torch.Tensor] = []
        all_values: list[torch.Tensor] = []
        for index, layer in enumerate(self.body.layers):
            attention: Any = layer.self_attn
            x = layer.input_layernorm(hidden)
            q, k, v = projected(attention, x, self.heads, self.kv_heads, cos, sin)
            k = torch.cat((keys[index], k), dim=2)
            v = torch.cat((values[index], v), dim=2)
            all_keys.append(k)
            all_values.append(v)
            hidden = hidden + attention.o_proj(attended(q, k, v, blocked))
            hidden = hidden + layer.mlp(layer.post_attention_layernorm(hidden))
        last = self.body.norm(hidden[:, -1])
        return self.head(last), torch.stack(all_keys), torch.stack(all_values)


def export(model: Network, tokenizer: Any, folder: Path, about: Mapping[str, Any], *, int8: bool = True) -> Path:
    """Write `model.onnx`, `tokenizer.json` and `model.json` for the runtime.

    Args:
        model: The trained network.
        tokenizer: A `tokenizers.Tokenizer`.
        folder: Where to.
        about: What `model.json` is to say: version, questions, reasons, how it was made.
        int8: Whether weights become int8.
    """
    folder.mkdir(parents=True, exist_ok=True)
    model = deepcopy(model).to("cpu").float().eval()
    step = Stepped(model).eval()
    config: Any = model.config
    shape = (config.num_hidden_layers, 1, config.num_key_value_heads, 4, step.width)
    example = (torch.zeros((1, 5), dtype=torch.int64), torch.zeros(shape), torch.zeros(shape))
    new, past = torch.export.Dim("new", min=1, max=512), torch.export.Dim("past", min=0, max=512)
    write_graph(
        step,
        example,
        ["ids", "keys", "values"],
        ["logits", "new_keys", "new_values"],
        ({1: new}, {3: past}, {3: past}),
        folder / "model.onnx",
        int8=int8,
    )
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
