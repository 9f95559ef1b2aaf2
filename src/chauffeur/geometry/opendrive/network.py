"""From OpenDRIVE records to a `RoadGraph`: lane centres, neighbours, and which lane leads into which."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from chauffeur.geometry.opendrive.document import MAX_BYTES, Connection, Document, OpenDriveRoad, RoadEnd, parse
from chauffeur.geometry.opendrive.roadside import RoadObject, RoadSignal, objects_of, signals_of
from chauffeur.geometry.opendrive.sections import CLOSED, LaneRecord, Section, limit_mps
from chauffeur.geometry.opendrive.values import MOST_M, OpenDriveError
from chauffeur.geometry.polyline import SAME_M, Polyline
from chauffeur.geometry.road_graph import Lane, LaneId, LaneKind, LanePlace, RoadGraph, turn_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from chauffeur.geometry.polyline import FloatArray

DEFAULT_SPEED_MPS: Final = 50.0 / 3.6
"""Where a network says nothing of speed."""
_SAMPLE_M: Final = 0.5
_CHORD_M: Final = 0.02
"""Most that a leg strays from the sampled curve."""
_LEAST_M: Final = 1e-3
"""A lane shorter than this is passed over."""
_EDGE_M: Final = 1e-6
_MOST_WIDTH_M: Final = 200.0
"""Wider than any lane: parking grounds are drawn as lanes of some tens of metres."""
_LEVEL_M: Final = 3.0
"""Roads farther apart in height lie over one another."""

_UNNAMED: Final = re.compile(r"\s*(road\s*[-\d]*|\d*)\s*", re.IGNORECASE)
"""Names that editors give to roads of no name."""


def lane_name(road: str, section: int | str, lane: int) -> LaneId:
    """Name of a lane in the graph: road id, number of the lane section (`0.1`: its second piece), lane id."""
    return f"{road}:{section}:{lane}"


@dataclass(frozen=True)
class OpenDriveMap:
    """Content of a file, in the plane.

    Attributes:
        name: Of the header.
        geo_reference: Projection string (PROJ), empty without one.
        road: Lanes; ids as `lane_name` makes them, junctions by their id.
        signals: Lights and signs, and references to them.
        objects: Crosswalks, stop lines, buildings.
        controllers: Signals that each controller switches.
        junction_controllers: Controllers of each junction.
        remarks: What was left out, or read otherwise than written, for people.
    """

    name: str
    geo_reference: str
    road: RoadGraph
    signals: tuple[RoadSignal, ...]
    objects: tuple[RoadObject, ...]
    controllers: Mapping[str, tuple[str, ...]]
    junction_controllers: Mapping[str, tuple[str, ...]]
    document: Document
    remarks: tuple[str, ...] = ()

    @cached_property
    def _spans(self) -> Mapping[LaneId, tuple[OpenDriveRoad, Section, bool]]:
        return {
            lane_name(road.id, section.name, record.id): (road, section, _forward(road, record))
            for road in self.document.roads.values()
            for section in road.sections
            for record in section.records
        }

    def road_station(self, lane: LaneId, station_m: float) -> float:
        """Station on the road's reference line beside a station of a lane. Raises KeyError."""
        _, section, forward = self._spans[lane]
        share = station_m / self.road[lane].length_m
        return section.start_m + (section.end_m - section.start_m) * (share if forward else 1.0 - share)

    def elevation(self, lane: LaneId, station_m: float) -> float:
        """Height of the reference line there, m; the graph itself is plane. Raises KeyError."""
        return float(self._spans[lane][0].elevation(np.array([self.road_station(lane, station_m)]))[0])

    def places(
        self, x_m: float, y_m: float, z_m: float, heading_rad: float | None = None, kinds: tuple[LaneKind, ...] = ()
    ) -> tuple[LanePlace, ...]:
        """`RoadGraph.places` at a height: of roads over one another only those that lie there, where any does."""
        found = self.road.places(x_m, y_m, heading_rad, kinds)
        level = tuple(one for one in found if abs(self.elevation(one.lane, one.station_m) - z_m) < _LEVEL_M)
        return level or found


def read_opendrive(path: str | Path) -> OpenDriveMap:
    """The network of a file. Raises OpenDriveError, OSError."""
    with Path(path).open("rb") as file:
        return parse_opendrive(file.read(MAX_BYTES + 1))


