"""An OpenDRIVE file as records: roads, lane sections, lanes, links and junctions, as written."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final
from xml.etree import ElementTree as ET

import numpy as np

from chauffeur.geometry.opendrive.curves import Cubics, Piece, ReferenceLine
from chauffeur.geometry.opendrive.sections import Section, Speeds, cubics, known, sections_of
from chauffeur.geometry.opendrive.values import (
    MOST_ROAD_M,
    OpenDriveError,
    Remarks,
    lane_id,
    number,
    quoted,
    speed_of,
)

MAX_BYTES: Final = 200_000_000
"""A larger file is not read: the largest of CARLA's towns has 3.4 MB, a motorway network some tens."""
_MOST_LANES_KM: Final = 5_000.0
"""Lanes of a large city; each is sampled every half metre."""
_ROAD_PARTS: Final = frozenset({
    "link", "type", "planView", "elevationProfile", "lateralProfile", "lanes", "objects", "signals", "surface",
    "railroad", "userData", "dataQuality",
})  # fmt: skip
_MINOR: Final = 8
"""The newest minor version whose elements are known here."""
_OFF_M: Final = 1.0
"""A plan view may differ so much, or by a hundredth, from the length that its road states."""
_STEEP_RAD: Final = 0.2
"""Superelevation from which lanes are more than 2 % narrower in the plane than along the slope."""
_MOST_CURVATURE: Final = 100.0
"""1/m: a bend of a centimetre's radius, as editors make where kerbs meet."""


@dataclass(frozen=True, slots=True)
class RoadEnd:
    """Link at a road's end: a road (and which of its ends), or a junction."""

    element: str
    id: str
    at_start: bool


@dataclass(frozen=True)
class OpenDriveRoad:
    """A road: reference line, lane offset, lane sections and what its ends lead to."""

    id: str
    name: str
    junction: str
    length_m: float
    left_hand: bool
    line: ReferenceLine
    offset: Cubics
    elevation: Cubics
    sections: tuple[Section, ...]
    before: RoadEnd | None
    after: RoadEnd | None
    speeds: Speeds
    node: ET.Element

    def heading_rad(self, station_m: float) -> float:
        """Heading of the reference line at a station."""
        return float(self.line(np.array([station_m]))[2][0])


@dataclass(frozen=True, slots=True)
class Connection:
    """A way through a junction: lanes of the incoming road and where they go on, on the connecting road."""

    junction: str
    incoming: str
    connecting: str
    at_start: bool
    lanes: tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class Document:
    """Everything of a file that the network is made of; `remarks` holds what could not be taken as written."""

    name: str
    geo_reference: str
    roads: dict[str, OpenDriveRoad]
    connections: tuple[Connection, ...]
    junctions: dict[str, str]
    controllers: dict[str, tuple[str, ...]]
    junction_controllers: dict[str, tuple[str, ...]]
    remarks: Remarks = field(compare=False)
    root: ET.Element = field(compare=False)

    def plain(self) -> ET.Element:
        """The file without what was left out, with usual spellings: for programs that take less. The caller's own."""
        root = copy.deepcopy(self.root)
        originals, copies = self.root.iter(), root.iter()
        twins = dict(zip(originals, copies, strict=True))
        parents = {child: parent for parent in root.iter() for child in parent}
        for node in map(twins.__getitem__, self.remarks.dropped):
            if node in parents[node]:
                parents[node].remove(node)
        return root


def parse(text: str | bytes) -> Document:
    """The records of a file's text. Raises OpenDriveError."""
    if len(text) > MAX_BYTES:
        raise OpenDriveError(f"It has {len(text) / 1e6:.0f} MB; at most {MAX_BYTES / 1e6:.0f} MB are read.")
    try:
        root = ET.fromstring(text)  # noqa: S314 - expat refuses entity bombs since 2.4.1; no external entity is loaded
    except (ET.ParseError, ValueError, LookupError) as error:  # a encoding that it names and Python does not know
        raise OpenDriveError(f"No XML: {error}.") from error
    for node in root.iter():
        if "}" in node.tag:  # 1.8 has a namespace
            node.tag = node.tag.rpartition("}")[2]
    if root.tag != "OpenDRIVE":
        raise OpenDriveError(f"No OpenDRIVE: the root element is <{root.tag}>.")
    remarks = Remarks()
    header = root.find("header")
    _look_at_version(header, remarks)
    if root.find(".//include") is not None:
        raise OpenDriveError("It includes another file (<include>), which is not read: put it into this one.")
    roads: dict[str, OpenDriveRoad] = {}
    for node in root.findall("road"):
        road = _road(node, remarks)
        if road.id in roads:
            raise OpenDriveError(f"Two roads have the id {road.id!r}.")
        roads[road.id] = road
    if not roads:
        raise OpenDriveError("An OpenDRIVE file without a road.")
    lanes_km = sum((one.end_m - one.start_m) * len(one.records) for road in roads.values() for one in road.sections)
    if lanes_km / 1000.0 > _MOST_LANES_KM:
        raise OpenDriveError(f"It has {lanes_km / 1000.0:.0f} km of lanes; at most {_MOST_LANES_KM:.0f} are read.")
    left_hand = [road.id for road in roads.values() if road.left_hand]
    if left_hand and len(left_hand) < len(roads):
        remarks.add("some roads keep left and others right", f"left: {len(left_hand)} of {len(roads)} roads")
    junctions, owners = root.findall("junction"), root.findall("controller")
    return Document(
        name="" if header is None else header.get("name", ""),
        geo_reference="" if header is None else (header.findtext("geoReference") or "").strip(),
        roads=roads,
        connections=tuple(one for node in junctions for one in _connections(node, roads, remarks)),
        junctions={node.get("id", ""): node.get("name", "") for node in junctions},
        controllers={
            node.get("id", ""): tuple(dict.fromkeys(one.get("signalId", "") for one in node.findall("control")))
            for node in owners
        },
        junction_controllers={
            node.get("id", ""): tuple(one.get("id", "") for one in node.findall("controller")) for node in junctions
        },
        remarks=remarks,
        root=root,
    )


