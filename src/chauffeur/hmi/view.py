"""From where a drive is looked at: which instants, turned which way, framed how. The page and the filmstrip share it.

Whatever the road, the car sets off to the right of the picture, so that its left is up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from chauffeur.concept import LaneView, Snapshot, VehicleState
from chauffeur.drive.recording import RecordedTrip
from chauffeur.hmi.road import Box, track_box

_MARGIN_M = 14.0
_BESIDE_M = 60.0
_FLAT_ROAD_M = 40.0
"""A road that spreads less than this across +x is shown lengthwise, with the camera moving along."""


@dataclass(frozen=True, slots=True)
class Camera:
    """How a drive is framed.

    Attributes:
        along: The camera moves with the car, along +x; otherwise it stands still.
        box: What must be seen; only its y range counts for a moving camera.
    """

    along: bool
    box: Box


def instants_of(recorded: RecordedTrip) -> tuple[Snapshot, ...]:
    """Every instant of a trip, the one after the last command included."""
    instants = tuple(frame.snapshot for frame in recorded.frames)
    return (*instants, recorded.final) if recorded.final is not None else instants


def facing_right(instants: tuple[Snapshot, ...]) -> tuple[Snapshot, ...]:
    """The same instants, turned about the origin so that the ego first heads along +x."""
    if not instants or abs(math.sin(instants[0].ego.heading_rad / 2.0)) < 0.1:
        return instants
    turn = _Turn.by(-instants[0].ego.heading_rad)
    roads: dict[int, tuple[LaneView, ...]] = {}
    turned: list[Snapshot] = []
    for shot in instants:
        if id(shot.lanes) not in roads:
            roads[id(shot.lanes)] = tuple(turn.lane(lane) for lane in shot.lanes)
        turned.append(
            replace(
                shot,
                ego=turn.vehicle(shot.ego),
                others=tuple(turn.vehicle(car) for car in shot.others),
                objects=tuple(turn.vehicle(thing) for thing in shot.objects),
                lanes=roads[id(shot.lanes)],
            )
        )
    return tuple(turned)


def frame_drive(instants: tuple[Snapshot, ...]) -> Camera:
    """The framing that shows a whole drive."""
    path = track_box(tuple((shot.ego.x_m, shot.ego.y_m) for shot in instants))
    beside = path.grown(_BESIDE_M)
    edges = [
        y + side * lane.width_m / 2.0
        for lane in instants[0].lanes
        if _overlaps(lane, beside)
        for _, y in lane.centre_m
        for side in (-1, 1)
    ]
    low, high = min([*edges, path.y0]), max([*edges, path.y1])
    if instants[0].kind == "intersection" or high - low > _FLAT_ROAD_M:
        return Camera(along=False, box=path.grown(_MARGIN_M))
    return Camera(along=True, box=Box(path.x0, low, path.x1, high))


def _overlaps(lane: LaneView, box: Box) -> bool:
    xs = [x for x, _ in lane.centre_m]
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
        return x * self.cos - y * self.sin, x * self.sin + y * self.cos

    def vehicle(self, body: VehicleState) -> VehicleState:
        x, y = self.point(body.x_m, body.y_m)
        return replace(body, x_m=x, y_m=y, heading_rad=body.heading_rad + self.angle_rad)

    def lane(self, lane: LaneView) -> LaneView:
        return replace(lane, centre_m=tuple(self.point(x, y) for x, y in lane.centre_m))
