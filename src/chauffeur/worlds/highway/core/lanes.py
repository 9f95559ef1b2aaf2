"""Lane geometry on arrays; highway-env's straight, sine and circular lanes, and which lane a vehicle is on.

Arguments called `lanes` and `traits` are the float and integer rows of all lanes (layout.py).
"""

from __future__ import annotations

import math
from typing import Any

from chauffeur.worlds.highway.core.arithmetic import dot, norm
from chauffeur.worlds.highway.core.jit import compiled
from chauffeur.worlds.highway.core.layout import (
    AMPLITUDE,
    ARC,
    CAR_M,
    COUNT,
    DIRECTION_X,
    DIRECTION_Y,
    EXIT,
    EXITS,
    FIRST,
    FORBIDDEN,
    FROM,
    HEADING,
    INDEX,
    LANE,
    LANE_HEADING,
    LANE_LENGTH,
    LANE_WIDTH,
    PHASE,
    PULSATION,
    RADIUS,
    ROAD,
    ROUTE,
    ROUTE_AT,
    ROUTE_END,
    SHAPE,
    SINE,
    START_PHASE,
    START_X,
    START_Y,
    TO,
    TURN_SIGN,
    X,
    Y,
)

Array = Any
"""A NumPy array; the kernels are typed by their compiler."""

_TWO_PI = 2.0 * math.pi


@compiled
def wrap(angle: float) -> float:
    """Angle in [-pi, pi)."""
    return (angle + math.pi) % _TWO_PI - math.pi


@compiled
def local(lanes: Array, traits: Array, lane: int, x: float, y: float) -> tuple[float, float]:
    """(longitudinal, lateral) of a point on a lane, m."""
    shape = traits[lane, SHAPE]
    if shape == ARC:
        dx, dy = x - lanes[lane, START_X], y - lanes[lane, START_Y]
        start, sign, radius = lanes[lane, START_PHASE], lanes[lane, TURN_SIGN], lanes[lane, RADIUS]
        phi = start + wrap(math.atan2(dy, dx) - start)
        return sign * (phi - start) * radius, sign * (radius - norm(dx, dy))
    dx, dy = x - lanes[lane, START_X], y - lanes[lane, START_Y]
    ux, uy = lanes[lane, DIRECTION_X], lanes[lane, DIRECTION_Y]
    s = dot(dx, ux, dy, uy)
    r = dot(dx, -uy, dy, ux)
    if shape == SINE:
        r -= lanes[lane, AMPLITUDE] * math.sin(lanes[lane, PULSATION] * s + lanes[lane, PHASE])
    return s, r


@compiled
def along(lanes: Array, traits: Array, lane: int, x: float, y: float) -> float:
    """Longitudinal coordinate of a point on a lane, m."""
    if traits[lane, SHAPE] == ARC:
        return local(lanes, traits, lane, x, y)[0]
    dx, dy = x - lanes[lane, START_X], y - lanes[lane, START_Y]
    return dot(dx, lanes[lane, DIRECTION_X], dy, lanes[lane, DIRECTION_Y])


@compiled
def heading_at(lanes: Array, traits: Array, lane: int, s: float) -> float:
    """Heading of a lane, rad."""
    shape = traits[lane, SHAPE]
    if shape == ARC:
        sign = lanes[lane, TURN_SIGN]
        return sign * s / lanes[lane, RADIUS] + lanes[lane, START_PHASE] + math.pi / 2.0 * sign
    heading = lanes[lane, LANE_HEADING]
    if shape == SINE:
        pulsation = lanes[lane, PULSATION]
        heading += math.atan(lanes[lane, AMPLITUDE] * pulsation * math.cos(pulsation * s + lanes[lane, PHASE]))
    return heading


@compiled
def centre_at(lanes: Array, traits: Array, lane: int, s: float) -> tuple[float, float]:
    """World position of the centre line, m."""
    shape = traits[lane, SHAPE]
    if shape == ARC:
        phi = lanes[lane, TURN_SIGN] * s / lanes[lane, RADIUS] + lanes[lane, START_PHASE]
        radius = lanes[lane, RADIUS]
        return lanes[lane, START_X] + radius * math.cos(phi), lanes[lane, START_Y] + radius * math.sin(phi)
    ux, uy = lanes[lane, DIRECTION_X], lanes[lane, DIRECTION_Y]
    x, y = lanes[lane, START_X] + s * ux, lanes[lane, START_Y] + s * uy
    if shape == SINE:
        r = lanes[lane, AMPLITUDE] * math.sin(lanes[lane, PULSATION] * s + lanes[lane, PHASE])
        x, y = x - r * uy, y + r * ux
    return x, y