def parse_opendrive(text: str | bytes) -> OpenDriveMap:
    """The network of a file's text. Raises OpenDriveError."""
    document = parse(text)
    return OpenDriveMap(
        document.name,
        document.geo_reference,
        _graph(document),
        signals_of(document),
        objects_of(document),
        document.controllers,
        document.junction_controllers,
        document,
        document.remarks.told(),
    )


def _forward(road: OpenDriveRoad, record: LaneRecord) -> bool:
    """True if a lane is driven along the reference line."""
    return (record.id < 0) != road.left_hand


def _graph(document: Document) -> RoadGraph:
    lanes = [lane for road in document.roads.values() for lane in _lanes(road)]
    drawn = {lane.id: lane for lane in lanes}
    onward = _Links(document).onward()
    passed = {lane: _resolved(lane, onward, drawn) for lane in drawn}
    speeds = _speeds(drawn, passed)
    return RoadGraph(
        tuple(
            replace(
                lane,
                successors=passed[lane.id],
                speed_limit_mps=speeds[lane.id],
                turn=turn_of(lane.bend_rad) if lane.junction else "straight",
            )
            for lane in lanes
        )
    )


def _resolved(
    lane: LaneId, onward: Mapping[LaneId, tuple[LaneId, ...]], drawn: Mapping[LaneId, Lane]
) -> tuple[LaneId, ...]:
    """Lanes that follow one, those too short to be drawn passed over; only of a kind with it."""
    found: dict[LaneId, None] = {}
    rim, seen = list(onward.get(lane, ())), {lane}
    while rim:
        one = rim.pop(0)
        if one in drawn:
            if (drawn[one].kind == "driving") == (drawn[lane].kind == "driving"):
                found[one] = None
        elif one not in seen:
            seen.add(one)
            rim += onward.get(one, ())
    return tuple(found)


# Geometry -------------------------------------------------------------------------------------------------------------


def _lanes(road: OpenDriveRoad) -> Iterator[Lane]:
    street = "" if road.junction or _UNNAMED.fullmatch(road.name) else road.name
    for section in road.sections:
        length = section.end_m - section.start_m
        if length <= 0.0:
            continue
        stations = np.linspace(section.start_m, section.end_m, max(3, math.ceil(length / _SAMPLE_M) + 1))
        x, y, heading = road.line(stations)
        nx, ny = -np.sin(heading), np.cos(heading)
        # Editors let offset and widths jump where a section ends: this section's value counts on both its edges.
        inside = np.clip(stations, section.start_m + _EDGE_M, max(section.end_m - _EDGE_M, section.start_m + _EDGE_M))
        offset = road.offset(inside)
        # Rules that change nearer to an end than the section is cut for count from there.
        within = section.start_m + length / 2.0
        for records, side in ((section.left, 1.0), (section.right, -1.0)):
            inner = offset
            leftmost = next((k for k, one in enumerate(records) if one.kind is not None), 0)
            for k, record in enumerate(records):
                width = record.width_m(inside, inner, offset)
                middle = inner + side * width / 2.0
                inner = inner + side * width
                kind = record.kind
                if kind is None:
                    continue
                name = lane_name(road.id, section.name, record.id)
                if not width.max() <= _MOST_WIDTH_M:
                    raise OpenDriveError(f"Lane {name} would be {width.max():g} m wide; at most {_MOST_WIDTH_M:g}.")
                points = np.column_stack((x + middle * nx, y + middle * ny))
                if not (np.abs(points) <= MOST_M).all():
                    raise OpenDriveError(f"Lane {name} leads to where no road is: {points[-1].tolist()}.")
                forward = _forward(road, record)
                line = _polyline(points if forward else points[::-1])
                if line is None:
                    continue
                # The marking towards the middle of the road is the outer one of the lane there.
                leftward, rightward = k > 0 and records[k - 1].crossed(within)[0], record.crossed(within)[1]
                limit = limit_mps(record, road.speeds, within)
                yield Lane(
                    id=name,
                    centre=line,
                    width_m=float(width.mean()),
                    speed_limit_mps=limit if limit is not None else math.nan,
                    kind=kind,
                    road=f"{road.id}:{section.name}:{'+' if side < 0.0 else '-'}",
                    index=k - leftmost if not road.left_hand else len(records) - 1 - k,
                    closed=kind in CLOSED,
                    change_left=rightward if road.left_hand else leftward,
                    change_right=leftward if road.left_hand else rightward,
                    junction=road.junction,
                    street=street,
                )