def _look_at_version(header: ET.Element | None, remarks: Remarks) -> None:
    major, minor = ("", "") if header is None else (header.get("revMajor", ""), header.get("revMinor", ""))
    if major.strip().isdecimal() and int(major[:9]) != 1:
        raise OpenDriveError(f"It is of OpenDRIVE {quoted(major)}; versions 1.0 to 1.{_MINOR} are read.")
    if minor.strip().isdecimal() and int(minor[:9]) > _MINOR:
        remarks.add(f"a version newer than 1.{_MINOR} may say what is not known here", f"OpenDRIVE 1.{minor[:9]}")


def _road(node: ET.Element, remarks: Remarks) -> OpenDriveRoad:
    name = node.get("id", "")
    try:
        return _read_road(node, name, remarks)
    except OpenDriveError as error:
        raise OpenDriveError(f"Road {quoted(name)}: {error}") from error


def _read_road(node: ET.Element, name: str, remarks: Remarks) -> OpenDriveRoad:
    where = f"road {quoted(name)}"
    for part in node:
        if part.tag not in _ROAD_PARTS:
            remarks.add(f"a <{part.tag}> is not known and not read", where)
    if (rails := node.find("railroad")) is not None and len(rails):
        remarks.add("rails are left out: no train drives there", where)
    length = number(node, "length", low=0.0, high=MOST_ROAD_M)
    rule = node.get("rule", "RHT").strip().upper()
    if rule not in ("RHT", "LHT"):
        raise OpenDriveError(f"it keeps to the side {quoted(rule)}, which is neither RHT nor LHT.")
    plan, lanes = node.find("planView"), node.find("lanes")
    if plan is not None:
        known(plan, ("geometry", "userData", "dataQuality"))
    speeds = tuple(sorted(_limits(node, where, remarks), key=lambda one: one[0]))
    _look_at_slope(node, where, remarks)
    return OpenDriveRoad(
        id=name,
        name=node.get("name", ""),
        junction="" if node.get("junction", "-1") == "-1" else node.get("junction", ""),
        length_m=length,
        left_hand=rule == "LHT",
        line=ReferenceLine(_plan(plan, length)),
        offset=cubics(node.findall("lanes/laneOffset"), "s"),
        elevation=_heights(node, where, remarks),
        sections=() if lanes is None else sections_of(lanes, length, speeds, name, remarks),
        before=_end(node.find("link/predecessor"), where, remarks),
        after=_end(node.find("link/successor"), where, remarks),
        speeds=speeds,
        node=node,
    )


def _limits(node: ET.Element, where: str, remarks: Remarks) -> Iterator[tuple[float, float | None]]:
    for one in node.findall("type"):
        at = remarks.tried(where, lambda one=one: number(one, "s", 0.0), one)
        if at is not None:
            yield at, speed_of(one.find("speed"), where, remarks)


def _heights(node: ET.Element, where: str, remarks: Remarks) -> Cubics:
    """Elevation tells roads over one another apart and nothing else: an odd record costs itself."""
    kept = [
        one
        for one in node.findall("elevationProfile/elevation")
        if remarks.tried(where, lambda one=one: cubics([one], "s"), one) is not None
    ]
    return cubics(kept, "s")


def _look_at_slope(node: ET.Element, where: str, remarks: Remarks) -> None:
    for one in node.findall("lateralProfile/superelevation"):
        slope = remarks.tried(where, lambda one=one: number(one, "a", 0.0), one)
        if slope is not None and abs(slope) > _STEEP_RAD:
            remarks.add("superelevation is not read: lanes are as wide in the plane as along the slope", where)


# Plan view ------------------------------------------------------------------------------------------------------------


