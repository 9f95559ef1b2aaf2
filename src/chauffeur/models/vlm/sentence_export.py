# pyright: reportMissingImports=false, reportUntypedBaseClass=false, reportUnknownParameterType=false
"""The frozen sentence encoder as it ships: all-MiniLM-L6-v2 with the word table's vocabulary, in 8 bits."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import torch
from torch import nn

from chauffeur.models.export.onnx_graph import write_graph
from chauffeur.models.vilad.word_table import checkpoint, kept_pieces
from chauffeur.planners.vlm.sentences import LAYERS
from chauffeur.planners.word_table import MOST_PIECES

_STEPS: Final = 127.0


class _MeanStates(nn.Module):
    """Numbers of pieces (1, T) to the mean hidden states of `LAYERS`, (1, FEATURES)."""

    def __init__(self, encoder: Any, rows: list[int]) -> None:
        super().__init__()
        self.encoder = encoder
        table = encoder.embeddings.word_embeddings.weight.detach()[rows]
        steps = table.abs().amax(dim=0) / _STEPS
        self.table: Any = nn.Buffer((table / steps).round().to(torch.int8))
        self.steps: Any = nn.Buffer(steps)
        encoder.embeddings.word_embeddings = nn.Embedding(1, table.shape[1])  # the table above stands for it

    def forward(self, ids: torch.Tensor) -> torch.Tensor:
        hidden = self.encoder.embeddings(inputs_embeds=self.table[ids].float() * self.steps)
        found: list[torch.Tensor] = []
        for number, layer in enumerate(self.encoder.encoder.layer, start=1):
            hidden = layer(hidden)
            hidden = hidden[0] if isinstance(hidden, tuple) else hidden
            if number in LAYERS:
                found.append(hidden.mean(dim=1))
        return torch.cat(found, dim=1)


def export_encoder(folder: Path, target: Path) -> Path:
    """Write the encoder's graph from a checkpoint of all-MiniLM-L6-v2.

    Args:
        folder: Holds `model.safetensors`, `config.json` and `vocab.txt`.
        target: File to write; 20 MB.

    Raises:
        DataError: A file is missing, or it is another model.
    """
    from transformers import AutoModel

    names, _ = checkpoint(folder)
    rows = [*kept_pieces(names), names.index("[CLS]"), names.index("[SEP]")]
    encoder = AutoModel.from_pretrained(folder, attn_implementation="eager").float().eval()
    longest = torch.export.Dim("pieces", min=3, max=MOST_PIECES + 2)
    example = (torch.zeros((1, 9), dtype=torch.int64),)
    return write_graph(_MeanStates(encoder, rows).eval(), example, ["ids"], ["features"], ({1: longest},), target)
