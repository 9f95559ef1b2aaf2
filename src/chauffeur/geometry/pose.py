"""A place and a heading in the plane: right-handed frame, x and y in m, headings counter-clockwise from +x in rad."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Pose:
    """A place and a heading."""

    x_m: float
    y_m: float
    heading_rad: float

    def sees(self, x_m: float, y_m: float) -> tuple[float, float]:
        """(forward, leftward), m, of a point in this frame."""
        dx, dy = x_m - self.x_m, y_m - self.y_m
        c, s = math.cos(self.heading_rad), math.sin(self.heading_rad)
        return c * dx + s * dy, c * dy - s * dx

    def place(self, forward_m: float, leftward_m: float) -> tuple[float, float]:
        """World (x, y), m, of a point of this frame: the inverse of `sees`."""
        c, s = math.cos(self.heading_rad), math.sin(self.heading_rad)
        return self.x_m + c * forward_m - s * leftward_m, self.y_m + s * forward_m + c * leftward_m

    def ahead(self, distance_m: float) -> Pose:
        """The pose after a straight distance."""
        return Pose(*self.place(distance_m, 0.0), self.heading_rad)
