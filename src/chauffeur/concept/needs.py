"""Parts that an extra of this package brings: told before any work is done where they are missing."""

from __future__ import annotations

from importlib.util import find_spec

from chauffeur.concept.errors import MissingExtraError


def needs(extra: str, what: str, *modules: str) -> None:
    """Say before any work is done that an extra is missing. Nothing is imported.

    Args:
        extra: The extra of this package that brings the modules.
        what: Who needs it, as the subject of a sentence.
        modules: Top-level modules.

    Raises:
        MissingExtraError: One cannot be found; the hint installs the extra for this interpreter.
    """
    missing = [name for name in modules if not _importable(name)]
    if missing:
        raise MissingExtraError(f"{what} needs {', '.join(missing)}.", extra=extra)


def _importable(name: str) -> bool:
    try:
        return find_spec(name) is not None
    except ValueError:  # it is being kept from being imported
        return False
