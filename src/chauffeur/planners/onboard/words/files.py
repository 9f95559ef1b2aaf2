"""Reads the vocabulary files of this folder."""

from __future__ import annotations

from importlib import resources
from typing import Final

_PACKAGE: Final = "chauffeur.planners.onboard.words"


def words_file(name: str) -> list[list[str]]:
    """Groups of lines of a file; an empty line ends a group, a line with `;` is a remark."""
    text = resources.files(_PACKAGE).joinpath(name).read_text(encoding="utf-8")
    groups: list[list[str]] = [[]]
    for line in text.splitlines():
        if not line:
            groups.append([])
        elif not line.startswith(";"):
            groups[-1].append(line)
    return [group for group in groups if group]
