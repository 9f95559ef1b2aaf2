# pyright: reportMissingImports=false
"""A module of PyTorch as an ONNX graph, its matrices in 8 bits."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import torch
from torch import nn


def write_graph(
    module: nn.Module,
    example: tuple[torch.Tensor, ...],
    inputs: list[str],
    outputs: list[str],
    dynamic: tuple[Any, ...],
    target: Path,
    *,
    int8: bool = True,
) -> Path:
    """Write a module as an ONNX graph.

    Args:
        module: In evaluation mode, float32, on the CPU.
        example: Inputs to trace it with.
        inputs, outputs: Names.
        dynamic: For each input, which axes may have any length: {axis: `torch.export.Dim`}.
        target: File to write.
        int8: Whether matrices become int8, with a scale for each of their columns.
    """
    import onnx
    from onnxruntime.quantization import QuantType, quantize_dynamic

    with tempfile.TemporaryDirectory() as scratch:
        plain = Path(scratch) / "plain.onnx"
        torch.onnx.export(
            module,
            example,
            str(plain),
            input_names=inputs,
            output_names=outputs,
            dynamic_shapes=dynamic,
            dynamo=True,
            external_data=False,
            verbose=False,
        )
        graph = onnx.load(str(plain))
        del graph.graph.value_info[:]  # the exporter's shapes of inner values contradict those of transposed weights
        onnx.save(graph, str(plain))
        if int8:
            quantize_dynamic(
                str(plain), str(target), op_types_to_quantize=["MatMul"], weight_type=QuantType.QInt8, per_channel=True
            )
        else:
            target.write_bytes(plain.read_bytes())
    return target
