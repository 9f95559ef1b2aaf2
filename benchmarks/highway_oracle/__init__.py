"""The highway world on the highway-env package itself: slow, and the oracle of the compiled one."""

from highway_oracle.perception import ReferencePerception
from highway_oracle.scenes import build_scene
from highway_oracle.world import ReferenceWorld

__all__ = ["ReferencePerception", "ReferenceWorld", "build_scene"]
