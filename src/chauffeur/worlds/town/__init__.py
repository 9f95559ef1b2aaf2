"""The town: map packs, and a world on SUMO to drive them in."""

from chauffeur.worlds.town.mirror import TownMirror
from chauffeur.worlds.town.referee import TownReferee
from chauffeur.worlds.town.world import TownWorld

__all__ = ["TownMirror", "TownReferee", "TownWorld"]
