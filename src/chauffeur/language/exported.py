"""Opens our exported networks with ONNX Runtime: no training library on board."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any


def open_exported(folder: Path, threads: int) -> tuple[dict[str, Any], Any]:
    """Contents of `model.json` of a model folder, and a session over its `model.onnx`.

    Args:
        folder: Where they are.
        threads: Threads of a forward pass.

    Raises:
        Exception: A file is missing or damaged; the runtime raises types of its own. Callers say which model it is.
    """
    about: dict[str, Any] = json.loads((folder / "model.json").read_text(encoding="utf-8"))
    return about, open_graph(folder / "model.onnx", threads)


def open_graph(path: Path, threads: int) -> Any:
    """A session over a graph. Raises as `open_exported`."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.inter_op_num_threads = 1
    options.log_severity_level = 3
    return onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
