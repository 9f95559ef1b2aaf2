"""The SUMO network of a town: netconvert for topology and right of way, OpenDRIVE for where the lanes lie.

netconvert cuts roads back at junctions and draws the lanes inside them half a lane off (SUMO issues 10342, 16482). So
every lane that has a counterpart in the road graph gets that one's shape, length and speed limit.
"""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final
from xml.etree import ElementTree as ET

from chauffeur.concept import ChauffeurError, DataError, MissingExtraError
from chauffeur.geometry import LaneId, Polyline, RoadGraph, joined
from chauffeur.geometry.opendrive import OpenDriveMap

_LEAST_M: Final = 0.1
"""Shortest lane that SUMO takes."""
_SNAP_M: Final = 3.0
_MANY: Final = 10
_LEAST_ROAD_M: Final = 0.5
_TIMEOUT_S: Final = 300.0
_OPTIONS: Final = (
    "--opendrive.import-all-lanes",
    "--opendrive.curve-resolution=1",
    "--offset.disable-normalization",
    "--opendrive.internal-shapes",
    "--output.original-names",
    "--no-turnarounds",
    "--precision=3",
)


@dataclass
class ReshapedNet:
    """A network under work.

    Attributes:
        root: Its XML.
        lanes: SUMO lanes of each lane of the road graph, in driving order.
        graph_lanes: Lanes of the road graph of each SUMO lane.
        inside: SUMO lane inside a junction of each lane of the graph before it and after it.
        unmatched: Connections between driving lanes that the road graph does not have.
    """

    root: ET.Element
    lanes: dict[LaneId, list[str]] = field(default_factory=dict[LaneId, list[str]])
    graph_lanes: dict[str, list[LaneId]] = field(default_factory=dict[str, list[LaneId]])
    unmatched: list[str] = field(default_factory=list[str])


def convert(xodr: Path, town: OpenDriveMap, net: Path, junctions: Iterable[str]) -> None:
    """Make a SUMO network of an OpenDRIVE file as it was read, with traffic lights at the junctions named.

    Raises:
        MissingExtraError: netconvert is not installed.
        DataError: It refuses the file.
    """
    bare = net.with_suffix(".xodr")
    bare.write_bytes(_prepared(town.document.plain()))
    command = [*netconvert(), "--opendrive-files", str(bare), "--output-file", str(net), *_OPTIONS]
    if lit := ",".join(junctions):
        command += ["--tls.set", lit]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=_TIMEOUT_S, check=False)  # noqa: S603
    except subprocess.TimeoutExpired as error:
        raise DataError(f"netconvert did not finish {xodr} in {_TIMEOUT_S:.0f} s.") from error
    finally:
        bare.unlink()
    if done.returncode != 0 or not net.is_file():
        lines = [line for line in done.stderr.splitlines() if line.startswith("Error")] or [done.stderr[-300:]]
        raise DataError(f"netconvert refuses {xodr}: {' '.join(lines)}")


def _prepared(root: ET.Element) -> bytes:
    """The file as netconvert takes it best.

    Without its signals: netconvert makes lights of them at seams, and stumbles over those it is told of. And without
    roads of next to no length, which it leaves without a way on.
    """
    for road in root.findall("road"):
        for signals in road.findall("signals"):
            road.remove(signals)
        pieces = road.findall("planView/geometry")
        if float(road.get("length", "1")) < _LEAST_ROAD_M and pieces:
            short = _LEAST_ROAD_M - float(road.get("length", "1"))
            road.set("length", str(_LEAST_ROAD_M))
            pieces[-1].set("length", str(float(pieces[-1].get("length", "0")) + short))
    roads = {road.get("id", ""): road for road in root.findall("road")}
    for name, road in roads.items():
        onward = road.find("link/successor")
        leads_on = onward is not None and onward.get("elementType") == "road" and onward.get("contactPoint") == "start"
        if onward is not None and leads_on and road.get("junction", "-1") == "-1":
            _link_back(name, road, roads.get(onward.get("elementId", "")))
    return ET.tostring(root)


def _link_back(name: str, road: ET.Element, onward: ET.Element | None) -> None:
    """Tell a road which road leads into its start, where it says that a junction does: netconvert asks both."""
    back = None if onward is None else onward.find("link/predecessor")
    if onward is None or back is None or back.get("elementType") != "junction":
        return
    back.attrib = {"elementType": "road", "elementId": name, "contactPoint": "end"}
    theirs = {lane.get("id"): lane for lane in onward.findall("lanes/laneSection")[0].iter("lane")}
    for lane in road.findall("lanes/laneSection")[-1].iter("lane"):
        goes_on = lane.find("link/successor")
        goal = None if goes_on is None else theirs.get(goes_on.get("id"))
        if goal is not None and goal.find("link/predecessor") is None:
            link = goal.find("link")
            ET.SubElement(ET.SubElement(goal, "link") if link is None else link, "predecessor", id=lane.get("id", ""))


