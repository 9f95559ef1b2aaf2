"""What the page draws: the road once, then where everything is, as plain JSON values in world metres."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from chauffeur.concept import LaneId, LaneView, Snapshot, VehicleState
from chauffeur.geometry import wrap_to_pi
from chauffeur.hmi.road import Box, draw_road
from chauffeur.hmi.wheel.hands import Instant

Json = dict[str, Any]

SIGHT_M = 220.0
"""No vehicle farther from the car than this is sent; the page shows less."""
_BEHIND_M = 120.0
"""How much road behind the start is drawn."""
_TURNING_ROADS = ("intersection",)
"""Kinds of road on which the picture turns with the car."""


def road_message(snapshot: Snapshot) -> Json:
    """What stands still: surfaces, lines, signs, obstacles, and the size of everything that moves."""
    road = draw_road(snapshot.lanes, snapshot.objects, _worth_drawing(snapshot))
    return {
        "kind": snapshot.kind,
        "turns": snapshot.kind in _TURNING_ROADS,
        "surfaces": [{"p": _flat(s.centre_m), "w": s.width_m, "e": s.emergency} for s in road.surfaces],
        "lines": [{"p": _flat(line.points_m), "s": line.style} for line in road.lines],
        "signs": [{"post": sign.post_m, "line": _flat(sign.line_m)} for sign in road.stop_signs],
        "obstacles": [[*_pose(o), o.length_m, o.width_m] for o in snapshot.objects if o.kind == "obstacle"],
        "sizes": {str(car.id): [car.length_m, car.width_m] for car in (snapshot.ego, *snapshot.others)},
    }


def tick_message(instant: Instant) -> Json:
    """One instant of a drive."""
    return situation(instant.snapshot) | {
        "t": "tick",
        "phase": instant.phase,
        "countdown": instant.countdown_s,
        "wheel": round(instant.positions.wheel, 3),
        "pedal": round(instant.positions.pedal, 3),
        "released": instant.released,
        "seq": instant.number,
        "late": instant.late,
    }


def situation(snapshot: Snapshot) -> Json:
    """Where everything is, and what the instruments read."""
    ego, front = snapshot.ego, snapshot.front
    lanes = {lane.id: lane for lane in snapshot.lanes}
    lane = None if ego.lane is None else lanes.get(ego.lane)
    near = [car for car in snapshot.others if math.hypot(car.x_m - ego.x_m, car.y_m - ego.y_m) < SIGHT_M]
    seen = front is not None and front.distance_m < SIGHT_M
    return {
        "time": round(snapshot.time_s, 1),
        "ego": [*_pose(ego), round(ego.speed_mps, 3), int(ego.crashed)],
        "cars": [[car.id, *_pose(car), round(car.speed_mps, 2), int(car.crashed)] for car in near],
        "lead": [front.vehicle, round(front.distance_m, 1), round(front.speed_mps, 1)] if front and seen else None,
        "limit": None if lane is None else round(lane.speed_limit_mps, 1),
        "sign": None if snapshot.stop_sign_m is None else round(snapshot.stop_sign_m, 1),
        "lane": None if lane is None else _place_in_road(lane.id, lanes),
        "askew": None if lane is None else round(math.degrees(_askew_rad(ego, lane)), 2),
        "off_road": bool(snapshot.off_road),
    }


def _worth_drawing(snapshot: Snapshot) -> Box:
    xs = [x for lane in snapshot.lanes for x, _ in lane.centre_m]
    ys = [y for lane in snapshot.lanes for _, y in lane.centre_m]
    everything = Box(min(xs), min(ys), max(xs), max(ys)).grown(20.0)
    if snapshot.kind in _TURNING_ROADS:
        return everything
    return Box(snapshot.ego.x_m - _BEHIND_M, everything.y0, everything.x1, everything.y1)


def _place_in_road(lane: LaneId, lanes: dict[LaneId, LaneView]) -> list[int]:
    """[lane counted from the left, lanes beside it and itself, whether it is an emergency lane]."""
    return [lane[2] + 1, sum(other[:2] == lane[:2] for other in lanes), int(lanes[lane].emergency)]


def _askew_rad(ego: VehicleState, lane: LaneView) -> float:
    """How far the car's heading is off the lane's direction beside it; positive when it points to the right."""
    points = np.asarray(lane.centre_m)
    start, along = points[:-1], np.diff(points, axis=0)
    offset = np.array([ego.x_m, ego.y_m]) - start
    share = np.clip((offset * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-12), 0.0, 1.0)
    apart = np.hypot(*(offset - share[:, None] * along).T)
    nearest = along[int(apart.argmin())]
    return wrap_to_pi(ego.heading_rad - math.atan2(float(nearest[1]), float(nearest[0])))


def _pose(body: VehicleState) -> list[float]:
    return [round(body.x_m, 3), round(body.y_m, 3), round(body.heading_rad, 5)]


def _flat(points: tuple[tuple[float, float], ...]) -> list[float]:
    return [round(value, 2) for point in points for value in point]
