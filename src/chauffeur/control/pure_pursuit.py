"""Pure pursuit: steer along the circle through the point of the path that is one look-ahead away.

Sources: R. C. Coulter, "Implementation of the Pure Pursuit Path Tracking Algorithm", CMU-RI-TR-92-01, 1992; the law of
the look-ahead distance is that of Autoware.AI's `pure_pursuit` (the follower Talk2Drive parametrises), in both modes.
The pose is that of the rear axle. No handedness is assumed: what turns headings up is a positive curvature and angle.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Self

LONGEST_LOOK_AHEAD_S: Final = 10.0
"""Autoware.AI looks no further ahead than the way of this time, unless the least distance is longer."""
_SAME_M: Final = 1e-6
"""Points of a path that are closer together than this are one."""
_STRAIGHT: Final = 1e-6
"""Curvature, 1/m, below which a circle is a line."""
_WORTH_LOOKING_M: Final = 0.25
"""A path is compared with a circle every so many metres, but at no more than `_CHECKS` places."""
_SHORTER: Final = 0.8
_CHECKS: Final = 12


def look_ahead_distance(speed_mps: float, ratio_s: float, least_m: float) -> float:
    """Look-ahead distance, m: speed times ratio, between the least one and the way of 10 s.

    As in Autoware.AI's waypoint mode, the least one wins where the two bounds cross (below `least_m / 10` m/s). With a
    ratio of 0 it is constant, which is Autoware.AI's dialog mode.

    Args:
        speed_mps: Own speed, 0 or more.
        ratio_s: Look-ahead per speed.
        least_m: Shortest look-ahead.
    """
    wanted = speed_mps * ratio_s
    return least_m if wanted < least_m else min(wanted, speed_mps * LONGEST_LOOK_AHEAD_S)


def chord_curvature(forward_m: float, sideways_m: float) -> float:
    """Curvature, 1/m, of the circle that leaves the origin forwards and meets a point: 2 y / (x^2 + y^2).

    The point is in the vehicle's frame. A point that is the origin itself asks for no turn.
    """
    square = forward_m * forward_m + sideways_m * sideways_m
    return 2.0 * sideways_m / square if square > _SAME_M * _SAME_M else 0.0


def steering_angle(curvature: float, wheelbase_m: float, most_rad: float) -> float:
    """Front-wheel angle, rad, of a kinematic bicycle whose rear axle drives a curvature, no larger than `most_rad`."""
    return max(-most_rad, min(most_rad, math.atan(wheelbase_m * curvature)))


@dataclass(frozen=True, slots=True)
class Pose:
    """A place and a heading in the plane."""

    x_m: float
    y_m: float
    heading_rad: float

    def sees(self, x_m: float, y_m: float) -> tuple[float, float]:
        """(forward, sideways) of a point in this frame; sideways grows to where headings grow."""
        dx, dy = x_m - self.x_m, y_m - self.y_m
        c, s = math.cos(self.heading_rad), math.sin(self.heading_rad)
        return c * dx + s * dy, c * dy - s * dx

    def ahead(self, way_m: float) -> Pose:
        """The pose after a straight way."""
        c, s = math.cos(self.heading_rad), math.sin(self.heading_rad)
        return Pose(self.x_m + c * way_m, self.y_m + s * way_m, self.heading_rad)


@dataclass(frozen=True, slots=True)
class Path:
    """A polyline to follow. Beyond its ends it goes on straight.

    Attributes:
        points_m: Its corners, no two neighbours the same.
        stations_m: Way along it to each corner.
    """

    points_m: tuple[tuple[float, float], ...]
    stations_m: tuple[float, ...]

    @classmethod
    def of(cls, points_m: Sequence[tuple[float, float]]) -> Self:
        """A path through points. Raises ValueError for fewer than two different ones, or one that is no number."""
        corners: list[tuple[float, float]] = []
        stations: list[float] = []
        for x, y in points_m:
            if not (math.isfinite(x) and math.isfinite(y)):
                raise ValueError(f"A path cannot pass through ({x}, {y}).")
            step = math.dist((x, y), corners[-1]) if corners else math.inf
            if step > _SAME_M:
                stations.append(stations[-1] + step if corners else 0.0)
                corners.append((x, y))
        if len(corners) < 2:
            raise ValueError("A path needs two different points.")
        return cls(tuple(corners), tuple(stations))

    @property
    def length_m(self) -> float:
        """Way from its first point to its last."""
        return self.stations_m[-1]

    def at(self, station_m: float) -> Pose:
        """The pose of somebody who drives it, after a way."""
        stations = self.stations_m
        low = self._leg(station_m)
        (ax, ay), (bx, by) = self.points_m[low], self.points_m[low + 1]
        share = (station_m - stations[low]) / (stations[low + 1] - stations[low])
        return Pose(ax + share * (bx - ax), ay + share * (by - ay), math.atan2(by - ay, bx - ax))

    def nearest(self, x_m: float, y_m: float, low_m: float = -math.inf, high_m: float = math.inf) -> float:
        """Way along the path to its point closest to a place, looked for between two ways; may lie beyond the ends."""
        best, found = math.inf, low_m
        last = len(self.points_m) - 2
        for i in range(self._leg(low_m), self._leg(high_m) + 1):
            (ax, ay), (bx, by) = self.points_m[i], self.points_m[i + 1]
            start, end = self.stations_m[i], self.stations_m[i + 1]
            least = max(low_m, start if i else -math.inf)
            most = min(high_m, end if i < last else math.inf)
            length = end - start
            ux, uy = (bx - ax) / length, (by - ay) / length
            along = max(least, min(most, start + (x_m - ax) * ux + (y_m - ay) * uy))
            px, py = ax + (along - start) * ux, ay + (along - start) * uy
            distance = (x_m - px) ** 2 + (y_m - py) ** 2
            if distance < best:
                best, found = distance, along
        return found

    def _leg(self, station_m: float) -> int:
        """Index of the straight piece that a way along the path ends in."""
        return max(0, min(bisect_right(self.stations_m, station_m), len(self.stations_m) - 1) - 1)

    def offset(self, x_m: float, y_m: float, station_m: float) -> float:
        """How far a place lies to the side of the path at a way along it; positive where headings grow."""
        return self.at(station_m).sees(x_m, y_m)[1]

    def look_ahead_point(self, x_m: float, y_m: float, distance_m: float, station_m: float) -> tuple[float, float]:
        """First point after a way along the path that is `distance_m` from a place.

        The point at that way itself where the place is farther from the path than that. It may lie beyond the end.
        """
        here = self.at(station_m)
        if math.dist((here.x_m, here.y_m), (x_m, y_m)) >= distance_m:
            return here.x_m, here.y_m
        ax, ay = here.x_m, here.y_m
        for bx, by in self.points_m[bisect_right(self.stations_m, station_m) :]:
            if math.dist((bx, by), (x_m, y_m)) >= distance_m:
                return _on_circle(ax, ay, bx, by, x_m, y_m, distance_m)
            ax, ay = bx, by
        beyond = Pose(ax, ay, self.at(self.length_m).heading_rad).ahead(2.0 * distance_m)
        bx, by = beyond.x_m, beyond.y_m
        return _on_circle(ax, ay, bx, by, x_m, y_m, distance_m)


def _on_circle(ax: float, ay: float, bx: float, by: float, x: float, y: float, radius: float) -> tuple[float, float]:
    """Where the way from `a`, inside a circle, to `b`, outside it, crosses it."""
    ux, uy = bx - ax, by - ay
    px, py = ax - x, ay - y
    a = ux * ux + uy * uy
    b = ux * px + uy * py
    c = px * px + py * py - radius * radius
    share = (-b + math.sqrt(max(b * b - a * c, 0.0))) / a
    return ax + share * ux, ay + share * uy


def pursuit_curvature(rear: Pose, path: Path, look_ahead_m: float, station_m: float) -> float:
    """Curvature, 1/m, that the rear axle should drive.

    Args:
        rear: Rear axle.
        path: To follow.
        look_ahead_m: Look-ahead distance, more than 0.
        station_m: Way along the path to its point beside the vehicle.
    """
    forward, sideways = rear.sees(*path.look_ahead_point(rear.x_m, rear.y_m, look_ahead_m, station_m))
    if forward < 0.0:  # the path lies behind: the circle to it would lead away first, so turn as hard as can be
        return math.copysign(math.inf, sideways)
    return chord_curvature(forward, sideways)


def pursuit_steering(
    rear: Pose, path: Path, look_ahead_m: float, station_m: float, wheelbase_m: float, most_rad: float
) -> float:
    """Steering angle, rad, of pure pursuit; arguments as of `pursuit_curvature` and `steering_angle`."""
    return steering_angle(pursuit_curvature(rear, path, look_ahead_m, station_m), wheelbase_m, most_rad)


def kept_within(rear: Pose, path: Path, look_ahead_m: float, station_m: float, room_m: float, least_m: float) -> float:
    """A look-ahead, no longer than asked, whose circle stays within a room beside the path.

    Pure pursuit cuts corners, the more the further it looks. Shorter look-aheads are tried until the circle to the
    look-ahead point leaves the path by no more than the room, or than the vehicle is off it already.

    Args:
        rear, path, look_ahead_m, station_m: As of `pursuit_curvature`.
        room_m: Room to either side of the path.
        least_m: Not shorter than this.
    """
    offset = abs(path.offset(rear.x_m, rear.y_m, station_m))
    room = max(room_m, offset + _SAME_M)
    distance = look_ahead_m
    while distance > least_m:
        if _widest(rear, path, distance, station_m) <= room:
            return distance
        distance *= _SHORTER
    return min(look_ahead_m, least_m)


def _widest(rear: Pose, path: Path, look_ahead_m: float, station_m: float) -> float:
    """Largest distance of the path, on the way of the look-ahead, from the circle that would be driven.

    Infinite where that circle turns by more than a right angle: it has little to do with the path on the way there.
    """
    ahead, aside = rear.sees(*path.look_ahead_point(rear.x_m, rear.y_m, look_ahead_m, station_m))
    if ahead < abs(aside):
        return math.inf
    curvature = chord_curvature(ahead, aside)
    checks = max(2, min(_CHECKS, round(look_ahead_m / _WORTH_LOOKING_M)))
    widest = 0.0
    for i in range(1, checks):
        point = path.at(station_m + look_ahead_m * i / checks)
        forward, sideways = rear.sees(point.x_m, point.y_m)
        if abs(curvature) < _STRAIGHT:
            away = abs(sideways)
        else:
            away = abs(math.hypot(forward, sideways - 1.0 / curvature) - 1.0 / abs(curvature))
        widest = max(widest, away)
    return widest
