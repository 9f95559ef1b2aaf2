"""Which road a car is on: ways in a grid, matched by position and heading.

Distances are measured in a plane that touches the earth where the car is, which is right to a millimetre within the
60 m that matter here. A lookup reads one cell of the grid and takes about 0.05 ms, whatever the size of the map.

A road is the likelier the nearer it is and the better it points where the car does: the weight of a road is
exp(-(d/s)^2/2 - (a/20 deg)^2/2), with d the distance beyond the edge of the road, s the accuracy of the position and a
the angle, after the emission probability of Newson and Krumm, "Hidden Markov map matching through noise and
sparseness", 2009.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chauffeur.concept import DataError
from chauffeur.describe.services.readings import M_PER_DEG, MAX_LATITUDE_DEG, Position, distance_m
from chauffeur.describe.services.ways import ServiceWay

REACH_M: Final = 40.0
"""Roads farther away than this are not the road the car is on."""
LOOK_AHEAD_M: Final = 2_000.0
"""How far ahead the next junction is looked for."""

_PIECE_M: Final = 150.0
"""Segments are cut into pieces no longer than this, so that none covers many cells."""
_MAX_SEGMENT_M: Final = 50_000.0
"""A longer line between two points is a mistake in the map."""
_MOST: Final = 60_000_000
"""Entries of the grid that fit into memory (about 2 GB while they are sorted)."""
_MOST_IN_CIRCLE: Final = 3_000_000
"""Of a circle of a few hundred metres: no town has a tenth of it."""
_MOST_NEAR: Final = 200
"""Pieces that are weighed in a lookup, nearest first: the time it takes is not the map's to choose."""
_CELL_DEG: Final = 0.001
_HEADING_DEG: Final = 20.0
_MAX_TURN_DEG: Final = 50.0
"""A road that points elsewhere by more is not the road the car is on."""
_PRIOR: Final[Mapping[str, float]] = {"service": 1.0, "busway": 2.0, "track": 2.0}
"""Added to the squared distances: one rarely drives there."""
_MINOR: Final = frozenset({"service", "track", "busway"})
"""Where these join a road, nobody speaks of a junction."""
_STEPS: Final = 5_000
"""Points of the road ahead that are looked at, at most."""

