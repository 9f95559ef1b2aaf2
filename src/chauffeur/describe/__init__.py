"""World state into context C: one situation descriptor per kind of world."""

from chauffeur.describe.dispatch import DESCRIPTORS, describe
from chauffeur.describe.traffic import describe_with_traffic

__all__ = ["DESCRIPTORS", "describe", "describe_with_traffic"]
