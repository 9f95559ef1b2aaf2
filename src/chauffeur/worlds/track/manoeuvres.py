"""The three manoeuvres of the paper's Sec. VI-C: the ground, the path to be tracked, where everybody starts.

- `acceleration`: from a stand to 50 km/h, behind a lead vehicle 30 m ahead that accelerates at 1.26 m/s2 to 45 km/h.
- `lane_change`: at 50 km/h past the same lead vehicle, into the lane to the left.
- `left_turn`: a bend of radius 23.89 m at a constant 30 km/h.

The paper prints neither the length of the lane change nor how the bend is entered: here 50 m (3.6 s, 1.6 m/s2
sideways), and clothoids of 8 m.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from typing import Final, Literal

from chauffeur.concept.units import MPS_PER_KMH
from chauffeur.concept.weather import Weather
from chauffeur.geometry import Box, Lane, Polyline, RoadGraph

ManoeuvreName = Literal["acceleration", "lane_change", "left_turn"]
MANOEUVRES: Final[tuple[ManoeuvreName, ...]] = "acceleration", "lane_change", "left_turn"

FRICTION: Final[dict[Weather, float]] = {"sunny": 1.0, "rain": 0.7, "fog": 0.9, "snow": 0.4, "night": 1.0}
"""Share of the dry road's peak friction: wet asphalt, damp asphalt, rolled snow on winter tyres."""

LANE_M: Final = 3.5
PAVED_M: Final = 15.0
"""Paved on every side of a proving ground's lanes, m."""
CHANGE_M: Final = 50.0
RADIUS_M: Final = 23.89
CLOTHOID_M: Final = 8.0
STEP_M: Final = 0.5
LIMIT_MPS: Final = 50.0 * MPS_PER_KMH
LEAD_GAP_M: Final = 30.0
LEAD_MPS2: Final = 1.26
LEAD_MPS: Final = 45.0 * MPS_PER_KMH
_APPROACH_M: Final = 30.0


@dataclass(frozen=True)
class Manoeuvre:
    """A manoeuvre: path, start and duration.

    Attributes:
        name: Which.
        path: To be tracked by the centre of mass, points `STEP_M` apart.
        speed_mps: Speed to reach and keep.
        start_mps: Speed at the start, which is the path's.
        lead: Whether the lead vehicle is there.
        duration_s: When it ends at the latest.
        road: The lanes.
        goal_m: Station of the path at which a drive has done it, where it is not the speed that says so.
    """

    name: ManoeuvreName
    path: Polyline
    speed_mps: float
    start_mps: float
    lead: bool
    duration_s: float
    road: RoadGraph
    goal_m: float | None


@cache
def manoeuvre(name: ManoeuvreName) -> Manoeuvre:
    """The manoeuvre of a name."""
    if name == "left_turn":
        path = _bend()
        speed = 30.0 * MPS_PER_KMH
        return Manoeuvre(name, path, speed, speed, False, 20.0, _bend_road(path, speed), path.length_m - 40.0)
    fifty = 50.0 * MPS_PER_KMH
    if name == "acceleration":
        path = Polyline.of((i * STEP_M, 0.0) for i in range(round(600.0 / STEP_M) + 1))
        return Manoeuvre(name, path, fifty, 0.0, True, 25.0, _two_lanes(), None)
    path = _change()
    return Manoeuvre(name, path, fifty, fifty, True, 9.0, _two_lanes(), 95.0)


def _two_lanes() -> RoadGraph:
    """Two lanes to the east; the ego starts in the right one, whose middle is y = 0."""
    lanes = (
        Lane(f"straight_{i}", Polyline.of(((-50.0, y), (650.0, y))), LANE_M, LIMIT_MPS, road="straight", index=i)
        for i, y in enumerate((LANE_M, 0.0))
    )
    return RoadGraph(tuple(lanes))


def proving_ground(lanes: Iterable[Lane]) -> Box:
    """The paved area around lanes on a proving ground: a car that slides off its lane leaves no road."""
    held = tuple(lanes)
    points = [point for lane in held for point in lane.centre.points_m]
    xs, ys = [x for x, _ in points], [y for _, y in points]
    middle = (min(xs) + max(xs)) / 2.0, (min(ys) + max(ys)) / 2.0
    wide, deep = max(xs) - min(xs) + 2.0 * PAVED_M, max(ys) - min(ys) + 2.0 * PAVED_M
    return Box(*middle, 0.0, wide, deep)


def _change() -> Polyline:
    """A lane change to the left at once, as a polynomial of fifth order: no jump of curvature."""
    points: list[tuple[float, float]] = []
    for i in range(round(600.0 / STEP_M) + 1):
        share = min(i * STEP_M / CHANGE_M, 1.0)
        points.append((i * STEP_M, LANE_M * share**3 * (10.0 - 15.0 * share + 6.0 * share**2)))
    return Polyline.of(points)


def _bend() -> Polyline:
    """Straight on, a bend of 90 degrees to the left between two clothoids, straight on."""
    clothoid_rad = CLOTHOID_M / (2.0 * RADIUS_M)
    arc_m = (math.pi / 2.0 - 2.0 * clothoid_rad) * RADIUS_M
    ends = (_APPROACH_M, CLOTHOID_M, arc_m, CLOTHOID_M, 100.0)
    fine, x, y, heading = 0.01, 0.0, 0.0, 0.0
    points = [(x, y)]
    at = 0.0
    for i in range(round(sum(ends) / fine)):
        heading_mid = heading + 0.5 * fine * _curvature(at, ends)
        x, y = x + fine * math.cos(heading_mid), y + fine * math.sin(heading_mid)
        heading += fine * _curvature(at + 0.5 * fine, ends)
        at += fine
        if (i + 1) % round(STEP_M / fine) == 0:
            points.append((x, y))
    return Polyline.of(points)


def _curvature(at_m: float, ends: tuple[float, ...]) -> float:
    straight, into, arc, out, _ = ends
    at = at_m - straight
    if at <= 0.0 or at >= into + arc + out:
        return 0.0
    if at < into:
        return at / into / RADIUS_M
    if at < into + arc:
        return 1.0 / RADIUS_M
    return (into + arc + out - at) / out / RADIUS_M


def _bend_road(path: Polyline, speed_mps: float) -> RoadGraph:
    """One lane: up to the bend, through it, on."""
    bend_m = path.length_m - 100.0
    before = Polyline.of(((-30.0, 0.0), (_APPROACH_M, 0.0)))
    through, after = path.between(_APPROACH_M, bend_m), path.between(bend_m, path.length_m)
    limit = max(speed_mps, LIMIT_MPS)
    return RoadGraph(
        (
            Lane("approach", before, LANE_M, limit, road="approach", successors=("bend",)),
            Lane("bend", through, LANE_M, limit, road="bend", successors=("exit",), junction="bend"),
            Lane("exit", after, LANE_M, limit, road="exit"),
        )
    )
