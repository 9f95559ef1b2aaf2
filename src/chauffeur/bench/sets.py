"""Generated data sets: what decides a set stands in its folder first, and is compared when the set is continued."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from chauffeur.concept import ConfigError
from chauffeur.drive.files import publish


def claim(folder: Path, wanted: Mapping[str, Any], name: str = "config.json", indent: int | None = None) -> None:
    """Begin a set in a folder, or continue it.

    Args:
        folder: Of the set.
        wanted: What decides it.
        name: File that holds that.
        indent: Of the JSON.

    Raises:
        ConfigError: The folder holds a set of another configuration.
        DataError: The disk refuses the file.
    """
    path = folder / name
    if not path.is_file():
        folder.mkdir(parents=True, exist_ok=True)
        publish(path, (json.dumps(wanted, indent=indent) + "\n").encode(), "configuration")
        return
    try:
        held = json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        held = None
    if held != json.loads(json.dumps(wanted)):
        raise ConfigError(
            f"{folder} holds a set of another configuration or version.",
            hint="Continue it with the options it was started with, or choose another --out folder.",
        )
