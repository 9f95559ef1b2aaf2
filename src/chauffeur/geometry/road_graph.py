"""The road as a graph of lanes: where a place is, what lies beside, ahead and across, and how far along.

Lanes are polylines in the world frame (right-handed, m), driven from their first point to their last. Lanes of one
`road` lie abreast, index 0 leftmost. Built by each world, or read from a map.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Final, Literal, NamedTuple

from chauffeur.geometry.angles import wrap_to_pi
from chauffeur.geometry.polyline import Polyline

if TYPE_CHECKING:
    from chauffeur.geometry.polyline import FloatArray

LaneId = str
"""Name of a lane: opaque, whoever wants to know something about it asks the graph."""

LaneKind = Literal["driving", "emergency", "aisle", "parking", "bicycle", "sidewalk", "crossing"]
Turn = Literal["left", "straight", "right"]

TURN_RAD: Final = math.radians(30.0)
"""A lane whose heading changes by more than this turns."""
BACK_RAD: Final = math.radians(150.0)
"""A lane whose heading changes by more than this leads back: to the left where traffic drives on the right."""
_CELL_M: Final = 20.0
_REACH_M: Final = 60.0
"""A place farther than this from every lane is looked for lane by lane."""


@dataclass(frozen=True)
class Lane:
    """One lane.

    Attributes:
        id: Its name in the graph.
        centre: Its middle, in driving direction.
        width_m: Mean width.
        speed_limit_mps: What the sign says.
        kind: Who may use it for what.
        road: Lanes of the same road and direction lie abreast.
        index: Place among them, 0 leftmost.
        successors: Lanes it leads into.
        closed: Nobody may change into it (a ramp that ends, the shoulder).
        junction: Name of the junction it crosses, empty outside of one.
        street: Name of the street, empty where it has none.
    """

    id: LaneId
    centre: Polyline
    width_m: float
    speed_limit_mps: float
    kind: LaneKind = "driving"
    road: str = ""
    index: int = 0
    successors: tuple[LaneId, ...] = ()
    closed: bool = False
    junction: str = ""
    street: str = ""

    @property
    def length_m(self) -> float:
        """Distance from its first point to its last."""
        return self.centre.length_m

    @property
    def emergency(self) -> bool:
        """Whether it is a shoulder."""
        return self.kind == "emergency"

    @cached_property
    def turn(self) -> Turn:
        """Which way it turns, from the headings at its ends."""
        headings = self.centre.headings
        return turn_of(float(headings[-1] - headings[0]))


def turn_of(change_rad: float) -> Turn:
    """Which way a change of heading turns."""
    change = wrap_to_pi(change_rad)
    if abs(change) <= TURN_RAD:
        return "straight"
    return "left" if change > 0.0 or change < -BACK_RAD else "right"


class LanePlace(NamedTuple):
    """A place in lane coordinates: distance along the lane's centre, and leftward of it, m."""

    lane: LaneId
    station_m: float
    offset_m: float