def netconvert() -> tuple[str, ...]:
    """The command, with its type map. Raises MissingExtraError."""
    try:
        import sumo  # pyright: ignore[reportMissingImports]

        home = Path(str(sumo.SUMO_HOME))
    except ImportError:
        home = None
    found = shutil.which("netconvert", path=str(home / "bin")) if home is not None else shutil.which("netconvert")
    if found is None or home is None:
        raise MissingExtraError(
            "Building a map needs netconvert, of eclipse-sumo.", hint="Install it: pip install 'chauffeur[maps]'"
        )
    types = [home / "data" / "typemap" / f"opendriveNetconvert{one}.typ.xml" for one in ("", "Pedestrians")]
    return found, "--type-files", ",".join(map(str, types))


def reshape(net: Path, road: RoadGraph) -> ReshapedNet:
    """The network with its lanes where the road graph has them. Raises DataError where the two do not fit."""
    made = ReshapedNet(ET.parse(net).getroot())  # noqa: S314 - our own file
    nodes = dict(_nodes(made.root))
    edges = {edge.get("id", ""): edge for edge in made.root.findall("edge")}
    by_road: dict[str, list[LaneId]] = {}
    for lane in road.lanes:
        name, _, number = lane.id.rsplit(":", 2)
        by_road.setdefault(f"{name}_{number}", []).append(lane.id)
    for edge in edges.values():
        if edge.get("function") != "internal":
            _place_edge(made, edge, nodes, by_road, road)
    _place_connections(made, edges, road)
    for edge in edges.values():
        _even_out(made, edge, road)
    if not any(road[lane].kind == "driving" for lane in made.lanes):
        raise DataError(f"The SUMO network {net} has no lane of the OpenDRIVE file.")
    return made


def _even_out(made: ReshapedNet, edge: ET.Element, road: RoadGraph) -> None:
    """One length for all lanes of an edge, their mean: who changes lanes keeps the station.

    In bends the outer lane is longer. With lengths of their own a car that changed lanes would leap by the difference;
    so it goes a few per cent faster or slower there than its speed says.
    """
    lanes = edge.findall("lane")
    driven = [lane for lane in lanes if _is_driven(made, lane, road)]
    if len(driven) > 1:
        mean = sum(float(lane.get("length", "0")) for lane in driven) / len(driven)
        for lane in lanes:
            lane.set("length", f"{mean:.3f}")


def _is_driven(made: ReshapedNet, lane: ET.Element, road: RoadGraph) -> bool:
    return any(road[one].kind == "driving" for one in made.graph_lanes.get(lane.get("id", ""), ()))


def _nodes(root: ET.Element) -> Iterable[tuple[str, tuple[float, float]]]:
    for node in root.findall("junction"):
        yield node.get("id", ""), (float(node.get("x", "nan")), float(node.get("y", "nan")))


def _place_edge(
    made: ReshapedNet,
    edge: ET.Element,
    nodes: Mapping[str, tuple[float, float]],
    by_road: Mapping[str, list[LaneId]],
    road: RoadGraph,
) -> None:
    """Lanes of a road between junctions: the lane sections that lie along the edge's own line."""
    shape = _points(edge.get("shape", "")) or [nodes[edge.get("from", "")], nodes[edge.get("to", "")]]
    along = Polyline.of(shape)
    for lane in edge.findall("lane"):
        found: list[tuple[float, LaneId, Polyline]] = []
        for name in _original(lane):
            for one in by_road.get(name, ()):
                centre = road[one].centre
                low, high = (_snapped(centre, *shape[end]) for end in (0, -1))
                middle = centre.at((low + high) / 2.0)
                at = along.nearest(middle.x_m, middle.y_m)
                if high - low > _LEAST_M and -_SNAP_M <= at <= along.length_m + _SNAP_M:
                    found.append((at, one, centre.between(low, high)))
        if found:
            found.sort(key=lambda part: part[0])
            _shape(made, lane, joined([part for _, _, part in found]), [one for _, one, _ in found], road)


def _snapped(line: Polyline, x_m: float, y_m: float) -> float:
    """Station beside a place, that of an end where it is near one: netconvert splits few lanes elsewhere."""
    station = line.nearest(x_m, y_m)
    snap = min(_SNAP_M, line.length_m / 3.0)
    return 0.0 if station < snap else line.length_m if station > line.length_m - snap else station


