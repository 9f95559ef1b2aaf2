"""The highway world on the highway-env package itself: slow, and the oracle of the compiled one."""

from chauffeur.worlds.highway.reference.perception import ReferencePerception
from chauffeur.worlds.highway.reference.world import ReferenceWorld

__all__ = ["ReferencePerception", "ReferenceWorld"]
