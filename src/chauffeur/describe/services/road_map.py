"""Which road a car is on: ways in a tree of rectangles (shapely), matched by position and heading.

Distances are measured in a plane that touches the earth where the car is, which is right to a millimetre within the
60 m that matter here.

A road is the likelier the nearer it is and the better it points where the car does: the weight of a road is
exp(-(d/s)^2/2 - (a/20 deg)^2/2), with d the distance beyond the edge of the road, s the accuracy of the position and a
the angle, after the emission probability of Newson and Krumm, "Hidden Markov map matching through noise and
sparseness", 2009.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from types import ModuleType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chauffeur.concept import DataError, MissingExtraError
from chauffeur.describe.services.readings import M_PER_DEG, MAX_LATITUDE_DEG, Position, distance_m
from chauffeur.describe.services.ways import Floats, ServiceWay, nearest

REACH_M: Final = 40.0
"""Roads farther away than this are not the road the car is on."""
LOOK_AHEAD_M: Final = 2_000.0
"""How far ahead the next junction is looked for."""

_MAX_SEGMENT_M: Final = 50_000.0
"""A longer line between two points is a mistake in the map."""
_MOST: Final = 10_000_000
"""Segments that fit into memory (about 3 GB while they are sorted)."""
_MOST_NEAR: Final = 200
"""Segments that are weighed in a lookup, nearest first: the time it takes is not the map's to choose."""
_HEADING_DEG: Final = 20.0
_MAX_TURN_DEG: Final = 50.0
"""A road that points elsewhere by more is not the road the car is on."""
_PRIOR: Final[Mapping[str, float]] = {"service": 1.0, "busway": 2.0, "track": 2.0}
"""Added to the squared distances: one rarely drives there."""
_MINOR: Final = frozenset({"service", "track", "busway"})
"""Where these join a road, nobody speaks of a junction."""
_SAME: Final = 1e-9
"""Costs that differ by less are the same, rounded."""
_STEPS: Final = 5_000
"""Points of the road ahead that are looked at, at most."""

Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Candidate:
    """A way the car may be on.

    Attributes:
        number: The way's place among the ways of the map.
        way: The way.
        distance_m: From its line.
        segment: Which of its segments is nearest: the index of that segment's first point.
        fraction: Where on that segment, 0 to 1.
        forward: Whether the car drives along its points; None where the heading is not known and both is allowed.
        cost: How badly it fits, as the exponent of its weight; 0 is best.
        share: Of all weights, 0 to 1.
    """

    number: int
    way: ServiceWay
    distance_m: float
    segment: int
    fraction: float
    forward: bool | None
    cost: float
    share: float = 0.0

    def fits_better_than(self, other: Candidate) -> bool:
        """Whether this place on a way is likelier than another on it; where a way passes twice, the first counts."""
        if abs(self.cost - other.cost) < _SAME:
            return self.segment < other.segment
        return self.cost < other.cost


@dataclass(frozen=True, slots=True)
class Match:
    """The way the car most likely is on, and what else comes into question.

    Attributes:
        best: The likeliest.
        others: All others within reach, likeliest first.
        fit: How well the best one fits by itself, 0 to 1.
    """

    best: Candidate
    others: tuple[Candidate, ...]
    fit: float


@dataclass(frozen=True, slots=True)
class RoadAhead:
    """What the map shows of the road ahead.

    Attributes:
        junction_m: Distance to the next junction along the road; None where none is in view.
        seen_m: How far the road could be followed.
    """

    junction_m: float | None
    seen_m: float


def geometry() -> ModuleType:
    """The library shapely. Raises MissingExtraError: it is not installed."""
    try:
        import shapely
    except ImportError as error:
        raise MissingExtraError("Maps need shapely.", extra="map") from error
    return shapely


