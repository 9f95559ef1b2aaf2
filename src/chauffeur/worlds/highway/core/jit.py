"""Compiles the kernels of this package and keeps the machine code.

Numba compiles on the first call, about half a minute for all kernels, and stores the result. It checks only the file a
function stands in, not the files of the functions it calls, so the store is named after the text of the whole package:
an edit anywhere in it starts a new one, and an old one is never used by mistake.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core import config

_F = TypeVar("_F", bound=Callable[..., Any])
_config: Any = config
_njit: Any = numba.njit


def _store() -> str:
    """Folder of the machine code: the user's cache, or a temporary folder where that cannot be written."""
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    for root in (base, tempfile.gettempdir()):
        folder = Path(root) / "chauffeur" / f"kernels-{digest.hexdigest()[:16]}"
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            return str(folder)
    return ""


_STORE = _store()


def compiled(function: _F) -> _F:
    """The function as machine code. IEEE arithmetic, no fast-math: results must not depend on the compiler's taste."""
    before = _config.CACHE_DIR
    _config.CACHE_DIR = _STORE or before
    try:
        return _njit(cache=True, error_model="numpy", fastmath=False)(function)
    finally:
        _config.CACHE_DIR = before
