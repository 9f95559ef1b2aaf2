"""A snapshot as Foxglove's well-known messages, for the 3D panel; for looking at only, nothing is read back from it.

Foxglove's frames are right-handed with z up, the worlds' y grows to the right: y and heading change sign here.
Numbers are rounded to a centimetre and a milliradian, which keeps a recording small.
"""

from __future__ import annotations

import math
from typing import Any

from chauffeur.concept import LaneView, Snapshot, VehicleState

_FRAME = "map"
_EGO_FRAME = "ego"
_HEIGHT_M = 1.5
_EGO_COLOR = {"r": 1.0, "g": 0.7, "b": 0.0, "a": 1.0}
_CAR_COLOR = {"r": 0.6, "g": 0.68, "b": 0.76, "a": 1.0}
_OBJECT_COLOR = {"r": 0.85, "g": 0.2, "b": 0.15, "a": 1.0}
_LANE_COLOR = {"r": 0.75, "g": 0.75, "b": 0.75, "a": 1.0}
_LINE_STRIP = 0


def nanoseconds(time_s: float) -> int:
    """Simulated time as MCAP log time."""
    return round(time_s * 1e9)


def scene_update(snapshot: Snapshot, *, with_road: bool) -> dict[str, Any]:
    """`foxglove.SceneUpdate` of an instant; entities replace those of the same id, so the road is sent once."""
    stamp = _stamp(snapshot.time_s)
    entities = [
        _entity("ego", stamp, cubes=[_cube(snapshot.ego, _EGO_COLOR)]),
        _entity("traffic", stamp, cubes=[_cube(car, _CAR_COLOR) for car in snapshot.others]),
    ]
    if with_road:
        entities.append(_entity("road", stamp, lines=[_edge(lane, s) for lane in snapshot.lanes for s in (-1, 1)]))
        entities.append(_entity("objects", stamp, cubes=[_cube(thing, _OBJECT_COLOR) for thing in snapshot.objects]))
    return {"deletions": [], "entities": entities}


def ego_transform(snapshot: Snapshot) -> dict[str, Any]:
    """`foxglove.FrameTransform` map -> ego, so that a 3D panel can follow the car."""
    ego = snapshot.ego
    return {
        "timestamp": _stamp(snapshot.time_s),
        "parent_frame_id": _FRAME,
        "child_frame_id": _EGO_FRAME,
        "translation": _point(ego.x_m, ego.y_m, 0.0),
        "rotation": _rotation(ego.heading_rad),
    }


def _stamp(time_s: float) -> dict[str, int]:
    sec, nsec = divmod(nanoseconds(time_s), 1_000_000_000)
    return {"sec": sec, "nsec": nsec}


def _point(x_m: float, y_m: float, z_m: float) -> dict[str, float]:
    return {"x": _round(x_m, 2), "y": _round(-y_m, 2), "z": z_m}


def _rotation(heading_rad: float) -> dict[str, float]:
    half = -_round(heading_rad, 4) / 2.0
    return {"x": 0.0, "y": 0.0, "z": round(math.sin(half), 4), "w": round(math.cos(half), 4)}


def _round(value: float, digits: int) -> float:
    """Rounded; what is not a number (a failed simulation) is drawn at the origin, the lossless channels keep it."""
    return round(value, digits) if math.isfinite(value) else 0.0


def _entity(name: str, stamp: dict[str, int], **primitives: list[dict[str, Any]]) -> dict[str, Any]:
    return {
        "timestamp": stamp,
        "frame_id": _FRAME,
        "id": name,
        "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": False,
        "metadata": [],
        "arrows": [],
        "cubes": [],
        "spheres": [],
        "cylinders": [],
        "lines": [],
        "triangles": [],
        "texts": [],
        "models": [],
        **primitives,
    }


def _cube(body: VehicleState, color: dict[str, float]) -> dict[str, Any]:
    return {
        "pose": {
            "position": _point(body.x_m, body.y_m, _HEIGHT_M / 2.0),
            "orientation": _rotation(body.heading_rad),
        },
        "size": {"x": _round(body.length_m, 2), "y": _round(body.width_m, 2), "z": _HEIGHT_M},
        "color": color,
    }


def _edge(lane: LaneView, side: int) -> dict[str, Any]:
    """One edge of a lane as a line strip; `side` is -1 for left, +1 for right of its direction."""
    points: list[dict[str, float]] = []
    centre = lane.centre_m
    for index, (x, y) in enumerate(centre):
        ahead, behind = centre[min(index + 1, len(centre) - 1)], centre[max(index - 1, 0)]
        dx, dy = ahead[0] - behind[0], ahead[1] - behind[1]
        norm = math.hypot(dx, dy) or 1.0
        offset = side * lane.width_m / 2.0
        points.append(_point(x - dy / norm * offset, y + dx / norm * offset, 0.0))
    return {
        "type": _LINE_STRIP,
        "pose": {"position": _point(0.0, 0.0, 0.0), "orientation": _rotation(0.0)},
        "thickness": 0.15,
        "scale_invariant": False,
        "points": points,
        "color": _LANE_COLOR,
        "colors": [],
        "indices": [],
    }
