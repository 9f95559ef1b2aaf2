"""Rectangles on the ground: whether they overlap, and whether one lies in another. Exact, by separating axes."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Box:
    """A rectangle: centre, heading of its length, size."""

    x_m: float
    y_m: float
    heading_rad: float
    length_m: float
    width_m: float

    def grown(self, margin_m: float) -> Box:
        """The box, larger by a margin on every side."""
        wider = 2.0 * margin_m
        return Box(self.x_m, self.y_m, self.heading_rad, self.length_m + wider, self.width_m + wider)

    def corners(self) -> tuple[tuple[float, float], ...]:
        """Its four corners, one after the other round it."""
        c, s = math.cos(self.heading_rad), math.sin(self.heading_rad)
        a, b = self.length_m / 2.0, self.width_m / 2.0
        return tuple(
            (self.x_m + c * u - s * v, self.y_m + s * u + c * v) for u, v in ((-a, -b), (a, -b), (a, b), (-a, b))
        )

    def place_of(self, x_m: float, y_m: float) -> tuple[float, float]:
        """(along, across) of a point from its centre."""
        dx, dy = x_m - self.x_m, y_m - self.y_m
        c, s = math.cos(self.heading_rad), math.sin(self.heading_rad)
        return c * dx + s * dy, c * dy - s * dx

    def holds(self, x_m: float, y_m: float) -> bool:
        """True if a point lies in it or on its edge."""
        along, across = self.place_of(x_m, y_m)
        return abs(along) <= self.length_m / 2.0 and abs(across) <= self.width_m / 2.0

    def contains(self, other: Box) -> bool:
        """True if all of another lies in it."""
        return all(self.holds(x, y) for x, y in other.corners())


def overlap(a: Box, b: Box) -> bool:
    """True if two boxes share ground; touching edges do not."""
    reach = (math.hypot(a.length_m, a.width_m) + math.hypot(b.length_m, b.width_m)) / 2.0
    if math.hypot(a.x_m - b.x_m, a.y_m - b.y_m) >= reach:
        return False
    return not (_separated(a, b) or _separated(b, a))


def _separated(a: Box, b: Box) -> bool:
    """True if an edge of `a` parts them."""
    places = [a.place_of(x, y) for x, y in b.corners()]
    for axis, half in ((0, a.length_m / 2.0), (1, a.width_m / 2.0)):
        values = [place[axis] for place in places]
        if min(values) >= half or max(values) <= -half:
            return True
    return False
