"""Writing a file whole or not at all."""

from __future__ import annotations

import contextlib
import secrets
from pathlib import Path

from chauffeur.concept import DataError


def publish(path: Path, content: bytes, what: str) -> Path:
    """Put content at a path in one step; its folder is made if need be.

    Args:
        path: Where to.
        content: All of it.
        what: What it is, for the error, e.g. `page`.

    Raises:
        DataError: The file cannot be written; what stood there before is untouched.
    """
    partial = path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        partial.write_bytes(content)
        partial.replace(path)
    except OSError as error:
        with contextlib.suppress(OSError):
            partial.unlink(missing_ok=True)
        raise DataError(
            f"The {what} cannot be written to {path}: {error.strerror or error}.", hint="Choose another folder."
        ) from error
    return path
