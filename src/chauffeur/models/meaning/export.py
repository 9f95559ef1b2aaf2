# pyright: reportMissingImports=false, reportUntypedBaseClass=false, reportUnknownParameterType=false
"""The trained parser as it ships: an encoder and a decoder as ONNX graphs in 8 bits, and the pieces' vocabulary."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any, Final

import torch
from torch import Tensor, nn

from chauffeur.concept import DataError
from chauffeur.language.meaning.parser import DECODER, ENCODER, PIECES
from chauffeur.language.meaning.pieces import MOST_PIECES
from chauffeur.language.meaning.symbols import MOST_SYMBOLS
from chauffeur.models.export.onnx_graph import write_graph
from chauffeur.models.meaning.network import MeaningParser

_STEPS: Final = 127.0


class _Encoder(nn.Module):
    """Ids (1, T) to memory (1, T, width); word vectors in int8, a scale a column."""

    def __init__(self, network: MeaningParser) -> None:
        super().__init__()
        self.encoder = network.encoder
        table = network.encoder.embeddings.word_embeddings.weight.detach()
        steps = table.abs().amax(dim=0) / _STEPS
        self.table: Any = nn.Buffer((table / steps).round().to(torch.int8))
        self.steps: Any = nn.Buffer(steps)
        network.encoder.embeddings.word_embeddings = nn.Embedding(1, table.shape[1])  # the table above stands for it

    def forward(self, ids: Tensor) -> Tensor:
        hidden = self.encoder.embeddings(inputs_embeds=self.table[ids].float() * self.steps)
        for layer in self.encoder.encoder.layer:
            hidden = layer(hidden)
            hidden = hidden[0] if isinstance(hidden, tuple) else hidden
        return hidden


class _Decoder(nn.Module):
    """What is written (1, L), tokens pointed at (1, L) and memory (1, T, width) to scores (1, symbols + T)."""

    def __init__(self, network: MeaningParser) -> None:
        super().__init__()
        self.network = network

    def forward(self, written: Tensor, positions: Tensor, memory: Tensor) -> Tensor:
        mask = torch.ones(memory.shape[:2], dtype=torch.long)
        return self.network.decode(written, positions, memory, mask)[:, -1]


_LAYER: Final = (
    "attention.self.query", "attention.self.key", "attention.self.value", "attention.output.dense",
    "intermediate.dense", "output.dense",
)  # fmt: skip
_DECODER: Final = (
    "pointed",
    *(f"decoder.layers.{layer}.{name}" for layer in range(2) for name in (
        "self_attn.in_proj_", "self_attn.out_proj", "multihead_attn.out_proj", "linear1", "linear2")),
    "point_from", "point_to", "out",
)  # fmt: skip
"""Matrices in the order in which the graphs use them."""


def exported_weights(folder: Path) -> dict[str, Tensor]:
    """The parameters of a network from the files that it was exported to: its matrices as their 8 bits tell them."""
    import onnx
    from onnx import numpy_helper

    found: dict[str, Tensor] = {}
    encoder = tuple(f"encoder.encoder.layer.{layer}.{name}" for layer in range(6) for name in _LAYER)
    for file, matrices in ((ENCODER, encoder), (DECODER, _DECODER)):
        graph = onnx.load(str(folder / file)).graph
        held = {one.name: torch.from_numpy(numpy_helper.to_array(one).copy()) for one in graph.initializer}
        quantised = [name.removesuffix("_quantized") for name in held if name.endswith("_quantized")]
        if len(quantised) != len(matrices):
            raise DataError(f"{folder / file} has {len(quantised)} matrices in 8 bits; {len(matrices)} are wanted.")
        for name, matrix in zip(quantised, matrices, strict=True):
            steps = held[f"{name}_quantized"].float() - held[f"{name}_zero_point"].float()
            weight = "weight" if matrix.endswith("_") else ".weight"
            found[f"{matrix}{weight}"] = (steps * held[f"{name}_scale"]).T.contiguous()
        for name, value in held.items():
            own = name.removeprefix("network.")
            if (
                own.startswith(("encoder.", "decoder.", "symbols.", "places.", "out.", "point"))
                and value.is_floating_point()
            ):
                found.setdefault(own, value)
        if "steps" in held:
            table = next(value for value in held.values() if value.dtype == torch.int8 and value.shape[0] > 20_000)
            found["encoder.embeddings.word_embeddings.weight"] = table.float() * held["steps"]
    return {name: value for name, value in found.items() if not name.endswith(("_scale", "_zero_point"))}


def export_parser(network: MeaningParser, vocabulary: Path, folder: Path) -> None:
    """Write the files that `language.meaning.parser` loads.

    Args:
        network: Trained; its word vectors are moved out of it.
        vocabulary: The encoder's, one piece a line.
        folder: Where to.
    """
    folder.mkdir(parents=True, exist_ok=True)
    network = network.eval()
    tokens = torch.export.Dim("tokens", min=2, max=MOST_PIECES)
    length = torch.export.Dim("length", min=1, max=MOST_SYMBOLS)
    width = network.config.width
    decoder = _Decoder(network)
    example = (torch.ones((1, 7), dtype=torch.long), torch.zeros((1, 7), dtype=torch.long), torch.zeros((1, 9, width)))
    write_graph(
        decoder,
        example,
        ["written", "positions", "memory"],
        ["scores"],
        ({1: length}, {1: length}, {1: tokens}),
        folder / DECODER,
    )
    encoder = _Encoder(network)
    write_graph(
        encoder, (torch.zeros((1, 9), dtype=torch.long),), ["ids"], ["memory"], ({1: tokens},), folder / ENCODER
    )
    shutil.copyfile(vocabulary, folder / PIECES)
