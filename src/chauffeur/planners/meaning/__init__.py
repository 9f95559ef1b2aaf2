"""The planner that drives by the meaning of words: what is in sight, and the events that acts wait for."""

from chauffeur.planners.meaning.planner import MeaningPlanner

__all__ = ["MeaningPlanner"]
