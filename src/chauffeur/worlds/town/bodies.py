"""Headings of the traffic's bodies: a rear axle that follows the front bumper.

SUMO's own headings leap where a vehicle comes out of a bend, by up to 40 degrees, and a truck would sweep over the
lane beside it in an instant.
"""

from __future__ import annotations

import math
from typing import Final

AXLE: Final = 0.8
"""Of its length a vehicle's rear axle lies behind its front bumper."""
LEAPS_M: Final = 3.0
"""Farther than this nobody gets in a control period: who does was put in there."""


class Trails:
    """Rear axles of those that are seen, one control period after the other."""

    def __init__(self) -> None:
        self._axles: dict[str, tuple[float, float]] = {}
        self._now: dict[str, tuple[float, float]] = {}

    def heading_rad(self, name: str, x_m: float, y_m: float, length_m: float, told_rad: float) -> float:
        """Heading of a body by where its front bumper is; as told, of one that was not seen right before."""
        axle = self._axles.get(name)
        near = axle is not None and math.dist(axle, (x_m, y_m)) <= AXLE * length_m + LEAPS_M
        heading = math.atan2(y_m - axle[1], x_m - axle[0]) if axle is not None and near else told_rad
        self._now[name] = x_m - AXLE * length_m * math.cos(heading), y_m - AXLE * length_m * math.sin(heading)
        return heading

    def seen(self) -> None:
        """End the period: forget agents that were not seen in it."""
        self._axles, self._now = self._now, {}
