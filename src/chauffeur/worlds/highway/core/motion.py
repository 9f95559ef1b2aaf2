"""Motion and contacts of vehicles: kinematic and dynamic bicycle, rectangles that push each other apart.

Source: highway-env's `Vehicle`, `BicycleVehicle` (Rajamani, "Vehicle Dynamics and Control", 2011, Ch. 2) and
`are_polygons_intersecting` (separating axes), on arrays.
"""

from __future__ import annotations

import math

import numpy as np

from chauffeur.worlds.highway.core.arithmetic import dot, norm, row
from chauffeur.worlds.highway.core.jit import compiled
from chauffeur.worlds.highway.core.lanes import Array, update_lane
from chauffeur.worlds.highway.core.layout import (
    ACCELERATION,
    CRASHED,
    DYNAMIC_EGO,
    EGO_PRESENT,
    ENTITIES,
    HEADING,
    KIND,
    LATERAL_SPEED,
    LENGTH,
    OBSTACLE,
    PUSH_X,
    PUSH_Y,
    PUSHED,
    SIGN,
    SPEED,
    STEERING,
    TIMER,
    TRAFFIC,
    VEHICLES,
    WIDTH,
    YAW_RATE,
    X,
    Y,
)
from chauffeur.worlds.highway.core.traffic import clip

_TOP_SPEED = 40.0
_TOP_SPEED_CROSSING = 15.0  # LaMPilot's bound for the dynamic ego
_HALF_LENGTH = 2.5
_INERTIA = 1.0 / 12.0 * 29.0  # of a 5 m x 2 m plate of mass 1
_GRIP = 15.0
_TOP_YAW_RATE = 2.0 * math.pi


@compiled
def clip_action(floats: Array, ints: Array, i: int, top_speed: float) -> None:
    """Bound the action in force: a crashed car brakes, a car at top speed stops gaining."""
    if ints[i, CRASHED] == 1:
        floats[i, STEERING] = 0.0
        floats[i, ACCELERATION] = -1.0 * floats[i, SPEED]
    speed = floats[i, SPEED]
    if speed > top_speed:
        floats[i, ACCELERATION] = min(floats[i, ACCELERATION], top_speed - speed)
    elif speed < -_TOP_SPEED:
        floats[i, ACCELERATION] = max(floats[i, ACCELERATION], -_TOP_SPEED - speed)


@compiled
def glide(floats: Array, ints: Array, i: int, dt: float) -> None:
    """Kinematic bicycle, explicit Euler, one step of a car whose action is clipped already."""
    heading, speed = floats[i, HEADING], floats[i, SPEED]
    slip = math.atan(0.5 * math.tan(floats[i, STEERING]))
    floats[i, X] += speed * math.cos(heading + slip) * dt
    floats[i, Y] += speed * math.sin(heading + slip) * dt
    if ints[i, PUSHED] == 1:
        floats[i, X] += floats[i, PUSH_X]
        floats[i, Y] += floats[i, PUSH_Y]
        ints[i, CRASHED] = 1
        ints[i, PUSHED] = 0
    floats[i, HEADING] = heading + speed * math.sin(slip) / _HALF_LENGTH * dt
    floats[i, SPEED] = speed + floats[i, ACCELERATION] * dt


@compiled
def _rates(
    heading: float, speed: float, lateral: float, yaw: float, steering: float, acceleration: float
) -> tuple[float, float, float, float, float, float]:
    if abs(speed) < 1.0:  # tyres hardly slip: sideways motion is damped out
        front = -lateral - _INERTIA / _HALF_LENGTH * yaw
        rear = -lateral + _INERTIA / _HALF_LENGTH * yaw
    else:
        front = 2.0 * _GRIP * (steering - math.atan2(lateral + _HALF_LENGTH * yaw, speed))
        rear = 2.0 * _GRIP * (0.0 - math.atan2(lateral - _HALF_LENGTH * yaw, speed))
    c, s = math.cos(heading), math.sin(heading)
    return (
        row(c, speed, -s, lateral),
        row(s, speed, c, lateral),
        yaw,
        acceleration,
        (front + rear) - yaw * speed,
        1.0 / _INERTIA * (_HALF_LENGTH * front - _HALF_LENGTH * rear),
    )


