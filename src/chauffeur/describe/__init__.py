"""World state into context C: one situation descriptor per kind of world."""

from chauffeur.describe.dispatch import describe
from chauffeur.describe.traffic import describe_with_traffic

__all__ = ["describe", "describe_with_traffic"]