def _place_connections(made: ReshapedNet, edges: Mapping[str, ET.Element], road: RoadGraph) -> None:
    """Lanes inside junctions: the way in the road graph from the lane before to the lane after."""
    links = made.root.findall("connection")
    onward: dict[str, ET.Element] = {}
    for link in links:
        onward.setdefault(f"{link.get('from')}_{link.get('fromLane')}", link)
    for link in links:
        before = made.graph_lanes.get(f"{link.get('from')}_{link.get('fromLane')}")
        if link.get("from", "").startswith(":") or link.get("via") is None or not before:
            continue
        parts, goal = _inside(made, link, onward)
        after = made.graph_lanes.get(goal)
        chain = _way(road, before[-1], after[0]) if after else None
        if chain is None or after is None:
            if road[before[-1]].kind == "driving":
                made.unmatched.append(f"{before[-1]} -> {goal}")
            continue
        _place_inside(made, [_lane(edges, one) for one in parts], chain, (before[-1], after[0]), road)


def _inside(made: ReshapedNet, link: ET.Element, onward: Mapping[str, ET.Element]) -> tuple[list[str], str]:
    """SUMO lanes that a connection leads over, and the one behind, which the road graph has.

    Two lanes where cars wait inside a junction; and roads of next to no length, which the graph passes over.
    """
    parts: list[str] = []
    goal = ""
    for _ in range(_MANY):
        link.attrib.pop("shape", None)
        goal = f"{link.get('to')}_{link.get('toLane')}"
        via = link.get("via")
        while via is not None:
            parts.append(via)
            following = onward.get(via)
            via = None if following is None else following.get("via")
            if following is not None:
                following.attrib.pop("shape", None)
        if goal in made.graph_lanes or goal not in onward:
            break
        parts.append(goal)
        link = onward[goal]
    return parts, goal


def _place_inside(
    made: ReshapedNet,
    parts: Sequence[ET.Element],
    chain: Sequence[LaneId],
    ends: tuple[LaneId, LaneId],
    road: RoadGraph,
) -> None:
    """Give a way through a junction to the lanes that SUMO made of it (two where cars wait inside)."""
    if not chain:  # a seam between roads: no length of its own
        here = road[ends[1]].centre
        for part in parts:
            _shape(made, part, here.between(0.0, min(_LEAST_M, here.length_m)), [], road, road[ends[1]].speed_limit_mps)
        return
    line = joined([road[one].centre for one in chain])
    low = 0.0
    for i, part in enumerate(parts):
        if i == len(parts) - 1:
            high = line.length_m
        else:
            x, y = _points(part.get("shape", ""))[-1]
            high = min(max(line.nearest(x, y), low + _LEAST_M), line.length_m - _LEAST_M * (len(parts) - 1 - i))
        if high > low:
            _shape(made, part, line.between(low, high), chain, road)
        low = high


def _way(road: RoadGraph, before: LaneId, after: LaneId) -> list[LaneId] | None:
    """Lanes between two others, the fewest; only such as lie in a junction, or in a section too short for SUMO."""
    if before == after:
        return []
    rim: list[list[LaneId]] = [[]]
    seen: set[LaneId] = set()
    while rim:
        way = rim.pop(0)
        for one in road.successors(way[-1] if way else before):
            if one.id == after:
                return way
            if one.id not in seen and len(way) < 40 and (one.junction or one.length_m < 5.0):
                seen.add(one.id)
                rim.append([*way, one.id])
    return None


def _shape(
    made: ReshapedNet,
    lane: ET.Element,
    line: Polyline,
    lanes: Sequence[LaneId],
    road: RoadGraph,
    speed_mps: float | None = None,
) -> None:
    name = lane.get("id", "")
    lane.set("shape", " ".join(f"{x:.3f},{y:.3f}" for x, y in line.points_m))
    lane.set("length", f"{max(line.length_m, _LEAST_M):.3f}")
    for one in lanes:
        made.lanes.setdefault(one, [])
        if name not in made.lanes[one]:
            made.lanes[one].append(name)
        if one not in made.graph_lanes.setdefault(name, []):
            made.graph_lanes[name].append(one)
    speeds = [road[one].speed_limit_mps for one in lanes if road[one].kind == "driving"]
    if speeds or speed_mps is not None:
        lane.set("speed", f"{min(speeds) if speeds else speed_mps:.3f}")


def _lane(edges: Mapping[str, ET.Element], name: str) -> ET.Element:
    edge, _, index = name.rpartition("_")
    found = next((one for one in edges[edge].findall("lane") if one.get("index") == index), None)
    if found is None:
        raise ChauffeurError(f"The SUMO network has no lane {name!r}.")
    return found


def _original(lane: ET.Element) -> list[str]:
    return [
        name for one in lane.findall("param") if one.get("key") == "origId" for name in one.get("value", "").split()
    ]


def _points(text: str) -> list[tuple[float, float]]:
    """A SUMO shape; a third coordinate is dropped."""
    return [(float(one.split(",")[0]), float(one.split(",")[1])) for one in text.split()]
