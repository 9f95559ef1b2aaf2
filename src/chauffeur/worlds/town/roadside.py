"""Lights, signs, crossings and landmarks of an OpenDRIVE file, laid onto the lanes."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final, Literal
from xml.etree import ElementTree as ET

from chauffeur.concept import DataError, Sign
from chauffeur.geometry import Lane, LaneId, Polyline, RoadGraph, wrap_to_pi
from chauffeur.geometry.opendrive import OpenDriveMap, RoadObject, RoadSignal
from chauffeur.worlds.town.pack import Crossing, Line, Place, Point, SignalGroup, SignalHead, SignalPhase
from chauffeur.worlds.town.signals import across, box_at, junction_of

LIGHT_TYPES: Final = frozenset({"1000001", "1000002", "1000009", "1000010", "1000011", "1000012"})
"""Traffic lights for vehicles, in the numbering of OpenDRIVE 1.4 that CARLA and editors use."""
SIGN_TYPES: Final[dict[str, Literal["stop", "yield", "speed_limit"]]] = {
    "206": "stop",
    "205": "yield",
    "274": "speed_limit",
}
"""German catalogue, as CARLA's importer reads it."""
GREEN_S, YELLOW_S, ALL_RED_S = 15.0, 5.0, 2.0
"""Of a cycle that no table gives: as most of CARLA's own."""
_SPEED_OBJECT: Final = re.compile(r"Speed_(\d+)")
"""Signs that CARLA's maps hold as objects; km/h, as CARLA shows them."""
_TOGETHER_RAD: Final = math.radians(45.0)
_NEAR_M: Final = 30.0
_SAME_JUNCTION_M: Final = 15.0
_BOX_DEPTH_M: Final = 3.0
_BEFORE_CROSSING_M: Final = 1.0
_AT_END_M: Final = 12.0


def lit_junctions(town: OpenDriveMap) -> tuple[str, ...]:
    """Junctions whose lanes a light rules: by references inside of them, or a light at a road that leads there."""
    found: dict[str, None] = {}
    for signal in town.signals:
        road = town.document.roads[signal.road]
        kind = signal.type or next((one.type for one in town.signals if one.id == signal.id and not one.reference), "")
        if kind not in LIGHT_TYPES:
            continue
        if road.junction:
            found[road.junction] = None
            continue
        end = road.before if signal.orientation == "-" else road.after
        if end is not None and end.element == "junction":
            found[end.id] = None
    return tuple(junction for junction in found if junction in town.road.junctions)


def approaches(road: RoadGraph, junction: str) -> tuple[tuple[LaneId, ...], ...]:
    """Driving lanes that lead into a junction, those of one road and direction together."""
    sides: dict[str, dict[LaneId, None]] = {}
    for lane in road.junctions.get(junction, ()):
        if lane.kind != "driving":
            continue
        for before in road.predecessors(lane.id):
            if before.junction != junction:
                sides.setdefault(before.road, {})[before.id] = None
    return tuple(tuple(sorted(lanes, key=lambda one: road[one].index)) for lanes in sides.values())


def guessed_group(road: RoadGraph, junction: str, crossings: Sequence[Crossing]) -> SignalGroup | None:
    """Lights for a junction without a table: a head an approach, opposite approaches together; None without two."""
    ways = approaches(road, junction)
    if len(ways) < 2:
        return None
    heads = tuple(_head_at(road, f"{junction}.{i}", lanes, crossings) for i, lanes in enumerate(ways))
    axes: list[float] = []
    turn_of_head: list[int] = []
    for lanes in ways:
        heading = float(road[lanes[0]].centre.headings[-1]) % math.pi
        fits = [k for k, axis in enumerate(axes) if min((d := abs(heading - axis)), math.pi - d) < _TOGETHER_RAD]
        if not fits:
            axes.append(heading)
        turn_of_head.append(fits[0] if fits else len(axes) - 1)
    if len(axes) == 1:  # roads that meet at a flat angle: one after the other
        turn_of_head, axes = list(range(len(ways))), [0.0] * len(ways)
    phases: list[SignalPhase] = []
    for turn in range(len(axes)):
        mine = [own == turn for own in turn_of_head]
        phases += [
            SignalPhase(ALL_RED_S, ("red",) * len(ways)),
            SignalPhase(GREEN_S, tuple("green" if one else "red" for one in mine)),
            SignalPhase(YELLOW_S, tuple("yellow" if one else "red" for one in mine)),
        ]
    return SignalGroup(junction, junction, heads, tuple(phases))


