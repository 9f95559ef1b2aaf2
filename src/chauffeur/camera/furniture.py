"""Traffic lights and signs: where they stand for the lanes they rule, and what they look like."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from chauffeur.camera.solids import Material, Pile, SemanticClass, Shape
from chauffeur.geometry import Pose, RoadGraph

if TYPE_CHECKING:
    from chauffeur.concept.scene import Sign, Signal, SignalState

_GREY: Final = (0.40, 0.41, 0.43)
_HOUSING: Final = (0.07, 0.07, 0.075)
LIGHTS: Final[dict[SignalState, tuple[float, float, float]]] = {
    "red": (1.0, 0.10, 0.06),
    "yellow": (1.0, 0.72, 0.08),
    "green": (0.10, 1.0, 0.45),
    "off": (0.0, 0.0, 0.0),
}
_ORDER: Final[tuple[SignalState, ...]] = ("red", "yellow", "green")
_FAR_M: Final = 14.0
"""Beyond the stop line where the road graph does not say how wide the junction is."""

STOP, YIELD, LIMIT = 1.0, 2.0, 3.0
"""What is on the face of a sign, for the shader."""


def ends_of_line(line: tuple[tuple[float, float], tuple[float, float]]) -> tuple[float, float, float]:
    """Middle (x, y) and width of a stop line."""
    (ax, ay), (bx, by) = line
    return (ax + bx) / 2.0, (ay + by) / 2.0, math.dist(*line)


def heading_at_line(
    road: RoadGraph, lanes: Sequence[str], line: tuple[tuple[float, float], tuple[float, float]]
) -> float:
    """Heading of who stops at a line: that of the lane it rules, else across the line."""
    x, y, _ = ends_of_line(line)
    for name in lanes:
        lane = road.get(name)
        if lane is not None:
            return lane.centre.at(lane.centre.nearest(x, y)).heading_rad
    return math.atan2(line[1][1] - line[0][1], line[1][0] - line[0][0]) + math.pi / 2.0


def signal_pose(road: RoadGraph, signal: Signal) -> Pose:
    """Pose of a traffic light's heads: over the far side of the junction, facing the lanes it rules."""
    x, y, _ = ends_of_line(signal.stop_line_m)
    heading = heading_at_line(road, signal.lanes, signal.stop_line_m)
    here = Pose(x, y, heading)
    for name in signal.lanes:
        if name not in road:
            continue
        ways = [way for way in road.successors(name) if way.junction]
        if ways:
            straight = min(ways, key=lambda way: abs(way.centre.at(way.length_m).heading_rad - heading) % math.tau)
            end = straight.centre.at(straight.length_m)
            ahead = here.sees(end.x_m, end.y_m)[0]
            return here.ahead(max(8.0, min(ahead + 1.5, 40.0)))
    return here.ahead(_FAR_M)


def put_signal(pile: Pile, road: RoadGraph, signal: Signal, instance: int) -> tuple[float, float, float]:
    """A traffic light on its mast; the place of the lamp that is lit (or of the middle one), m."""
    pose = signal_pose(road, signal)
    _, _, wide = ends_of_line(signal.stop_line_m)
    label, yaw = SemanticClass.TRAFFIC_LIGHT, pose.heading_rad
    mast = pose.place(0.0, -(wide / 2.0 + 1.6))
    pile.add(Shape.CYLINDER, (*mast, 2.9), (0.22, 0.22, 5.8), _GREY, taper=(0.7, 0.7), label=SemanticClass.POLE)
    reach = wide / 2.0 + 1.6
    arm = pose.place(0.0, -reach / 2.0)
    pile.add(Shape.BOX, (*arm, 5.7), (0.12, reach + 0.4, 0.12), _GREY, yaw=yaw, label=SemanticClass.POLE)
    lit = (*pose.place(-0.2, 0.0), 5.3)
    for middle, low in ((pose.place(0.0, 0.0), 4.62), (pose.place(0.05, -reach + 0.05), 2.5)):
        at = Pose(*middle, yaw)
        back = at.place(0.05, 0.0)
        pile.add(Shape.BOX, (*back, low + 0.65), (0.06, 0.78, 1.7), _HOUSING, yaw=yaw, instance=instance, label=label)
        pile.add(
            Shape.BOX, (*middle, low + 0.65), (0.26, 0.44, 1.36), _HOUSING, yaw=yaw, instance=instance, label=label
        )
        for i, state in enumerate(_ORDER):
            z = low + 1.07 - 0.42 * i
            on = signal.state == state
            colour = LIGHTS[state] if on else tuple(0.10 + 0.10 * c for c in LIGHTS[state])
            face = at.place(-0.14, 0.0)
            pile.add(
                Shape.BALL, (*face, z), (0.12, 0.34, 0.34), colour, yaw=yaw,  # type: ignore[arg-type]
                material=Material.LAMP, glow=1.0 if on else 0.0, instance=instance, label=label,
            )  # fmt: skip
            if on and low > 4.0:
                lit = (*at.place(-0.2, 0.0), z)
    return lit


def put_sign(
    pile: Pile, kind: float, at: tuple[float, float], heading_rad: float, instance: int, number: float = 0.0
) -> None:
    """A sign on a post, its face towards who comes along `heading_rad`."""
    pole, label = SemanticClass.POLE, SemanticClass.TRAFFIC_SIGN
    pose = Pose(*at, heading_rad)
    pile.add(Shape.CYLINDER, (*at, 1.2), (0.09, 0.09, 2.4), _GREY, label=pole)
    width, height = {STOP: (0.86, 0.86), YIELD: (0.95, 0.86)}.get(kind, (0.75, 0.95))
    face = pose.place(-0.08, 0.0)
    pile.add(
        Shape.BOX, (*face, 2.35), (0.03, width, height), (kind / 8.0, number / 128.0, 0.0), yaw=heading_rad,
        material=Material.SIGN, instance=instance, label=label,
    )  # fmt: skip


def sign_pose(road: RoadGraph, sign: Sign) -> tuple[tuple[float, float], float]:
    """Position of a sign, moved beside the lane if the world puts it on one, and the heading it is read from."""
    heading = 0.0
    for name in sign.lanes:
        lane = road.get(name)
        if lane is not None:
            heading = lane.centre.at(lane.centre.nearest(sign.x_m, sign.y_m)).heading_rad
            break
    else:
        place = road.locate(sign.x_m, sign.y_m)
        if place is not None:
            heading = road[place.lane].centre.at(place.station_m).heading_rad
    return beside_the_road(road, sign.x_m, sign.y_m, heading), heading


def beside_the_road(road: RoadGraph, x_m: float, y_m: float, heading_rad: float) -> tuple[float, float]:
    """A place off every lane, to the right of the one that goes this way."""
    place = road.locate(x_m, y_m, heading_rad)
    if place is None:
        return x_m, y_m
    lane = road[place.lane]
    if abs(place.offset_m) > lane.width_m / 2.0 + 0.3:
        return x_m, y_m
    right = max(road.abreast(lane.id), key=lambda one: one.index)
    pose = right.centre.at(right.centre.nearest(x_m, y_m))
    return pose.place(0.0, -(right.width_m / 2.0 + 0.9))
