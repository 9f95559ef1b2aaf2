"""The run-time shield: after the controllers, before the world."""

from chauffeur.safety.shield.shield import Guarded, Shield
from chauffeur.safety.shield.table import LAMPILOT_SHIELD, SHIELD_VERSION, ShieldParameters

__all__ = ["LAMPILOT_SHIELD", "SHIELD_VERSION", "Guarded", "Shield", "ShieldParameters"]
