"""The lab (`chauffeur-lab`: benchmarks and training), which the driving part offers where it is installed."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Final

from chauffeur.concept.errors import MissingExtraError
from chauffeur.concept.extras import LAB, install_command

LAB_COMMANDS: Final = ("bench", "evaluate", "model", "report", "view")
"""Commands of `chauffeur` that the lab brings."""


def has_lab() -> bool:
    """True if the lab is installed beside this package; nothing of it is imported."""
    found = find_spec("chauffeur.bench")
    return found is not None and found.origin is not None  # an emptied folder is a package without an origin


def needs_lab(what: str) -> None:
    """Raise MissingExtraError, whose hint installs the lab, where it is not here.

    Args:
        what: Asks for it, as the subject of a sentence.
    """
    if not has_lab():
        raise MissingExtraError(f"{what} needs {LAB}, which is not installed.", hint=f"Run: {install_command()}")
