"""Vocabulary files: groups of lines, as the packages that read words keep them beside their code."""

from __future__ import annotations

from importlib import resources


def word_groups(package: str, name: str) -> list[list[str]]:
    """Groups of lines of a file of a package; an empty line ends a group, a line with `;` is a remark."""
    groups: list[list[str]] = [[]]
    for line in resources.files(package).joinpath(name).read_text(encoding="utf-8").splitlines():
        if not line:
            groups.append([])
        elif not line.startswith(";"):
            groups[-1].append(line)
    return [group for group in groups if group]