@dataclass(frozen=True, eq=False)
class RoadGraph:
    """All lanes of a road network. Nothing in it changes while driving, and worlds share it between instants."""

    lanes: tuple[Lane, ...]

    def __eq__(self, other: object) -> bool:
        """Same lanes in the same order."""
        return self is other or (isinstance(other, RoadGraph) and self.lanes == other.lanes)

    __hash__ = None  # type: ignore[assignment]

    @cached_property
    def by_id(self) -> Mapping[LaneId, Lane]:
        """Lanes by name."""
        return {lane.id: lane for lane in self.lanes}

    def __contains__(self, lane: object) -> bool:
        """Whether it has a lane of this name."""
        return lane in self.by_id

    def __getitem__(self, lane: LaneId) -> Lane:
        """The lane of a name. Raises KeyError."""
        return self.by_id[lane]

    def get(self, lane: LaneId | None) -> Lane | None:
        """The lane of a name, None where there is none."""
        return None if lane is None else self.by_id.get(lane)

    # Beside -----------------------------------------------------------------------------------------------------------

    @cached_property
    def _roads(self) -> Mapping[str, tuple[Lane, ...]]:
        roads: dict[str, list[Lane]] = {}
        for lane in self.lanes:
            roads.setdefault(lane.road, []).append(lane)
        return {road: tuple(sorted(lanes, key=lambda lane: lane.index)) for road, lanes in roads.items()}

    def abreast(self, lane: LaneId) -> tuple[Lane, ...]:
        """All lanes of a lane's road and direction, itself included, leftmost first."""
        own = self[lane]
        return self._roads[own.road] if own.road else (own,)

    def neighbour(self, lane: LaneId, offset: int) -> LaneId | None:
        """The lane so many places to the right (negative: left); None beyond the edge."""
        index = self[lane].index + offset
        return next((one.id for one in self.abreast(lane) if one.index == index), None)

    def places_between(self, lane: LaneId, other: LaneId) -> int | None:
        """How many places to the right of a lane another lies; None where they are of different roads."""
        own, its = self[lane], self[other]
        return its.index - own.index if own.road == its.road and (own.road or own is its) else None

    # Along ------------------------------------------------------------------------------------------------------------

    def successors(self, lane: LaneId) -> tuple[Lane, ...]:
        """Lanes that a lane leads into."""
        return tuple(self[one] for one in self[lane].successors)

    @cached_property
    def _before(self) -> Mapping[LaneId, tuple[LaneId, ...]]:
        found: dict[LaneId, list[LaneId]] = {}
        for lane in self.lanes:
            for onward in lane.successors:
                found.setdefault(onward, []).append(lane.id)
        return {lane: tuple(before) for lane, before in found.items()}

    def predecessors(self, lane: LaneId) -> tuple[Lane, ...]:
        """Lanes that lead into a lane."""
        return tuple(self[one] for one in self._before.get(lane, ()))

    def onward(self, lane: LaneId, turn: Turn | None = None) -> Lane | None:
        """The lane that follows: where ways part the one that turns most to the asked side, else the straightest."""
        ways = self.successors(lane)
        if not ways:
            return None
        if turn == "left":
            return max(ways, key=_turned_rad)
        if turn == "right":
            return min(ways, key=_turned_rad)
        return min(ways, key=lambda one: abs(_turned_rad(one)))

    def ahead(self, lane: LaneId, turn: Turn | None = None) -> Iterator[Lane]:
        """A lane and what follows it, one after the other, each lane once."""
        seen: set[LaneId] = set()
        here: Lane | None = self[lane]
        while here is not None and here.id not in seen:
            seen.add(here.id)
            yield here
            here = self.onward(here.id, turn)

    def distance_m(self, place: LanePlace, goal: LanePlace, within_m: float = 500.0) -> float | None:
        """Shortest distance along lanes from a place to one ahead of it; None where it is not within reach."""
        if place.lane == goal.lane and goal.station_m >= place.station_m:
            return goal.station_m - place.station_m
        best: dict[LaneId, float] = {}
        rim = [(one, self[place.lane].length_m - place.station_m) for one in self[place.lane].successors]
        while rim:
            rim.sort(key=lambda step: -step[1])
            lane, at_m = rim.pop()
            if at_m > within_m or at_m >= best.get(lane, math.inf):
                continue
            best[lane] = at_m
            rim += [(one, at_m + self[lane].length_m) for one in self[lane].successors]
        total = best.get(goal.lane, math.inf) + goal.station_m
        return total if total <= within_m else None

    # Where ------------------------------------------------------------------------------------------------------------

    @cached_property
    def _legs(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Of every leg of every lane: (row of lane, station), start (x, y), direction and length (ux, uy, length)."""
        import numpy as np

        rows: list[tuple[float, float]] = []
        starts: list[tuple[float, float]] = []
        ways: list[tuple[float, float, float]] = []
        for row, lane in enumerate(self.lanes):
            points, stations = lane.centre.points_m, lane.centre.stations_m
            for i in range(len(points) - 1):
                length = stations[i + 1] - stations[i]
                (ax, ay), (bx, by) = points[i], points[i + 1]
                rows.append((float(row), stations[i]))
                starts.append((ax, ay))
                ways.append(((bx - ax) / length, (by - ay) / length, length))
        return np.array(rows), np.array(starts), np.array(ways)

    @cached_property
    def _cells(self) -> Mapping[tuple[int, int], list[int]]:
        """Legs that pass a square of the plane, or one beside it."""
        _, starts, ways = self._legs
        cells: dict[tuple[int, int], set[int]] = {}
        for leg, ((x, y), (ux, uy, length)) in enumerate(zip(starts.tolist(), ways.tolist(), strict=True)):
            for i in range(math.ceil(length / _CELL_M) + 1):
                at = min(i * _CELL_M, length)
                cx, cy = math.floor((x + at * ux) / _CELL_M), math.floor((y + at * uy) / _CELL_M)
                for dx in (-1, 0, 1):
                    for dy in (-1, 0, 1):
                        cells.setdefault((cx + dx, cy + dy), set()).add(leg)
        return {cell: sorted(legs) for cell, legs in cells.items()}

    def locate(
        self, x_m: float, y_m: float, heading_rad: float | None = None, kinds: tuple[LaneKind, ...] = ()
    ) -> LanePlace | None:
        """The closest lane at a place, the heading error in rad counted as metres; None where there is no such lane.

        Args:
            x_m, y_m: The place.
            heading_rad: Of whoever is there; None counts every direction alike.
            kinds: Only lanes of these kinds; all by default.
        """
        found = self._closest(
            self._cells.get((math.floor(x_m / _CELL_M), math.floor(y_m / _CELL_M))), x_m, y_m, heading_rad, kinds
        )
        return found if found is not None else self._closest(None, x_m, y_m, heading_rad, kinds)

    def _closest(
        self,
        legs: list[int] | None,
        x_m: float,
        y_m: float,
        heading_rad: float | None,
        kinds: tuple[LaneKind, ...],
    ) -> LanePlace | None:
        import numpy as np

        rows, starts, ways = self._legs
        chosen = np.arange(len(rows)) if legs is None else np.array(legs)
        if kinds:
            chosen = chosen[[self.lanes[int(row)].kind in kinds for row in rows[chosen, 0]]]
        if not len(chosen):
            return None
        delta = np.array([x_m, y_m]) - starts[chosen]
        ux, uy, length = ways[chosen].T
        along = np.clip(delta[:, 0] * ux + delta[:, 1] * uy, 0.0, length)
        away = np.hypot(delta[:, 0] - along * ux, delta[:, 1] - along * uy)
        if heading_rad is not None:
            away = away + np.abs(np.angle(np.exp(1j * (heading_rad - np.arctan2(uy, ux)))))
        best = int(np.argmin(away))
        row, station = rows[chosen[best]]
        offset = ux[best] * delta[best, 1] - uy[best] * delta[best, 0]
        return LanePlace(self.lanes[int(row)].id, float(station + along[best]), float(offset))

    # Across -----------------------------------------------------------------------------------------------------------

    @cached_property
    def junctions(self) -> Mapping[str, tuple[Lane, ...]]:
        """Lanes that cross each junction."""
        found: dict[str, list[Lane]] = {}
        for lane in self.lanes:
            if lane.junction:
                found.setdefault(lane.junction, []).append(lane)
        return {name: tuple(lanes) for name, lanes in found.items()}

    @cached_property
    def _conflicts(self) -> Mapping[LaneId, tuple[LaneId, ...]]:
        found: dict[LaneId, list[LaneId]] = {}
        for lanes in self.junctions.values():
            for i, lane in enumerate(lanes):
                for other in lanes[i + 1 :]:
                    merges = bool(set(lane.successors) & set(other.successors))
                    if merges or (
                        not set(self._before.get(lane.id, ())) & set(self._before.get(other.id, ()))
                        and lane.centre.crossings(other.centre)
                    ):
                        found.setdefault(lane.id, []).append(other.id)
                        found.setdefault(other.id, []).append(lane.id)
        return {lane: tuple(others) for lane, others in found.items()}

    def conflicts(self, lane: LaneId) -> tuple[LaneId, ...]:
        """Lanes of the same junction that cross a lane or merge with it; not those that fork off where it begins."""
        return self._conflicts.get(lane, ())


def _turned_rad(lane: Lane) -> float:
    """Change of heading from the start of a lane to its end, positive to the left."""
    headings = lane.centre.headings
    return wrap_to_pi(float(headings[-1] - headings[0]))
