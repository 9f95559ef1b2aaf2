"""Reads vocabulary files: those of this folder, and of others like it."""

from __future__ import annotations

from importlib import resources
from typing import Final

ONBOARD: Final = "chauffeur.planners.onboard.words"


def words_file(name: str, package: str = ONBOARD) -> list[list[str]]:
    """Groups of lines of a file in a package; an empty line ends a group, a line with `;` is a remark."""
    text = resources.files(package).joinpath(name).read_text(encoding="utf-8")
    groups: list[list[str]] = [[]]
    for line in text.splitlines():
        if not line:
            groups.append([])
        elif not line.startswith(";"):
            groups[-1].append(line)
    return [group for group in groups if group]
