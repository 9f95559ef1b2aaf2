"""Roadside records: signals, references to them, objects."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TypeVar
from xml.etree import ElementTree as ET

import numpy as np

from chauffeur.geometry.opendrive.document import Document, OpenDriveRoad
from chauffeur.geometry.opendrive.values import OpenDriveError, Remarks, lane_id, number, quoted, speed_mps

_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class RoadSignal:
    """A signal or a reference to one: a light, a sign.

    Attributes:
        id: Of the signal itself, also in a reference.
        road: Road that it is written at.
        station_m, offset_m: Station on that road's reference line and leftward distance from it.
        x_m, y_m: Where that is.
        heading_rad: Driving direction that it is for.
        type, subtype, value, name: As written; empty in a reference.
        dynamic: Whether what it shows changes.
        orientation: "+" for traffic along the reference line, "-" against it, "none" for both.
        lanes: Ids (from, to) of the lanes that it is valid for; empty for all.
        reference: Whether this is a reference to a signal written elsewhere.
    """

    id: str
    road: str
    station_m: float
    offset_m: float
    x_m: float
    y_m: float
    heading_rad: float
    type: str
    subtype: str
    value: float | None
    unit: str
    name: str
    dynamic: bool
    orientation: str
    lanes: tuple[tuple[int, int], ...]
    reference: bool

    @property
    def speed_mps(self) -> float | None:
        """The speed that its value says, km/h where no unit stands there; None where it says none."""
        try:
            return None if self.value is None else speed_mps(str(self.value), self.unit or "km/h")
        except OpenDriveError:
            return None

    def rules(self, lane: int) -> bool:
        """True if it is for a lane of its road, driven on the right."""
        if (self.orientation == "+" and lane > 0) or (self.orientation == "-" and lane < 0):
            return False
        return not self.lanes or any(min(span) <= lane <= max(span) for span in self.lanes)


@dataclass(frozen=True, slots=True)
class RoadObject:
    """An object: crosswalk, stop line, building, bus stop, sign of an editor.

    Attributes:
        outline_m: Its corners in the plane; of one without an outline, the box of its length and width.
    """

    id: str
    road: str
    type: str
    subtype: str
    name: str
    station_m: float
    offset_m: float
    x_m: float
    y_m: float
    heading_rad: float
    length_m: float
    width_m: float
    orientation: str
    outline_m: tuple[tuple[float, float], ...]


def signals_of(document: Document) -> tuple[RoadSignal, ...]:
    """All signals and references of a file, in its order."""
    return tuple(_kept(document, "signals/*", ("signal", "signalReference"), _signal))


def objects_of(document: Document) -> tuple[RoadObject, ...]:
    """All objects of a file, in its order."""
    return tuple(_kept(document, "objects/*", ("object",), _object))


def _kept(
    document: Document, path: str, tags: tuple[str, ...], read: Callable[[OpenDriveRoad, ET.Element, Remarks], _T]
) -> Iterator[_T]:
    """Records at the roads; a record that cannot be read is left out, with a remark."""
    remarks = document.remarks
    for road in document.roads.values():
        for node in road.node.findall(path):
            if node.tag in tags:
                where = f"{node.tag} {quoted(node.get('id', ''))} of road {quoted(road.id)}"
                found = remarks.tried(where, lambda node=node, road=road: read(road, node, remarks), node)
                if found is not None:
                    yield found


def _place(road: OpenDriveRoad, station_m: float, offset_m: float) -> tuple[float, float, float]:
    x, y, heading = (float(one[0]) for one in road.line(np.array([station_m])))
    return x - offset_m * math.sin(heading), y + offset_m * math.cos(heading), heading


def _signal(road: OpenDriveRoad, node: ET.Element, remarks: Remarks) -> RoadSignal:
    station, offset = number(node, "s"), number(node, "t")
    x, y, heading = _place(road, station, offset)
    orientation = node.get("orientation", "none")
    against = orientation == "-" if not road.left_hand else orientation == "+"
    where = f"{node.tag} {quoted(node.get('id', ''))} of road {quoted(road.id)}"
    spans = [remarks.tried(where, lambda one=one: _span(one)) for one in node.findall("validity")]
    return RoadSignal(
        id=node.get("id", ""),
        road=road.id,
        station_m=station,
        offset_m=offset,
        x_m=x,
        y_m=y,
        heading_rad=heading + (math.pi if against else 0.0),
        type=node.get("type", ""),
        subtype=node.get("subtype", ""),
        value=remarks.tried(f"value of {where}", lambda: number(node, "value")) if node.get("value") else None,
        unit=node.get("unit", ""),
        name=node.get("name", ""),
        dynamic=node.get("dynamic") == "yes",
        orientation=orientation,
        lanes=tuple(one for one in spans if one is not None),
        reference=node.tag == "signalReference",
    )


def _span(node: ET.Element) -> tuple[int, int]:
    return lane_id(node, "fromLane"), lane_id(node, "toLane")


def _object(road: OpenDriveRoad, node: ET.Element, remarks: Remarks) -> RoadObject:
    del remarks
    station, offset = number(node, "s"), number(node, "t")
    x, y, heading = _place(road, station, offset)
    heading += number(node, "hdg", 0.0)
    length, width = number(node, "length", 0.0), number(node, "width", 0.0)
    return RoadObject(
        id=node.get("id", ""),
        road=road.id,
        type=node.get("type", ""),
        subtype=node.get("subtype", ""),
        name=node.get("name", ""),
        station_m=station,
        offset_m=offset,
        x_m=x,
        y_m=y,
        heading_rad=heading,
        length_m=length,
        width_m=width,
        orientation=node.get("orientation", "none"),
        outline_m=tuple(_outline(node, road, x, y, heading, length, width)),
    )


def _outline(
    node: ET.Element, road: OpenDriveRoad, x: float, y: float, heading: float, length: float, width: float
) -> Iterator[tuple[float, float]]:
    cos, sin = math.cos(heading), math.sin(heading)
    outline = node.find("outline")
    if outline is None:
        outline = node.find("outlines/outline")
    corners = [] if outline is None else list(outline)
    local = [(number(one, "u"), number(one, "v")) for one in corners if one.tag == "cornerLocal"]
    for one in corners:
        if one.tag == "cornerRoad":
            yield _place(road, number(one, "s"), number(one, "t"))[:2]
    if not corners and length > 0.0 and width > 0.0:
        a, b = length / 2.0, width / 2.0
        local = [(a, b), (a, -b), (-a, -b), (-a, b)]
    for u, v in local:
        yield x + u * cos - v * sin, y + u * sin + v * cos
