"""Lane sections: what the lanes of a road are from station to station, cut where a rule changes along the way."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, zip_longest
from typing import TYPE_CHECKING, Final

import numpy as np

from chauffeur.geometry.opendrive.curves import Cubics
from chauffeur.geometry.opendrive.values import (
    MOST_ROAD_M,
    OpenDriveError,
    Remarks,
    lane_id,
    linked_lane,
    number,
    offset_m,
    quoted,
    speed_of,
)
from chauffeur.geometry.road_graph import LaneKind

if TYPE_CHECKING:
    from xml.etree import ElementTree as ET

    from chauffeur.geometry.polyline import FloatArray

LANE_KINDS: Final[Mapping[str, LaneKind]] = {
    "driving": "driving", "entry": "driving", "exit": "driving", "onramp": "driving", "offramp": "driving",
    "connectingramp": "driving", "sliplane": "driving", "bus": "driving", "taxi": "driving", "hov": "driving",
    "mwyentry": "driving", "mwyexit": "driving", "bidirectional": "aisle", "shoulder": "emergency",
    "stop": "emergency", "parking": "parking", "biking": "bicycle", "sidewalk": "sidewalk", "walking": "sidewalk",
}  # fmt: skip
"""Lane types, in small letters, that are lanes."""
CLOSED: Final = frozenset({"emergency", "parking", "sidewalk", "bicycle", "aisle"})
"""Kinds of lanes that no car changes into."""
_NO_LANES: Final = frozenset({
    "none", "border", "median", "curb", "restricted", "roadworks", "tram", "rail", "special1", "special2", "special3",
    "shared",
})  # fmt: skip
"""Lane types that are no part of the graph, since no car drives there."""
_RAILS: Final = frozenset({"tram", "rail"})
_CROSSABLE: Final = frozenset({"none", "broken", "broken broken", "botts dots"})
"""Markings that one may drive over where the file does not say."""
_WAYS: Final = {
    "both": ("increase", "decrease"),
    "increase": ("increase",),
    "decrease": ("decrease",),
    "none": (),
}
_LANE_PARTS: Final = frozenset({
    "link", "width", "border", "roadMark", "material", "visibility", "speed", "access", "height", "rule", "userData",
    "dataQuality",
})  # fmt: skip
_LEAST_CUT_M: Final = 0.5
"""A rule that changes so close to where lanes end anyway counts from there: a car is ten times as long."""


@dataclass(frozen=True)
class LaneRecord:
    """A lane of a lane section, or of a piece of one.

    Attributes:
        id: Positive to the left of the reference line, negative to its right.
        type: As written: driving, shoulder, sidewalk ...
        kind: What that is in the road graph; None for what is no lane there.
        origin_m: Station that its records count from.
        widths: Width as function of the distance from there.
        border: Where its outer edge lies, leftwards of the middle lane, in place of a width.
        before, after: Lane of the previous and the next section (or road) along the reference line.
        speeds: (station, limit m/s) of its own records, in order; None: that of the road.
        marks: (station, inwards, outwards) in order: whether the marking on its outer side lets one change over it,
            towards smaller ids (in size), towards larger ones.
    """

    id: int
    type: str
    kind: LaneKind | None
    origin_m: float
    widths: Cubics
    border: Cubics | None
    before: int | None
    after: int | None
    speeds: tuple[tuple[float, float | None], ...] = ()
    marks: tuple[tuple[float, bool, bool], ...] = ()

    def speed_mps(self, station_m: float) -> float | None:
        """Its own limit at a station of the road."""
        return next((speed for start, speed in reversed(self.speeds) if start <= station_m), None)

    def crossed(self, station_m: float) -> tuple[bool, bool]:
        """(inwards, outwards) at a station of the road; before the first marking there is none to cross."""
        return next(((one, other) for start, one, other in reversed(self.marks) if start <= station_m), (False, False))

    def width_m(self, stations: FloatArray, inner: FloatArray, middle: FloatArray) -> FloatArray:
        """Width (n,) at stations (n,) of the road.

        Args:
            stations: Stations.
            inner: Where its inner edge lies, leftwards of the reference line (n,).
            middle: Where the middle lane lies, the same way (n,).
        """
        along = stations - self.origin_m
        if self.border is None:
            return np.maximum(self.widths(along), 0.0)
        outwards = self.border(along) + middle - inner
        return np.maximum(outwards if self.id > 0 else -outwards, 0.0)


@dataclass(frozen=True)
class Section:
    """A lane section or a piece of one: between two stations, lanes by id, from the middle outwards on each side.

    Attributes:
        name: Number of the section as the file has it; of a further piece with the piece's number behind a dot.
    """

    name: str
    start_m: float
    end_m: float
    left: tuple[LaneRecord, ...]
    right: tuple[LaneRecord, ...]

    @property
    def records(self) -> tuple[LaneRecord, ...]:
        """All its lanes."""
        return (*self.left, *self.right)


Speeds = Sequence[tuple[float, float | None]]
"""(station, limit m/s) of a road, in order."""


def limit_mps(record: LaneRecord, speeds: Speeds, station_m: float) -> float | None:
    """Limit on a lane at a station: its own, else the road's; None where none is written."""
    own = record.speed_mps(station_m)
    return own if own is not None else next((speed for start, speed in reversed(speeds) if start <= station_m), None)


