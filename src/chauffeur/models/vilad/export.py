# pyright: reportMissingImports=false, reportUntypedBaseClass=false, reportUnknownParameterType=false
"""The network as it ships: one function of words, candidates and y_t, for one command."""

from __future__ import annotations

import json
from collections.abc import Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any, Final

import torch
from torch import nn

from chauffeur.concept import ConfigError
from chauffeur.models.export.onnx_graph import write_graph
from chauffeur.models.net.transformer import attended, projected, rotary
from chauffeur.models.vilad.network import Vilad


class ViladGraph(nn.Module):
    """The network, written out for the exporter; a test holds it to `transformers`' own forward pass."""

    def __init__(self, model: Vilad) -> None:
        """Args: a trained one, bidirectional."""
        super().__init__()
        self.model = model

    def forward(self, words: torch.Tensor, scene: torch.Tensor, rows: torch.Tensor) -> torch.Tensor:
        """Logits (1, L, size + S) of words (1, T, width), candidates (1, S, width) and y_t (1, L)."""
        model, body, config = self.model, self.model.body, self.model.config.body
        count, many, length = words.shape[1], scene.shape[1], rows.shape[1]
        hidden = torch.cat((model.prompt(words, scene), model.embedded(rows, scene)), dim=1)
        cos, sin = rotary(config.head_width, config.rope_theta, model.places(count, many, length))
        for layer in body.layers:
            normed = layer.input_layernorm(hidden)
            q, k, v = projected(
                layer.self_attn, normed, config.heads, config.kv_heads, cos[None, None], sin[None, None]
            )
            hidden = hidden + layer.self_attn.o_proj(attended(q, k, v))
            hidden = hidden + layer.mlp(layer.post_attention_layernorm(hidden))
        hidden = body.norm(hidden)
        return model.scored(hidden[:, count + many :], scene, hidden[:, count : count + many], rows)


def export(model: Vilad, folder: Path, about: Mapping[str, Any], *, int8: bool = True) -> Path:
    """Write `model.onnx` and `model.json` for `planners.vilad.engine`.

    Args:
        model: Trained, bidirectional.
        folder: Where to.
        about: What `model.json` is to say.
        int8: Whether matrices become int8.
    """
    folder.mkdir(parents=True, exist_ok=True)
    graph = ViladGraph(deepcopy(model).to("cpu").float().eval()).eval()
    config = model.config
    length = int(about["length"])
    example = (
        torch.zeros((1, 7, config.words)),
        torch.zeros((1, 5, config.scene)),
        torch.zeros((1, length), dtype=torch.int64),
    )
    words, candidates = torch.export.Dim("words", min=1, max=64), torch.export.Dim("candidates", min=2, max=512)
    write_graph(
        graph,
        example,
        ["words", "scene", "rows"],
        ["logits"],
        ({1: words}, {1: candidates}, None),
        folder / "model.onnx",
        int8=int8,
    )
    (folder / "model.json").write_text(json.dumps(dict(about), indent=1) + "\n", encoding="utf-8")
    return folder


_OF_A_LAYER: Final = (
    "self_attn.q_proj", "self_attn.k_proj", "self_attn.v_proj", "self_attn.o_proj",
    "mlp.gate_proj", "mlp.up_proj", "mlp.down_proj",
)  # fmt: skip


def exported_weights(folder: Path, layers: int) -> dict[str, torch.Tensor]:
    """The weights of an exported network by their names in `Vilad`, from 8 bits: to go on from what ships.

    The exporter keeps the names of vectors, but numbers the matrices in the order of the forward pass.

    Args:
        folder: With `model.onnx`, in int8.
        layers: Of its transformer.

    Raises:
        ConfigError: There is no such graph, or it is another one.
    """
    import onnx
    from onnx import numpy_helper

    try:
        held = {one.name: one for one in onnx.load(str(folder / "model.onnx")).graph.initializer}
    except OSError as error:
        raise ConfigError(f"{folder} holds no exported network.", hint="Give a folder with `model.onnx`.") from error
    found = {
        name.removeprefix("model."): torch.from_numpy(numpy_helper.to_array(one).copy())
        for name, one in held.items()
        if name.startswith("model.")
    }
    stems = sorted({name.removesuffix("_quantized") for name in held if name.endswith("_quantized")}, key=_number)
    own = ["words.first", "words.second"]
    for _ in range(2):  # candidates are connected twice, as prompt and as tokens; the exporter may share what is square
        own += ["scene.first"] + ["scene.second"] * ("scene.second.weight" not in found)
    own += [f"body.layers.{layer}.{part}" for layer in range(layers) for part in _OF_A_LAYER]
    own += ["query", "head", "keys"]
    if len(stems) != len(own):
        raise ConfigError(f"{folder} has {len(stems)} matrices, not {len(own)}.", hint="It is of another size.")

    def values(name: str) -> torch.Tensor:
        return torch.from_numpy(numpy_helper.to_array(held[name]).astype("float32"))

    for name, stem in zip(own, stems, strict=True):
        whole = values(f"{stem}_quantized") - values(f"{stem}_zero_point")
        found[f"{name}.weight"] = (whole * values(f"{stem}_scale")).T.contiguous()
    return found


def _number(stem: str) -> int:
    return int(stem.rpartition("_")[2])
