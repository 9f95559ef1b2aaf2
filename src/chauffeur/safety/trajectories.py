"""What can be known of a trajectory before it is driven: whether a car could, on this road, among who is there."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Final, NamedTuple

from chauffeur.concept import Observation, Trajectory, VehicleState
from chauffeur.geometry import Box, Pose, overlap, wrap_to_pi

BRAKING_MPS2: Final = 8.0
ACCELERATION_MPS2: Final = 4.0
SIDEWAYS_MPS2: Final = 6.0
"""What tyres hold on a dry road, with a reserve."""
TIGHTEST_M: Final = 4.5
"""Radius of the tightest turn of a passenger car's middle."""
_ROAD_M: Final = 0.6
"""How far a waypoint may be beyond the edge of a lane: junctions and lots have ground beside their lanes."""
_SAME_M: Final = 0.2
_STILL_MPS: Final = 0.5


class TrajectoryFault(NamedTuple):
    """What is wrong, and what would help."""

    reason: str
    remedy: str


def trajectory_faults(trajectory: Trajectory, observation: Observation) -> Iterator[TrajectoryFault]:
    """Faults of a well-formed trajectory in a situation, one of each kind at most.

    Args:
        trajectory: Waypoints in the ego frame; the first is reached a period from now.
        observation: Now.
    """
    period, ego = trajectory.period_s, observation.ego
    points = [(0.0, 0.0), *trajectory.waypoints_m]
    legs = [math.dist(a, b) / period for a, b in pairwise(points)]
    yield from _along([max(ego.speed_mps, 0.0), *legs], period)
    yield from _across(points, legs)
    start = Pose(ego.x_m, ego.y_m, ego.heading_rad)
    poses = list(_poses(start, points))
    yield from _off_road(poses, observation)
    yield from _touching(poses, period, observation)


def _along(speeds: list[float], period_s: float) -> Iterator[TrajectoryFault]:
    # The speed of a leg is that at its middle; the first is half a period from now.
    changes = [
        (after - before) / (period_s * (0.5 if i == 0 else 1.0)) for i, (before, after) in enumerate(pairwise(speeds))
    ]
    hardest, gentlest = max(changes), min(changes)
    if hardest > ACCELERATION_MPS2:
        yield TrajectoryFault(
            f"The trajectory asks for an acceleration of {hardest:.1f} m/s2.",
            f"Speed up by {ACCELERATION_MPS2:g} m/s2 at most: waypoints closer together.",
        )
    if gentlest < -BRAKING_MPS2:
        yield TrajectoryFault(
            f"The trajectory asks for braking with {-gentlest:.1f} m/s2.",
            f"Brake with {BRAKING_MPS2:g} m/s2 at most: the first waypoints farther away.",
        )


def _across(points: list[tuple[float, float]], legs: list[float]) -> Iterator[TrajectoryFault]:
    if any(b[0] < a[0] - _SAME_M and math.dist(a, b) > _SAME_M for a, b in pairwise(points[:3])):
        yield TrajectoryFault("The trajectory begins backwards.", "Give waypoints ahead of the car.")
        return
    tightest, sideways = math.inf, 0.0
    headings = [
        (math.atan2(b[1] - a[1], b[0] - a[0]) if math.dist(a, b) > _SAME_M else None, math.dist(a, b))
        for a, b in pairwise(points)
    ]
    last = (0.0, 0.0)
    for (heading, way), speed in zip(headings, legs, strict=True):
        if heading is None:
            continue
        turned, between = wrap_to_pi(heading - last[0]), (way + last[1]) / 2.0
        if abs(turned) > 1e-6:
            radius = between / abs(turned)
            tightest = min(tightest, radius)
            sideways = max(sideways, speed**2 / radius)
        last = heading, way
    if tightest < TIGHTEST_M:
        yield TrajectoryFault(
            f"The trajectory bends with a radius of {tightest:.1f} m, tighter than a car can turn.",
            f"Bend with a radius of {TIGHTEST_M:g} m or more.",
        )
    elif sideways > SIDEWAYS_MPS2:
        yield TrajectoryFault(
            f"The trajectory asks for {sideways:.1f} m/s2 sideways, more than tyres hold.",
            "Drive the bend slower, or wider.",
        )


def _poses(start: Pose, points: list[tuple[float, float]]) -> Iterator[Pose]:
    """Where the car is at each waypoint, headed as it comes."""
    heading = start.heading_rad
    for before, point in pairwise(points):
        if math.dist(before, point) > _SAME_M:
            heading = start.heading_rad + math.atan2(point[1] - before[1], point[0] - before[0])
        x, y = start.place(*point)
        yield Pose(x, y, heading)


def _off_road(poses: list[Pose], observation: Observation) -> Iterator[TrajectoryFault]:
    for number, pose in enumerate(poses, start=1):
        place = observation.road.locate(pose.x_m, pose.y_m)
        if place is None:
            return
        lane = observation.road[place.lane]
        beyond = abs(lane.centre.project(pose.x_m, pose.y_m)[1])  # where a map ends, its lanes go on
        if beyond > lane.width_m / 2.0 + _ROAD_M:
            yield TrajectoryFault(
                f"Waypoint {number} is {beyond - lane.width_m / 2.0:.1f} m off the road.",
                "Keep the waypoints on a lane.",
            )
            return


def _touching(poses: list[Pose], period_s: float, observation: Observation) -> Iterator[TrajectoryFault]:
    """Who would be touched if everybody goes on as they do; those who stand, where they stand."""
    ego = observation.ego
    others = [one for one in (*observation.others, *observation.objects) if one.kind != "stop_sign"]
    for number, pose in enumerate(poses, start=1):
        own = Box(pose.x_m, pose.y_m, pose.heading_rad, ego.length_m, ego.width_m)
        for other in others:
            if overlap(own, _then(other, number * period_s)):
                yield TrajectoryFault(
                    f"At waypoint {number} the car would touch {_named(other)}.",
                    "Keep clear of everybody around, where they are and where they drive.",
                )
                return


def _then(other: VehicleState, seconds: float) -> Box:
    way = other.speed_mps * seconds if abs(other.speed_mps) > _STILL_MPS else 0.0
    there = Pose(other.x_m, other.y_m, other.heading_rad).ahead(way)
    return Box(there.x_m, there.y_m, there.heading_rad, other.length_m, other.width_m)


def _named(other: VehicleState) -> str:
    return "somebody on foot" if other.kind == "pedestrian" else f"a {other.kind}"