def _plan(plan: ET.Element | None, length_m: float) -> tuple[Piece, ...]:
    pieces = tuple(sorted(() if plan is None else map(_piece, plan.findall("geometry")), key=lambda one: one.start_m))
    if not pieces:
        raise OpenDriveError("it has no plan view.")
    ends = [one.start_m for one in pieces[1:]] + [length_m]
    off = max(_OFF_M, length_m / 100.0)
    for piece, end_m in zip(pieces, ends, strict=True):
        if abs(piece.start_m + piece.length_m - end_m) > off:
            raise OpenDriveError(
                f"its geometry at s={piece.start_m:g} is {piece.length_m:g} m long, and goes on to s={end_m:g}."
            )
    if pieces[0].start_m > off:
        raise OpenDriveError(f"its plan view begins at s={pieces[0].start_m:g}.")
    return pieces


def _piece(node: ET.Element) -> Piece:
    shape = next((one for one in node if one.tag in _SHAPES), None)
    if shape is None:
        strange = next((one.tag for one in node if one.tag != "userData"), "none")
        raise OpenDriveError(f"a geometry of unknown shape <{strange}> at s={node.get('s')}.")
    known(node, (shape.tag, "userData", "dataQuality"))
    spread = shape.get("pRange", "normalized").strip().casefold()
    if shape.tag == "paramPoly3" and spread not in ("normalized", "arclength"):
        raise OpenDriveError(f"<paramPoly3> has pRange={quoted(spread)}, which is neither normalized nor arcLength.")
    most = _MOST_CURVATURE if shape.tag in ("arc", "spiral") else math.inf
    return Piece(
        start_m=number(node, "s", low=-1.0, high=MOST_ROAD_M),
        x_m=number(node, "x"),
        y_m=number(node, "y"),
        heading_rad=number(node, "hdg"),
        length_m=number(node, "length", low=0.0, high=MOST_ROAD_M),
        kind=shape.tag,
        factors=tuple(number(shape, key, low=-most, high=most) for key in _SHAPES[shape.tag]),
        normalised=spread == "normalized",
    )


_SHAPES: Final[dict[str, tuple[str, ...]]] = {
    "line": (),
    "arc": ("curvature",),
    "spiral": ("curvStart", "curvEnd"),
    "poly3": ("a", "b", "c", "d"),
    "paramPoly3": ("aU", "bU", "cU", "dU", "aV", "bV", "cV", "dV"),
}


# Links ----------------------------------------------------------------------------------------------------------------


def _end(node: ET.Element | None, where: str, remarks: Remarks) -> RoadEnd | None:
    if node is None:
        return None
    element, contact = node.get("elementType", "road"), node.get("contactPoint")
    name = node.get("elementId", "")
    if name.strip() and element == "junction":
        return RoadEnd(element, name, contact != "end")
    if name.strip() and element == "road" and contact in ("start", "end"):
        return RoadEnd(element, name, contact == "start")
    remarks.dropped.append(node)
    if name.strip():
        # With elementS it leads into the middle of a road.
        what = f"a link to a {quoted(element)}" if element != "road" else "a link to neither start nor end of a road"
        remarks.add(f"{what} is left out", where)
    return None


def _connections(node: ET.Element, roads: dict[str, OpenDriveRoad], remarks: Remarks) -> Iterator[Connection]:
    name, kind = node.get("id", ""), node.get("type", "default")
    where = f"junction {quoted(name)}"
    if kind == "virtual" and node.find("connection") is not None:
        # Its ways leave a road that is not cut there.
        remarks.add("virtual junctions are not read: the ways that branch off there lead nowhere", where)
        remarks.dropped.append(node)
        return
    for one in node.findall("connection"):
        contact = one.get("contactPoint")
        direct = one.get("connectingRoad") is None and one.get("linkedRoad") is not None
        incoming, onto = one.get("incomingRoad", ""), one.get("linkedRoad" if direct else "connectingRoad", "")
        if incoming not in roads or onto not in roads or contact not in ("start", "end", None):
            remarks.add("a connection without known roads is left out", f"{where}, connection {one.get('id')}")
            remarks.dropped.append(one)
            continue
        at_start = contact != "end"
        links = (_lane_link(link, where, remarks) for link in one.findall("laneLink"))
        lanes = tuple(link for link in links if link is not None) or tuple(_told_by_lanes(roads[onto], at_start))
        yield Connection(name, incoming, onto, at_start, lanes)
        if direct:
            # Where a road ends in several without a way between, each leads into the other.
            before = roads[incoming].before
            starts = before is not None and before.element == "junction" and before.id == name
            yield Connection(name, onto, incoming, starts, tuple((two, one) for one, two in lanes))


def _lane_link(node: ET.Element, where: str, remarks: Remarks) -> tuple[int, int] | None:
    return remarks.tried(where, lambda: (lane_id(node, "from"), lane_id(node, "to")), node)


def _told_by_lanes(road: OpenDriveRoad, at_start: bool) -> Iterator[tuple[int, int]]:
    """Lane links that a connection leaves to the lanes of its road."""
    if road.sections:
        section = road.sections[0 if at_start else -1]
        for record in section.records:
            came_from: int | None = record.before if at_start else record.after
            if came_from is not None:
                yield came_from, record.id