def sections_of(lanes: ET.Element, length_m: float, speeds: Speeds, road: str, remarks: Remarks) -> tuple[Section, ...]:
    """The lane sections of a road, cut where limits or markings change between their ends. Raises OpenDriveError."""
    known(lanes, {"laneOffset", "laneSection", "userData", "dataQuality"})
    nodes = sorted(lanes.findall("laneSection"), key=lambda one: _station(one, "s"))
    ends = [_station(one, "s") for one in nodes[1:]] + [length_m]
    whole: list[Section] = []
    for number_of, (node, end_m) in enumerate(zip(nodes, ends, strict=True)):
        section = _section(node, str(number_of), end_m, f"road {road!r}", remarks)
        if node.get("singleSide", "").casefold() == "true" and whole:
            whole[-1], section = _with_other_side(whole[-1], section)
        whole.append(section)
    return tuple(piece for section in whole for piece in _pieces(section, speeds))


def known(node: ET.Element, parts: Iterable[str]) -> None:
    """Refuse an element whose parts are not all known. Raises OpenDriveError."""
    strange = next((one.tag for one in node if one.tag not in parts), None)
    if strange is not None:
        raise OpenDriveError(f"<{node.tag}> holds a <{strange}>, which is not known and may change where lanes lie.")


def cubics(nodes: Iterable[ET.Element], key: str) -> Cubics:
    """Records of a cubic polynomial. Raises OpenDriveError."""
    pieces = [(_station(one, key), *(number(one, name) for name in "abcd")) for one in nodes]
    return Cubics(pieces)  # pyright: ignore[reportArgumentType]


def _station(node: ET.Element, key: str) -> float:
    return number(node, key, low=-1.0, high=MOST_ROAD_M)


def _section(node: ET.Element, name: str, end_m: float, where: str, remarks: Remarks) -> Section:
    known(node, {"left", "center", "right", "userData", "dataQuality"})
    start_m = _station(node, "s")
    sides: dict[str, list[LaneRecord]] = {}
    for side, sign in (("left", 1), ("right", -1)):
        found = [
            _lane(lane, side, start_m, f"{where}, section {name}", remarks)
            for group in node.findall(side)
            for lane in _lane_nodes(group)
        ]
        sides[side] = sorted(found, key=lambda one: abs(one.id))
        ids = [one.id for one in sides[side]]
        if any(one * sign <= 0 for one in ids) or len({*ids}) < len(ids):
            raise OpenDriveError(f"section {name} has lanes {ids} on its {side}.")
        # What is no lane of a car only matters for where the lanes outside of it lie.
        last = max((k for k, one in enumerate(sides[side]) if one.kind is not None), default=-1)
        for one in sides[side][: last + 1]:
            if one.border is None and not one.widths.known:
                raise OpenDriveError(f"lane {one.id} of section {name} has neither a <width> nor a <border>.")
    return Section(name, start_m, end_m, tuple(sides["left"]), tuple(sides["right"]))


def _lane_nodes(group: ET.Element) -> list[ET.Element]:
    known(group, {"lane", "userData", "dataQuality"})
    return group.findall("lane")


def _lane(node: ET.Element, side: str, start_m: float, where: str, remarks: Remarks) -> LaneRecord:
    known(node, _LANE_PARTS)
    name = lane_id(node)
    where = f"{where}, lane {name}"
    written = node.get("type", "none")
    plain = written.strip().casefold()
    kind = LANE_KINDS.get(plain)
    if kind is None and plain not in _NO_LANES:
        remarks.add(f"lanes of the unknown type {quoted(written)} are left out", where)
        node.set("type", "none")
    elif plain in _RAILS:
        remarks.add("rails are left out: no train drives there", where)
    way = node.get("direction", "standard").casefold()
    if way == "both":
        kind = None if kind is None else "aisle"
    elif way != "standard":
        raise OpenDriveError(f"lane {name} is driven in the direction {quoted(way)}, which is not known here.")
    if node.find("access") is not None and kind == "driving":
        remarks.add("who may drive on a lane (access) is not read", where)
    widths, borders = node.findall("width"), node.findall("border")
    return LaneRecord(
        id=name,
        type=written,
        kind=kind,
        origin_m=start_m,
        widths=cubics(widths, "sOffset"),
        border=cubics(borders, "sOffset") if borders and not widths else None,
        before=linked_lane(node.find("link/predecessor"), where, remarks),
        after=linked_lane(node.find("link/successor"), where, remarks),
        speeds=tuple(sorted(_speeds(node, start_m, where, remarks), key=lambda one: one[0])),
        marks=tuple(sorted(_marks(node, side, start_m, where, remarks), key=lambda one: one[0])),
    )