class RoadMap:
    """Ways, ready to be looked up.

    Args:
        ways: The ways.
        source: Who drew the map, in words.
        as_of_s: Unix time of the data; None where it is not known.
        extent: (centre, radius in m) beyond which ways are missing; None for a map that knows its whole region.

    Raises:
        DataError: There are too many ways.
        MissingExtraError: shapely is not installed.
    """

    def __init__(
        self,
        ways: Iterable[ServiceWay],
        *,
        source: str = "OpenStreetMap",
        as_of_s: float | None = None,
        extent: tuple[Position, float] | None = None,
    ) -> None:
        shapely = geometry()
        self.ways = tuple(ways)
        self.source = source
        self.as_of_s = as_of_s
        self.extent = extent
        counts = np.array([len(way.points) for way in self.ways], dtype=np.int64)
        self._first: Ints = np.concatenate(([0], np.cumsum(counts))).astype(np.int64)
        self._points: Floats = np.array([one for way in self.ways for one in way.points], np.float64).reshape(-1, 2)
        owner = np.repeat(np.arange(len(self.ways), dtype=np.int64), counts)
        self._sort_segments(shapely, owner)
        self._join(owner)

    def _sort_segments(self, shapely: ModuleType, owner: Ints) -> None:
        """Segments in a tree of rectangles: owner, first point, ends (longitude, latitude), bearing; one row each."""
        start = np.flatnonzero(owner[:-1] == owner[1:])
        begin, end = self._points[start, ::-1], self._points[start + 1, ::-1].copy()
        # The short way round: a segment may cross the 180th meridian.
        end[:, 0] = begin[:, 0] + np.remainder(end[:, 0] - begin[:, 0] + 180.0, 360.0) - 180.0
        middle = np.cos(np.radians((begin[:, 1] + end[:, 1]) / 2.0))
        east_m, north_m = ((end - begin) * M_PER_DEG).T
        east_m = east_m * middle
        highest = np.maximum(np.abs(begin[:, 1]), np.abs(end[:, 1]))
        fine = (np.hypot(north_m, east_m) <= _MAX_SEGMENT_M) & (highest < MAX_LATITUDE_DEG)
        if (count := int(fine.sum())) > _MOST:
            raise DataError(
                f"The map of {self.source} has too many roads to be sorted ({count} segments).",
                hint="Cut out your area: osmium extract --bbox WEST,SOUTH,EAST,NORTH map.osm.pbf -o area.osm.pbf",
            )
        self._segment: Ints = start[fine]
        self._owner: Ints = owner[self._segment]
        self._begin, self._end = begin[fine], end[fine]
        self._bearing: Floats = np.degrees(np.arctan2(east_m, north_m))[fine]
        low, high = np.minimum(self._begin, self._end), np.maximum(self._begin, self._end)
        self._box = shapely.box
        self._tree = shapely.STRtree(shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1]))

    def _join(self, owner: Ints) -> None:
        """How many arms of road meet at each point, and which ways end where."""
        # Ways are joined where they share a point. OSM keeps seven decimals, so equal points are equal numbers.
        latitude, longitude = np.rint(self._points * 1e7).astype(np.int64).T
        arms = np.full(len(owner), 2, dtype=np.int64)
        arms[self._first[:-1]] = 1
        arms[self._first[1:] - 1] = 1
        minor = np.array([way.road_class in _MINOR for way in self.ways], dtype=bool)
        _, where = np.unique(latitude * 3_600_000_001 + longitude, return_inverse=True)
        self._arms: Ints = np.bincount(where, weights=arms).astype(np.int64)[where]
        self._major_arms: Ints = np.bincount(where, weights=np.where(minor[owner], 0, arms)).astype(np.int64)[where]
        self._place: Ints = where.astype(np.int64)
        self._ends: dict[int, list[tuple[int, bool]]] = {}
        first, last = where[self._first[:-1]].tolist(), where[self._first[1:] - 1].tolist()
        for way, (begin, end) in enumerate(zip(first, last, strict=True)):
            self._ends.setdefault(begin, []).append((way, True))
            self._ends.setdefault(end, []).append((way, False))

    def covers(self, position: Position, margin_m: float = REACH_M) -> bool:
        """Whether all ways within a margin of a position are on the map, as far as the map itself can tell."""
        if self.extent is None:
            return True
        centre, radius_m = self.extent
        return distance_m(centre, position) + margin_m <= radius_m

    def match(self, position: Position) -> Match | None:
        """The way a car is on, by its position and, where it is known, its heading; None where none is near."""
        near = self._near(position)
        if not near:
            return None
        least = min(one.cost for one in near)
        weights = [math.exp((least - one.cost) / 2.0) for one in near]
        total = sum(weights)
        found = [replace(one, share=weight / total) for weight, one in zip(weights, near, strict=True)]
        best, *others = sorted(found, key=lambda one: (-one.share, one.way.id))
        return Match(best, tuple(others), math.exp(-least / 8.0))

    def _near(self, position: Position) -> list[Candidate]:
        """Ways within reach that point where the car does, one each, not yet weighed against one another."""
        lat, lon = position.latitude_deg, position.longitude_deg
        if abs(lat) >= MAX_LATITUDE_DEG:
            return []
        best: dict[int, Candidate] = {}
        across = M_PER_DEG * math.cos(math.radians(lat))
        # A little more than the reach: what is within it is measured below.
        high, wide = 1.01 * REACH_M / M_PER_DEG, 1.01 * REACH_M / across
        for east in (lon, lon - 360.0, lon + 360.0) if abs(lon) > 179.0 else (lon,):
            rows = self._tree.query(self._box(east - wide, lat - high, east + wide, lat + high))
            begin, end = ((ends[rows] - (east, lat)) * (across, M_PER_DEG) for ends in (self._begin, self._end))
            away, place = nearest(begin[:, 0], begin[:, 1], end[:, 0], end[:, 1])
            within = np.flatnonzero(away <= REACH_M)
            if len(within) > _MOST_NEAR:
                within = within[np.argpartition(away[within], _MOST_NEAR)[:_MOST_NEAR]]
            for index in within.tolist():
                one = self._weighed(position, int(rows[index]), float(away[index]), float(place[index]))
                if one is not None and (one.number not in best or one.fits_better_than(best[one.number])):
                    best[one.number] = one
        return list(best.values())

    def _weighed(self, position: Position, row: int, away_m: float, fraction: float) -> Candidate | None:
        number = int(self._owner[row])
        way = self.ways[number]
        forward, angle = _directed(way.oneway, float(self._bearing[row]), position.heading_deg)
        if angle > _MAX_TURN_DEG:
            return None
        segment = int(self._segment[row] - self._first[number])
        # A road has width beside its line, but none beyond its ends.
        beyond = (segment == 0 and fraction <= 0.0) or (segment == len(way.points) - 2 and fraction >= 1.0)
        distance = max(0.0, away_m - (0.0 if beyond else way.half_width_m)) / max(position.accuracy_m, 1.0)
        # Between ways that lie equally well, the nearer line decides.
        cost = distance**2 + (angle / _HEADING_DEG) ** 2 + _PRIOR.get(way.road_class, 0.0) + (away_m / REACH_M) ** 2
        return Candidate(number, way, away_m, segment, fraction, forward, cost)

    def ahead(self, candidate: Candidate) -> RoadAhead | None:
        """The road ahead of a car, as far as LOOK_AHEAD_M; None where the direction it drives in is not known."""
        if candidate.forward is None:
            return None
        minor = candidate.way.road_class in _MINOR
        arms = self._arms if minor else self._major_arms
        gone_m = 0.0
        here = self._at(candidate)
        for point in self._following(candidate):
            there = float(self._points[point, 0]), float(self._points[point, 1])
            step_m = _apart_m(here, there)
            part = self._covered(here, there)
            gone_m += part * step_m
            if part < 1.0:
                return RoadAhead(None, min(gone_m, LOOK_AHEAD_M))
            here = there
            if gone_m > LOOK_AHEAD_M:
                return RoadAhead(None, LOOK_AHEAD_M)
            if arms[point] >= 3:
                return RoadAhead(gone_m, gone_m)
        return RoadAhead(None, gone_m)

    def _covered(self, here: tuple[float, float], there: tuple[float, float]) -> float:
        """Which part of a straight line, from a place that the map knows, is on the map: 0 to 1."""
        if self.extent is None or self.covers(Position(*there)):
            return 1.0
        east = math.remainder(there[1] - here[1], 360.0)
        low, high = 0.0, 1.0
        for _ in range(16):
            middle = (low + high) / 2.0
            place = here[0] + middle * (there[0] - here[0]), math.remainder(here[1] + middle * east, 360.0)
            low, high = (middle, high) if self.covers(Position(*place)) else (low, middle)
        return low

    def _at(self, candidate: Candidate) -> tuple[float, float]:
        (lat0, lon0), (lat1, lon1) = candidate.way.points[candidate.segment : candidate.segment + 2]
        east = math.remainder(lon1 - lon0, 360.0)
        return lat0 + candidate.fraction * (lat1 - lat0), lon0 + candidate.fraction * east

    def _following(self, candidate: Candidate) -> Iterator[int]:
        """Points of the road ahead in driving order, over the ends of ways, until a junction or the end of the road."""
        number = candidate.number
        forward = bool(candidate.forward)
        point = int(self._first[number]) + candidate.segment + (1 if forward else 0)
        for _ in range(_STEPS):
            yield point
            first, last = int(self._first[number]), int(self._first[number + 1]) - 1
            if point != (last if forward else first):
                point += 1 if forward else -1
                continue
            onward = self._onward(int(self._place[point]), number)
            if onward is None:
                return
            number, forward = onward
            point = int(self._first[number]) + 1 if forward else int(self._first[number + 1]) - 2

    def _onward(self, place: int, number: int) -> tuple[int, bool] | None:
        """The way on which a road goes on behind the end of a way: (way, whether along its points)."""
        minor = self.ways[number].road_class in _MINOR
        for way, at_start in self._ends.get(place, []):
            if way == number or (self.ways[way].road_class in _MINOR and not minor):
                continue
            if self.ways[way].oneway in (0, 1 if at_start else -1):
                return way, at_start
        return None

    def joined(self, one: Candidate, other: Candidate) -> bool:
        """Whether two ways meet end to end."""
        return bool(self._end_places(one.number) & self._end_places(other.number))

    def _end_places(self, number: int) -> set[int]:
        return {int(self._place[self._first[number]]), int(self._place[self._first[number + 1] - 1])}


def _directed(oneway: int, bearing_deg: float, heading_deg: float | None) -> tuple[bool | None, float]:
    """(Whether the car drives along the points, angle between car and road in degrees)."""
    if heading_deg is None:
        return (None if oneway == 0 else oneway > 0), 0.0
    along = abs(math.remainder(heading_deg - bearing_deg, 360.0))
    if oneway == 0:
        return along <= 90.0, min(along, 180.0 - along)
    return oneway > 0, along if oneway > 0 else 180.0 - along


def _apart_m(one: tuple[float, float], other: tuple[float, float]) -> float:
    north = (other[0] - one[0]) * M_PER_DEG
    east = math.remainder(other[1] - one[1], 360.0) * M_PER_DEG * math.cos(math.radians((one[0] + other[0]) / 2.0))
    return math.hypot(north, east)
