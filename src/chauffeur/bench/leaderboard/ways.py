"""From the key points of a route file to the way: lanes for the world, and a point every metre for the rules."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from chauffeur.bench.leaderboard.track import RouteTrack
from chauffeur.concept import ScenarioError
from chauffeur.geometry import LanePlace, Pose, RoadGraph, Route
from chauffeur.geometry.route import plan_through

if TYPE_CHECKING:
    from chauffeur.bench.leaderboard.routes import LeaderboardRoute
    from chauffeur.worlds.town.pack import MapPack


ON_ROAD_M: Final = 20.0
"""A key point farther than this from the closest lane belongs to another map."""


@dataclass(frozen=True)
class PlannedRoute:
    """A way, in both forms."""

    route: Route
    track: RouteTrack


def plan_official(town: MapPack, route: LeaderboardRoute) -> PlannedRoute:
    """The way of a route through its town; heights, where the route says them, tell a bridge from what is under it.

    Raises:
        ScenarioError: As of `plan_keypoints`.
    """
    if not route.heights_m:
        return plan_keypoints(town.road, route.keypoints, headed=route.headed)
    levels = town.opendrive
    places = [
        levels.places(one.x_m, one.y_m, height_m, one.heading_rad if route.headed else None, ("driving",))
        for one, height_m in zip(route.keypoints, route.heights_m, strict=True)
    ]
    return _planned(town.road, route.keypoints, places)


def plan_keypoints(road: RoadGraph, keypoints: Sequence[Pose], *, headed: bool = True) -> PlannedRoute:
    """The way through key points in the plane; where they are not headed, the shortest past lanes of any direction.

    Raises:
        ScenarioError: A key point is on no lane, or no way leads past all of them.
    """
    places = [road.places(one.x_m, one.y_m, one.heading_rad if headed else None, ("driving",)) for one in keypoints]
    return _planned(road, keypoints, places)


def _planned(road: RoadGraph, keypoints: Sequence[Pose], places: Sequence[tuple[LanePlace, ...]]) -> PlannedRoute:
    hint = "Does the map belong to the route file?"
    for number, (found, pose) in enumerate(zip(places, keypoints, strict=True)):
        if not found or _away_m(road, found[0], pose) > ON_ROAD_M:
            raise ScenarioError(f"Key point {number} at ({pose.x_m:.1f}, {pose.y_m:.1f}) is on no lane.", hint=hint)
    route = plan_through(road, places)
    if route is None:
        raise ScenarioError("No way leads past the key points of the route.", hint=hint)
    return PlannedRoute(route, track_of(road, route))


def _away_m(road: RoadGraph, place: LanePlace, pose: Pose) -> float:
    at = road[place.lane].centre.at(min(max(place.station_m, 0.0), road[place.lane].length_m))
    return math.hypot(at.x_m - pose.x_m, at.y_m - pose.y_m)


def track_of(road: RoadGraph, route: Route) -> RouteTrack:
    """The line of a route, a point every metre. Raises ScenarioError: it has no length."""
    try:
        line = route.dense(road)
        return RouteTrack(
            tuple(Pose(one.x_m, one.y_m, one.heading_rad) for one in line), tuple(one.manoeuvre for one in line)
        )
    except ValueError as error:
        raise ScenarioError("The route has no length.", hint="Its key points have to lie apart.") from error
