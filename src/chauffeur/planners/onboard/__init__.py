"""The embedded default planner: reads a wish by meaning and instantiates one of its own exemplar programs."""

from chauffeur.planners.onboard.planner import OnboardPlanner
from chauffeur.planners.onboard.understand import understand

__all__ = ["OnboardPlanner", "understand"]
