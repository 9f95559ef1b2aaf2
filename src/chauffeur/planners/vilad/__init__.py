"""ViLaD planner: the runtime, without a training library (paper Sec. VII)."""

from chauffeur.planners.vilad.planner import ViladPlanner

__all__ = ["ViladPlanner"]