def _head_at(road: RoadGraph, name: str, lanes: Sequence[LaneId], crossings: Sequence[Crossing]) -> SignalHead:
    """A light at the end of lanes abreast, its stop line before the crossing that lies there."""
    back = 0.0
    for crossing in crossings:
        own = [lane for lane in lanes if lane in crossing.lanes]
        for station, _ in road[own[0]].centre.crossings(Polyline.of(crossing.centre_m)) if own else ():
            before = road[own[0]].length_m - station + crossing.width_m / 2.0 + _BEFORE_CROSSING_M
            if before < _AT_END_M:
                back = max(back, before)
    ends = [road[lane].centre.at(max(0.0, road[lane].length_m - back)) for lane in lanes]
    heading = ends[0].heading_rad
    width = sum(road[lane].width_m for lane in lanes)
    x, y = (sum(one) / len(ends) for one in zip(*((end.x_m, end.y_m) for end in ends), strict=True))
    return SignalHead(name, tuple(lanes), across(x, y, heading, width), box_at(x, y, heading, _BOX_DEPTH_M, width))


def net_junctions(road: RoadGraph, net: Path) -> tuple[str, ...]:
    """Junctions of the road graph that have lights in a SUMO network of the same town. Raises DataError, OSError."""
    try:
        root = ET.parse(net).getroot()  # noqa: S314 - expat refuses entity bombs
        offset = root.find("location")
        dx, dy = (float(one) for one in ("0,0" if offset is None else offset.get("netOffset", "0,0")).split(","))
        lit = [
            (float(one.get("x", "nan")) - dx, float(one.get("y", "nan")) - dy)
            for one in root.findall("junction")
            if one.get("type") == "traffic_light"
        ]
    except (ET.ParseError, ValueError) as error:
        raise DataError(f"{net} is no SUMO network that can be read: {error}.") from error
    middles = {name: _middle(lanes) for name, lanes in road.junctions.items()}
    found: dict[str, None] = {}
    for at in lit:
        closest = min(middles, key=lambda name: math.dist(at, middles[name]), default=None)
        if closest is not None and math.dist(at, middles[closest]) < _SAME_JUNCTION_M:
            found[closest] = None
    return tuple(found)


def _middle(lanes: Sequence[Lane]) -> Point:
    ends = [
        point
        for lane in lanes
        if lane.kind == "driving"
        for point in (lane.centre.points_m[0], lane.centre.points_m[-1])
    ]
    if not ends:
        return math.inf, math.inf
    return sum(x for x, _ in ends) / len(ends), sum(y for _, y in ends) / len(ends)


# Signs ----------------------------------------------------------------------------------------------------------------


def signs_of(town: OpenDriveMap) -> tuple[tuple[Sign, ...], dict[str, tuple[Point, ...]]]:
    """(signs, stop boxes) of a file: its signals of known types, and the speed signs that CARLA holds as objects."""
    signs: list[Sign] = []
    boxes: dict[str, tuple[Point, ...]] = {}
    for signal in town.signals:
        kind = SIGN_TYPES.get(signal.type)
        if kind is None or signal.reference:
            continue
        lanes = _beside(town.road, signal.x_m, signal.y_m, signal.heading_rad)
        if not lanes:
            continue
        if kind == "speed_limit":
            if signal.speed_mps is not None:
                signs.append(Sign(signal.id, kind, lanes, signal.x_m, signal.y_m, value=signal.speed_mps))
            continue
        line, (x, y), heading, width = _line_for(town, signal, lanes)
        signs.append(Sign(signal.id, kind, lanes, signal.x_m, signal.y_m, line))
        boxes[signal.id] = box_at(x, y, heading, _BOX_DEPTH_M, width)
    for thing in town.objects:
        told = _SPEED_OBJECT.match(thing.name)
        if told:
            lanes = _beside(town.road, thing.x_m, thing.y_m, _served_heading(town, thing))
            if lanes:
                speed = float(told[1]) / 3.6
                signs.append(Sign(thing.id, "speed_limit", lanes, thing.x_m, thing.y_m, value=speed))
    return tuple(signs), boxes


