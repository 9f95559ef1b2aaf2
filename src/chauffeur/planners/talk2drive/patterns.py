"""Regular expressions over what people say."""

from __future__ import annotations

import re


def any_of(*patterns: str) -> re.Pattern[str]:
    """One that finds any of some patterns as whole words, whatever their case."""
    return re.compile("|".join(rf"\b(?:{pattern})\b" for pattern in patterns), re.IGNORECASE)