@compiled
def within(lanes: Array, lane: int, s: float, r: float, margin: float) -> bool:
    """True if local coordinates are on a lane; it reaches a car length beyond both ends."""
    if abs(r) > lanes[lane, LANE_WIDTH] / 2.0 + margin:
        return False
    return s >= -CAR_M and s < lanes[lane, LANE_LENGTH] + CAR_M


@compiled
def reachable(lanes: Array, traits: Array, lane: int, x: float, y: float) -> bool:
    """True if a car may change to a lane from a point."""
    if traits[lane, FORBIDDEN] == 1:
        return False
    s, r = local(lanes, traits, lane, x, y)
    return abs(r) <= 2.0 * lanes[lane, LANE_WIDTH] and s >= 0.0 and s < lanes[lane, LANE_LENGTH] + CAR_M


@compiled
def after_end(lanes: Array, traits: Array, lane: int, x: float, y: float) -> bool:
    """True if a point is past the last half car length of a lane."""
    return along(lanes, traits, lane, x, y) > lanes[lane, LANE_LENGTH] - CAR_M / 2.0


@compiled
def closest(lanes: Array, traits: Array, x: float, y: float, heading: float) -> int:
    """Lane with the least distance, the heading error (rad) added as metres; the first of equals."""
    best, smallest = 0, math.inf
    for lane in range(lanes.shape[0]):
        s, r = local(lanes, traits, lane, x, y)
        distance = abs(r) + max(s - lanes[lane, LANE_LENGTH], 0.0) + max(0.0 - s, 0.0)
        if distance >= smallest:
            continue
        distance += abs(wrap(heading - heading_at(lanes, traits, lane, s)))
        if distance < smallest:
            best, smallest = lane, distance
    return best


@compiled
def off_centre(lanes: Array, traits: Array, lane: int, x: float, y: float) -> float:
    """L1 distance from a point to a lane, m."""
    s, r = local(lanes, traits, lane, x, y)
    return abs(r) + max(s - lanes[lane, LANE_LENGTH], 0.0) + max(0.0 - s, 0.0)


@compiled
def onto(lanes: Array, traits: Array, roads: Array, lane: int, road: int, x: float, y: float) -> int:
    """Lane of the road that follows `lane`, for a car at a centre-line point: the same place, or the nearest."""
    first, count = roads[road, FIRST], roads[road, COUNT]
    if roads[traits[lane, ROAD], COUNT] == count:
        return first + traits[lane, INDEX]
    best, smallest = first, math.inf
    for candidate in range(first, first + count):
        distance = off_centre(lanes, traits, candidate, x, y)
        if distance < smallest:
            best, smallest = candidate, distance
    return best


@compiled
def next_lane(lanes: Array, traits: Array, roads: Array, lane: int, next_road: int, x: float, y: float) -> int:
    """Lane that follows `lane`: on `next_road` where one is planned (>= 0), else the nearest; itself at a dead end."""
    centre_x, centre_y = centre_at(lanes, traits, lane, along(lanes, traits, lane, x, y))
    if next_road >= 0:
        return onto(lanes, traits, roads, lane, next_road, centre_x, centre_y)
    road = traits[lane, ROAD]
    best, smallest = lane, math.inf
    for k in range(roads[road, EXITS]):
        candidate = onto(lanes, traits, roads, lane, roads[road, EXIT + k], centre_x, centre_y)
        distance = off_centre(lanes, traits, candidate, centre_x, centre_y)
        if distance < smallest:
            best, smallest = candidate, distance
    return best


@compiled
def planned_road(traits: Array, roads: Array, ints: Array, i: int, lane: int) -> int:
    """Road after `lane` on the route of entity `i`, -1 for none; a finished leg is dropped, as highway-env does."""
    road = traits[lane, ROAD]
    if ints[i, ROUTE_AT] < ints[i, ROUTE_END] and ints[i, ROUTE + ints[i, ROUTE_AT]] == road:
        ints[i, ROUTE_AT] += 1
    if ints[i, ROUTE_AT] < ints[i, ROUTE_END]:
        leg = ints[i, ROUTE + ints[i, ROUTE_AT]]
        if roads[leg, FROM] == roads[road, TO]:
            return leg
    return -1


@compiled
def update_lane(lanes: Array, traits: Array, floats: Array, ints: Array, i: int) -> None:
    """Store the closest lane of an entity after it moved."""
    ints[i, LANE] = closest(lanes, traits, floats[i, X], floats[i, Y], floats[i, HEADING])
