"""Which memory this installation uses: `CHAUFFEUR_MEMORY`, `vault` (encrypted, the default) or `chroma` by name."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from chauffeur.concept.registry import load_plugin
from chauffeur.memory.base import Memory

MEMORY_VARIABLE: Final = "CHAUFFEUR_MEMORY"
DEFAULT: Final = "vault"


def chosen_memory(environ: Mapping[str, str] = os.environ) -> str:
    """Name of the memory that is used."""
    return environ.get(MEMORY_VARIABLE, "").strip() or DEFAULT


def open_memory(name: str | None = None, home: Path | None = None) -> Memory:
    """A memory.

    Args:
        name: Which; the chosen one if left out.
        home: Data directory; the memory's own choice, which is this installation's, if left out.

    Raises:
        ConfigError: There is none of that name.
        MissingExtraError: It needs a library that is not installed.
    """
    kind = load_plugin("chauffeur.memories", chosen_memory() if name is None else name)
    memory: Memory = kind() if home is None else kind(home=home)
    return memory
