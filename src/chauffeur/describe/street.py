"""The road ahead as values: ways on, and what there is to stop by. Read from the road graph and what stands on it, so
in any world."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final, Literal

from chauffeur.concept import Lane, Observation, Street, StreetMark, StreetWay, Turn, VehicleState
from chauffeur.describe.road import ego_lane
from chauffeur.geometry import Polyline, Pose, RoadGraph, joined, wrap_to_pi
from chauffeur.geometry.road_graph import TURN_RAD

KNOWN_M: Final = 55.0
"""As far as ways on are told."""
_LEAST_M: Final = 5.0
_LOOK_M: Final = 0.5
_STANDS_MPS: Final = 0.1
_BESIDE_M: Final = 5.0
_LEFT_M: Final = 1.8
_ONE_GROUP_M: Final = 3.0
_SAME_M: Final = 0.3
_DRIVEN: Final = ("driving", "aisle")

MarkKind = Literal["crosswalk", "junction", "cones", "vehicle"]


def street_ahead(observation: Observation) -> Street | None:
    """The street of an observation; None where the ego drives on no lane that leads on.

    Raises:
        ScenarioError: The ego is on no lane of the road.
    """
    road, lane = observation.road, ego_lane(observation)
    if lane.kind == "emergency":  # from the kerb it goes on in the lane beside
        beside = road.get(road.neighbour(lane.id, -1))
        lane = lane if beside is None else beside
    if lane.kind not in _DRIVEN:
        return None
    ego = Pose(observation.ego.x_m, observation.ego.y_m, observation.ego.heading_rad)
    ways: list[StreetWay] = []
    marks: list[StreetMark] = []
    for turn, lanes in _ways(road, lane):
        line = joined([one.centre for one in lanes])
        start = min(max(line.nearest(ego.x_m, ego.y_m, high_m=lane.length_m), 0.0), line.length_m)
        if line.length_m - start < _LEAST_M:
            continue
        path = line.between(start, min(line.length_m, start + KNOWN_M))
        bend, radius = _bend(lanes, line, start)
        here = tuple(ego.sees(x, y) for x, y in path.points_m)
        ways.append(StreetWay(turn, path.length_m, bend, radius, _kerb_m(road, lanes), here))
        for kind, low, high in _marks(observation, road, path, bend):
            marks.append(StreetMark(kind, (turn,), low, high))
    if not ways:
        return None
    fork = min((way.bend_m[0] for way in ways if way.bend_m is not None), default=math.inf)
    return Street(tuple(ways), tuple(_merged(marks, fork)), max(observation.ego.speed_mps, 0.0))


def _ways(road: RoadGraph, lane: Lane) -> Iterator[tuple[Turn, list[Lane]]]:
    """The ways on from a lane: one for each side to which the next junction leads."""
    before: list[Lane] = [lane]
    while sum(one.length_m for one in before) < 2.0 * KNOWN_M + lane.length_m and not before[-1].junction:
        onward = [one for one in road.successors(before[-1].id) if one.kind in _DRIVEN]
        if len({one.turn for one in onward if one.junction}) > 1 or any(one.junction for one in onward):
            sides: list[Turn] = [one.turn for one in onward]
            for turn in dict.fromkeys(sides):
                first = road.onward(before[-1].id, turn)
                if first is not None and first.turn == turn:
                    yield turn, [*before, *_onward(road, first)]
            return
        if not onward or onward[0] in before:
            break
        before.append(min(onward, key=lambda one: abs(one.bend_rad)))
    yield "straight", before if not before[-1].junction else [*before, *_onward(road, before[-1])[1:]]


def _onward(road: RoadGraph, lane: Lane) -> list[Lane]:
    found: list[Lane] = []
    for one in road.ahead(lane.id):
        found.append(one)
        if sum(part.length_m for part in found) > 2.0 * KNOWN_M:
            break
    return found


def _bend(lanes: Sequence[Lane], line: Polyline, start_m: float) -> tuple[tuple[float, float] | None, float | None]:
    """(stations of the junction, radius of the bend there) on a way that begins at a station of its line."""
    at, begins = 0.0, None
    for lane in lanes:
        if lane.junction and begins is None:
            begins = at
        elif not lane.junction and begins is not None:
            break
        at += lane.length_m
    if begins is None or at <= start_m or begins >= start_m + KNOWN_M:
        return None, None
    before, behind = line.at(max(begins - _LOOK_M, 0.0)), line.at(min(at + _LOOK_M, line.length_m))
    turned = abs(wrap_to_pi(behind.heading_rad - before.heading_rad))
    return (begins - start_m, at - start_m), (at - begins) / turned if turned > TURN_RAD else None


def _kerb_m(road: RoadGraph, lanes: Sequence[Lane]) -> float | None:
    """From the middle of the lane to that of the strip at the kerb; None where a lane outside of junctions has none."""
    found: list[float] = []
    for lane in lanes:
        if lane.junction:
            continue
        strip = road.get(road.neighbour(lane.id, 1))
        if strip is None or strip.kind != "emergency":
            return None
        found.append((lane.width_m + strip.width_m) / 2.0)
    return min(found, default=None)


def _marks(
    now: Observation, road: RoadGraph, path: Polyline, bend: tuple[float, float] | None
) -> Iterator[tuple[MarkKind, float, float]]:
    if bend is not None and bend[0] > 0.0:
        yield "junction", *bend
    for lane in road.lanes:
        if lane.kind == "crossing":
            for at, _ in path.crossings(lane.centre):
                yield "crosswalk", at - lane.width_m / 2.0, at + lane.width_m / 2.0
    cones = [one for one in now.objects if one.kind in ("static", "obstacle")]
    standing = [one for one in now.others if one.kind in ("car", "truck", "bus") and one.speed_mps < _STANDS_MPS]
    for kind, things in (("cones", cones), ("vehicle", standing)):
        spans = sorted(span for one in things if (span := _span(path, one)) is not None)
        while spans:
            low, high = spans.pop(0)
            while kind == "cones" and spans and spans[0][0] - high < _ONE_GROUP_M:
                high = max(high, spans.pop(0)[1])
            yield "cones" if kind == "cones" else "vehicle", low, high


def _span(path: Polyline, thing: VehicleState) -> tuple[float, float] | None:
    """Stations between which something stands beside a path; None where it stands nowhere near."""
    station, offset = path.project(thing.x_m, thing.y_m)
    if not (0.0 < station < path.length_m and -_BESIDE_M < offset < _LEFT_M):
        return None
    pose = path.at(station)
    turned = thing.heading_rad - pose.heading_rad
    half = abs(thing.length_m * math.cos(turned)) / 2.0 + abs(thing.width_m * math.sin(turned)) / 2.0
    return station - half, station + half


def _merged(marks: Sequence[StreetMark], fork_m: float) -> list[StreetMark]:
    """What several ways lead past before they part, once; nearest first."""
    found: list[StreetMark] = []
    for one in sorted(marks, key=lambda mark: (mark.start_m, mark.kind)):
        same = next((i for i, other in enumerate(found) if one.start_m < fork_m and _alike(one, other)), None)
        if same is None:
            found.append(one)
        else:
            found[same] = StreetMark(one.kind, (*found[same].ways, *one.ways), found[same].start_m, found[same].end_m)
    return found


def _alike(one: StreetMark, other: StreetMark) -> bool:
    return (
        one.kind == other.kind and abs(one.start_m - other.start_m) < _SAME_M and abs(one.end_m - other.end_m) < _SAME_M
    )


_NAMED: Final = {
    "crosswalk": "A crosswalk",
    "cones": "A row of cones",
    "vehicle": "A parked car",
}
_WHERE: Final = {"left": "on the road to the left", "right": "on the road to the right", "straight": "straight ahead"}


def street_sentences(street: Street) -> list[str]:
    """The street in words."""
    turns = [way.turn for way in street.ways if way.bend_m is not None]
    found: list[str] = []
    if turns:
        start = next(way.bend_m[0] for way in street.ways if way.bend_m is not None)
        said = " or ".join("straight on" if turn == "straight" else turn for turn in turns)
        found.append(f"At the junction {start:.0f} m ahead I can go {said}.")
    if any(way.kerb_m is not None for way in street.ways):
        found.append("There is room to stop at the kerb.")
    for mark in street.marks:
        if mark.kind != "junction":
            shared = len(mark.ways) == len(street.ways)
            where = "ahead" if shared else f"ahead, {' and '.join(_WHERE[turn] for turn in mark.ways)}"
            found.append(f"{_NAMED[mark.kind]} is {mark.start_m:.0f} m {where}.")
    return found
