"""Faults of a trajectory before it is driven: what no car can do, ground that it leaves, agents that it touches."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import islice, pairwise
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chauffeur.concept import Observation, Trajectory, VehicleState
from chauffeur.geometry import Box, Polyline, Pose, RoadGraph, joined, overlap, wrap_to_pi
from chauffeur.geometry.ground import EDGE_M, GroundFaultKind, swept
from chauffeur.geometry.polyline import smooth

Array = NDArray[np.float64]

BRAKING_MPS2: Final = 8.0
ACCELERATION_MPS2: Final = 4.0
SIDEWAYS_MPS2: Final = 6.0
"""Limits of tyres on a dry road, with a reserve."""
TIGHTEST_M: Final = 4.5
"""Radius of the tightest turn of a passenger car's middle."""
_SAME_M: Final = 0.2
_STILL_MPS: Final = 0.5
_ALONG_RAD: Final = math.radians(40.0)
_PARTS: Final = 6
"""Pieces of a path between two waypoints, before it is looked at more closely where it is long."""
_LANES_AHEAD: Final = 6


class TrajectoryFault(NamedTuple):
    """A fault and its remedy."""

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
    way = _way(Pose(ego.x_m, ego.y_m, ego.heading_rad), points, period)
    yield from _off_the_ground(way, legs[-1] < _STILL_MPS, observation)
    yield from _touching(way, observation)


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


class _Way(NamedTuple):
    """A trajectory as it is driven: where the car is at instants close to one another.

    Attributes:
        poses: (n, 3): x, y and heading of its middle; the first is where it is now.
        waypoint: (n,): number of the waypoint it is on its way to, counted from 1.
        at_s: (n,): seconds from now.
    """

    poses: Array
    waypoint: NDArray[np.int64]
    at_s: Array


def _way(start: Pose, points: list[tuple[float, float]], period_s: float) -> _Way:
    """Smoothly through the waypoints, as its executor lays it, places where it stands passed over."""
    kept, at = [points[0]], [0]
    for number, point in enumerate(points[1:], start=1):
        if math.dist(kept[-1], point) > _SAME_M:
            kept.append(point)
            at.append(number)
    if len(kept) == 1:
        kept, at = [points[0], (_SAME_M, 0.0)], [0, 1]
    places = smooth(np.array(kept), _PARTS)
    reached = np.interp(np.linspace(0.0, len(kept) - 1.0, len(places)), np.arange(len(kept)), at)
    steps = np.diff(places, axis=0)
    heading = np.append(0.0, np.arctan2(steps[:, 1], steps[:, 0]))
    heading[1:-1] = np.angle(np.exp(1j * heading[1:-1]) + np.exp(1j * heading[2:]))
    x, y = start.place(1.0, 0.0)[0] - start.x_m, start.place(1.0, 0.0)[1] - start.y_m
    world = np.stack(
        [
            start.x_m + x * places[:, 0] - y * places[:, 1],
            start.y_m + y * places[:, 0] + x * places[:, 1],
            start.heading_rad + np.unwrap(heading),
        ],
        axis=1,
    )
    poses, share = swept(world)
    passed = np.interp(share, np.arange(len(reached)), reached)
    ends = len(points) - 1 - passed[-1]  # it stands at the last place for as long as the waypoints do
    waits = np.arange(1, round(ends) + 1)
    poses = np.concatenate([poses, np.repeat(poses[-1:], len(waits), axis=0)])
    passed = np.append(passed, passed[-1] + waits)
    return _Way(poses, np.maximum(1, np.ceil(passed - 1e-9)).astype(np.int64), passed * period_s)


