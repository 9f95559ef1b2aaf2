"""The embedded planner: the on-board language model beside the acts of the one reader, and the dialect of both."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from chauffeur.planners.onboard.language_model import LanguageModelPlanner

__all__ = ["LanguageModelPlanner"]


def __getattr__(name: str) -> object:
    """The planner, when it is asked for: the dialect is used by `planners.meaning`, which it stands on."""
    if name == "LanguageModelPlanner":
        from chauffeur.planners.onboard.language_model import LanguageModelPlanner

        return LanguageModelPlanner
    raise AttributeError(name)
