"""The expert's program texts; the crossing and the helpers are those of the on-board planner's exemplars."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from chauffeur.planners.onboard.exemplars import texts

PROGRAMS = ("distance", "speed", "lane", "overtake", "pull_over", "cross")
_SHARED = "chauffeur.planners.onboard.exemplars"


def filled(name: str, values: Mapping[str, str]) -> str:
    """A program's text. Raises KeyError for an unknown program or a value that is missing."""
    return texts.filled(_texts(), name, values)


def open_names(name: str) -> frozenset[str]:
    """Names of the values a program's text asks for."""
    return texts.open_names(_texts(), name)


@cache
def _texts() -> Mapping[str, str]:
    own = texts.read_texts("chauffeur.bench.lampilot.expert", PROGRAMS[:-1], _SHARED)
    return {**own, **texts.read_texts(_SHARED, ("crossing",), _SHARED)}
