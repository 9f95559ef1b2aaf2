"""LaMPilot's roads: ramp merge, multi-lane highway, intersection."""

from chauffeur.worlds.highway.baselines import MobilBaseline
from chauffeur.worlds.highway.instant import Instant, RoadPerception
from chauffeur.worlds.highway.world import HighwayWorld

__all__ = ["HighwayWorld", "Instant", "MobilBaseline", "RoadPerception"]
