"""Where data lie: the user's own, and the data sets of the lab, in its wheel or in a source checkout."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from chauffeur.concept.errors import DataError
from chauffeur.concept.extras import LAB

DATA_VARIABLE: Final = "CHAUFFEUR_DATA"
"""Environment variable that names a folder of data sets, in place of those that came with the lab."""

_PACKAGE: Final = Path(__file__).resolve().parents[1]


def data_home() -> Path:
    """Chauffeur's data directory: CHAUFFEUR_HOME, or the user's own data directory."""
    if home := os.environ.get("CHAUFFEUR_HOME"):
        return Path(home).expanduser()
    if shared := os.environ.get("XDG_DATA_HOME"):
        return Path(shared) / "chauffeur"
    return Path.home() / ".local" / "share" / "chauffeur"


def data_folder(name: str, environ: Mapping[str, str] = os.environ, package: Path = _PACKAGE) -> Path:
    """Folder of a data set.

    Args:
        name: Its name, e.g. `onboard`; `data/README.md` lists them.
        environ: Environment.
        package: Folder of `chauffeur`: the lab's wheel brings the sets in its `data`, a checkout has them at its root.

    Raises:
        DataError: It is not here; says where it was looked for and where to get it.
    """
    given = environ.get(DATA_VARIABLE, "")
    checked_out = (package.parents[1] / "pyproject.toml").is_file()
    root = Path(given) if given else (package.parents[1] if checked_out else package) / "data"
    if (folder := root / name).is_dir():
        return folder
    if given:
        raise DataError(
            f"The data set {name!r} is not in {root}.",
            hint=f"Set {DATA_VARIABLE} to the folder `data` of a source checkout of Chauffeur.",
        )
    if checked_out:
        raise DataError(f"The data set {name!r} is not in {root}.", hint="Restore it: git checkout -- data")
    raise DataError(
        f"The data set {name!r} is no part of the installed package.",
        hint=f"Install {LAB} again, or set {DATA_VARIABLE} to the folder `data` of its sources.",
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
