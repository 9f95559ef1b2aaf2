"""Pure pursuit: steer along the circle through the point of the path that is one look-ahead away.

Sources: R. C. Coulter, "Implementation of the Pure Pursuit Path Tracking Algorithm", CMU-RI-TR-92-01, 1992; the law of
the look-ahead distance is that of Autoware.AI's `pure_pursuit` (the follower Talk2Drive parametrises), in both modes.
The pose is that of the rear axle. No handedness is assumed: what turns headings up is a positive curvature and angle.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from typing import Final

from chauffeur.geometry import Polyline, Pose
from chauffeur.geometry.polyline import SAME_M

LONGEST_LOOK_AHEAD_S: Final = 10.0
"""Autoware.AI looks no further ahead than the way of this time, unless the least distance is longer."""
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
    return 2.0 * sideways_m / square if square > SAME_M * SAME_M else 0.0


def steering_angle(curvature: float, wheelbase_m: float, most_rad: float) -> float:
    """Front-wheel angle, rad, of a kinematic bicycle whose rear axle drives a curvature, no larger than `most_rad`."""
    return max(-most_rad, min(most_rad, math.atan(wheelbase_m * curvature)))


def look_ahead_point(
    path: Polyline, x_m: float, y_m: float, distance_m: float, station_m: float
) -> tuple[float, float]:
    """First point of a path after a station that is `distance_m` from a place.

    The point at the station itself where the place is farther from the path than that. It may lie beyond the end.
    """
    here = path.at(station_m)
    if math.dist((here.x_m, here.y_m), (x_m, y_m)) >= distance_m:
        return here.x_m, here.y_m
    ax, ay = here.x_m, here.y_m
    for bx, by in path.points_m[bisect_right(path.stations_m, station_m) :]:
        if math.dist((bx, by), (x_m, y_m)) >= distance_m:
            return _on_circle(ax, ay, bx, by, x_m, y_m, distance_m)
        ax, ay = bx, by
    beyond = Pose(ax, ay, path.at(path.length_m).heading_rad).ahead(2.0 * distance_m)
    return _on_circle(ax, ay, beyond.x_m, beyond.y_m, x_m, y_m, distance_m)


def _on_circle(ax: float, ay: float, bx: float, by: float, x: float, y: float, radius: float) -> tuple[float, float]:
    """Point where the segment from `a`, inside a circle, to `b`, outside it, crosses it."""
    ux, uy = bx - ax, by - ay
    px, py = ax - x, ay - y
    a = ux * ux + uy * uy
    b = ux * px + uy * py
    c = px * px + py * py - radius * radius
    share = (-b + math.sqrt(max(b * b - a * c, 0.0))) / a
    return ax + share * ux, ay + share * uy


def pursuit_curvature(rear: Pose, path: Polyline, look_ahead_m: float, station_m: float) -> float:
    """Curvature, 1/m, that the rear axle should drive.

    Args:
        rear: Rear axle.
        path: To follow.
        look_ahead_m: Look-ahead distance, more than 0.
        station_m: Way along the path to its point beside the vehicle.
    """
    forward, sideways = rear.sees(*look_ahead_point(path, rear.x_m, rear.y_m, look_ahead_m, station_m))
    if forward < 0.0:  # the path lies behind: the circle to it would lead away first, so turn as hard as can be
        return math.copysign(math.inf, sideways)
    return chord_curvature(forward, sideways)


def pursuit_steering(
    rear: Pose, path: Polyline, look_ahead_m: float, station_m: float, wheelbase_m: float, most_rad: float
) -> float:
    """Steering angle, rad, of pure pursuit; arguments as of `pursuit_curvature` and `steering_angle`."""
    return steering_angle(pursuit_curvature(rear, path, look_ahead_m, station_m), wheelbase_m, most_rad)


def kept_within(
    rear: Pose, path: Polyline, look_ahead_m: float, station_m: float, room_m: float, least_m: float
) -> float:
    """A look-ahead, no longer than asked, whose circle stays within a room beside the path.

    Pure pursuit cuts corners, the more the further it looks. Shorter look-aheads are tried until the circle to the
    look-ahead point leaves the path by no more than the room, or than the vehicle is off it already.

    Args:
        rear, path, look_ahead_m, station_m: As of `pursuit_curvature`.
        room_m: Room to either side of the path.
        least_m: Not shorter than this.
    """
    offset = abs(path.offset(rear.x_m, rear.y_m, station_m))
    room = max(room_m, offset + SAME_M)
    distance = look_ahead_m
    while distance > least_m:
        if _widest(rear, path, distance, station_m) <= room:
            return distance
        distance *= _SHORTER
    return min(look_ahead_m, least_m)


def _widest(rear: Pose, path: Polyline, look_ahead_m: float, station_m: float) -> float:
    """Largest distance of the path, on the way of the look-ahead, from the circle that would be driven.

    Infinite where that circle turns by more than a right angle: it has little to do with the path on the way there.
    """
    ahead, aside = rear.sees(*look_ahead_point(path, rear.x_m, rear.y_m, look_ahead_m, station_m))
    if ahead < abs(aside):
        return math.inf
    curvature = chord_curvature(ahead, aside)
    checks = max(2, round(min(_CHECKS, look_ahead_m / _WORTH_LOOKING_M)))
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
