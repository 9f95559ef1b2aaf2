"""Unit conversions. Inside Chauffeur everything is SI; these stand at the borders.

Sources: exact definitions of the international mile (1609.344 m), foot (0.3048 m) and yard (0.9144 m).
"""

from __future__ import annotations

import math
from typing import Final, Literal

MPS_PER_KMH = 1.0 / 3.6
MPS_PER_MPH = 1609.344 / 3600.0
MPS_PER_KNOT = 1852.0 / 3600.0
M_PER_FOOT = 0.3048
M_PER_YARD = 0.9144
M_PER_MILE = 1609.344
M_PER_KM = 1000.0
M_PER_CAR_LENGTH = 5.0
"""A car of the highway worlds is 5 m long; people count gaps in such lengths."""


def kmh(speed_mps: float) -> float:
    """Speed in km/h for a speed in m/s."""
    return speed_mps / MPS_PER_KMH


def mph(speed_mps: float) -> float:
    """Speed in mph for a speed in m/s."""
    return speed_mps / MPS_PER_MPH


SpeedUnit = Literal["km/h", "mph"]
"""Units of speed that people drive by."""
_SLACK: Final = 0.05
"""Of a unit: what is lost when a whole speed is stored in hundredths of m/s, and is no reason to round it down."""


def people_speed(speed_mps: float, unit: SpeedUnit = "km/h", *, at_most: bool = False) -> str:
    """A speed as people say it, whole and in one unit: `85 km/h`.

    Args:
        speed_mps: The speed, m/s.
        unit: The person's.
        at_most: Whether it is one that must not be exceeded (a limit, a set-point): such a number is rounded down.
    """
    value = (mph if unit == "mph" else kmh)(speed_mps)
    if math.isfinite(value):
        value = math.floor(value + _SLACK) if at_most else round(value)
    return f"{value:.0f} {unit}"
