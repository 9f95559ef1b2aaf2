"""Helper functions of composed programs, in the driving language: driving on, waiting for an event, coming to a stand.

A control period of a town is 0.05 s. A wait ends after two minutes, and says so.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

from chauffeur.planners.onboard.exemplars.texts import programs

HELPERS: Final[Mapping[str, str]] = programs("chauffeur.planners.meaning", "helpers")
"""Source of each by its name; `helpers.lmp` holds them."""
_WORD: Final = re.compile(r"\w+")


def helpers_used(source: str) -> str:
    """The helper functions that a program calls, and those that they call, as one text."""
    used: list[str] = []
    rim = [name for name in HELPERS if name in set(_WORD.findall(source))]
    while rim:
        name = rim.pop(0)
        if name not in used:
            used.append(name)
            rim += [one for one in HELPERS if one != name and one in set(_WORD.findall(HELPERS[name]))]
    return "\n\n".join(HELPERS[name] for name in HELPERS if name in used)
