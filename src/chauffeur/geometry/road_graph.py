"""The road as a graph of lanes: where a place is, what lies beside, ahead and across, and how far along.

Lanes are polylines in the world frame (right-handed, m), driven from their first point to their last. Lanes of one
`road` lie abreast, index 0 leftmost. Built by each world, or read from a map.
"""

from __future__ import annotations

import hashlib
import math
from array import array
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import TYPE_CHECKING, Final, Literal, NamedTuple

from chauffeur.geometry.angles import wrap_to_pi
from chauffeur.geometry.box import Box  # at run time too: trips are written by their types
from chauffeur.geometry.polyline import Polyline

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from chauffeur.geometry.ground import Ground
    from chauffeur.geometry.polyline import FloatArray

LaneId = str
"""Name of a lane: opaque, whoever wants to know something about it asks the graph."""

LaneKind = Literal["driving", "emergency", "aisle", "parking", "bicycle", "sidewalk", "crossing"]
Turn = Literal["left", "straight", "right"]
TURNS: Final[tuple[Turn, ...]] = ("left", "straight", "right")

TURN_RAD: Final = math.radians(30.0)
"""A lane whose heading changes by more than this turns."""
BACK_RAD: Final = math.radians(150.0)
"""A lane whose heading changes by more than this leads back: to the left where traffic drives on the right."""
_CELL_M: Final = 8.0
"""Squares of the plane by which lanes are looked up."""
_ROOM_M: Final = 100.0
_ROOM_LANES: Final = 20
_REACH_M: Final = 7.0
"""A place farther than this from every lane is compared with all."""


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
        change_left, change_right: Whether the marking on that side lets one change over it.
        junction: Name of the junction it crosses, empty outside of one.
        turn: Which way it turns; worlds say so where ways part.
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
    turn: Turn = "straight"
    street: str = ""
    change_left: bool = True
    change_right: bool = True

    @property
    def length_m(self) -> float:
        """Distance from its first point to its last."""
        return self.centre.length_m

    @property
    def emergency(self) -> bool:
        """True if it is a shoulder."""
        return self.kind == "emergency"

    @cached_property
    def bend_rad(self) -> float:
        """Change of heading from its start to its end, positive to the left."""
        headings = self.centre.headings
        return wrap_to_pi(float(headings[-1] - headings[0]))


def turn_of(change_rad: float) -> Turn:
    """Turn of a change of heading, counter-clockwise positive."""
    change = wrap_to_pi(change_rad)
    if abs(change) <= TURN_RAD:
        return "straight"
    return "left" if change > 0.0 or change < -BACK_RAD else "right"


class _Legs(NamedTuple):
    """Straight legs of lanes, a column each (n,): row of the lane, station, start, direction, length, heading."""

    lane: FloatArray
    station: FloatArray
    x: FloatArray
    y: FloatArray
    ux: FloatArray
    uy: FloatArray
    length: FloatArray
    heading: FloatArray


class LanePlace(NamedTuple):
    """A place in lane coordinates: distance along the lane's centre, and leftward of it, m."""

    lane: LaneId
    station_m: float
    offset_m: float


_NUMBERS: Final = frozenset({"centre", "width_m", "speed_limit_mps"})
"""Fields of a lane that are numbers, whatever library they come from."""


