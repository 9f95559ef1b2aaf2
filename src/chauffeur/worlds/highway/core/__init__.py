"""The compiled stepping core: highway-env's traffic on arrays, equal to it to rounding."""

from chauffeur.worlds.highway.core.road import CoreRoad

__all__ = ["CoreRoad"]
