"""Other drivers: IDM along the lane, MOBIL across lanes, lane keeping; highway-env's `IDMVehicle` on arrays.

Source: Treiber et al. 2000 (IDM), Kesting et al. 2007 (MOBIL), in the form and with the constants of the highway-env
package, of which every branch is kept: the reference world is the oracle of these functions.
"""

from __future__ import annotations

import math

from chauffeur.worlds.highway.core.arithmetic import dot
from chauffeur.worlds.highway.core.jit import compiled
from chauffeur.worlds.highway.core.lanes import (
    Array,
    after_end,
    along,
    heading_at,
    local,
    next_lane,
    planned_road,
    reachable,
    within,
    wrap,
)
from chauffeur.worlds.highway.core.layout import (
    ACCELERATION,
    COUNT,
    CRASHED,
    EGO_KIND,
    EGO_PRESENT,
    ENTITIES,
    EXPONENT,
    FIRST,
    HEADING,
    INDEX,
    KIND,
    LANE,
    LENGTH,
    LIMIT,
    OBSTACLE,
    PARALLEL,
    ROAD,
    SIGN,
    SOLID,
    SPEED,
    STEERING,
    TARGET_LANE,
    TARGET_SPEED,
    TIMER,
    TRAFFIC,
    VEHICLES,
    X,
    Y,
)

_ACC_MAX = 6.0
_COMFORT_ACC = 3.0
_COMFORT_BRAKE = 5.0
_JAM_M = 10.0
_HEADWAY_S = 1.5
_CHANGE_DELAY_S = 1.0
_CHANGE_GAIN = 0.2
_CHANGE_BRAKING = 2.0
_MAX_STEERING = math.pi / 3.0
_GAP_ROOT = 2.0 * math.sqrt(_COMFORT_ACC * _COMFORT_BRAKE)
_NEIGHBOUR_MARGIN_M = 1.0


@compiled
def off_zero(value: float) -> float:
    """`value`, or 0.01 with its sign where it is closer to zero than that."""
    if abs(value) > 1e-2:
        return value
    return 1e-2 if value >= 0 else -1e-2


@compiled
def clip(value: float, low: float, high: float) -> float:
    """`value` within bounds."""
    return min(max(value, low), high)


@compiled
def sort_along(floats: Array, order: Array, scene: Array) -> None:
    """Restore `order` after a step; cars seldom pass each other, so insertion sort looks at each one once."""
    if scene[PARALLEL] == 0:
        return
    for k in range(1, scene[SOLID]):
        row = order[k]
        x = floats[row, X]
        q = k - 1
        while q >= 0 and floats[order[q], X] > x:
            order[q + 1] = order[q]
            q -= 1
        order[q + 1] = row


@compiled
def rank(scene: Array, row: int) -> int:
    """Place of a row in highway-env's list: other vehicles, the ego, objects."""
    if row == 0:
        return scene[VEHICLES] - 1
    return row - 1 if row < scene[VEHICLES] else row


@compiled
def _neighbours_sorted(
    lanes: Array, traits: Array, floats: Array, scene: Array, order: Array, i: int, lane: int
) -> tuple[int, int]:
    x = floats[i, X]
    count = scene[SOLID]
    # Rows left of x come first, then those at x, then those beyond.
    low, high = 0, count
    while low < high:
        middle = (low + high) // 2
        if floats[order[middle], X] < x:
            low = middle + 1
        else:
            high = middle
    front, rear = -1, -1
    for q in range(low, count):
        j = order[q]
        if front >= 0 and floats[j, X] > floats[front, X]:
            break
        if j == i:
            continue
        s, r = local(lanes, traits, lane, floats[j, X], floats[j, Y])
        if within(lanes, lane, s, r, _NEIGHBOUR_MARGIN_M) and (front < 0 or rank(scene, j) > rank(scene, front)):
            front = j
    for q in range(low - 1, -1, -1):
        j = order[q]
        if rear >= 0 and floats[j, X] < floats[rear, X]:
            break
        s, r = local(lanes, traits, lane, floats[j, X], floats[j, Y])
        if within(lanes, lane, s, r, _NEIGHBOUR_MARGIN_M) and (rear < 0 or rank(scene, j) < rank(scene, rear)):
            rear = j
    return front, rear


