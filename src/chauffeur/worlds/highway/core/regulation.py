"""Right of way at the intersection: highway-env's `RegulatedRoad` on arrays.

Twice a second every pair of vehicles is predicted at constant speed over 3 s; where their (enlarged) rectangles meet,
the one on the lane of lower priority stops until the next check. The corner test turns rectangles the wrong way round,
as in highway-env, and traffic behaves accordingly.
"""

from __future__ import annotations

import math

import numpy as np

from chauffeur.worlds.highway.core.arithmetic import dot, norm, row
from chauffeur.worlds.highway.core.jit import compiled
from chauffeur.worlds.highway.core.lanes import Array, centre_at, heading_at, local
from chauffeur.worlds.highway.core.layout import (
    ACCELERATION,
    EGO_PRESENT,
    FIRST,
    HEADING,
    KIND,
    LANE,
    LANE_LENGTH,
    LATERAL_SPEED,
    LENGTH,
    LIMIT,
    PRIORITY,
    ROUTE,
    ROUTE_AT,
    ROUTE_END,
    SPEED,
    STEERING,
    TARGET_SPEED,
    TICKS,
    TRAFFIC,
    VEHICLES,
    WIDTH,
    YAW_RATE,
    YIELDING,
    X,
    Y,
)
from chauffeur.worlds.highway.core.motion import bound_bicycle, load_bicycle, slide

_EVERY_TICKS = 5
_STEP_S = 0.25
_STEPS = 11  # 0.25 s to 2.75 s


@compiled
def _foresee_traffic(lanes: Array, traits: Array, roads: Array, floats: Array, ints: Array, i: int, out: Array) -> None:
    """Predict a car along its route at constant speed: rows of (x, y, heading)."""
    lane = ints[i, LANE]
    start, _ = local(lanes, traits, lane, floats[i, X], floats[i, Y])
    for n in range(_STEPS):
        s = start + floats[i, SPEED] * (_STEP_S * (n + 1))
        leg, end = ints[i, ROUTE_AT], ints[i, ROUTE_END]
        on = roads[ints[i, ROUTE + leg], FIRST] if leg < end else lane
        while leg + 1 < end and s > lanes[on, LANE_LENGTH]:
            s -= lanes[on, LANE_LENGTH]
            leg += 1
            on = roads[ints[i, ROUTE + leg], FIRST]
        out[n, 0], out[n, 1] = centre_at(lanes, traits, on, s)
        out[n, 2] = heading_at(lanes, traits, on, s)


@compiled
def _foresee_ego(floats: Array, ints: Array, out: Array) -> None:
    """Predict the ego at constant speed and steering: rows of (x, y, heading)."""
    ghost, ghost_ints = floats[0:1].copy(), ints[0:1].copy()
    ghost[0, ACCELERATION] = 0.0
    state = np.empty(6)
    for n in range(_STEPS):
        bound_bicycle(ghost, ghost_ints, 0)
        load_bicycle(ghost, 0, state)
        slide(state, ghost[0, STEERING], ghost[0, ACCELERATION], _STEP_S)
        ghost[0, X], ghost[0, Y], ghost[0, HEADING] = state[0], state[1], state[2]
        ghost[0, SPEED] = state[3]
        ghost[0, LATERAL_SPEED], ghost[0, YAW_RATE] = state[4], state[5]
        out[n, 0], out[n, 1], out[n, 2] = state[0], state[1], state[2]


@compiled
def _corner_inside(
    ax: float, ay: float, a_heading: float, bx: float, by: float, b_heading: float, length: float, width: float
) -> bool:
    """True if a corner, edge middle or the centre of rectangle a lies in b (turned the wrong way, see above)."""
    ca, sa = math.cos(a_heading), math.sin(a_heading)
    cb, sb = math.cos(b_heading), math.sin(b_heading)
    for u in range(-1, 2):
        for v in range(-1, 2):
            px, py = u * length / 2.0, v * width / 2.0
            dx, dy = dot(ca, px, -sa, py) + ax - bx, dot(sa, px, ca, py) + ay - by
            rx, ry = row(cb, dx, -sb, dy), row(sb, dx, cb, dy)
            if -length / 2.0 <= rx <= length / 2.0 and -width / 2.0 <= ry <= width / 2.0:
                return True
    return False


@compiled
def _conflict(a: Array, b: Array, length: float, width: float) -> bool:
    for n in range(_STEPS):
        dx, dy = b[n, 0] - a[n, 0], b[n, 1] - a[n, 1]
        if norm(dx, dy) > length:
            continue
        if _corner_inside(
            a[n, 0], a[n, 1], a[n, 2], b[n, 0], b[n, 1], b[n, 2], 1.5 * length, 0.9 * width
        ) or _corner_inside(b[n, 0], b[n, 1], b[n, 2], a[n, 0], a[n, 1], a[n, 2], 1.5 * length, 0.9 * width):
            return True
    return False


@compiled
def _ahead(floats: Array, i: int, j: int) -> float:
    """Distance from `i` to `j` along the heading of `i`, m."""
    c, s = math.cos(floats[i, HEADING]), math.sin(floats[i, HEADING])
    return dot(c, floats[j, X] - floats[i, X], s, floats[j, Y] - floats[i, Y])


@compiled
def regulate(lanes: Array, traits: Array, roads: Array, floats: Array, ints: Array, scene: Array) -> None:
    """Count a tick; on every fifth release yielding cars and stop those that must yield now."""
    scene[TICKS] += 1
    if scene[TICKS] % _EVERY_TICKS != 0:
        return
    vehicles = scene[VEHICLES]
    present = scene[EGO_PRESENT] == 1
    paths = np.empty((vehicles, _STEPS, 3))
    for i in range(1, vehicles):
        if ints[i, YIELDING] == 1:
            floats[i, TARGET_SPEED] = lanes[ints[i, LANE], LIMIT]
            ints[i, YIELDING] = 0
        _foresee_traffic(lanes, traits, roads, floats, ints, i, paths[i])
    if present:
        _foresee_ego(floats, ints, paths[0])
    for k in range(1, vehicles + 1):
        i = k % vehicles
        for q in range(k + 1, vehicles + 1):
            j = q % vehicles
            if (i == 0 or j == 0) and not present:
                continue
            if not _conflict(paths[i], paths[j], floats[i, LENGTH], floats[i, WIDTH]):
                continue
            mine, theirs = traits[ints[i, LANE], PRIORITY], traits[ints[j, LANE], PRIORITY]
            if mine > theirs:
                waits = j
            elif mine < theirs:
                waits = i
            else:
                waits = i if _ahead(floats, i, j) > _ahead(floats, j, i) else j
            if ints[waits, KIND] == TRAFFIC:
                floats[waits, TARGET_SPEED] = 0.0
                ints[waits, YIELDING] = 1
