"""Planners: from a wish to a plan. By name through `make_planner`; nothing heavy is imported before it is asked for."""

from chauffeur.planners.base import Planner
from chauffeur.planners.registry import make_planner, planner_names

__all__ = ["Planner", "make_planner", "planner_names"]
