"""Make the words that ship from the open sentence encoder all-MiniLM-L6-v2: the table of word vectors, and the frozen
encoder with that table's vocabulary, in 8 bits.

    python benchmarks/shipped_words.py --checkpoint FOLDER --out FOLDER
"""

from __future__ import annotations

import argparse
import hashlib
import re
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from torch import nn

from chauffeur.concept import DataError
from chauffeur.models.export.onnx_graph import write_graph
from chauffeur.planners.vlm.sentences import LAYERS
from chauffeur.planners.word_table import MOST_PIECES, WIDTH, WordTable

SHA256: Final = "53aa51172d142c89d9012cce15ae4d6cc0ca6895895114379cacb4fab128d9db"
"""Of `model.safetensors` of sentence-transformers/all-MiniLM-L6-v2."""
_KEPT: Final = re.compile(r"(##)?[a-z]+|(##)?[0-9]|[.,!?;:'\"-]|\[UNK\]")


def checkpoint(folder: Path) -> tuple[list[str], Path]:
    """Vocabulary, and the file of the weights, of a checkpoint of all-MiniLM-L6-v2.

    Raises:
        DataError: A file is missing, or it is another model.
    """
    file = folder / "model.safetensors"
    try:
        digest = hashlib.sha256(file.read_bytes()).hexdigest()
        names = (folder / "vocab.txt").read_text(encoding="utf-8").splitlines()
    except OSError as error:
        raise DataError(f"{folder} holds no checkpoint: {error}.") from error
    if digest != SHA256:
        raise DataError(f"{file} is not all-MiniLM-L6-v2 (sha256 {digest[:12]}...).")
    return names, file


def kept_pieces(names: list[str]) -> list[int]:
    """Places of the pieces that the table keeps, in its order."""
    return [place for place, piece in enumerate(names) if _KEPT.fullmatch(piece)]


def word_table(folder: Path) -> WordTable:
    """The table of a checkpoint of all-MiniLM-L6-v2: `model.safetensors` and `vocab.txt`.

    Raises:
        DataError: A file is missing, or it is another model.
    """
    from safetensors.numpy import load_file

    names, file = checkpoint(folder)
    tensors: dict[str, Any] = load_file(str(file))
    name = next(name for name in tensors if name.endswith("word_embeddings.weight"))
    kept = kept_pieces(names)
    vectors = tensors[name][kept].astype(np.float64)
    centred = vectors - vectors.mean(axis=0)
    _, axes = np.linalg.eigh(centred.T @ centred)
    axes = axes[:, ::-1][:, :WIDTH]
    axes *= np.sign(axes[np.abs(axes).argmax(axis=0), np.arange(WIDTH)])  # an axis has no sign of its own
    reduced = centred @ axes
    reduced /= reduced.std()
    steps = np.abs(reduced).max(axis=0) / 127.0
    return WordTable(tuple(names[place] for place in kept), np.round(reduced / steps).astype(np.int8), steps)


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


def main() -> None:
    """Write `words.npz` and `encoder.onnx`."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--checkpoint", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    word_table(given.checkpoint).store(given.out / "words.npz")
    export_encoder(given.checkpoint, given.out / "encoder.onnx")


if __name__ == "__main__":
    main()
