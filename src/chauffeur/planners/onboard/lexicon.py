"""Words: how people shorten, decorate and idiomatically bend what they say to a car, and how to undo it.

`rewrite` gives a few things fixed names (`shoulder`, `junction`, `ahead`, `cruise`). Meaning is read by `cues`;
nothing here decides what is wanted.
"""

from __future__ import annotations

import re

from chauffeur.planners.onboard.words import words_file

_REWRITES = tuple(
    (re.compile("|".join(group[:-1])), group[-1].removeprefix("->").strip() or " ")
    for group in words_file("rewrites.txt")
)
"""Applied in order to the token string; later rules and the cues see the replacement."""


def rewrite(line: str) -> str:
    """Token string with idioms undone and things called by one name."""
    for pattern, by in _REWRITES:
        line = pattern.sub(by, line)
    return re.sub(r"\s+", " ", line).strip()


FILLERS = frozenset(word for group in words_file("fillers.txt") for line in group for word in line.split())
"""Words that carry no manoeuvre of their own; whatever is neither here nor in a cue counts as unknown."""
