"""Drivers that read no words: the world's own as upper reference, and two lower ones."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final, Protocol

from chauffeur.bench.leaderboard.track import RouteTrack
from chauffeur.concept import Command, LaneId, Observation
from chauffeur.worlds.base import World

DRIVERS: Final = ("expert", "reckless", "standing")


class RouteDriver(Protocol):
    """Drives a route by observations alone.

    Attributes:
        aim: Lane that it steers for, where it changes lanes.
    """

    aim: LaneId | None

    def command(self, observation: Observation) -> Command:
        """Command for the present instant."""
        ...


class ExpertDriver:
    """The world's own driver, which is told the route.

    It keeps to 40 km/h whatever the sign says: the scenarios put people and cyclists onto the road 12 m ahead, along
    roads signed 105 km/h too.
    """

    MOST_MPS: Final = 40.0 / 3.6

    def __init__(self, world: World) -> None:
        """Drive a world just reset."""
        self.aim: LaneId | None = None
        self._driver = world.driver()
        self._wishes = replace(self._driver.initial_setpoints(), target_speed_mps=self.MOST_MPS)

    def command(self, observation: Observation) -> Command:
        del observation
        wishes = self._driver.settle(self._wishes)
        return self._driver.command(wishes)


class RecklessDriver:
    """Follows the way at the speed limit by pure pursuit; sees no car, person, light or sign."""

    WHEELBASE_M: Final = 2.85
    LATERAL_MPS2: Final = 3.0

    def __init__(self, track: RouteTrack) -> None:
        """Drive along a way."""
        self.aim: LaneId | None = None
        self._track = track
        self._index = 0

    def command(self, observation: Observation) -> Command:
        ego, poses = observation.ego, self._track.poses
        near = range(self._index, min(self._index + 40, len(poses)))
        self._index = min(near, key=lambda i: math.hypot(poses[i].x_m - ego.x_m, poses[i].y_m - ego.y_m))
        ahead = max(4.0, 0.8 * ego.speed_mps)
        aim = poses[min(self._index + round(ahead), len(poses) - 1)]
        x, y = ego.x_m - math.cos(ego.heading_rad) * 1.425, ego.y_m - math.sin(ego.heading_rad) * 1.425
        away = max(math.hypot(aim.x_m - x, aim.y_m - y), 1.0)
        angle = math.atan2(aim.y_m - y, aim.x_m - x) - ego.heading_rad
        curvature = 2.0 * math.sin(angle) / away
        lane = observation.road.get(ego.lane)
        limit = 8.0 if lane is None else lane.speed_limit_mps
        beyond = poses[min(self._index + round(2.0 * ahead), len(poses) - 1)]
        bend = abs(math.remainder(beyond.heading_rad - ego.heading_rad, math.tau)) / (2.0 * ahead)
        speed = min(limit, math.sqrt(self.LATERAL_MPS2 / max(bend, abs(curvature), 1e-3)))
        return Command(
            max(-4.0, min(2.5, 1.5 * (speed - ego.speed_mps))),
            max(-0.6, min(0.6, math.atan(self.WHEELBASE_M * curvature))),
        )


class StandingDriver:
    """Stands."""

    def __init__(self) -> None:
        """Stand."""
        self.aim: LaneId | None = None

    def command(self, observation: Observation) -> Command:
        del observation
        return Command(-4.0, 0.0)


def make_driver(name: str, world: World, track: RouteTrack) -> RouteDriver:
    """A driver by name: one of DRIVERS."""
    if name == "reckless":
        return RecklessDriver(track)
    return ExpertDriver(world) if name == "expert" else StandingDriver()
