"""Gap acceptance: whether there is room in the lane beside, ahead and behind, for a change of lanes."""

from __future__ import annotations

import math
from typing import Final

from chauffeur.concept import LaneId, Observation, VehicleState
from chauffeur.geometry import Lane, Polyline, Pose, RoadGraph, joined, wrap_to_pi
from chauffeur.worlds.town.way import Stretch, first_m

NEAR_M: Final = 70.0
COMING_S: Final = 5.0
"""Time by which a fast vehicle is minded from farther away: from as far as it gets in it."""
_ASIDE_M: Final = 8.0
"""Distance of an agent's middle from a lane beyond which it is not in it."""
_UPSTREAM_M: Final = 60.0
"""Distance from which a vehicle on a way into the target lane is minded."""
_MOST_WAYS: Final = 6


class GapAcceptance:
    """Judges gaps on one road; keeps the ways into its lanes."""

    def __init__(self, road: RoadGraph) -> None:
        """Args: the road."""
        self._road = road
        self._into: dict[LaneId, tuple[Polyline, ...]] = {}

    def accepts(self, seen: Observation, goal: Stretch) -> bool:
        """True if there is room in another lane, ahead and behind."""
        ego = seen.ego
        here = goal.line.nearest(ego.x_m, ego.y_m, 0.0, first_m(goal))
        reach = NEAR_M + COMING_S * max([0.0, *(one.speed_mps - ego.speed_mps for one in seen.others)])
        low, high = goal.index(here - reach), goal.index(here + NEAR_M) + 1
        x, y = goal.x[low:high], goal.y[low:high]
        for other in seen.others:
            if math.dist((other.x_m, other.y_m), (ego.x_m, ego.y_m)) > reach:
                continue
            away = (x - other.x_m) ** 2 + (y - other.y_m) ** 2
            at = int(away.argmin())
            if away[at] > _ASIDE_M**2:
                continue
            station = goal.line.nearest(other.x_m, other.y_m, low + at - 2.0, low + at + 2.0)
            pose = goal.line.at(station)
            aside = abs(pose.sees(other.x_m, other.y_m)[1])
            if aside > 1.9 + other.width_m / 2.0:
                continue
            along = other.speed_mps * math.cos(wrap_to_pi(other.heading_rad - pose.heading_rad))
            gap = abs(station - here) - (ego.length_m + other.length_m) / 2.0
            if station >= here:
                closing = max(0.0, ego.speed_mps - along)
                needed = 2.5 + 0.3 * ego.speed_mps + closing * closing / 4.0
            else:
                needed = _behind_m(along, ego.speed_mps)
            if gap < needed:
                return False
        return not any(self._comes_up(one, goal.lanes[0].id, here, ego) for one in seen.others)

    def _comes_up(self, other: VehicleState, goal: LaneId, here: float, ego: VehicleState) -> bool:
        """True if a vehicle that is not in a lane yet, but on a way into it, would come too close behind the ego.

        Args:
            other: Who.
            goal: The lane.
            here: Where the ego is along it, m.
            ego: The ego.
        """
        ahead, aside = Pose(ego.x_m, ego.y_m, ego.heading_rad).sees(other.x_m, other.y_m)
        follows = ahead < 0.0 and abs(aside) < (ego.width_m + other.width_m) / 2.0
        if follows or math.hypot(ahead, aside) > _UPSTREAM_M:
            return False
        for line in self._upstream(goal):
            station, aside = line.project(other.x_m, other.y_m)
            pose = line.at(station)
            turned = wrap_to_pi(other.heading_rad - pose.heading_rad)
            if abs(aside) > 1.9 + other.width_m / 2.0 or station >= line.length_m or math.cos(turned) < 0.7:
                continue
            along = other.speed_mps * math.cos(turned)
            gap = here + line.length_m - station - (ego.length_m + other.length_m) / 2.0
            if gap < _behind_m(along, ego.speed_mps):
                return True
        return False

    def _upstream(self, lane: LaneId) -> tuple[Polyline, ...]:
        """The ways into a lane, as far back as a fast vehicle has to be seen."""
        known = self._into.get(lane)
        if known is None:
            done: list[list[Lane]] = []
            rim: list[tuple[list[Lane], float]] = [([], 0.0)]
            while rim:
                way, length = rim.pop()
                before = () if length > _UPSTREAM_M else self._road.predecessors(way[0].id if way else lane)
                if way and not before:
                    done.append(way)
                rim += [([one, *way], length + one.length_m) for one in before]
            known = self._into[lane] = tuple(joined([one.centre for one in way]) for way in done[:_MOST_WAYS])
        return known


def _behind_m(along_mps: float, ego_mps: float) -> float:
    """Gap that a vehicle coming up from behind needs, by their speed and the ego's."""
    closing = max(0.0, along_mps - ego_mps)
    return 2.5 + 0.7 * along_mps + closing * closing / 4.0
