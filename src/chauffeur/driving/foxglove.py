"""An observation as Foxglove's well-known messages, for viewers; for looking at only, nothing is read back from it.

Foxglove draws all of them. Rerun 0.41 draws transforms, point clouds and logs, but no `SceneUpdate`: that is why roads
and road users are sent as points, too. Foxglove's frames are right-handed with z up, as the worlds' are. Lengths are
rounded to 1/64 m and rotations to 1/8192: steps that are powers of two end in zero bits, which compress.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable, Iterator
from itertools import pairwise

from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.CubePrimitive_pb2 import CubePrimitive
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.timestamp_pb2 import Timestamp

from chauffeur.concept import Lane, Observation, VehicleState

MESSAGES = {"/scene": SceneUpdate, "/tf": FrameTransform, "/road": PointCloud, "/vehicles": PointCloud, "/log": Log}
"""Topic -> message, in the order in which the channels are registered."""

_FRAME = "map"
_EGO_FRAME = "ego"
_HEIGHT_M = 1.5
_EGO_COLOR = Color(r=1.0, g=0.7, b=0.0, a=1.0)
_CAR_COLOR = Color(r=0.6, g=0.68, b=0.76, a=1.0)
_OBJECT_COLOR = Color(r=0.85, g=0.2, b=0.15, a=1.0)
_LANE_COLOR = Color(r=0.75, g=0.75, b=0.75, a=1.0)

_LENGTH_PARTS = 64
_ROTATION_PARTS = 8192

_ROAD_POINTS_M = 2.0
"""Distance between the points of a lane's edge."""

_MOST_ROAD_POINTS = 20_000
"""A road that would take more is drawn with larger gaps."""

_POINT = struct.Struct("<fff")
_FIELDS = [
    PackedElementField(name=name, offset=4 * index, type=PackedElementField.FLOAT32) for index, name in enumerate("xyz")
]

_OUTLINE = ((-1, -1), (-1, 1), (1, -1), (1, 1), (1.3, 0))
"""Points of a road user's outline, in half lengths and half widths; the last shows where its nose is."""


def nanoseconds(time_s: float) -> int:
    """Simulated time as MCAP log time."""
    return round(time_s * 1e9)


def scene_update(observation: Observation, *, with_road: bool) -> SceneUpdate:
    """The scene of an instant; entities replace those of the same id, so the road is sent once."""
    stamp = _stamp(observation.time_s)
    entities = [
        _entity("ego", stamp, cubes=[_cube(observation.ego, _EGO_COLOR)]),
        _entity("traffic", stamp, cubes=[_cube(car, _CAR_COLOR) for car in observation.others]),
    ]
    if with_road:
        entities.append(
            _entity(
                "road", stamp, lines=[_line(_edge(lane, side)) for lane in observation.road.lanes for side in (-1, 1)]
            )
        )
        entities.append(_entity("objects", stamp, cubes=[_cube(thing, _OBJECT_COLOR) for thing in observation.objects]))
    return SceneUpdate(entities=entities)


def ego_transform(observation: Observation) -> FrameTransform:
    """The transform map -> ego, so that a 3D panel can follow the car."""
    ego = observation.ego
    x, y = _place(ego.x_m, ego.y_m)
    return FrameTransform(
        timestamp=_stamp(observation.time_s),
        parent_frame_id=_FRAME,
        child_frame_id=_EGO_FRAME,
        translation=Vector3(x=x, y=y),
        rotation=_rotation(ego.heading_rad),
    )


def road_points(observation: Observation) -> PointCloud:
    """The edges of all lanes, `_ROAD_POINTS_M` apart."""
    edges = [_edge(lane, side) for lane in observation.road.lanes for side in (-1, 1)]
    length = sum(math.dist(a, b) for edge in edges for a, b in pairwise(edge))
    step = max(_ROAD_POINTS_M, length / _MOST_ROAD_POINTS)
    # Neighbouring lanes share an edge: each point once.
    points = dict.fromkeys(point for edge in edges for point in _dotted(edge, step))
    return _cloud(observation.time_s, points, 0.0)


def vehicle_points(observation: Observation) -> PointCloud:
    """The outlines of the ego, the other road users and what stands on the road."""
    bodies = (observation.ego, *observation.others, *observation.objects)
    return _cloud(observation.time_s, (point for body in bodies for point in _outline(body)), _HEIGHT_M / 2.0)


def said(text: str, time_s: float) -> Log:
    """What the car told the passenger."""
    return Log(timestamp=_stamp(time_s), level=Log.INFO, message=text, name="chauffeur")


