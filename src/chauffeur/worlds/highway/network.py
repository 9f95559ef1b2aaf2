"""Lanes of a road while its traffic is placed: straight lines, sines and arcs between named nodes.

The formulas, their order of operations and the choice among equals are those of the highway-env package (E. Leurent,
2018), so that a configuration and a seed start from the same traffic, bit for bit; `benchmarks/highway_oracle` builds
the same scenes on that package, and tests compare. Stepping works on arrays (`core`).
"""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from chauffeur.geometry import LaneId

FloatArray = NDArray[np.float64]
LaneKey = tuple[str, str, int]
"""(from node, to node, index); index 0 is leftmost. Outside of this room a lane has a name (`lane_id`)."""

LANE_WIDTH_M = 4.0
_TWO_PI = 2.0 * math.pi


def lane_id(key: LaneKey) -> LaneId:
    """The name of a lane in the road graph."""
    return f"{key[0]}-{key[1]}:{key[2]}"


class HighwayLane(Protocol):
    """A lane by its centre line. Longitudinal and lateral coordinates in m, y and lateral growing to the right."""

    length: float
    speed_limit: float
    forbidden: bool
    priority: int

    def position(self, longitudinal: float, lateral: float) -> FloatArray:
        """World position (2,), m, of lane coordinates."""
        ...

    def heading_at(self, longitudinal: float) -> float:
        """Heading of the centre line, rad."""
        ...

    def local_coordinates(self, position: FloatArray) -> tuple[float, float]:
        """(longitudinal, lateral), m, of a world position."""
        ...


class StraightLane:
    """A straight line from start to end."""

    def __init__(self, start: Any, end: Any, *, speed_limit: float, forbidden: bool = False, priority: int = 0) -> None:
        """Args: start and end as (x, y), m; speed limit, m/s; whether it may be changed to; right of way."""
        self.start: FloatArray = np.array(start)
        along = np.array(end) - self.start
        self.length = float(np.linalg.norm(along))
        self.heading = float(np.arctan2(along[1], along[0]))
        self.direction: FloatArray = along / self.length
        self._across: FloatArray = np.array([-self.direction[1], self.direction[0]])
        self._axial = bool(self.direction[0] == 1.0 and self.direction[1] == 0.0)
        self.speed_limit = speed_limit
        self.forbidden = forbidden
        self.priority = priority

    def position(self, longitudinal: float, lateral: float) -> FloatArray:
        """World position (2,), m, of lane coordinates."""
        return self.start + longitudinal * self.direction + lateral * self._across

    def heading_at(self, longitudinal: float) -> float:
        """Heading of the line, rad."""
        del longitudinal
        return self.heading

    def local_coordinates(self, position: FloatArray) -> tuple[float, float]:
        """(longitudinal, lateral), m, of a world position."""
        if self._axial:  # the dot products of a lane along +x, to the bit
            return float(position[0]) - float(self.start[0]), float(position[1]) - float(self.start[1])
        delta = position - self.start
        return float(np.dot(delta, self.direction)), float(np.dot(delta, self._across))


class SineLane(StraightLane):
    """A sine about a straight line."""

    def __init__(
        self,
        start: Any,
        end: Any,
        amplitude: float,
        pulsation: float,
        phase: float,
        *,
        speed_limit: float,
        forbidden: bool = False,
        priority: int = 0,
    ) -> None:
        """Args: as of the line; amplitude, m; pulsation, rad/m; phase, rad."""
        super().__init__(start, end, speed_limit=speed_limit, forbidden=forbidden, priority=priority)
        self.amplitude = amplitude
        self.pulsation = pulsation
        self.phase = phase

    def position(self, longitudinal: float, lateral: float) -> FloatArray:
        """World position (2,), m, of lane coordinates."""
        return super().position(longitudinal, lateral + self._swing(longitudinal))

    def heading_at(self, longitudinal: float) -> float:
        """Heading of the centre line, rad."""
        slope = self.amplitude * self.pulsation * np.cos(self.pulsation * longitudinal + self.phase)
        return float(self.heading + np.arctan(slope))

    def local_coordinates(self, position: FloatArray) -> tuple[float, float]:
        """(longitudinal, lateral), m, of a world position."""
        longitudinal, lateral = super().local_coordinates(position)
        return longitudinal, float(lateral - self._swing(longitudinal))

    def _swing(self, longitudinal: float) -> Any:
        return self.amplitude * np.sin(self.pulsation * longitudinal + self.phase)


