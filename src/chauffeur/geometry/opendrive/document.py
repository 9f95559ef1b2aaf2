"""An OpenDRIVE file as records: roads, lane sections, lanes, links and junctions, as written."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final
from xml.etree import ElementTree as ET

import numpy as np

from chauffeur.geometry.opendrive.curves import Cubics, Piece, ReferenceLine

_MPS: Final = {"m/s": 1.0, "km/h": 1.0 / 3.6, "mph": 0.44704, "": 1.0}


class OpenDriveError(ValueError):
    """The file is no OpenDRIVE, or says something that cannot be read; the message says where."""


@dataclass(frozen=True, slots=True)
class RoadEnd:
    """What a road's end leads to: a road (and which of its ends), or a junction."""

    element: str
    id: str
    at_start: bool


@dataclass(frozen=True)
class LaneRecord:
    """A lane of a lane section.

    Attributes:
        id: Positive to the left of the reference line, negative to its right.
        type: As written: driving, shoulder, sidewalk ...
        widths: Width as function of the distance from the section's start.
        before, after: Lane of the previous and the next section (or road) along the reference line.
        speed_mps: Its own speed record, None without one.
        inwards, outwards: Whether the marking on its outer side lets one change over it: towards smaller ids (in size),
            towards larger ones.
    """

    id: int
    type: str
    widths: Cubics
    before: int | None
    after: int | None
    speed_mps: float | None
    inwards: bool
    outwards: bool


@dataclass(frozen=True)
class Section:
    """A lane section: between two stations, lanes by id, from the reference line outwards on each side."""

    start_m: float
    end_m: float
    left: tuple[LaneRecord, ...]
    right: tuple[LaneRecord, ...]


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
    speeds: tuple[tuple[float, float | None], ...]
    node: ET.Element

    def heading_rad(self, station_m: float) -> float:
        """Heading of the reference line at a station."""
        return float(self.line(np.array([station_m]))[2][0])

    def speed_mps(self, station_m: float) -> float | None:
        """Speed limit of the road type at a station, None where none is written."""
        found: float | None = None
        for start_m, speed in self.speeds:
            if start_m <= station_m + 1e-6:
                found = speed
        return found


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
    """Everything of a file that the network is made of."""

    name: str
    geo_reference: str
    roads: dict[str, OpenDriveRoad]
    connections: tuple[Connection, ...]
    junctions: dict[str, str]
    controllers: dict[str, tuple[str, ...]]
    junction_controllers: dict[str, tuple[str, ...]]


def number(node: ET.Element, key: str, default: float | None = None) -> float:
    """A finite number of an attribute. Raises OpenDriveError where it is missing or none."""
    text = node.get(key)
    if text is None:
        if default is None:
            raise OpenDriveError(f"<{node.tag}> has no {key!r}.")
        return default
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise OpenDriveError(f"<{node.tag}> has {key}={text!r}, which is no number.")
    return value


def parse(text: str | bytes) -> Document:
    """The records of a file's text. Raises OpenDriveError."""
    try:
        root = ET.fromstring(text)  # noqa: S314 - expat refuses entity bombs since 2.4.1; no external entity is loaded
    except ET.ParseError as error:
        raise OpenDriveError(f"No XML: {error}.") from error
    for node in root.iter():
        if "}" in node.tag:  # 1.8 has a namespace
            node.tag = node.tag.rpartition("}")[2]
    if root.tag != "OpenDRIVE":
        raise OpenDriveError(f"No OpenDRIVE: the root element is <{root.tag}>.")
    header = root.find("header")
    roads = {road.id: road for road in (_road(node) for node in root.findall("road"))}
    if not roads:
        raise OpenDriveError("An OpenDRIVE file without a road.")
    junctions, owners = root.findall("junction"), root.findall("controller")
    return Document(
        name="" if header is None else header.get("name", ""),
        geo_reference="" if header is None else (header.findtext("geoReference") or "").strip(),
        roads=roads,
        connections=tuple(one for node in junctions for one in _connections(node)),
        junctions={node.get("id", ""): node.get("name", "") for node in junctions},
        controllers={
            node.get("id", ""): tuple(dict.fromkeys(one.get("signalId", "") for one in node.findall("control")))
            for node in owners
        },
        junction_controllers={
            node.get("id", ""): tuple(one.get("id", "") for one in node.findall("controller")) for node in junctions
        },
    )


def _road(node: ET.Element) -> OpenDriveRoad:
    name = node.get("id", "")
    try:
        return _read_road(node, name)
    except OpenDriveError as error:
        raise OpenDriveError(f"Road {name!r}: {error}") from error


