"""Chauffeur: a passenger says what they want; the car does it, safely, says why, and remembers.

What most programs need stands here: `drive`, `run_benchmark`, `evaluate`, and what a planner of one's own is made of.

>>> chauffeur.drive("Change to the left lane.", scenario="cruise").trip.plan.intent
'lane.left'
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

from chauffeur.telemetry import switch_off
from chauffeur.version import __version__

if TYPE_CHECKING:
    from chauffeur.api import drive, drive_async, evaluate, run_benchmark
    from chauffeur.concept import ChauffeurError, Parameters, Plan, PlanRequest, Program, Scenario, Thoughts
    from chauffeur.hmi.notebook import Drive
    from chauffeur.planners.base import Answerer, Planner
    from chauffeur.planners.registry import make_planner

__all__ = [
    "Answerer",
    "ChauffeurError",
    "Drive",
    "Parameters",
    "Plan",
    "PlanRequest",
    "Planner",
    "Program",
    "Scenario",
    "Thoughts",
    "__version__",
    "drive",
    "drive_async",
    "evaluate",
    "make_planner",
    "run_benchmark",
]

switch_off()

_HOMES: Final = {
    "chauffeur.api": ("drive", "drive_async", "evaluate", "run_benchmark"),
    "chauffeur.concept": ("ChauffeurError", "Parameters", "Plan", "PlanRequest", "Program", "Scenario", "Thoughts"),
    "chauffeur.hmi.notebook": ("Drive",),
    "chauffeur.planners.base": ("Answerer", "Planner"),
    "chauffeur.planners.registry": ("make_planner",),
}


def __getattr__(name: str) -> Any:
    """What stands in `__all__`, imported when it is first asked for: a help text must not wait for a simulator."""
    for home, names in _HOMES.items():
        if name in names:
            return getattr(import_module(home), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """What completion offers: `__all__`, imported or not yet."""
    return __all__