@compiled
def slide(state: Array, steering: float, acceleration: float, dt: float) -> None:
    """Dynamic bicycle, one RK4 step of `state` = (x, y, heading, speed, lateral speed, yaw rate), in place."""
    k1 = _rates(state[2], state[3], state[4], state[5], steering, acceleration)
    h = dt / 2.0
    k2 = _rates(
        state[2] + k1[2] * h, state[3] + k1[3] * h, state[4] + k1[4] * h, state[5] + k1[5] * h, steering, acceleration
    )
    k3 = _rates(
        state[2] + k2[2] * h, state[3] + k2[3] * h, state[4] + k2[4] * h, state[5] + k2[5] * h, steering, acceleration
    )
    k4 = _rates(
        state[2] + k3[2] * dt,
        state[3] + k3[3] * dt,
        state[4] + k3[4] * dt,
        state[5] + k3[5] * dt,
        steering,
        acceleration,
    )
    for n in range(6):
        state[n] += (dt / 6.0) * (k1[n] + 2.0 * k2[n] + 2.0 * k3[n] + k4[n])


@compiled
def load_bicycle(floats: Array, i: int, state: Array) -> None:
    """Copy an entity's state into the six numbers of `slide`, the yaw rate bounded."""
    state[0], state[1], state[2] = floats[i, X], floats[i, Y], floats[i, HEADING]
    state[3], state[4] = floats[i, SPEED], floats[i, LATERAL_SPEED]
    state[5] = clip(floats[i, YAW_RATE], -_TOP_YAW_RATE, _TOP_YAW_RATE)


@compiled
def bound_bicycle(floats: Array, ints: Array, i: int) -> None:
    """Bound the action of a dynamic bicycle."""
    clip_action(floats, ints, i, _TOP_SPEED_CROSSING)
    floats[i, STEERING] = clip(floats[i, STEERING], -math.pi / 2.0, math.pi / 2.0)


@compiled
def _move_ego(floats: Array, ints: Array, scene: Array, dt: float) -> None:
    if scene[DYNAMIC_EGO] == 0:
        clip_action(floats, ints, 0, _TOP_SPEED)
        glide(floats, ints, 0, dt)
        return
    bound_bicycle(floats, ints, 0)
    state = np.empty(6)
    load_bicycle(floats, 0, state)
    slide(state, floats[0, STEERING], floats[0, ACCELERATION], dt)
    floats[0, X], floats[0, Y], floats[0, HEADING] = state[0], state[1], state[2]
    floats[0, SPEED], floats[0, LATERAL_SPEED], floats[0, YAW_RATE] = state[3], state[4], state[5]


@compiled
def corners(floats: Array, i: int, out: Array) -> None:
    """The rectangle of an entity as four corners, metres."""
    c, s = math.cos(floats[i, HEADING]), math.sin(floats[i, HEADING])
    x, y = floats[i, X], floats[i, Y]
    a, b = floats[i, LENGTH] / 2.0, floats[i, WIDTH] / 2.0
    for n in range(4):
        u = -a if n < 2 else a
        v = b if 0 < n < 3 else -b
        out[n, 0] = dot(c, u, -s, v) + x
        out[n, 1] = dot(s, u, c, v) + y


@compiled
def _span(points: Array, nx: float, ny: float) -> tuple[float, float]:
    low = high = dot(points[0, 0], nx, points[0, 1], ny)
    for n in range(1, 4):
        value = dot(points[n, 0], nx, points[n, 1], ny)
        low, high = min(low, value), max(high, value)
    return low, high


@compiled
def _apart(min_a: float, max_a: float, min_b: float, max_b: float) -> float:
    return min_b - max_a if min_a < min_b else min_a - max_b


