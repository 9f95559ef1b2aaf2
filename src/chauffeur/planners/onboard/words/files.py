"""Reads the vocabulary files of this folder."""

from __future__ import annotations

from typing import Final

from chauffeur.language.word_files import word_groups

_PACKAGE: Final = "chauffeur.planners.onboard.words"


def words_file(name: str) -> list[list[str]]:
    """Groups of lines of a file, as `word_groups` has them."""
    return word_groups(_PACKAGE, name)
