"""On-board vision-language model that sets the controllers' gains (paper Sec. VI)."""

from chauffeur.planners.vlm.planner import VlmPlanner

__all__ = ["VlmPlanner"]
