"""Quantities read off an instant: the lead, how close a collision is by three definitions, and the ego's driver.

The three times to collision (s, -1 for none) are those of LaMPilot's code (along the ego's lane, whatever the lateral
distance), of the paper's Eq. 1 (in the plane, between centres), and our lane-aware one (bumper to bumper, vehicles in
the ego's lane or overlapping it sideways).
"""

from __future__ import annotations

import math

from chauffeur.worlds.highway.core.jit import compiled
from chauffeur.worlds.highway.core.lanes import Array, along, heading_at, local, within
from chauffeur.worlds.highway.core.layout import (
    ACCELERATION,
    CAR_M,
    CRASHED,
    ENTITIES,
    HEADING,
    KIND,
    LANE,
    LANE_LENGTH,
    LANE_WIDTH,
    LENGTH,
    OUT_ACCELERATION,
    OUT_CRASHED,
    OUT_FRONT,
    OUT_GAP,
    OUT_LANE,
    OUT_ON_ROAD,
    OUT_STEERING,
    OUT_TTC_ALONG,
    OUT_TTC_LANE,
    OUT_TTC_PLANE,
    REGULATED,
    SIGN,
    SPEED,
    STEERING,
    VEHICLES,
    WIDTH,
    X,
    Y,
)
from chauffeur.worlds.highway.core.motion import move
from chauffeur.worlds.highway.core.regulation import regulate
from chauffeur.worlds.highway.core.traffic import act, approach_rate, gap, neighbours, off_zero, sort_along

_EGO_ACC = 6.0
_EGO_JAM_M = 6.0


@compiled
def ttc_along(lanes: Array, traits: Array, floats: Array, ints: Array, scene: Array) -> float:
    """LaMPilot's time to collision, s; -1 for none."""
    lane, speed, heading = ints[0, LANE], floats[0, SPEED], floats[0, HEADING]
    own = along(lanes, traits, lane, floats[0, X], floats[0, Y])
    least = -1.0
    for j in range(1, scene[VEHICLES]):
        if floats[j, SPEED] == speed:
            continue
        distance = along(lanes, traits, lane, floats[j, X], floats[j, Y]) - own
        time = distance / off_zero(speed - floats[j, SPEED] * math.cos(floats[j, HEADING] - heading))
        if time >= 0.0:
            least = min(least, time) if least > 0.0 else time
    return least


@compiled
def ttc_plane(floats: Array, scene: Array) -> float:
    """Least positive time to the closest approach, paper Eq. 1, s; -1 for none."""
    vx, vy = floats[0, SPEED] * math.cos(floats[0, HEADING]), floats[0, SPEED] * math.sin(floats[0, HEADING])
    least = -1.0
    for j in range(1, scene[VEHICLES]):
        dvx = vx - floats[j, SPEED] * math.cos(floats[j, HEADING])
        dvy = vy - floats[j, SPEED] * math.sin(floats[j, HEADING])
        square = dvx * dvx + dvy * dvy
        if square < 1e-12:
            continue
        time = -((floats[0, X] - floats[j, X]) * dvx + (floats[0, Y] - floats[j, Y]) * dvy) / square
        if time > 0.0 and (least < 0.0 or time < least):
            least = time
    return least


@compiled
def ttc_lane(lanes: Array, traits: Array, floats: Array, ints: Array, scene: Array) -> float:
    """Bumper-to-bumper time to collision with what shares the ego's lane or its width, s; -1 for none, 0 on contact."""
    lane = ints[0, LANE]
    own_s, own_r = local(lanes, traits, lane, floats[0, X], floats[0, Y])
    heading = heading_at(lanes, traits, lane, own_s)
    speed = floats[0, SPEED] * math.cos(floats[0, HEADING] - heading)
    least = -1.0
    for j in range(1, scene[ENTITIES]):
        if ints[j, KIND] == SIGN:
            continue
        s, r = local(lanes, traits, lane, floats[j, X], floats[j, Y])
        beside = abs(r - own_r) >= (floats[0, WIDTH] + floats[j, WIDTH]) / 2.0
        if (beside and ints[j, LANE] != lane) or not within(lanes, lane, s, r, 1.0):
            continue
        free = abs(s - own_s) - (floats[0, LENGTH] + floats[j, LENGTH]) / 2.0
        if free <= 0.0:
            if not beside:
                return 0.0
            continue
        other = floats[j, SPEED] * math.cos(floats[j, HEADING] - heading)
        closing = speed - other if s > own_s else other - speed
        if closing > 1e-6 and (least < 0.0 or free / closing < least):
            least = free / closing
    return least


