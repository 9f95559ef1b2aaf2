"""Plane geometry of the road: angles, distances, conflicts. Pure functions of numbers."""

from chauffeur.geometry.angles import wrap_to_pi

__all__ = ["wrap_to_pi"]
