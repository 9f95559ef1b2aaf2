# pyright: reportMissingImports=false, reportUntypedBaseClass=false, reportUnknownParameterType=false
"""The compact VLM as it ships: one function of words, picture and tokens so far, for one request."""

from __future__ import annotations

import json
from collections.abc import Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any

import torch
from torch import nn

from chauffeur.models.export.onnx_graph import write_graph
from chauffeur.models.net.transformer import attended, projected, rotary
from chauffeur.models.vlm.network import CompactVlm
from chauffeur.planners.camera_faults import HEIGHT, WIDTH
from chauffeur.planners.vlm.template import TEMPLATE
from chauffeur.planners.word_table import MOST_PIECES
from chauffeur.planners.word_table import WIDTH as WORD_WIDTH


class VlmGraph(nn.Module):
    """The network, written out for the exporter; a test holds it to `transformers`' own forward pass."""

    def __init__(self, model: CompactVlm) -> None:
        """Args: a trained one."""
        super().__init__()
        self.model = model

    def forward(self, words: torch.Tensor, pixels: torch.Tensor, rows: torch.Tensor) -> torch.Tensor:
        """Logits (1, L, size) of words (1, T, width), a picture (1, H, W, 3) in 0..1 and tokens (1, L)."""
        model, body, config = self.model, self.model.body, self.model.config.body
        count = words.shape[1]
        hidden = model.sequence(words, model.seen(pixels), rows)
        places = model.positions(count)
        cos, sin = rotary(config.head_width, config.rope_theta, places)
        later = places[None, :] > places[:, None]  # places grow along the sequence
        blocked = later.to(hidden.dtype) * -1e9
        for layer in body.layers:
            normed = layer.input_layernorm(hidden)
            q, k, v = projected(
                layer.self_attn, normed, config.heads, config.kv_heads, cos[None, None], sin[None, None]
            )
            hidden = hidden + layer.self_attn.o_proj(attended(q, k, v, blocked))
            hidden = hidden + layer.mlp(layer.post_attention_layernorm(hidden))
        return model.scored(body.norm(hidden), count)


def export(model: CompactVlm, folder: Path, about: Mapping[str, Any], *, int8: bool = True) -> Path:
    """Write `model.onnx` and `model.json` for `planners.vlm.engine`.

    Args:
        model: Trained.
        folder: Where to.
        about: What `model.json` is to say.
        int8: Whether matrices become int8; the convolutions stay as they are.
    """
    folder.mkdir(parents=True, exist_ok=True)
    graph = VlmGraph(deepcopy(model).to("cpu").float().eval()).eval()
    example = (
        torch.zeros((1, 7, WORD_WIDTH)),
        torch.zeros((1, HEIGHT, WIDTH, 3)),
        torch.zeros((1, TEMPLATE.length), dtype=torch.int64),
    )
    words = torch.export.Dim("words", min=1, max=MOST_PIECES)
    write_graph(
        graph,
        example,
        ["words", "pixels", "rows"],
        ["logits"],
        ({1: words}, None, None),
        folder / "model.onnx",
        int8=int8,
    )
    (folder / "model.json").write_text(json.dumps(dict(about), indent=1) + "\n", encoding="utf-8")
    return folder
