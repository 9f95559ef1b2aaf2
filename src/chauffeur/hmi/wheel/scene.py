"""What the page draws: the road once, then where everything is, as plain JSON values in the frame of pictures.

That is the world's, in metres, with y downwards on the screen and headings clockwise.
"""

from __future__ import annotations

import math
from typing import Any

from chauffeur.concept import Lane, Observation, RoadGraph, VehicleState
from chauffeur.geometry import wrap_to_pi
from chauffeur.hmi.road import Bounds, draw_road
from chauffeur.hmi.view import in_picture
from chauffeur.hmi.wheel.commands import WheelInstant

Json = dict[str, Any]

SIGHT_M = 220.0
"""No vehicle farther from the car than this is sent; the page shows less."""
_BEHIND_M = 120.0
"""How much road behind the start is drawn."""


def road_message(observation: Observation) -> Json:
    """What stands still: surfaces, lines, signs, obstacles, and the size of everything that moves."""
    (seen,) = in_picture((observation,))
    road = draw_road(seen.road, seen.objects, _worth_drawing(seen))
    return {
        "kind": observation.kind,
        "turns": bool(observation.road.junctions),
        "surfaces": [{"p": _flat(s.centre_m), "w": s.width_m, "e": s.emergency} for s in road.surfaces],
        "lines": [{"p": _flat(line.points_m), "s": line.style} for line in road.lines],
        "signs": [{"post": sign.post_m, "line": _flat(sign.line_m)} for sign in road.stop_signs],
        "obstacles": [[*_pose(o), o.length_m, o.width_m] for o in observation.objects if o.kind == "obstacle"],
        "sizes": {str(car.id): [car.length_m, car.width_m] for car in (observation.ego, *observation.others)},
    }


def tick_message(instant: WheelInstant) -> Json:
    """One instant of a drive."""
    return situation(instant.observation) | {
        "t": "tick",
        "phase": instant.phase,
        "countdown": instant.countdown_s,
        "wheel": round(instant.positions.wheel, 3),
        "pedal": round(instant.positions.pedal, 3),
        "released": instant.released,
        "seq": instant.number,
        "late": instant.late,
    }


def situation(observation: Observation) -> Json:
    """Where everything is, and what the instruments read."""
    ego, front = observation.ego, observation.front
    lane = observation.road.get(ego.lane)
    near = [car for car in observation.others if math.hypot(car.x_m - ego.x_m, car.y_m - ego.y_m) < SIGHT_M]
    seen = front is not None and front.distance_m < SIGHT_M
    return {
        "time": round(observation.time_s, 1),
        "ego": [*_pose(ego), round(ego.speed_mps, 3), int(ego.crashed)],
        "cars": [[car.id, *_pose(car), round(car.speed_mps, 2), int(car.crashed)] for car in near],
        "lead": [front.vehicle, round(front.distance_m, 1), round(front.speed_mps, 1)] if front and seen else None,
        "limit": None if lane is None else round(lane.speed_limit_mps, 1),
        "sign": None if observation.stop_sign_m is None else round(observation.stop_sign_m, 1),
        "lane": None if lane is None else _place_in_road(lane, observation.road),
        "askew": None if lane is None else round(math.degrees(_askew_rad(ego, lane)), 2),
        "off_road": bool(observation.off_road),
    }


def _worth_drawing(observation: Observation) -> Bounds:
    xs = [x for lane in observation.road.lanes for x, _ in lane.centre.points_m]
    ys = [y for lane in observation.road.lanes for _, y in lane.centre.points_m]
    everything = Bounds(min(xs), min(ys), max(xs), max(ys)).grown(20.0)
    if observation.road.junctions:
        return everything
    return Bounds(observation.ego.x_m - _BEHIND_M, everything.y0, everything.x1, everything.y1)


def _place_in_road(lane: Lane, road: RoadGraph) -> list[int]:
    """[lane counted from the left, lanes beside it and itself, whether it is an emergency lane]."""
    return [lane.index + 1, len(road.abreast(lane.id)), int(lane.emergency)]


def _askew_rad(ego: VehicleState, lane: Lane) -> float:
    """How far the car's heading is off the lane's direction beside it; positive when it points to the right."""
    station = lane.centre.nearest(ego.x_m, ego.y_m, 0.0, lane.length_m)
    return wrap_to_pi(lane.centre.at(station).heading_rad - ego.heading_rad)


def _pose(body: VehicleState) -> list[float]:
    """Where the picture has a body."""
    return [round(body.x_m, 3), round(-body.y_m, 3), round(-body.heading_rad, 5)]


def _flat(points: tuple[tuple[float, float], ...]) -> list[float]:
    return [round(value, 2) for point in points for value in point]