def _off_the_ground(way: _Way, stands: bool, observation: Observation) -> Iterator[TrajectoryFault]:
    """Yield a fault if the outline leaves its ground farther than it does now."""
    ego, road = observation.ego, observation.road
    if not road.has_shape:
        return
    ground = road.ground
    # Who comes to a stand may do so on a shoulder, and who is on one already may leave it.
    stops = stands or ground.beyond_m(way.poses[:1], ego.length_m, ego.width_m)[0] > EDGE_M
    now = float(ground.beyond_m(way.poses[:1], ego.length_m, ego.width_m, stops=stops)[0])
    fault = ground.fault(way.poses, ego.length_m, ego.width_m, stops=stops, edge_m=max(EDGE_M, now + _SAME_M))
    if fault is not None:
        number = int(way.waypoint[fault.index])
        yield TrajectoryFault(
            f"On the way to waypoint {number} the car would be {fault.beyond_m:.1f} m {_WHERE[fault.kind]}.",
            "Keep all of the car on lanes that lead its way.",
        )


_WHERE: Final[dict[GroundFaultKind, str]] = {
    "off_road": "off the road",
    "oncoming": "in the oncoming lane",
    "sidewalk": "off the road, on a pavement",
    "bicycle": "in a bicycle lane",
    "emergency": "on the shoulder, where cars only stop",
    "parking": "in a parking lane, where cars only stop",
}


def _touching(way: _Way, observation: Observation) -> Iterator[TrajectoryFault]:
    """Yield a fault if an agent would be touched; agents keep their lanes and speeds, those who stand stay."""
    ego, road = observation.ego, observation.road
    others = [
        one for one in (*observation.others, *observation.objects) if one.kind != "stop_sign" and not _follows(one, ego)
    ]
    paths = {one.id: _path(one, road) for one in others}
    for (x, y, heading), number, at_s in zip(way.poses.tolist(), way.waypoint.tolist(), way.at_s.tolist(), strict=True):
        own = Box(x, y, heading, ego.length_m, ego.width_m)
        for other in others:
            if at_s > 0.0 and overlap(own, _then(other, paths[other.id], at_s)):
                yield TrajectoryFault(
                    f"On the way to waypoint {number} the car would touch {_named(other)}.",
                    "Keep clear of everybody around, where they are and where they drive.",
                )
                return


def _follows(other: VehicleState, ego: VehicleState) -> bool:
    """True if a vehicle comes from behind in the ego's own lane, and minds the ego."""
    ahead, aside = Pose(other.x_m, other.y_m, other.heading_rad).sees(ego.x_m, ego.y_m)
    along = abs(wrap_to_pi(other.heading_rad - ego.heading_rad)) < _ALONG_RAD
    beside = abs(aside) < (other.width_m + ego.width_m) / 2.0
    return along and beside and ahead > (other.length_m + ego.length_m) / 2.0


def _path(other: VehicleState, road: RoadGraph) -> tuple[Polyline, float, float] | None:
    """The line that somebody drives along, where on it they are, and how far left of it; None for straight on."""
    lane = road.get(other.lane)
    if other.kind == "pedestrian" or lane is None or lane.length_m <= 0.0 or abs(other.speed_mps) < _STILL_MPS:
        return None
    station, aside = lane.centre.project(other.x_m, other.y_m)
    if abs(wrap_to_pi(other.heading_rad - lane.centre.at(station).heading_rad)) > _ALONG_RAD:
        return None
    return joined([one.centre for one in islice(road.ahead(lane.id), _LANES_AHEAD)]), station, aside


def _then(other: VehicleState, path: tuple[Polyline, float, float] | None, seconds: float) -> Box:
    way = other.speed_mps * seconds if abs(other.speed_mps) > _STILL_MPS else 0.0
    if path is None:
        there = Pose(other.x_m, other.y_m, other.heading_rad).ahead(way)
    else:
        line, station, aside = path
        at = line.at(station + way)
        there = Pose(*at.place(0.0, aside), at.heading_rad)
    return Box(there.x_m, there.y_m, there.heading_rad, other.length_m, other.width_m)


def _named(other: VehicleState) -> str:
    return "a pedestrian" if other.kind == "pedestrian" else f"a {other.kind}"
