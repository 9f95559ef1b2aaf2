"""World state into context C: one situation descriptor per kind of world."""

from chauffeur.describe.dispatch import DESCRIPTORS, describe

__all__ = ["DESCRIPTORS", "describe"]
