"""CARLA as a world: the same contract as the town's, over a CARLA server."""

from chauffeur.worlds.carla.world import CarlaWorld

__all__ = ["CarlaWorld"]
