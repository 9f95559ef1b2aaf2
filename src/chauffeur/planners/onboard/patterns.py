"""Regular expressions over what people say, from the vocabulary files."""

from __future__ import annotations

import re
from functools import cache

from chauffeur.concept import ConfigError
from chauffeur.planners.onboard.words.files import words_file


def any_of(*patterns: str) -> re.Pattern[str]:
    """One that finds any of some patterns as whole words, whatever their case."""
    return re.compile("|".join(rf"\b(?:{pattern})\b" for pattern in patterns), re.IGNORECASE)


@cache
def said(file: str, name: str) -> re.Pattern[str]:
    """The patterns of a group of a file, as one.

    Args:
        file: In the folder, e.g. `moods.txt`.
        name: What heads the group in brackets.

    Raises:
        ConfigError: There is no such group.
    """
    lines = [line for group in words_file(file) for line in group]
    head = f"[{name}]"
    if head not in lines:
        raise ConfigError(f"There is no group {head} in {file}.")
    found: list[str] = []
    for line in lines[lines.index(head) + 1 :]:
        if line.startswith("[") and line.endswith("]"):
            break
        found.append(line)
    return any_of(*found)