def _read_road(node: ET.Element, name: str) -> OpenDriveRoad:
    length = number(node, "length")
    pieces = tuple(sorted((_piece(one) for one in node.findall("planView/geometry")), key=lambda one: one.start_m))
    if not pieces:
        raise OpenDriveError("it has no plan view.")
    starts = sorted(node.findall("lanes/laneSection"), key=lambda one: number(one, "s"))
    ends = [number(one, "s") for one in starts[1:]] + [length]
    return OpenDriveRoad(
        id=name,
        name=node.get("name", ""),
        junction="" if node.get("junction", "-1") == "-1" else node.get("junction", ""),
        length_m=length,
        left_hand=node.get("rule", "RHT") == "LHT",
        line=ReferenceLine(pieces),
        offset=_cubics(node.findall("lanes/laneOffset"), "s"),
        elevation=_cubics(node.findall("elevationProfile/elevation"), "s"),
        sections=tuple(_section(one, end) for one, end in zip(starts, ends, strict=True)),
        before=_end(node.find("link/predecessor")),
        after=_end(node.find("link/successor")),
        speeds=tuple(sorted((number(one, "s", 0.0), _speed(one.find("speed"))) for one in node.findall("type"))),
        node=node,
    )


def _piece(node: ET.Element) -> Piece:
    shape = next((one for one in node if one.tag in _SHAPES), None)
    if shape is None:
        raise OpenDriveError(f"a geometry of unknown shape at s={node.get('s')}.")
    return Piece(
        start_m=number(node, "s"),
        x_m=number(node, "x"),
        y_m=number(node, "y"),
        heading_rad=number(node, "hdg"),
        length_m=number(node, "length"),
        kind=shape.tag,
        factors=tuple(number(shape, key) for key in _SHAPES[shape.tag]),
        normalised=shape.get("pRange", "normalized") == "normalized",
    )


_SHAPES: Final[dict[str, tuple[str, ...]]] = {
    "line": (),
    "arc": ("curvature",),
    "spiral": ("curvStart", "curvEnd"),
    "poly3": ("a", "b", "c", "d"),
    "paramPoly3": ("aU", "bU", "cU", "dU", "aV", "bV", "cV", "dV"),
}


def _cubics(nodes: list[ET.Element], key: str) -> Cubics:
    return Cubics([(number(one, key), *(number(one, name) for name in "abcd")) for one in nodes])  # type: ignore[misc]


def _section(node: ET.Element, end_m: float) -> Section:
    sides = {side: sorted(_lanes(node, side), key=lambda one: abs(one.id)) for side in ("left", "right")}
    return Section(number(node, "s"), end_m, tuple(sides["left"]), tuple(sides["right"]))


def _lanes(section: ET.Element, side: str) -> Iterator[LaneRecord]:
    for node in section.findall(f"{side}/lane"):
        before, after = node.find("link/predecessor"), node.find("link/successor")
        allowed = {way for mark in node.findall("roadMark") for way in _crossed(mark)}
        inwards, outwards = ("decrease", "increase") if side == "left" else ("increase", "decrease")
        yield LaneRecord(
            id=int(number(node, "id")),
            type=node.get("type", "none"),
            widths=_cubics(node.findall("width"), "sOffset"),
            before=None if before is None else int(number(before, "id")),
            after=None if after is None else int(number(after, "id")),
            speed_mps=_speed(node.find("speed")),
            inwards=inwards in allowed,
            outwards=outwards in allowed,
        )


def _crossed(mark: ET.Element) -> tuple[str, ...]:
    """Directions of lane ids in which a marking may be crossed; where it does not say, solid lines may not."""
    written = mark.get("laneChange")
    if written is None:
        written = "none" if "solid" in mark.get("type", "") or mark.get("type") == "curb" else "both"
    return ("increase", "decrease") if written == "both" else (written,)


def _end(node: ET.Element | None) -> RoadEnd | None:
    if node is None:
        return None
    return RoadEnd(node.get("elementType", "road"), node.get("elementId", ""), node.get("contactPoint") != "end")


def _speed(node: ET.Element | None) -> float | None:
    if node is None or node.get("max") in (None, "no limit", "undefined"):
        return None
    unit = node.get("unit", "")
    if unit not in _MPS:
        raise OpenDriveError(f"a speed in {unit!r}.")
    speed = number(node, "max") * _MPS[unit]
    return speed if speed > 0.0 else None


def _connections(node: ET.Element) -> Iterator[Connection]:
    for one in node.findall("connection"):
        yield Connection(
            junction=node.get("id", ""),
            incoming=one.get("incomingRoad", ""),
            connecting=one.get("connectingRoad", ""),
            at_start=one.get("contactPoint") != "end",
            lanes=tuple((int(number(link, "from")), int(number(link, "to"))) for link in one.findall("laneLink")),
        )
