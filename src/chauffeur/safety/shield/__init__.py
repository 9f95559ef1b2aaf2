"""The run-time shield: after the controllers, before the world."""

from chauffeur.safety.shield.ground import GroundShield, shield_for
from chauffeur.safety.shield.shield import FilterResult, Shield
from chauffeur.safety.shield.street import StreetShield
from chauffeur.safety.shield.table import LAMPILOT_SHIELD, SHIELD_VERSION, ShieldParameters

__all__ = [
    "LAMPILOT_SHIELD",
    "SHIELD_VERSION",
    "FilterResult",
    "GroundShield",
    "Shield",
    "ShieldParameters",
    "StreetShield",
    "shield_for",
]