def _speeds(node: ET.Element, start_m: float, where: str, remarks: Remarks) -> Iterator[tuple[float, float | None]]:
    for one in node.findall("speed"):
        at = offset_m(one, where, remarks)
        if at is not None:
            yield start_m + at, speed_of(one, where, remarks)


def _marks(
    node: ET.Element, side: str, start_m: float, where: str, remarks: Remarks
) -> Iterator[tuple[float, bool, bool]]:
    inwards, outwards = ("decrease", "increase") if side == "left" else ("increase", "decrease")
    for one in node.findall("roadMark"):
        at = offset_m(one, where, remarks)
        # Where a marking begins is not known: none is crossed along the whole lane.
        ways = () if at is None else _crossed(one, where, remarks)
        yield start_m + (at or 0.0), inwards in ways, outwards in ways


def _crossed(mark: ET.Element, where: str, remarks: Remarks) -> tuple[str, ...]:
    """Directions of lane ids in which a marking may be crossed; where it does not say, only broken lines may be."""
    written = mark.get("laneChange")
    if written is None or not written.strip():
        kind = " ".join(mark.get("type", "none").casefold().split())
        return _WAYS["both"] if kind in _CROSSABLE else ()
    ways = _WAYS.get(written.strip().casefold())
    if ways is None:
        remarks.add(f"a marking with laneChange={quoted(written)} is taken for one that none may cross", where)
        mark.set("laneChange", "none")
    return ways or ()


def _with_other_side(last: Section, section: Section) -> tuple[Section, Section]:
    """(last, section) where the section says something of one side alone: the lanes at its other side go on."""
    if section.left and not section.right:
        return replace(last, right=_going_on(last.right)), replace(section, right=_gone_on(last.right))
    if section.right and not section.left:
        return replace(last, left=_going_on(last.left)), replace(section, left=_gone_on(last.left))
    return last, section


def _going_on(records: Iterable[LaneRecord]) -> tuple[LaneRecord, ...]:
    return tuple(replace(one, after=one.id) for one in records)


def _gone_on(records: Iterable[LaneRecord]) -> tuple[LaneRecord, ...]:
    return tuple(replace(one, before=one.id) for one in records)


def _pieces(section: Section, speeds: Speeds) -> Iterator[Section]:
    """A section cut where what its lanes allow changes by more than the sense of a cut."""
    cuts = [section.start_m, *_cuts(section, speeds), section.end_m]
    for part, (start_m, end_m) in enumerate(pairwise(cuts)):
        first, last = part == 0, part == len(cuts) - 2
        left, right = section.left, section.right
        if not first:
            left, right = _gone_on(left), _gone_on(right)
        if not last:
            left, right = _going_on(left), _going_on(right)
        yield Section(section.name if first else f"{section.name}.{part}", start_m, end_m, left, right)


def _cuts(section: Section, speeds: Speeds) -> Iterator[float]:
    changes = {station for station, _ in speeds}
    changes |= {one[0] for record in section.records for one in (*record.speeds, *record.marks)}
    at = section.start_m
    for station in sorted(changes):
        if not at + _LEAST_CUT_M <= station <= section.end_m - _LEAST_CUT_M:
            continue
        if _allowed(section, speeds, station - _LEAST_CUT_M) != _allowed(section, speeds, station):
            yield station
            at = station


def _allowed(section: Section, speeds: Speeds, station_m: float) -> tuple[object, ...]:
    """Lane changes that a section allows at a station."""
    found: list[object] = []
    for side in (section.left, section.right):
        for record, outer in zip_longest(side, side[1:]):
            if record.kind is None:
                continue
            if record.kind not in CLOSED:
                found.append(limit_mps(record, speeds, station_m))
                if outer is not None and outer.kind is not None and outer.kind not in CLOSED:
                    found.append(record.crossed(station_m))
    return tuple(found)