@compiled
def _neighbours_all(
    lanes: Array, traits: Array, floats: Array, ints: Array, scene: Array, i: int, lane: int
) -> tuple[int, int]:
    own = along(lanes, traits, lane, floats[i, X], floats[i, Y])
    front, rear = -1, -1
    front_s, rear_s = 0.0, 0.0
    vehicles, entities = scene[VEHICLES], scene[ENTITIES]
    for k in range(1, entities + 1):
        # Other vehicles, then the ego, then the objects.
        j = k if k < vehicles else 0 if k == vehicles else k - 1
        if j == i or ints[j, KIND] == SIGN or (j == 0 and scene[EGO_PRESENT] == 0):
            continue
        s, r = local(lanes, traits, lane, floats[j, X], floats[j, Y])
        if not within(lanes, lane, s, r, _NEIGHBOUR_MARGIN_M):
            continue
        if own <= s and (front < 0 or s <= front_s):
            front, front_s = j, s
        if s < own and (rear < 0 or s > rear_s):
            rear, rear_s = j, s
    return front, rear


@compiled
def neighbours(
    lanes: Array, traits: Array, floats: Array, ints: Array, scene: Array, order: Array, i: int, lane: int
) -> tuple[int, int]:
    """Rows of the nearest solid entities ahead of and behind entity `i` projected on a lane, -1 for none."""
    if scene[PARALLEL] == 1:
        return _neighbours_sorted(lanes, traits, floats, scene, order, i, lane)
    return _neighbours_all(lanes, traits, floats, ints, scene, i, lane)


@compiled
def gap(lanes: Array, traits: Array, floats: Array, ints: Array, i: int, j: int) -> float:
    """Centre-to-centre distance from `i` to `j` along the lane of `i`, m."""
    lane = ints[i, LANE]
    own = along(lanes, traits, lane, floats[i, X], floats[i, Y])
    return along(lanes, traits, lane, floats[j, X], floats[j, Y]) - own


@compiled
def approach_rate(floats: Array, i: int, j: int) -> float:
    """Speed of `i` relative to `j` along the heading of `i`, m/s."""
    c, s = math.cos(floats[i, HEADING]), math.sin(floats[i, HEADING])
    dx = floats[i, SPEED] * c - floats[j, SPEED] * math.cos(floats[j, HEADING])
    dy = floats[i, SPEED] * s - floats[j, SPEED] * math.sin(floats[j, HEADING])
    return dot(dx, c, dy, s)


@compiled
def wanted_gap(floats: Array, i: int, j: int) -> float:
    """IDM's desired distance of `i` behind `j`, m."""
    speed = floats[i, SPEED]
    return _JAM_M + speed * _HEADWAY_S + speed * approach_rate(floats, i, j) / _GAP_ROOT


@compiled
def idm(lanes: Array, traits: Array, floats: Array, ints: Array, exponent: float, i: int, front: int) -> float:
    """IDM acceleration of `i` behind `front` (-1: none), m/s2; 0 for no vehicle. `exponent` is the asking driver's."""
    if i < 0 or ints[i, KIND] >= OBSTACLE:
        return 0.0
    # Traffic takes the ego for a car that wants to stand: highway-env finds no target speed on it.
    target = 0.0 if ints[i, KIND] == EGO_KIND else clip(floats[i, TARGET_SPEED], 0.0, lanes[ints[i, LANE], LIMIT])
    acceleration = _COMFORT_ACC * (1.0 - (max(floats[i, SPEED], 0.0) / abs(off_zero(target))) ** exponent)
    if front >= 0:
        ratio = wanted_gap(floats, i, front) / off_zero(gap(lanes, traits, floats, ints, i, front))
        acceleration -= _COMFORT_ACC * (ratio * ratio)
    return acceleration


@compiled
def steer_to(lanes: Array, traits: Array, floats: Array, i: int, lane: int) -> float:
    """Steering angle that brings entity `i` onto a lane's centre, rad."""
    speed = floats[i, SPEED]
    s, r = local(lanes, traits, lane, floats[i, X], floats[i, Y])
    heading_ahead = heading_at(lanes, traits, lane, s + speed * 0.1)
    divisor = off_zero(speed)
    approach = math.asin(clip(-(1.0 / 0.6) * r / divisor, -1.0, 1.0))
    reference = heading_ahead + clip(approach, -math.pi / 4.0, math.pi / 4.0)
    rate = (1.0 / 0.2) * wrap(reference - floats[i, HEADING])
    slip = math.asin(clip(floats[i, LENGTH] / 2.0 / divisor * rate, -1.0, 1.0))
    return clip(math.atan(2.0 * math.tan(slip)), -_MAX_STEERING, _MAX_STEERING)