Floats = NDArray[np.float64]
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
        share: Of all weights, 0 to 1.
    """

    number: int
    way: ServiceWay
    distance_m: float
    segment: int
    fraction: float
    forward: bool | None
    share: float


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


class RoadMap:
    """Ways, ready to be looked up.

    Args:
        ways: The ways.
        source: Who drew the map, in words.
        as_of_s: Unix time of the data; None where it is not known.
        extent: (centre, radius in m) beyond which ways are missing; None for a map that knows its whole region.

    Raises:
        DataError: There are too many ways, or too long ones.
    """

    def __init__(
        self,
        ways: Iterable[ServiceWay],
        *,
        source: str = "OpenStreetMap",
        as_of_s: float | None = None,
        extent: tuple[Position, float] | None = None,
    ) -> None:
        self.ways = tuple(ways)
        self.source = source
        self.as_of_s = as_of_s
        self.extent = extent
        counts = np.array([len(way.points) for way in self.ways], dtype=np.int64)
        self._first: Ints = np.concatenate(([0], np.cumsum(counts))).astype(np.int64)
        points = np.array([point for way in self.ways for point in way.points], dtype=np.float64).reshape(-1, 2)
        self._lat: Floats = points[:, 0]
        self._lon: Floats = points[:, 1]
        owner = np.repeat(np.arange(len(self.ways), dtype=np.int64), counts)
        self._cut(owner)
        self._fill_grid()
        self._join(owner)

    def _cut(self, owner: Ints) -> None:
        """Segments, cut into pieces: (way, segment, start, end, place on the segment), one row each."""
        start = np.flatnonzero(owner[:-1] == owner[1:]) if len(owner) else np.zeros(0, dtype=np.int64)
        lat0, lat1 = self._lat[start], self._lat[start + 1]
        lon0 = self._lon[start]
        # The short way round: a segment may cross the 180th meridian.
        lon1 = lon0 + np.remainder(self._lon[start + 1] - lon0 + 180.0, 360.0) - 180.0
        north_m = (lat1 - lat0) * M_PER_DEG
        east_m = (lon1 - lon0) * M_PER_DEG * np.cos(np.radians((lat0 + lat1) / 2.0))
        length_m = np.hypot(north_m, east_m)
        fine = (length_m <= _MAX_SEGMENT_M) & (np.maximum(np.abs(lat0), np.abs(lat1)) < MAX_LATITUDE_DEG)
        start, lat0, lat1, lon0, lon1 = start[fine], lat0[fine], lat1[fine], lon0[fine], lon1[fine]
        bearing = np.degrees(np.arctan2(east_m[fine], north_m[fine]))
        pieces = np.maximum(1, np.ceil(length_m[fine] / _PIECE_M)).astype(np.int64)
        self._allow(int(pieces.sum()))
        row = np.repeat(np.arange(len(start)), pieces)
        step = np.arange(len(row)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
        begin, end = step / pieces[row], (step + 1) / pieces[row]
        self._piece_way: Ints = owner[start][row]
        self._piece_segment: Ints = start[row] - self._first[self._piece_way]
        self._piece_begin: Floats = begin
        self._piece_share: Floats = end - begin
        self._piece_bearing: Floats = bearing[row]
        self._lat0: Floats = lat0[row] + begin * (lat1 - lat0)[row]
        self._lat1: Floats = lat0[row] + end * (lat1 - lat0)[row]
        self._lon0: Floats = lon0[row] + begin * (lon1 - lon0)[row]
        self._lon1: Floats = lon0[row] + end * (lon1 - lon0)[row]

    def _fill_grid(self) -> None:
        """Cells and the pieces within reach of each: every piece stands in all cells its surroundings touch."""
        most = float(np.max(np.abs(self._lat0), initial=0.0)) + 2 * _CELL_DEG
        margin = REACH_M / M_PER_DEG
        margin_lon = margin / math.cos(math.radians(min(most, MAX_LATITUDE_DEG)))
        south = _cells(np.minimum(self._lat0, self._lat1) - margin)
        north = _cells(np.maximum(self._lat0, self._lat1) + margin)
        west = _cells(np.minimum(self._lon0, self._lon1) - margin_lon)
        east = _cells(np.maximum(self._lon0, self._lon1) + margin_lon)
        high, wide = north - south + 1, east - west + 1
        area = high * wide
        self._allow(int(area.sum()))
        piece = np.repeat(np.arange(len(area)), area)
        index = np.arange(len(piece)) - np.repeat(np.cumsum(area) - area, area)
        keys = _keys(south[piece] + index // wide[piece], west[piece] + index % wide[piece])
        order = np.argsort(keys, kind="stable")
        self._in_cell: Ints = piece[order]
        cells, begins = np.unique(keys[order], return_index=True)
        ends = np.append(begins, len(order))[1:]
        self._cell: dict[int, tuple[int, int]] = {
            cell: (begin, end) for cell, begin, end in zip(cells.tolist(), begins.tolist(), ends.tolist(), strict=True)
        }

    def _allow(self, entries: int) -> None:
        if entries > (_MOST if self.extent is None else _MOST_IN_CIRCLE):
            raise DataError(
                f"The map of {self.source} has too many or too long roads to be sorted ({entries} pieces).",
                hint="Cut out your area: osmium extract --bbox WEST,SOUTH,EAST,NORTH map.osm.pbf -o area.osm.pbf",
            )

    def _join(self, owner: Ints) -> None:
        """How many arms of road meet at each point, and which ways end where."""
        # Ways are joined where they share a point. OSM keeps seven decimals, so equal points are equal numbers.
        place = np.rint(self._lat * 1e7).astype(np.int64) * 3_600_000_001 + np.rint(self._lon * 1e7).astype(np.int64)
        arms = np.full(len(owner), 2, dtype=np.int64)
        arms[self._first[:-1]] = 1
        arms[self._first[1:] - 1] = 1
        minor = np.array([way.road_class in _MINOR for way in self.ways], dtype=bool)
        _, where = np.unique(place, return_inverse=True)
        every = np.bincount(where, weights=arms).astype(np.int64)
        major = np.bincount(where, weights=np.where(minor[owner], 0, arms)).astype(np.int64)
        self._arms: Ints = every[where]
        self._major_arms: Ints = major[where]
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
        least = min(cost for cost, _ in near)
        weights = [math.exp((least - cost) / 2.0) for cost, _ in near]
        total = sum(weights)
        ranked = sorted(zip(weights, near, strict=True), key=lambda pair: (-pair[0], self.ways[pair[1][1].way].id))
        found = [
            Candidate(one.way, self.ways[one.way], one.away_m, one.segment, one.fraction, one.forward, weight / total)
            for weight, (_, one) in ranked
        ]
        return Match(found[0], tuple(found[1:]), math.exp(-least / 8.0))

    def _near(self, position: Position) -> list[tuple[float, _Near]]:
        """Ways within reach that point where the car does: (cost, how it lies there), one per way."""
        lat, lon = position.latitude_deg, position.longitude_deg
        if abs(lat) >= MAX_LATITUDE_DEG:
            return []
        best: dict[int, tuple[float, _Near]] = {}
        across = M_PER_DEG * math.cos(math.radians(lat))
        for east in (lon, lon - 360.0, lon + 360.0) if abs(lon) > 179.0 else (lon,):
            span = self._cell.get(_key(lat, east))
            if span is None:
                continue
            rows = self._in_cell[span[0] : span[1]]
            x0, y0 = (self._lon0[rows] - east) * across, (self._lat0[rows] - lat) * M_PER_DEG
            dx, dy = (self._lon1[rows] - east) * across - x0, (self._lat1[rows] - lat) * M_PER_DEG - y0
            square = np.maximum(dx * dx + dy * dy, 1e-9)
            place = np.clip(-(x0 * dx + y0 * dy) / square, 0.0, 1.0)
            away = np.hypot(x0 + place * dx, y0 + place * dy)
            within = np.flatnonzero(away <= REACH_M)
            if len(within) > _MOST_NEAR:
                within = within[np.argpartition(away[within], _MOST_NEAR)[:_MOST_NEAR]]
            for index in within.tolist():
                self._weigh(position, int(rows[index]), float(away[index]), float(place[index]), best)
        return list(best.values())

    def _weigh(
        self, position: Position, row: int, away_m: float, place: float, best: dict[int, tuple[float, _Near]]
    ) -> None:
        number = int(self._piece_way[row])
        way = self.ways[number]
        forward, angle = _directed(way.oneway, float(self._piece_bearing[row]), position.heading_deg)
        if angle > _MAX_TURN_DEG:
            return
        segment = int(self._piece_segment[row])
        fraction = float(self._piece_begin[row] + place * self._piece_share[row])
        # A road has width beside its line, but none beyond its ends.
        beyond = (segment == 0 and fraction <= 0.0) or (segment == len(way.points) - 2 and fraction >= 1.0)
        distance = max(0.0, away_m - (0.0 if beyond else way.half_width_m)) / max(position.accuracy_m, 1.0)
        cost = distance**2 + (angle / _HEADING_DEG) ** 2 + _PRIOR.get(way.road_class, 0.0)
        # Between ways that lie equally well, the nearer line decides.
        cost += (away_m / REACH_M) ** 2
        known = best.get(number)
        if known is None or cost < known[0]:
            best[number] = (cost, _Near(number, away_m, segment, fraction, forward))

    def ahead(self, candidate: Candidate) -> RoadAhead | None:
        """The road ahead of a car, as far as LOOK_AHEAD_M; None where the direction it drives in is not known."""
        if candidate.forward is None:
            return None
        minor = candidate.way.road_class in _MINOR
        arms = self._arms if minor else self._major_arms
        gone_m = 0.0
        here = self._at(candidate)
        for point in self._following(candidate):
            there = float(self._lat[point]), float(self._lon[point])
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


@dataclass(frozen=True, slots=True)
class _Near:
    way: int
    away_m: float
    segment: int
    fraction: float
    forward: bool | None


def _directed(oneway: int, bearing_deg: float, heading_deg: float | None) -> tuple[bool | None, float]:
    """(Whether the car drives along the points, angle between car and road in degrees)."""
    if heading_deg is None:
        return (None if oneway == 0 else oneway > 0), 0.0
    along = abs(math.remainder(heading_deg - bearing_deg, 360.0))
    if oneway == 0:
        return along <= 90.0, min(along, 180.0 - along)
    return oneway > 0, along if oneway > 0 else 180.0 - along


def _cells(degrees: Floats) -> Ints:
    return np.floor(degrees / _CELL_DEG).astype(np.int64)


def _keys(rows: Ints, columns: Ints) -> Ints:
    return rows * 1_000_003 + columns


def _key(lat: float, lon: float) -> int:
    return math.floor(lat / _CELL_DEG) * 1_000_003 + math.floor(lon / _CELL_DEG)


def _apart_m(one: tuple[float, float], other: tuple[float, float]) -> float:
    north = (other[0] - one[0]) * M_PER_DEG
    east = math.remainder(other[1] - one[1], 360.0) * M_PER_DEG * math.cos(math.radians((one[0] + other[0]) / 2.0))
    return math.hypot(north, east)