@dataclass(frozen=True, eq=False)
class RoadGraph:
    """All lanes of a road network. Nothing in it changes while driving, and worlds share it between instants.

    Attributes:
        lanes: All of them.
        paved: Ground on which a car may be anywhere: a parking lot, a junction that is more than the lanes through it.
    """

    lanes: tuple[Lane, ...]
    paved: tuple[Box, ...] = ()

    def __eq__(self, other: object) -> bool:
        """Same lanes in the same order."""
        return self is other or (isinstance(other, RoadGraph) and self._digest == other._digest)

    @cached_property
    def _digest(self) -> bytes:
        """Of all that is in it: roads are compared at every instant of a replay, and a town has thousands of points."""
        whole = hashlib.sha256()
        for lane in self.lanes:
            numbers = (float(value) for point in lane.centre.points_m for value in point)
            whole.update(array("d", (lane.width_m, lane.speed_limit_mps, *numbers)).tobytes())
            rest = {one.name: getattr(lane, one.name) for one in fields(lane) if one.name not in _NUMBERS}
            whole.update(repr(rest).encode())
        return whole.digest()

    __hash__ = None  # type: ignore[assignment]

    @cached_property
    def by_id(self) -> Mapping[LaneId, Lane]:
        """Lanes by name."""
        return {lane.id: lane for lane in self.lanes}

    def __contains__(self, lane: object) -> bool:
        """True if it has a lane of this name."""
        return lane in self.by_id

    def __getitem__(self, lane: LaneId) -> Lane:
        """The lane of a name. Raises KeyError."""
        return self.by_id[lane]

    def get(self, lane: LaneId | None) -> Lane | None:
        """The lane of a name, None where there is none."""
        return None if lane is None else self.by_id.get(lane)

    @property
    def least_limit_mps(self) -> float:
        """The strictest sign of the whole road, m/s; 0 where there is no lane."""
        return min((lane.speed_limit_mps for lane in self.lanes), default=0.0)

    @cached_property
    def uninterrupted(self) -> bool:
        """True if traffic flows on it without end: no junction, no aisle (the Highway Capacity Manual's motorways)."""
        return not self.junctions and all(lane.kind in ("driving", "emergency") for lane in self.lanes)

    @cached_property
    def has_shape(self) -> bool:
        """True if it is known where its lanes are: a vehicle may know no more of a road than its speed limit."""
        return bool(self.paved) or any(lane.width_m > 0.0 for lane in self.lanes)

    @cached_property
    def has_parking(self) -> bool:
        """True if there are spots to park in."""
        return any(lane.kind == "parking" for lane in self.lanes)

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

    @cached_property
    def _changes(self) -> dict[LaneId, tuple[tuple[LaneId, float], ...]]:
        """Cache of `changes`."""
        return {}

    def changes(self, lane: LaneId) -> tuple[tuple[LaneId, float], ...]:
        """(neighbour, room) of the lanes that one may change into, left before right.

        They are open, of the same kind, outside of junctions, and the marking between may be crossed.

        The room is the distance over which the two run on beside each other, m, this stretch and those before and
        behind it, counted up to `_ROOM_M`.
        """
        found = self._changes.get(lane)
        if found is None:
            own = self[lane]
            sides = (
                [] if own.junction else [side for side, may in ((-1, own.change_left), (1, own.change_right)) if may]
            )
            beside = [self.neighbour(lane, side) for side in sides]
            found = self._changes[lane] = tuple(
                (one, self._room_m(lane, one))
                for one in beside
                if one is not None and not self[one].closed and self[one].kind == own.kind
            )
        return found

    def _room_m(self, lane: LaneId, other: LaneId) -> float:
        room, side = self[lane].length_m, self.places_between(lane, other)
        for ahead in (False, True):
            a, b = lane, other
            for _ in range(_ROOM_LANES):
                if room >= _ROOM_M:
                    return _ROOM_M
                onward = self.successors if ahead else self.predecessors
                pairs = [(p.id, q.id) for p in onward(a) for q in onward(b) if self.places_between(p.id, q.id) == side]
                if len(pairs) != 1:
                    break
                a, b = pairs[0]
                room += self[a].length_m
        return room

    def places_between(self, lane: LaneId, other: LaneId) -> int | None:
        """Places that a lane lies to the right of another; None if they are on different roads, or unknown."""
        own, its = self.get(lane), self.get(other)
        if own is None or its is None or own.road != its.road or not (own.road or own is its):
            return None
        return its.index - own.index

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
        """The lane that follows: where ways part one that turns to the asked side, else the straightest."""
        ways = self.successors(lane)
        asked = [one for one in ways if one.turn == turn] if turn in ("left", "right") else []
        if asked:
            return max(asked, key=lambda one: abs(one.bend_rad))
        return min(ways, key=lambda one: abs(one.bend_rad), default=None)

    def turns(self, lane: LaneId) -> tuple[Turn, ...]:
        """Ways on from the end of a lane, where there is a choice at all: left, straight, right."""
        ways = {one.turn for one in self.successors(lane)} if len(self[lane].successors) > 1 else set[Turn]()
        return tuple(turn for turn in TURNS if turn in ways)

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
    def _legs(self) -> _Legs:
        """Every leg of every lane."""
        import numpy as np

        table = [
            (
                row, stations[i], points[i][0], points[i][1],
                (points[i + 1][0] - points[i][0]) / (stations[i + 1] - stations[i]),
                (points[i + 1][1] - points[i][1]) / (stations[i + 1] - stations[i]),
                stations[i + 1] - stations[i],
            )
            for row, lane in enumerate(self.lanes)
            for points, stations in ((lane.centre.points_m, lane.centre.stations_m),)
            for i in range(len(points) - 1)
        ]  # fmt: skip
        columns = np.array(table).T
        row, station, x, y, ux, uy, length = columns
        return _Legs(row, station, x, y, ux, uy, length, np.arctan2(uy, ux))

    @cached_property
    def _cells(self) -> Mapping[tuple[int, int], list[int]]:
        """Legs that pass a square of the plane, or one beside it: all that lie within reach of its places.

        A leg is looked at in steps, so that no point of it is farther from one looked at than `_CELL_M` - `_REACH_M`.
        """
        legs = self._legs
        cells: dict[tuple[int, int], list[int]] = {}
        for leg, (x, y, ux, uy, length) in enumerate(
            zip(*(one.tolist() for one in (legs.x, legs.y, legs.ux, legs.uy, legs.length)), strict=True)
        ):
            steps = max(1, math.ceil(length / (2.0 * (_CELL_M - _REACH_M))))
            passed = {
                (math.floor((x + at * ux) / _CELL_M), math.floor((y + at * uy) / _CELL_M))
                for at in (i * length / steps for i in range(steps + 1))
            }
            for cell in {(cx + dx, cy + dy) for cx, cy in passed for dx in (-1, 0, 1) for dy in (-1, 0, 1)}:
                cells.setdefault(cell, []).append(leg)
        return cells

    @cached_property
    def _near(self) -> dict[tuple[int, int, tuple[LaneKind, ...]], _Legs | None]:
        """Legs of the squares that somebody asked for, by the kinds asked for."""
        return {}

    @cached_property
    def _everywhere(self) -> dict[tuple[LaneKind, ...], _Legs | None]:
        """All legs, by the kinds asked for."""
        return {}

    @cached_property
    def _of_kinds(self) -> dict[tuple[LaneKind, ...], NDArray[np.bool_]]:
        """Mask of the lanes of the requested kinds."""
        return {}

    def locate(
        self, x_m: float, y_m: float, heading_rad: float | None = None, kinds: tuple[LaneKind, ...] = ()
    ) -> LanePlace | None:
        """The closest lane at a place, the heading error in rad counted as metres; None where there is no such lane.

        Lanes above one another (a bridge) lie alike in the plane: the heading tells them apart where they cross, and
        nothing does where they run along each other.

        Args:
            x_m, y_m: The place.
            heading_rad: Of whoever is there; None counts every direction alike.
            kinds: Only lanes of these kinds; all by default.
        """
        cx, cy = math.floor(x_m / _CELL_M), math.floor(y_m / _CELL_M)
        try:
            near = self._near[cx, cy, kinds]
        except KeyError:
            near = self._near[cx, cy, kinds] = self._chosen(self._cells.get((cx, cy), ()), kinds)
        if near is not None:
            place, away = self._closest(near, x_m, y_m, heading_rad)
            if away <= _REACH_M:
                return place
        if kinds not in self._everywhere:
            self._everywhere[kinds] = self._chosen(None, kinds)
        everywhere = self._everywhere[kinds]
        return None if everywhere is None else self._closest(everywhere, x_m, y_m, heading_rad)[0]

    def places(
        self,
        x_m: float,
        y_m: float,
        heading_rad: float | None = None,
        kinds: tuple[LaneKind, ...] = (),
        within_m: float = 1.5,
        within_rad: float = math.pi / 4.0,
    ) -> tuple[LanePlace, ...]:
        """Every lane that passes a place, the closest first: lanes lie over one another where ways part and meet.

        Without one that near, the closest there is (`locate`).
        """
        found: dict[LaneId, tuple[float, LanePlace]] = {}
        near = self._chosen(self._cells.get((math.floor(x_m / _CELL_M), math.floor(y_m / _CELL_M)), ()), kinds)
        for row in sorted({int(one) for one in near.lane}) if near is not None else ():
            lane = self.lanes[row]
            station = min(max(lane.centre.nearest(x_m, y_m), 0.0), lane.length_m)
            pose = lane.centre.at(station)
            away = math.hypot(x_m - pose.x_m, y_m - pose.y_m)
            askew = 0.0 if heading_rad is None else abs(wrap_to_pi(heading_rad - pose.heading_rad))
            if away <= within_m and askew <= within_rad:
                found[lane.id] = away + askew, LanePlace(lane.id, station, pose.sees(x_m, y_m)[1])
        if not found:
            closest = self.locate(x_m, y_m, heading_rad, kinds)
            return () if closest is None else (closest,)
        return tuple(place for _, place in sorted(found.values(), key=lambda one: one[0]))

    def _chosen(self, rows: Sequence[int] | None, kinds: tuple[LaneKind, ...]) -> _Legs | None:
        """Legs of some rows, all for None, of lanes of some kinds; None where that is none."""
        import numpy as np

        legs = self._legs
        chosen = np.arange(len(legs.lane)) if rows is None else np.array(rows, dtype=np.int64)
        if kinds:
            wanted = self._of_kinds.get(kinds)
            if wanted is None:
                wanted = self._of_kinds[kinds] = np.array([lane.kind in kinds for lane in self.lanes])
            chosen = chosen[wanted[legs.lane[chosen].astype(int)]]
        return _Legs(*(one[chosen] for one in legs)) if len(chosen) else None

    def _closest(self, legs: _Legs, x_m: float, y_m: float, heading_rad: float | None) -> tuple[LanePlace, float]:
        """(place, distance and heading error) on the closest of some legs."""
        import numpy as np

        dx, dy = x_m - legs.x, y_m - legs.y
        along = np.minimum(np.maximum(dx * legs.ux + dy * legs.uy, 0.0), legs.length)
        dx, dy = dx - along * legs.ux, dy - along * legs.uy
        away = np.sqrt(dx * dx + dy * dy)
        if heading_rad is not None:
            askew = np.abs(wrap_to_pi(heading_rad) - legs.heading)
            away += np.minimum(askew, 2.0 * math.pi - askew)
        best = int(away.argmin())
        offset = legs.ux[best] * (y_m - legs.y[best]) - legs.uy[best] * (x_m - legs.x[best])
        lane = self.lanes[int(legs.lane[best])].id
        return LanePlace(lane, float(legs.station[best] + along[best]), float(offset)), float(away[best])

    @cached_property
    def ground(self) -> Ground:
        """Drivable ground: lanes, direction, and whole outlines."""
        from chauffeur.geometry.ground import Ground

        return Ground(self)

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
            boxes = {lane.id: _bounds(lane.centre) for lane in lanes}
            for i, lane in enumerate(lanes):
                for other in lanes[i + 1 :]:
                    merges = bool(set(lane.successors) & set(other.successors))
                    if merges or (
                        _boxes_meet(boxes[lane.id], boxes[other.id])
                        and not set(self._before.get(lane.id, ())) & set(self._before.get(other.id, ()))
                        and lane.centre.crossings(other.centre)
                    ):
                        found.setdefault(lane.id, []).append(other.id)
                        found.setdefault(other.id, []).append(lane.id)
        return {lane: tuple(others) for lane, others in found.items()}

    def conflicts(self, lane: LaneId) -> tuple[LaneId, ...]:
        """Lanes of the same junction that cross a lane or merge with it; not those that fork off where it begins."""
        return self._conflicts.get(lane, ())


def _bounds(line: Polyline) -> tuple[float, float, float, float]:
    """Least and greatest x, least and greatest y."""
    xs, ys = zip(*line.points_m, strict=True)
    return min(xs), max(xs), min(ys), max(ys)


def _boxes_meet(one: tuple[float, float, float, float], other: tuple[float, float, float, float]) -> bool:
    return one[0] <= other[1] and other[0] <= one[1] and one[2] <= other[3] and other[2] <= one[3]