def _polyline(points: FloatArray) -> Polyline | None:
    """A curve sampled densely, thinned to what keeps within `_CHORD_M` of it; None for one of no length."""
    steps = np.diff(points, axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    if lengths.sum() < _LEAST_M:
        return None
    kept = _thinned(points[np.concatenate(((True,), lengths > SAME_M))])
    try:
        return Polyline.of((x, y) for x, y in kept.tolist())
    except ValueError:
        return None


def _thinned(points: FloatArray) -> FloatArray:
    """Douglas and Peucker's thinning: the farthest point from each chord is kept until none is far."""
    keep = np.zeros(len(points), dtype=bool)
    keep[[0, -1]] = True
    rim = [(0, len(points) - 1)]
    while rim:
        low, high = rim.pop()
        if high - low < 2:
            continue
        chord = points[high] - points[low]
        between = points[low + 1 : high] - points[low]
        length = math.hypot(chord[0], chord[1])
        if length > SAME_M:
            away = np.abs(between[:, 0] * chord[1] - between[:, 1] * chord[0]) / length
        else:
            away = np.hypot(between[:, 0], between[:, 1])
        farthest = int(np.argmax(away))
        if away[farthest] > _CHORD_M:
            middle = low + 1 + farthest
            keep[middle] = True
            rim += [(low, middle), (middle, high)]
    return points[keep]


# Links ----------------------------------------------------------------------------------------------------------------


class _Links:
    """Successors of lanes, by the links of lanes, roads and junctions."""

    def __init__(self, document: Document) -> None:
        self._roads = document.roads
        self._connections: dict[tuple[str, str], list[Connection]] = {}
        for one in document.connections:
            self._connections.setdefault((one.junction, one.incoming), []).append(one)

    def onward(self) -> dict[LaneId, tuple[LaneId, ...]]:
        """Lanes that each lane leads into, in its driving direction."""
        return {
            lane_name(road.id, section.name, record.id): tuple(dict.fromkeys(self._after(road, i, record)))
            for road in self._roads.values()
            for i, section in enumerate(road.sections)
            for record in section.records
        }

    def _after(self, road: OpenDriveRoad, i: int, record: LaneRecord) -> Iterator[LaneId]:
        forward = _forward(road, record)
        target = record.after if forward else record.before
        beyond = i + (1 if forward else -1)
        if 0 <= beyond < len(road.sections):
            if target is not None:
                yield lane_name(road.id, road.sections[beyond].name, target)
            return
        end = road.after if forward else road.before
        if end is None:
            return
        if end.element == "junction":
            for one in self._connections.get((end.id, road.id), ()):
                for lane_from, lane_to in one.lanes:
                    if lane_from == record.id:
                        yield from self._entered(RoadEnd("road", one.connecting, one.at_start), lane_to)
        elif target is not None:
            yield from self._entered(end, target)

    def _entered(self, end: RoadEnd, lane: int) -> Iterator[LaneId]:
        road = self._roads.get(end.id)
        if road is not None and road.sections:
            yield lane_name(road.id, road.sections[0 if end.at_start else -1].name, lane)


def _speeds(lanes: Mapping[LaneId, Lane], onward: Mapping[LaneId, tuple[LaneId, ...]]) -> dict[LaneId, float]:
    """Speed limits; a lane without one (inside a junction) has that of the lanes before it, else of those after."""
    speeds = {name: lane.speed_limit_mps for name, lane in lanes.items()}
    pairs = [(lane, one) for lane, many in onward.items() for one in many]
    for links in (pairs, [(after, before) for before, after in pairs]):
        unknown = {name for name, speed in speeds.items() if math.isnan(speed)}
        while unknown:
            told: dict[LaneId, float] = {}
            for giver, taker in links:
                if taker in unknown and not math.isnan(speeds[giver]):
                    told[taker] = min(told.get(taker, math.inf), speeds[giver])
            if not told:
                break
            speeds.update(told)
            unknown -= told.keys()
    return {name: DEFAULT_SPEED_MPS if math.isnan(speed) else speed for name, speed in speeds.items()}
