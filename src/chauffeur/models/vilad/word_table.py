"""The word table of the ViLaD planner, from the input embeddings of an open sentence encoder."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path
from typing import Any, Final

import numpy as np

from chauffeur.concept import DataError
from chauffeur.planners.word_table import WIDTH, WordTable

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
