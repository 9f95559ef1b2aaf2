"""People on foot: along the pavements, and over the crossings once there is time to."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from chauffeur.concept import SignalState, VehicleState
from chauffeur.geometry import Box, Polyline, Pose, RoadGraph, overlap

if TYPE_CHECKING:
    from numpy.random import Generator

    from chauffeur.worlds.town.pack import Crossing

WIDE_M: Final = 0.6
_WALKS_MPS: Final = 0.9, 1.6
_JOIN_M: Final = 6.0
"""A pavement and a crossing whose ends are closer together than this lead into each other."""
_ASIDE_M: Final = 0.7
_GAP_S: Final = 2.0
_SEES_M: Final = 60.0
_STEP_M: Final = 0.8
_STANDS_MPS: Final = 1.0
_NEAR_M: Final = 12.0


@dataclass(slots=True)
class _Walk:
    """A line that can be walked, and where it leads at either end: (index, whether forwards)."""

    line: Polyline
    crossing: Crossing | None
    at_start: list[tuple[int, bool]]
    at_end: list[tuple[int, bool]]


@dataclass(slots=True)
class Walker:
    """A pedestrian."""

    id: int
    walk: int
    forwards: bool
    at_m: float
    pace_mps: float
    aside_m: float
    speed_mps: float = 0.0
    waited_s: float = 0.0
    over: Polyline | None = None
    """The way over to the start of the walk, while it is walked."""


class People:
    """Everybody on foot in a town."""

    def __init__(
        self, road: RoadGraph, crossings: Sequence[Crossing], count: int, first_id: int, rng: Generator
    ) -> None:
        """So many people, fewer than that only where a town has no place to walk."""
        self._rng = rng
        self._walks = _walks(road, crossings)
        self._lanes = {one.id: one.lanes for one in crossings}
        self.walkers: list[Walker] = []
        lengths = [walk.line.length_m for walk in self._walks]
        for i in range(count if lengths else 0):
            at = rng.random() * sum(lengths)
            walk = 0
            while at > lengths[walk]:
                at -= lengths[walk]
                walk += 1
            if self._walks[walk].crossing is not None:
                at = 0.0
            aside = float(rng.uniform(-_ASIDE_M, _ASIDE_M))
            self.walkers.append(
                Walker(first_id + i, walk, bool(rng.random() < 0.5), at, float(rng.uniform(*_WALKS_MPS)), aside)
            )

    def step(self, dt_s: float, lights: Mapping[str, SignalState], vehicles: Sequence[VehicleState]) -> None:
        """Walk on for a period; who comes to a crossing waits until it is free.

        Args:
            dt_s: The period.
            lights: What each lane before a junction is shown.
            vehicles: Those that may come.
        """
        for walker in self.walkers:
            walk = self._walks[walker.walk]
            if walker.over is not None:
                walker.speed_mps, walker.at_m = walker.pace_mps, walker.at_m + walker.pace_mps * dt_s
                if walker.at_m >= walker.over.length_m:
                    walker.over, walker.at_m = None, 0.0
                continue
            crossing = walk.crossing
            if crossing is not None and walker.at_m == 0.0 and not self._may_cross(walker, crossing, lights, vehicles):
                walker.speed_mps, walker.waited_s = 0.0, walker.waited_s + dt_s
                continue
            if crossing is not None and self._in_the_way(walker, vehicles):
                walker.speed_mps = 0.0
                continue
            walker.waited_s = 0.0
            walker.speed_mps = walker.pace_mps
            walker.at_m += walker.pace_mps * dt_s
            if walker.at_m >= walk.line.length_m:
                self._next(walker, walk)

    def state(self, walker: Walker) -> VehicleState:
        """The pedestrian as other agents see them."""
        over = walker.over
        pose = self._on_walk(walker) if over is None else over.at(min(walker.at_m, over.length_m))
        x, y, heading = pose.x_m, pose.y_m, pose.heading_rad
        return VehicleState(walker.id, "pedestrian", x, y, heading, walker.speed_mps, WIDE_M, WIDE_M, None)

    def _on_walk(self, walker: Walker) -> Pose:
        line = self._walks[walker.walk].line
        at = min(walker.at_m, line.length_m)
        pose = line.at(at if walker.forwards else line.length_m - at)
        heading = pose.heading_rad if walker.forwards else pose.heading_rad + math.pi
        x, y = Pose(pose.x_m, pose.y_m, heading).place(0.0, walker.aside_m)
        return Pose(x, y, heading)

    def crosses(self, walker: Walker) -> bool:
        """True if a pedestrian is on the carriageway."""
        return self._walks[walker.walk].crossing is not None and walker.at_m > 0.0 and walker.over is None

    def _in_the_way(self, walker: Walker, vehicles: Sequence[VehicleState]) -> bool:
        """True if a vehicle that stands has the next step: nobody walks into the side of a car."""
        one = self.state(walker)
        step = Pose(one.x_m, one.y_m, one.heading_rad).ahead(_STEP_M)
        body = Box(step.x_m, step.y_m, step.heading_rad, _STEP_M, WIDE_M)
        return any(
            vehicle.speed_mps < _STANDS_MPS
            and vehicle.kind != "pedestrian"
            and math.hypot(vehicle.x_m - one.x_m, vehicle.y_m - one.y_m) < _NEAR_M
            and overlap(body, vehicle.box)
            for vehicle in vehicles
        )

    def _next(self, walker: Walker, walk: _Walk) -> None:
        ways = walk.at_end if walker.forwards else walk.at_start
        end = self._on_walk(walker)
        if ways:
            walker.walk, walker.forwards = ways[int(self._rng.integers(len(ways)))]
        else:
            walker.forwards = not walker.forwards
        walker.at_m = 0.0
        start = self._on_walk(walker)
        if math.dist((end.x_m, end.y_m), (start.x_m, start.y_m)) > _STEP_M:
            walker.over = Polyline.of(((end.x_m, end.y_m), (start.x_m, start.y_m)))

    def _may_cross(
        self,
        walker: Walker,
        crossing: Crossing,
        lights: Mapping[str, SignalState],
        vehicles: Sequence[VehicleState],
    ) -> bool:
        """True if the light of those who drive over the crossing is red, and nobody comes who could not stop."""
        if any(lights.get(lane, "red") in ("green", "yellow") for lane in self._lanes[crossing.id]):
            return False
        line = self._walks[walker.walk].line
        middle = line.at(line.length_m / 2.0)
        corridor = Box(middle.x_m, middle.y_m, middle.heading_rad, line.length_m, 2.0 * (_ASIDE_M + WIDE_M))
        needed = line.length_m / walker.pace_mps
        for vehicle in vehicles:
            if vehicle.kind == "pedestrian":
                continue
            if vehicle.speed_mps < 0.5:
                if overlap(corridor, vehicle.box):
                    return False
                continue
            ahead, aside = Pose(vehicle.x_m, vehicle.y_m, vehicle.heading_rad).sees(middle.x_m, middle.y_m)
            if not -2.0 < ahead < _SEES_M or abs(aside) > 6.0:
                continue
            stops = vehicle.speed_mps**2 / 5.0 + vehicle.speed_mps + 5.0
            if ahead < stops and ahead / vehicle.speed_mps < needed + _GAP_S:
                return False
        return True


def _walks(road: RoadGraph, crossings: Sequence[Crossing]) -> list[_Walk]:
    walks = [_Walk(lane.centre, None, [], []) for lane in road.lanes if lane.kind == "sidewalk" and lane.length_m > 2.0]
    walks += [_Walk(Polyline.of(one.centre_m), one, [], []) for one in crossings]
    ends = [(walk.line.points_m[0], walk.line.points_m[-1]) for walk in walks]
    for i, walk in enumerate(walks):
        for mine, ways in ((ends[i][0], walk.at_start), (ends[i][1], walk.at_end)):
            for j, (first, last) in enumerate(ends):
                if i == j:
                    continue
                if math.dist(mine, first) < _JOIN_M:
                    ways.append((j, True))
                if math.dist(mine, last) < _JOIN_M:
                    ways.append((j, False))
    return walks