def _served_heading(town: OpenDriveMap, thing: RoadObject) -> float:
    """Driving direction of the traffic that an object stands at the right of (where one drives on the right)."""
    road = town.document.roads[thing.road]
    along = road.heading_rad(thing.station_m)
    return along + (math.pi if (thing.offset_m > 0.0) != road.left_hand else 0.0)


def _beside(road: RoadGraph, x_m: float, y_m: float, heading_rad: float) -> tuple[LaneId, ...]:
    """Driving lanes abreast of the one that a sign stands at."""
    place = road.locate(x_m, y_m, heading_rad, ("driving",))
    if place is None or abs(place.offset_m) > _NEAR_M:
        return ()
    askew = road[place.lane].centre.at(place.station_m).heading_rad - heading_rad
    if abs(wrap_to_pi(askew)) > math.pi / 2.0:
        return ()
    return tuple(one.id for one in road.abreast(place.lane) if one.kind == "driving")


def _line_for(town: OpenDriveMap, signal: RoadSignal, lanes: Sequence[LaneId]) -> tuple[Line, Point, float, float]:
    """Stop line of a sign: across its lanes where it stands."""
    poses = []
    for lane in lanes:
        centre = town.road[lane].centre
        poses.append(centre.at(min(max(centre.nearest(signal.x_m, signal.y_m), 0.0), centre.length_m)))
    width = sum(town.road[lane].width_m for lane in lanes)
    x, y = sum(one.x_m for one in poses) / len(poses), sum(one.y_m for one in poses) / len(poses)
    return across(x, y, poses[0].heading_rad, width), (x, y), poses[0].heading_rad, width


# Crossings and landmarks ----------------------------------------------------------------------------------------------


def crossings_of(town: OpenDriveMap) -> tuple[Crossing, ...]:
    """Crosswalks of a file, and the driving lanes that they cross."""
    return tuple(_crossings(town))


def _crossings(town: OpenDriveMap) -> Iterator[Crossing]:
    for thing in town.objects:
        corners = thing.outline_m[:-1] if thing.outline_m[:1] == thing.outline_m[-1:] else thing.outline_m
        corners = tuple(dict.fromkeys((round(x, 3), round(y, 3)) for x, y in corners))
        if thing.type != "crosswalk" or len(corners) < 3:
            continue
        cx, cy = (sum(one) / len(corners) for one in zip(*corners, strict=True))
        ux, uy = math.cos(thing.heading_rad), math.sin(thing.heading_rad)
        along = [(x - cx) * ux + (y - cy) * uy for x, y in corners]
        aside = [(y - cy) * ux - (x - cx) * uy for x, y in corners]
        if max(along) - min(along) < max(aside) - min(aside):
            along, aside, ux, uy = aside, along, -uy, ux
        centre = ((cx + min(along) * ux, cy + min(along) * uy), (cx + max(along) * ux, cy + max(along) * uy))
        way = Polyline.of(centre)
        reach = way.length_m / 2.0 + 1.0
        near = town.road.places(cx, cy, None, ("driving",), reach, math.pi)
        lanes = [one.lane for one in near if town.road[one.lane].centre.crossings(way)]
        junction = next((town.road[lane].junction for lane in lanes if town.road[lane].junction), "")
        yield Crossing(
            thing.id, corners, centre, max(aside) - min(aside), tuple(lanes), junction or junction_of(town.road, lanes)
        )


def places_of(town: OpenDriveMap) -> tuple[Place, ...]:
    """Buildings and stops of a file that have a name and say what they are (subtype), and where the road passes."""
    found: list[Place] = []
    for thing in town.objects:
        if thing.type not in ("building", "busStop") or not thing.name or not thing.subtype:
            continue
        place = town.road.locate(thing.x_m, thing.y_m, _served_heading(town, thing), ("driving",))
        if place is not None:
            found.append(Place(thing.name, thing.subtype, thing.x_m, thing.y_m, place.lane, place.station_m))
    return tuple(found)