def _stamp(time_s: float) -> Timestamp:
    seconds, nanos = divmod(nanoseconds(time_s), 1_000_000_000)
    return Timestamp(seconds=seconds, nanos=nanos)


def _place(x_m: float, y_m: float) -> tuple[float, float]:
    return _round(x_m), _round(y_m)


def _rotation(heading_rad: float) -> Quaternion:
    half = heading_rad / 2.0 if math.isfinite(heading_rad) else 0.0
    return Quaternion(z=_round(math.sin(half), _ROTATION_PARTS), w=_round(math.cos(half), _ROTATION_PARTS))


def _round(value: float, parts: int = _LENGTH_PARTS) -> float:
    """Rounded; what is not a number (a failed simulation) is drawn at the origin, the lossless channels keep it."""
    scaled = value * parts
    return round(scaled) / parts if math.isfinite(scaled) else 0.0


def _entity(
    name: str, stamp: Timestamp, *, cubes: Iterable[CubePrimitive] = (), lines: Iterable[LinePrimitive] = ()
) -> SceneEntity:
    return SceneEntity(timestamp=stamp, frame_id=_FRAME, id=name, cubes=cubes, lines=lines)


def _cube(body: VehicleState, color: Color) -> CubePrimitive:
    x, y = _place(body.x_m, body.y_m)
    return CubePrimitive(
        pose=Pose(position=Vector3(x=x, y=y, z=_HEIGHT_M / 2.0), orientation=_rotation(body.heading_rad)),
        size=Vector3(x=_round(body.length_m), y=_round(body.width_m), z=_HEIGHT_M),
        color=color,
    )


def _line(edge: list[tuple[float, float]]) -> LinePrimitive:
    return LinePrimitive(
        type=LinePrimitive.LINE_STRIP,
        pose=Pose(position=Vector3(), orientation=Quaternion(w=1.0)),
        thickness=0.15,
        points=[Point3(x=x, y=y) for x, y in edge],
        color=_LANE_COLOR,
    )


def _edge(lane: Lane, side: int) -> list[tuple[float, float]]:
    """One edge of a lane; `side` is -1 for right, +1 for left of its direction."""
    points: list[tuple[float, float]] = []
    centre = lane.centre.points_m
    for index, (x, y) in enumerate(centre):
        ahead, behind = centre[min(index + 1, len(centre) - 1)], centre[max(index - 1, 0)]
        dx, dy = ahead[0] - behind[0], ahead[1] - behind[1]
        norm = math.hypot(dx, dy) or 1.0
        offset = side * lane.width_m / 2.0
        points.append(_place(x - dy / norm * offset, y + dx / norm * offset))
    return points


def _dotted(edge: list[tuple[float, float]], step_m: float) -> Iterator[tuple[float, float]]:
    """Points along an edge, at most a step apart."""
    if not math.isfinite(step_m):  # a failed simulation's road
        yield from edge
        return
    yield from edge[:1]
    for (x, y), (next_x, next_y) in pairwise(edge):
        pieces = math.ceil(math.dist((x, y), (next_x, next_y)) / step_m) or 1
        for piece in range(1, pieces + 1):
            part = piece / pieces
            yield _round(x + (next_x - x) * part), _round(y + (next_y - y) * part)


def _outline(body: VehicleState) -> Iterator[tuple[float, float]]:
    heading = body.heading_rad if math.isfinite(body.heading_rad) else 0.0
    forward, side = math.cos(heading), math.sin(heading)
    length, width = _round(body.length_m) / 2.0, _round(body.width_m) / 2.0
    for along, across in _OUTLINE:
        dx, dy = along * length, across * width
        yield _place(body.x_m + dx * forward - dy * side, body.y_m + dx * side + dy * forward)


def _cloud(time_s: float, points: Iterable[tuple[float, float]], z_m: float) -> PointCloud:
    # JSON and protobuf hold any double, these points 32 bits: what does not fit is drawn at the edge of what does.
    data = b"".join(_POINT.pack(_float32(x), _float32(y), z_m) for x, y in points)
    return PointCloud(
        timestamp=_stamp(time_s),
        frame_id=_FRAME,
        pose=Pose(position=Vector3(), orientation=Quaternion(w=1.0)),
        point_stride=_POINT.size,
        fields=_FIELDS,
        data=data,
    )


_MOST_FLOAT32 = 3.4e38


def _float32(value: float) -> float:
    return max(-_MOST_FLOAT32, min(_MOST_FLOAT32, value))