@compiled
def _abort_change(lanes: Array, traits: Array, floats: Array, ints: Array, scene: Array, i: int) -> None:
    """Give a lane change up if another vehicle close ahead is changing into the same lane."""
    lane, target = ints[i, LANE], ints[i, TARGET_LANE]
    if traits[lane, ROAD] != traits[target, ROAD]:
        return
    for j in range(1, scene[VEHICLES]):
        if j != i and ints[j, LANE] != target and ints[j, TARGET_LANE] == target:
            distance = gap(lanes, traits, floats, ints, i, j)
            if distance > 0.0 and distance < wanted_gap(floats, i, j):
                ints[i, TARGET_LANE] = lane
                return


@compiled
def _worth_changing(
    lanes: Array, traits: Array, floats: Array, ints: Array, scene: Array, order: Array, i: int, lane: int
) -> bool:
    """MOBIL with politeness 0: safe for the new follower, and a gain for oneself."""
    exponent = floats[i, EXPONENT]
    ahead, behind = neighbours(lanes, traits, floats, ints, scene, order, i, lane)
    if idm(lanes, traits, floats, ints, exponent, behind, i) < -_CHANGE_BRAKING:
        return False
    ahead_now, _ = neighbours(lanes, traits, floats, ints, scene, order, i, ints[i, LANE])
    after = idm(lanes, traits, floats, ints, exponent, i, ahead)
    now = idm(lanes, traits, floats, ints, exponent, i, ahead_now)
    return not (after - now < _CHANGE_GAIN)


@compiled
def _choose_lane(
    lanes: Array, traits: Array, roads: Array, floats: Array, ints: Array, scene: Array, order: Array, i: int
) -> None:
    if ints[i, LANE] != ints[i, TARGET_LANE]:
        _abort_change(lanes, traits, floats, ints, scene, i)
        return
    if not (floats[i, TIMER] > _CHANGE_DELAY_S):
        return
    floats[i, TIMER] = 0.0
    if abs(floats[i, SPEED]) < 1.0:
        return
    lane = ints[i, LANE]
    road, index = traits[lane, ROAD], traits[lane, INDEX]
    for side in (-1, 1):
        place = index + side
        if place < 0 or place >= roads[road, COUNT]:
            continue
        candidate = roads[road, FIRST] + place
        if reachable(lanes, traits, candidate, floats[i, X], floats[i, Y]) and _worth_changing(
            lanes, traits, floats, ints, scene, order, i, candidate
        ):
            ints[i, TARGET_LANE] = candidate


@compiled
def act(lanes: Array, traits: Array, roads: Array, floats: Array, ints: Array, scene: Array, order: Array) -> None:
    """Every other driver decides, in spawn order; positions stand still meanwhile."""
    for i in range(1, scene[VEHICLES]):
        if ints[i, KIND] != TRAFFIC or ints[i, CRASHED] == 1:
            continue
        target = ints[i, TARGET_LANE]
        if after_end(lanes, traits, target, floats[i, X], floats[i, Y]):
            road = planned_road(traits, roads, ints, i, target)
            ints[i, TARGET_LANE] = next_lane(lanes, traits, roads, target, road, floats[i, X], floats[i, Y])
        _choose_lane(lanes, traits, roads, floats, ints, scene, order, i)
        lane, target = ints[i, LANE], ints[i, TARGET_LANE]
        exponent = floats[i, EXPONENT]
        floats[i, STEERING] = steer_to(lanes, traits, floats, i, target)
        front, _ = neighbours(lanes, traits, floats, ints, scene, order, i, lane)
        acceleration = idm(lanes, traits, floats, ints, exponent, i, front)
        if lane != target:
            front, _ = neighbours(lanes, traits, floats, ints, scene, order, i, target)
            acceleration = min(acceleration, idm(lanes, traits, floats, ints, exponent, i, front))
        floats[i, ACCELERATION] = clip(acceleration, -_ACC_MAX, _ACC_MAX)
