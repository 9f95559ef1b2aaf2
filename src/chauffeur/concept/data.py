"""Where data lie: the user's own, and the data sets of a source checkout, which are no part of the wheel."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from chauffeur.concept.errors import DataError

DATA_VARIABLE: Final = "CHAUFFEUR_DATA"
"""Environment variable that names a folder of data sets, in place of the checkout's own."""

_CHECKOUT: Final = Path(__file__).resolve().parents[3]


def data_home() -> Path:
    """Chauffeur's data directory: CHAUFFEUR_HOME, or the user's own data directory."""
    if home := os.environ.get("CHAUFFEUR_HOME"):
        return Path(home).expanduser()
    if shared := os.environ.get("XDG_DATA_HOME"):
        return Path(shared) / "chauffeur"
    return Path.home() / ".local" / "share" / "chauffeur"


def data_folder(name: str, environ: Mapping[str, str] = os.environ, checkout: Path = _CHECKOUT) -> Path:
    """Folder of a data set.

    Args:
        name: Its name, e.g. `onboard`; `data/README.md` lists them.
        environ: Environment.
        checkout: Where the sources would lie; an installed package has none there.

    Raises:
        DataError: It is not here; says where it was looked for and where to get it.
    """
    given = environ.get(DATA_VARIABLE, "")
    root = Path(given) if given else checkout / "data"
    if (folder := root / name).is_dir():
        return folder
    if given:
        raise DataError(
            f"The data set {name!r} is not in {root}.",
            hint=f"Set {DATA_VARIABLE} to the folder `data` of a source checkout of Chauffeur.",
        )
    if (checkout / "pyproject.toml").is_file():
        raise DataError(f"The data set {name!r} is not in {root}.", hint="Restore it: git checkout -- data")
    raise DataError(
        f"The data set {name!r} is no part of the installed package.",
        hint=f"Get Chauffeur's sources and set {DATA_VARIABLE} to their folder `data`.",
    )


def read_data(name: str, file: str) -> bytes:
    """Content of a file of a data set.

    Raises:
        DataError: The set is not here (`data_folder`), or the file cannot be read.
    """
    path = data_folder(name) / file
    try:
        return path.read_bytes()
    except OSError as error:
        raise DataError(f"Cannot read {path}: {error.strerror}.", hint="Restore it: git checkout -- data") from error


def parse_json(content: str | bytes) -> Any:
    """A JSON value of a file that may come from anywhere. Raises ValueError, also where it is nested too deeply."""
    try:
        return json.loads(content)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