@compiled
def touching(floats: Array, i: int, j: int, dt: float) -> tuple[bool, bool, float, float]:
    """(overlap now, overlap within `dt`, push x, push y) of two rectangles; the push parts them, for `i`."""
    a, b = np.empty((4, 2)), np.empty((4, 2))
    corners(floats, i, a)
    corners(floats, j, b)
    vx = floats[i, SPEED] * math.cos(floats[i, HEADING]) * dt - floats[j, SPEED] * math.cos(floats[j, HEADING]) * dt
    vy = floats[i, SPEED] * math.sin(floats[i, HEADING]) * dt - floats[j, SPEED] * math.sin(floats[j, HEADING]) * dt
    cx = (a[0, 0] + a[1, 0] + a[2, 0] + a[3, 0]) / 4.0 - (b[0, 0] + b[1, 0] + b[2, 0] + b[3, 0]) / 4.0
    cy = (a[0, 1] + a[1, 1] + a[2, 1] + a[3, 1]) / 4.0 - (b[0, 1] + b[1, 1] + b[2, 1] + b[3, 1]) / 4.0
    now, soon = True, True
    least = math.inf
    axis_x, axis_y = 0.0, 0.0
    for polygon in range(2):
        points = a if polygon == 0 else b
        for n in range(4):
            m = (n + 1) % 4
            nx, ny = points[n, 1] - points[m, 1], points[m, 0] - points[n, 0]
            length = norm(nx, ny)
            nx, ny = nx / length, ny / length
            min_a, max_a = _span(a, nx, ny)
            min_b, max_b = _span(b, nx, ny)
            if _apart(min_a, max_a, min_b, max_b) > 0.0:
                now = False
            drift = dot(nx, vx, ny, vy)
            if drift < 0.0:
                min_a += drift
            else:
                max_a += drift
            distance = _apart(min_a, max_a, min_b, max_b)
            if distance > 0.0:
                soon = False
            if not now and not soon:
                return False, False, 0.0, 0.0
            if abs(distance) < least:
                least = abs(distance)
                sign = 1.0 if dot(cx, nx, cy, ny) > 0.0 else -1.0
                axis_x, axis_y = sign * nx, sign * ny
    return now, soon, least * axis_x, least * axis_y


@compiled
def _diagonal(floats: Array, i: int) -> float:
    return math.sqrt(floats[i, LENGTH] * floats[i, LENGTH] + floats[i, WIDTH] * floats[i, WIDTH])


@compiled
def _meet(floats: Array, ints: Array, i: int, j: int, dt: float) -> None:
    """Let entity `i` check for `j`, as `RoadObject.handle_collisions` does."""
    dx, dy = floats[j, X] - floats[i, X], floats[j, Y] - floats[i, Y]
    reach = (_diagonal(floats, i) + _diagonal(floats, j)) / 2.0
    reach += floats[i, SPEED] * dt
    if norm(dx, dy) > reach:
        return
    now, soon, push_x, push_y = touching(floats, i, j, dt)
    if soon:
        if ints[j, KIND] == OBSTACLE:
            floats[i, PUSH_X], floats[i, PUSH_Y] = push_x, push_y
        else:
            floats[i, PUSH_X], floats[i, PUSH_Y] = push_x / 2.0, push_y / 2.0
            floats[j, PUSH_X], floats[j, PUSH_Y] = -push_x / 2.0, -push_y / 2.0
            ints[j, PUSHED] = 1
        ints[i, PUSHED] = 1
    if now:
        ints[i, CRASHED] = 1
        ints[j, CRASHED] = 1


@compiled
def move(lanes: Array, traits: Array, floats: Array, ints: Array, scene: Array, dt: float) -> None:
    """Move every vehicle, then test all pairs in highway-env's order."""
    vehicles, entities = scene[VEHICLES], scene[ENTITIES]
    for i in range(1, vehicles):
        if ints[i, KIND] == TRAFFIC:
            floats[i, TIMER] += dt
        clip_action(floats, ints, i, _TOP_SPEED)
        glide(floats, ints, i, dt)
        update_lane(lanes, traits, floats, ints, i)
    present = scene[EGO_PRESENT] == 1
    if present:
        _move_ego(floats, ints, scene, dt)
        update_lane(lanes, traits, floats, ints, 0)
    for k in range(1, vehicles + 1):
        i = k % vehicles
        if i == 0 and not present:
            continue
        far = 6.0 + abs(floats[i, SPEED]) * dt
        for q in range(k + 1, entities + 1):
            j = q if q < vehicles else 0 if q == vehicles else q - 1
            if q > vehicles and ints[j, KIND] == SIGN:
                continue
            if j == 0 and not present:
                continue
            if abs(floats[j, X] - floats[i, X]) <= far:
                _meet(floats, ints, i, j, dt)
