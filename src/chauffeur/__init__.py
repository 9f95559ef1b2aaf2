"""Chauffeur: a passenger says what they want; the car does it, safely, says why, and remembers."""

from chauffeur.telemetry import switch_off

__version__ = "0.1.0"

switch_off()
