"""Optional parts of the package, and the lab: the command that installs one."""

from __future__ import annotations

import json
import sys
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any, Final
from urllib.parse import urlsplit
from urllib.request import url2pathname

LAB: Final = "chauffeur-lab"
"""The package of benchmarks and training, built from the same repository."""
LAB_EXTRAS: Final = frozenset({"cluster", "inspect", "models"})
"""Extras that are the lab's; all others are those of `chauffeur`."""


def install_command(*extras: str) -> str:
    """The exact command that adds extras, or without any the lab, to this Python, from where Chauffeur itself came.

    A source checkout installs the versions that it was tested with: without them an extra may bring other, far larger
    builds of the same libraries.
    """
    editable, source = _origin()
    pins = Path(source) / "constraints.txt"
    if LAB_EXTRAS.issuperset(extras):
        source = str(Path(source) / "lab") if (Path(source) / "lab" / "pyproject.toml").is_file() else LAB
    wanted = f"{source}[{','.join(extras)}]" if extras else source
    options = (f'-c "{pins}" ' if pins.is_file() else "") + ("-e " if editable else "")
    return f'{sys.executable} -m pip install {options}"{wanted}"'


def _origin() -> tuple[bool, str]:
    """(editable install or not, the folder it came from or the package's name)."""
    try:
        text = distribution("chauffeur").read_text("direct_url.json")
    except PackageNotFoundError:  # run from its source, never installed
        text = None
    found: dict[str, Any] = json.loads(text) if text else {}
    url = str(found.get("url", ""))
    path = url2pathname(urlsplit(url).path) if url.startswith("file://") else ""
    if not path or not Path(path).exists():  # sources that an image was built from are not in it
        return False, "chauffeur"
    return bool(found.get("dir_info", {}).get("editable")), path
