"""Chauffeur: a passenger says what they want; the car does it, safely, says why, and remembers."""

__version__ = "0.1.0"
