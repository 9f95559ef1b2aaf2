"""From where a drive is looked at: which instants, turned which way, framed how. The page and the filmstrip share it.

Whatever the road, the car sets off to the right of the picture, so that its left is up.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

from chauffeur.concept import Lane, Observation, RoadGraph, Sign, Signal, VehicleState
from chauffeur.driving.recording import RecordedTrip
from chauffeur.geometry import Polyline
from chauffeur.hmi.road import Bounds, track_box

_MARGIN_M = 14.0
_BESIDE_M = 60.0
_LEVEL = 0.1
"""Sine of half the angle off +x below which a drive is shown as it is."""
_FLAT_ROAD_M = 40.0
"""A road that spreads less than this across +x is shown lengthwise, with the camera moving along."""


@dataclass(frozen=True, slots=True)
class Framing:
    """How a drive is framed.

    Attributes:
        along: The camera moves with the car, along +x; otherwise it stands still.
        box: What must be seen; only its y range counts for a moving camera.
    """

    along: bool
    box: Bounds


def instants_of(recorded: RecordedTrip) -> tuple[Observation, ...]:
    """Every instant of a trip, the one after the last command included."""
    instants = tuple(frame.observation for frame in recorded.frames)
    return (*instants, recorded.final) if recorded.final is not None else instants


def facing_right(instants: tuple[Observation, ...]) -> tuple[Observation, ...]:
    """The same instants in the frame of pictures, whose y grows downwards, turned so that the ego first heads along +x.

    Who heads that way within a few degrees is not turned: a straight road stays level.
    """
    return _turned(instants, _to_the_right(instants[0])) if instants else instants


def place_facing_right(first: Observation, x_m: float, y_m: float) -> tuple[float, float]:
    """A point of the world in that frame, from the first instant as it was."""
    return _to_the_right(first).point(x_m, y_m)


def as_picture(road: RoadGraph, signs: Iterable[Sign]) -> tuple[RoadGraph, tuple[Sign, ...]]:
    """A road and its signs in the frame of pictures, not turned: north is up."""
    turn = _Turn.by(0.0)
    return RoadGraph(tuple(turn.lane(lane) for lane in road.lanes)), tuple(turn.sign(one) for one in signs)


def _to_the_right(first: Observation) -> _Turn:
    heading = first.ego.heading_rad
    return _Turn.by(0.0 if abs(math.sin(heading / 2.0)) < _LEVEL else heading)


def _turned(instants: tuple[Observation, ...], turn: _Turn) -> tuple[Observation, ...]:
    roads: dict[int, RoadGraph] = {}
    signs = tuple(turn.sign(one) for one in instants[0].signs)  # they do not change within a trip
    turned: list[Observation] = []
    for shot in instants:
        if id(shot.road) not in roads:
            roads[id(shot.road)] = RoadGraph(tuple(turn.lane(lane) for lane in shot.road.lanes))
        turned.append(
            replace(
                shot,
                ego=turn.vehicle(shot.ego),
                others=tuple(turn.vehicle(car) for car in shot.others),
                objects=tuple(turn.vehicle(thing) for thing in shot.objects),
                road=roads[id(shot.road)],
                signals=tuple(turn.signal(one) for one in shot.signals),
                signs=signs,
            )
        )
    return tuple(turned)


def frame_drive(instants: tuple[Observation, ...]) -> Framing:
    """The framing that shows a whole drive."""
    path = track_box(tuple((shot.ego.x_m, shot.ego.y_m) for shot in instants))
    beside = path.grown(_BESIDE_M)
    edges = [
        y + side * lane.width_m / 2.0
        for lane in instants[0].road.lanes
        if _overlaps(lane, beside)
        for _, y in lane.centre.points_m
        for side in (-1, 1)
    ]
    low, high = min([*edges, path.y0]), max([*edges, path.y1])
    if instants[0].road.junctions or high - low > _FLAT_ROAD_M:
        return Framing(along=False, box=path.grown(_MARGIN_M))
    return Framing(along=True, box=Bounds(path.x0, low, path.x1, high))


def _overlaps(lane: Lane, box: Bounds) -> bool:
    xs = [x for x, _ in lane.centre.points_m]
    return min(xs) <= box.x1 and max(xs) >= box.x0


@dataclass(frozen=True, slots=True)
class _Turn:
    angle_rad: float
    cos: float
    sin: float

    @classmethod
    def by(cls, angle_rad: float) -> _Turn:
        return cls(angle_rad, math.cos(angle_rad), math.sin(angle_rad))

    def point(self, x: float, y: float) -> tuple[float, float]:
        return x * self.cos + y * self.sin, x * self.sin - y * self.cos

    def vehicle(self, body: VehicleState) -> VehicleState:
        x, y = self.point(body.x_m, body.y_m)
        return replace(body, x_m=x, y_m=y, heading_rad=self.angle_rad - body.heading_rad)

    def signal(self, one: Signal) -> Signal:
        (ax, ay), (bx, by) = one.stop_line_m
        return replace(one, stop_line_m=(self.point(ax, ay), self.point(bx, by)))

    def sign(self, one: Sign) -> Sign:
        x, y = self.point(one.x_m, one.y_m)
        line = None if one.stop_line_m is None else (self.point(*one.stop_line_m[0]), self.point(*one.stop_line_m[1]))
        return replace(one, x_m=x, y_m=y, stop_line_m=line)

    def lane(self, lane: Lane) -> Lane:
        return replace(lane, centre=Polyline.of(self.point(x, y) for x, y in lane.centre.points_m))
