"""Judge of a short drive on a street: success is to stand where it was to end, after driving at the pace meant."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Final

from chauffeur.concept import Metric, Trajectory
from chauffeur.geometry import Pose
from chauffeur.worlds.base import World
from chauffeur.worlds.skeleton import PlaceJudge

ALONG_M: Final = 2.0
ACROSS_M: Final = 0.8
"""A drive that ends nearer than this to where it was to end is a success."""
PACE_MPS: Final = 0.9
_STANDS_MPS: Final = 0.1
_STANDS_S: Final = 1.0
_PATIENCE_S: Final = 8.0
_SAME_M: Final = 0.2


class StreetReferee(PlaceJudge):
    """Looks at a street after each control period."""

    def __init__(self, world: World, end: Pose, peak_mps: float | None = None, waits_s: float = 0.0) -> None:
        """Take a place.

        Args:
            world: Just reset.
            end: Where the middle of the car is to stand.
            peak_mps: The highest speed, if one is meant.
            waits_s: How long it may stand on the way, for lights and others.
        """
        self._world, self._end, self._peak, self._waits_s = world, end, peak_mps, waits_s
        self._stood_s, self._moved, self._most = 0.0, False, 0.0

    def observe(self) -> None:
        """Look at the instant after a control period."""
        ego = self._world.observe().ego
        stands = ego.speed_mps < _STANDS_MPS
        self._moved = self._moved or not stands
        self._stood_s = self._stood_s + self._world.dt_s if stands else 0.0
        self._most = max(self._most, ego.speed_mps)

    @property
    def over(self) -> bool:
        """True if the car stands for good, or never began to move."""
        needed = _STANDS_S if self._moved else _PATIENCE_S
        if not self._near:
            needed = max(needed, self._waits_s)
        return self._stood_s >= needed - 1e-9

    @property
    def _near(self) -> bool:
        along, across = self._missed_m()
        return abs(along) <= ALONG_M and abs(across) <= ACROSS_M

    @property
    def success(self) -> bool:
        """True if it stands where it was to stand."""
        paced = self._peak is None or abs(self._most - self._peak) <= PACE_MPS
        return self.over and self._near and paced

    def metrics(self) -> tuple[Metric, ...]:
        """Offsets of the car beyond and to the left of the goal, and time."""
        along, across = self._missed_m()
        return (
            Metric("street-success-v1", float(self.success), "points"),
            Metric("street-along-v1", along, "m", applies=self.over),
            Metric("street-across-v1", across, "m", applies=self.over),
            Metric("street-time-v1", self._world.observe().time_s, "s", applies=self.success),
        )

    def _missed_m(self) -> tuple[float, float]:
        ego = self._world.observe().ego
        return self._end.sees(ego.x_m, ego.y_m)


def end_of(trajectory: Trajectory, start: Pose) -> Pose:
    """Pose at the end of a trajectory.

    Args:
        trajectory: Waypoints in the ego frame.
        start: Of the ego when it was planned, in a right-handed world.
    """
    heading, before = start.heading_rad, (0.0, 0.0)
    for one, two in pairwise(((0.0, 0.0), *trajectory.waypoints_m)):
        if math.dist(before, two) > _SAME_M:
            heading = start.heading_rad + math.atan2(two[1] - one[1], two[0] - one[0]) if one != two else heading
            before = two
    return Pose(*start.place(*trajectory.waypoints_m[-1]), heading)


def peak_of(trajectory: Trajectory) -> float:
    """Highest speed between two waypoints, m/s."""
    points = ((0.0, 0.0), *trajectory.waypoints_m)
    return max(math.dist(one, two) for one, two in pairwise(points)) / trajectory.period_s
