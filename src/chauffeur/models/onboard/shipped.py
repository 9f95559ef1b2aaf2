# pyright: reportMissingImports=false, reportUnknownParameterType=false
"""From what ships back to a network that can be trained on: int8 weights times their scales.

What was lost in rounding is half a step of 127 of a column's largest weight, which training on from there makes good.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np
import torch

from chauffeur.concept import DataError

_LAYER: Final = (
    "self_attn.q_proj",
    "self_attn.k_proj",
    "self_attn.v_proj",
    "self_attn.o_proj",
    "mlp.gate_proj",
    "mlp.up_proj",
    "mlp.down_proj",
)
"""A layer's matrices in the order in which the exported graph uses them."""


def shipped_weights(folder: Path) -> dict[str, torch.Tensor]:
    """Weights of an exported model, named as `transformers` names those of a `LlamaForCausalLM`.

    Args:
        folder: Holds the `model.onnx` of `export`.

    Raises:
        DataError: There is no such graph, or it is not one of ours with int8 weights.
    """
    import onnx
    from onnx import numpy_helper

    try:
        graph: Any = onnx.load(str(folder / "model.onnx")).graph
    except Exception as error:  # the library raises whatever it met in a damaged file
        raise DataError(f"{folder / 'model.onnx'} cannot be read: {error}.") from error
    stored = {tensor.name: numpy_helper.to_array(tensor) for tensor in graph.initializer}
    plain = {
        name.replace("body.", "model.", 1): torch.from_numpy(np.array(value, np.float32))
        for name, value in stored.items()
        if name.startswith("body.")
    }
    products = [node.input[1] for node in graph.node if node.op_type == "MatMulInteger"]
    layers = sum(name.endswith("input_layernorm.weight") for name in plain)
    names = [f"model.layers.{layer}.{part}.weight" for layer in range(layers) for part in _LAYER]
    if not layers or len(products) != len(names) + 1:
        raise DataError(
            f"{folder / 'model.onnx'} is no int8 model of `chauffeur model train onboard`.",
            hint="--base takes the folder of a finished run, or that of the weights of a version of this package.",
        )
    embedded = plain["model.embed_tokens.weight"]
    matrices = {name: _matrix(stored, product) for name, product in zip(names, products[:-1], strict=True)}
    return {**plain, **matrices, "lm_head.weight": embedded}


def _matrix(stored: dict[str, Any], quantized: str) -> torch.Tensor:
    values = stored[quantized].astype(np.float32)
    scale = stored[quantized.removesuffix("_quantized") + "_scale"]
    zero = stored[quantized.removesuffix("_quantized") + "_zero_point"].astype(np.float32)
    return torch.from_numpy(np.ascontiguousarray(((values - zero) * scale).T))
