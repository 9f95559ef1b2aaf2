"""The dense way of a route: a point about every metre, what the rules measure by."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chauffeur.geometry import Pose, wrap_to_pi
from chauffeur.geometry.route import RoadOption

TURNS: Final[tuple[RoadOption, ...]] = ("left", "straight", "right")
"""Movements of a way inside a junction."""


@dataclass(frozen=True)
class RouteTrack:
    """Points of the way, in order.

    Attributes:
        poses: Where they are, heading along their lane, right-handed frame.
        options: What the way does at each.
    """

    poses: tuple[Pose, ...]
    options: tuple[RoadOption, ...]

    def __post_init__(self) -> None:
        """Raises ValueError for fewer than two points, or as many options as points."""
        if len(self.poses) < 2 or len(self.poses) != len(self.options):
            raise ValueError(f"A way of {len(self.poses)} points with {len(self.options)} options is none.")

    @cached_property
    def stations_m(self) -> tuple[float, ...]:
        """Distance along the points to each."""
        found = [0.0]
        for before, pose in pairwise(self.poses):
            found.append(found[-1] + math.dist((before.x_m, before.y_m), (pose.x_m, pose.y_m)))
        return tuple(found)

    @cached_property
    def _xy(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return np.array([one.x_m for one in self.poses]), np.array([one.y_m for one in self.poses])

    @property
    def length_m(self) -> float:
        """Distance along all points."""
        return self.stations_m[-1]

    @property
    def goal(self) -> Pose:
        """The last point."""
        return self.poses[-1]

    def next_turn(self, index: int) -> RoadOption | None:
        """Movement of the way at the next junction from a point on; None where no junction follows."""
        at = self.next_junction(index)
        return None if at is None else self.options[at]

    def next_junction(self, index: int) -> int | None:
        """Index of the first point inside a junction, from a point on; None where no junction follows."""
        return next((i for i in range(index, len(self.options)) if self.options[i] in TURNS), None)

    def at(self, station_m: float) -> Pose:
        """The pose at a distance along the way, between its points and a little beyond its end."""
        index = max(bisect_right(self.stations_m, station_m) - 1, 0)
        return self.poses[index].ahead(station_m - self.stations_m[index])

    def matches(self, pose: Pose, within_m: float, within_rad: float) -> int | None:
        """Index of the first point close to a pose in place and heading; None where there is none."""
        x, y = self._xy
        for index in np.flatnonzero(np.hypot(x - pose.x_m, y - pose.y_m) < within_m).tolist():
            if abs(wrap_to_pi(self.poses[index].heading_rad - pose.heading_rad)) < within_rad:
                return index
        return None

    @staticmethod
    def straight(points: Sequence[tuple[float, float]], options: Sequence[RoadOption] | None = None) -> RouteTrack:
        """A way through points, headings from each to the next."""
        headings = [math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in pairwise(points)]
        headings.append(headings[-1])
        poses = tuple(Pose(x, y, heading) for (x, y), heading in zip(points, headings, strict=True))
        return RouteTrack(poses, tuple(options or ("follow",) * len(poses)))