class ArcLane:
    """An arc of a circle; `turn_sign` is 1 where its phase grows along it, else -1."""

    def __init__(
        self,
        centre: Any,
        radius: float,
        start_phase: float,
        end_phase: float,
        turn_sign: int,
        *,
        speed_limit: float,
        forbidden: bool = False,
        priority: int = 0,
    ) -> None:
        """Args: centre as (x, y), m; radius, m; phases, rad; speed limit, m/s; right of way."""
        self.centre: FloatArray = np.array(centre)
        self.radius = radius
        self.start_phase = start_phase
        self.turn_sign = turn_sign
        self.length = float(radius * (end_phase - start_phase) * turn_sign)
        self.speed_limit = speed_limit
        self.forbidden = forbidden
        self.priority = priority

    def position(self, longitudinal: float, lateral: float) -> FloatArray:
        """World position (2,), m, of lane coordinates."""
        phi = self._phase_at(longitudinal)
        return self.centre + (self.radius - lateral * self.turn_sign) * np.array([np.cos(phi), np.sin(phi)])

    def heading_at(self, longitudinal: float) -> float:
        """Heading of the centre line, rad."""
        return float(self._phase_at(longitudinal) + np.pi / 2 * self.turn_sign)

    def local_coordinates(self, position: FloatArray) -> tuple[float, float]:
        """(longitudinal, lateral), m, of a world position."""
        delta = position - self.centre
        turned = _wrapped(np.arctan2(delta[1], delta[0]) - self.start_phase)
        phi = self.start_phase + turned
        longitudinal = self.turn_sign * (phi - self.start_phase) * self.radius
        return float(longitudinal), float(self.turn_sign * (self.radius - np.linalg.norm(delta)))

    def _phase_at(self, longitudinal: float) -> float:
        return self.turn_sign * longitudinal / self.radius + self.start_phase


class LaneNetwork:
    """Lanes by the nodes they join, in order of insertion: what draws choose from, and the order among equals."""

    def __init__(self) -> None:
        self.graph: dict[str, dict[str, list[HighwayLane]]] = {}

    def add(self, start: str, end: str, lane: HighwayLane) -> None:
        """Append a lane to the right of those that join two nodes already."""
        self.graph.setdefault(start, {}).setdefault(end, []).append(lane)

    def lanes(self) -> dict[LaneKey, HighwayLane]:
        """All lanes by key."""
        return {
            (start, end, i): lane
            for start, ends in self.graph.items()
            for end, lanes in ends.items()
            for i, lane in enumerate(lanes)
        }

    def lane(self, lane: LaneKey) -> HighwayLane:
        """The lane of a key. Raises KeyError or IndexError for one that is not there."""
        return self.graph[lane[0]][lane[1]][lane[2]]

    def closest(self, position: FloatArray, heading_rad: float) -> LaneKey:
        """Lane of the smallest distance, m, the heading error, rad, added to it; the first of equals."""
        best: LaneKey | None = None
        smallest = math.inf
        for name, lane in self.lanes().items():
            s, r = lane.local_coordinates(position)
            distance = abs(r) + max(s - lane.length, 0) + max(0 - s, 0)
            distance = distance + abs(_wrapped(heading_rad - lane.heading_at(s)))
            if distance < smallest:
                best, smallest = name, distance
        assert best is not None
        return best

    def shortest_path(self, start: str, goal: str) -> list[str]:
        """Nodes of the way with the fewest roads, both ends included; of equals the first by name; empty for none."""
        ways = [[start]]
        seen = {start}
        for way in ways:
            for node in sorted(self.graph.get(way[-1], {})):
                if node == goal:
                    return [*way, node]
                if node not in seen:
                    seen.add(node)
                    ways.append([*way, node])
        return []


def _wrapped(angle_rad: float) -> float:
    return (angle_rad + math.pi) % _TWO_PI - math.pi
