"""Chauffeur: a passenger says what they want; the car does it, safely, says why, and remembers.

What most programs need stands here: `drive_wish`, `run_benchmark`, and what a planner of one's own is made of.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

from chauffeur.telemetry import switch_off
from chauffeur.version import __version__

if TYPE_CHECKING:
    from chauffeur.api import drive_wish, run_benchmark
    from chauffeur.concept import Parameters, Plan, PlanRequest, Program, Thoughts
    from chauffeur.planners.base import Answerer, Planner

__all__ = [
    "Answerer",
    "Parameters",
    "Plan",
    "PlanRequest",
    "Planner",
    "Program",
    "Thoughts",
    "__version__",
    "drive_wish",
    "run_benchmark",
]

switch_off()

_HOMES: Final = {
    "chauffeur.api": ("drive_wish", "run_benchmark"),
    "chauffeur.concept": ("Parameters", "Plan", "PlanRequest", "Program", "Thoughts"),
    "chauffeur.planners.base": ("Answerer", "Planner"),
}


def __getattr__(name: str) -> Any:
    """What stands in `__all__`, imported when it is first asked for: a help text must not wait for a simulator."""
    for home, names in _HOMES.items():
        if name in names:
            return getattr(import_module(home), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