@compiled
def report(lanes: Array, traits: Array, floats: Array, ints: Array, scene: Array, order: Array, out: Array) -> None:
    """Fill `out` (layout.py) with what the world, its goals and its scores read after every step."""
    lane = ints[0, LANE]
    s, r = local(lanes, traits, lane, floats[0, X], floats[0, Y])
    out[OUT_CRASHED] = ints[0, CRASHED]
    beyond = s >= lanes[lane, LANE_LENGTH] + CAR_M and abs(r) <= lanes[lane, LANE_WIDTH] / 2.0
    out[OUT_ON_ROAD] = 1.0 if within(lanes, lane, s, r, 0.0) else -1.0 if beyond else 0.0
    out[OUT_LANE] = lane
    front, _ = neighbours(lanes, traits, floats, ints, scene, order, 0, lane)
    out[OUT_FRONT] = front
    out[OUT_GAP] = gap(lanes, traits, floats, ints, 0, front) if front >= 0 else math.nan
    out[OUT_TTC_ALONG] = ttc_along(lanes, traits, floats, ints, scene)
    out[OUT_TTC_PLANE] = ttc_plane(floats, scene)
    out[OUT_TTC_LANE] = ttc_lane(lanes, traits, floats, ints, scene)
    out[OUT_STEERING] = floats[0, STEERING]
    out[OUT_ACCELERATION] = floats[0, ACCELERATION]


@compiled
def advance(
    lanes: Array,
    traits: Array,
    roads: Array,
    floats: Array,
    ints: Array,
    scene: Array,
    order: Array,
    out: Array,
    acceleration: float,
    steering: float,
    ticks: int,
    dt: float,
) -> None:
    """Step the scene `ticks` times under one ego action (m/s2, rad), then report."""
    for _ in range(ticks):
        floats[0, ACCELERATION], floats[0, STEERING] = acceleration, steering
        act(lanes, traits, roads, floats, ints, scene, order)
        if scene[REGULATED] == 1:
            regulate(lanes, traits, roads, floats, ints, scene)
        move(lanes, traits, floats, ints, scene, dt)
        sort_along(floats, order, scene)
    report(lanes, traits, floats, ints, scene, order, out)


@compiled
def blocker(lanes: Array, traits: Array, floats: Array, ints: Array, scene: Array, served: int, vehicles: bool) -> int:
    """Nearest stop sign (bit of `served` unset), or vehicle, ahead on the ego's own lane; -1 for none."""
    lane = ints[0, LANE]
    own = along(lanes, traits, lane, floats[0, X], floats[0, Y])
    found, nearest = -1, math.inf
    first = scene[VEHICLES]
    for j in range(first, scene[ENTITIES]):
        if ints[j, KIND] != SIGN or (served >> (j - first)) & 1 == 1:
            continue
        s, r = local(lanes, traits, lane, floats[j, X], floats[j, Y])
        if s >= own and s <= nearest and within(lanes, lane, s, r, 0.0):
            found, nearest = j, s
    if vehicles:
        for j in range(1, first):
            s, r = local(lanes, traits, lane, floats[j, X], floats[j, Y])
            if s >= own and s <= nearest and within(lanes, lane, s, r, 0.0):
                found, nearest = j, s
    return found


@compiled
def follow(
    lanes: Array,
    traits: Array,
    floats: Array,
    ints: Array,
    i: int,
    front: int,
    target_speed: float,
    headway: float,
) -> float:
    """`control.idm_acceleration` with LaMPilot's ego parameters, of entity `i` behind `front` (-1: none), m/s2."""
    speed = floats[i, SPEED]
    ratio = max(speed, 0.0) / abs(off_zero(target_speed))
    acceleration = _EGO_ACC * (1.0 - ratio**4.0)
    if front >= 0:
        desired = _EGO_JAM_M + speed * headway + speed * approach_rate(floats, i, front) / (2.0 * _EGO_ACC)
        if ints[front, KIND] == SIGN:
            desired -= _EGO_JAM_M / 2.0
        closeness = desired / off_zero(gap(lanes, traits, floats, ints, i, front))
        acceleration -= _EGO_ACC * (closeness * closeness)
    return acceleration
