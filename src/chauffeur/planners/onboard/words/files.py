"""Reads the vocabulary files of this folder."""

from __future__ import annotations

from importlib import resources


def words_file(name: str) -> list[list[str]]:
    """Groups of lines of a file of this folder; an empty line ends a group, a line with `;` is a remark."""
    text = resources.files("chauffeur.planners.onboard.words").joinpath(name).read_text(encoding="utf-8")
    groups: list[list[str]] = [[]]
    for line in text.splitlines():
        if not line:
            groups.append([])
        elif not line.startswith(";"):
            groups[-1].append(line)
    return [group for group in groups if group]
