"""Rollout of a car that brakes to a stand after a command: the poses of its body, and who may be met there.

Compiled, and all in this file, because numba checks only the file a function stands in when it reuses machine code.

Arrays: a line has rows (x, y, heading) every metre. A car is (wheelbase, rear axle to middle, length, width, full lock,
steering rate, hardest acceleration, hardest braking, grip, lag). A state is (x, y, heading) of the rear axle, speed,
wheel angle, acceleration. Everybody else is a row (x, y, heading, speed, length, width, side, brakes, first row and
number of rows of the line it follows, station on it, offset to its left, way to a stand for the car, way that it needs
between itself and a car that enters its lane); who follows no line has 0 rows of it and goes straight on.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chauffeur.control.kinematic_bicycle import KinematicBicycle
from chauffeur.safety.shield.compiled import compiled

Array = NDArray[np.float64]

PURSUE, HELD, STRAIGHT = 0, 1, 2
"""Steering laws while braking: back along a line, wheel held, wheel straight."""
LAWS: Final = (PURSUE, HELD, STRAIGHT)
LONGEST: Final = 400
"""Periods that are looked at at most: 20 s at 20 Hz, more than any car takes to stand."""
_LEAST_LOOK_M = 3.2
_LOOK_S = 0.6
_DISC_M = 1.0
"""Bodies of others are covered by discs so far apart."""
_GAP_M = 0.6
"""Left to whoever is ahead."""
_STANDS_MPS = 0.05


def numbers(car: KinematicBicycle, speed_mps: float = 0.0) -> Array:
    """A car as the functions here want it: as large as the ground that it may come to a stand on from a speed."""
    stray = 2.0 * car.stray_s * speed_mps
    return np.array(
        [
            car.wheelbase_m, car.rear_to_middle_m, car.length_m + stray, car.width_m + stray,
            car.most_steering_rad,
            car.steering_rate_radps, car.most_acceleration_mps2, car.most_braking_mps2, car.grip_mps2, car.lag_s,
        ]
    )  # fmt: skip


@compiled
def _clipped(value: float, bound: float) -> float:
    return max(-bound, min(bound, value))


@compiled
def _wrapped(angle: float) -> float:
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


@compiled
def nearest(line: Array, x: float, y: float, guess: int, window: int) -> int:
    """Row of a line that is closest to a place, looked for about a guess; below 0 among all."""
    low = 0 if guess < 0 else max(0, guess - window)
    high = len(line) if guess < 0 else min(len(line), guess + window + 1)
    best, found = math.inf, low
    for i in range(low, high):
        away = (line[i, 0] - x) ** 2 + (line[i, 1] - y) ** 2
        if away < best:
            best, found = away, i
    return found


@compiled
def along(line: Array, x: float, y: float, heading: float) -> tuple[float, float, float]:
    """(station, offset to its left, angle against it) of somebody on a line; before its start and beyond its end, too.

    Close to it: rows are a metre apart, and the leg from the closest one is taken.
    """
    row = nearest(line, x, y, -1, 0)
    c, s = math.cos(line[row, 2]), math.sin(line[row, 2])
    dx, dy = x - line[row, 0], y - line[row, 1]
    return row + c * dx + s * dy, c * dy - s * dx, _wrapped(heading - line[row, 2])


@compiled
def pursuing(state: Array, line: Array, at: int, car: Array) -> float:
    """Wheel angle that leads a rear axle back to a line: pure pursuit, on beyond its end."""
    look = max(_LEAST_LOOK_M, _LOOK_S * state[3])
    ahead = at + math.ceil(look)
    last = len(line) - 1
    row = min(ahead, last)
    beyond = float(ahead - row)
    if at == last:  # the car itself may be beyond the end
        beyond += max(
            0.0,
            math.cos(line[last, 2]) * (state[0] - line[last, 0]) + math.sin(line[last, 2]) * (state[1] - line[last, 1]),
        )
    x, y = line[row, 0] + beyond * math.cos(line[row, 2]), line[row, 1] + beyond * math.sin(line[row, 2])
    dx, dy = x - state[0], y - state[1]
    away = max(dx * dx + dy * dy, 1e-6)
    bearing = _wrapped(math.atan2(dy, dx) - state[2])
    if abs(bearing) > math.pi / 2.0:
        return math.copysign(car[4], bearing)
    return _clipped(math.atan(2.0 * car[0] * math.sin(bearing) / math.sqrt(away)), car[4])


@compiled
def _moved(state: Array, acceleration: float, steering: float, dt_s: float, car: Array) -> None:
    """`control.kinematic_bicycle.advanced`, in place, of a car whose pedals answer by and by."""
    asked = max(-car[7], min(car[6], acceleration))
    if car[9] > 0.0:
        asked += (state[5] - asked) * math.exp(-dt_s / car[9])
        state[5] = asked
    turn = car[5] * dt_s
    wheel = max(state[4] - turn, min(state[4] + turn, _clipped(steering, car[4])))
    before = state[3]
    speed = max(0.0, before + asked * dt_s)
    way = (before + speed) / 2.0 * dt_s
    if speed == 0.0 and asked < 0.0:
        way = min(way, before * before / (-2.0 * asked))
    fastest = max(speed, before)
    held = car[8] / max(fastest * fastest, 1e-6)
    half = way * _clipped(math.tan(wheel) / car[0], held) / 2.0
    chord = way * (math.sin(half) / half if abs(half) > 1e-9 else 1.0)
    state[0] += chord * math.cos(state[2] + half)
    state[1] += chord * math.sin(state[2] + half)
    state[2] += 2.0 * half
    state[3], state[4] = speed, wheel


@compiled
def stopped(
    start: Array, acceleration: float, steering: float, car: Array, dt_s: float, line: Array, at: int, law: int
) -> Array:
    """Poses of the middle of a car: now, after a period under a command, and then each period until it stands.

    Returns:
        (n, 5): x, y, heading, speed, row of the line that the rear axle is at.
    """
    rows = np.empty((LONGEST, 5))
    state = start.copy()
    count = 0
    at = nearest(line, state[0], state[1], at, 8)
    while count < LONGEST:
        rows[count, 0] = state[0] + car[1] * math.cos(state[2])
        rows[count, 1] = state[1] + car[1] * math.sin(state[2])
        rows[count, 2], rows[count, 3], rows[count, 4] = state[2], state[3], at
        count += 1
        if count > 1 and state[3] <= 0.0:
            break
        if count == 1:
            _moved(state, acceleration, steering, dt_s, car)
        else:
            wheel = state[4] if law == HELD else 0.0 if law == STRAIGHT else pursuing(state, line, at, car)
            _moved(state, -car[7], wheel, dt_s, car)
        at = nearest(line, state[0], state[1], at, 3)
    return rows[:count]


@compiled
def followed(line: Array, car: Array, speed_mps: float, dt_s: float) -> Array:
    """Poses of a car that follows a line from its start to its end at an even speed; rows as of `stopped`."""
    count = int(len(line) / (speed_mps * dt_s)) + 1
    rows = np.empty((count, 5))
    state = np.array([line[0, 0], line[0, 1], line[0, 2], speed_mps, 0.0, 0.0])
    at = 0
    for i in range(count):
        at = nearest(line, state[0], state[1], at, 4)
        rows[i, 0] = state[0] + car[1] * math.cos(state[2])
        rows[i, 1] = state[1] + car[1] * math.sin(state[2])
        rows[i, 2], rows[i, 3], rows[i, 4] = state[2], speed_mps, at
        _moved(state, 0.0, pursuing(state, line, at, car), dt_s, car)
    return rows


@compiled
def _apart(pose: Array, px: float, py: float, long: float, wide: float, gap: float) -> float:
    """Distance of a place from a body, and from what it keeps free ahead of itself, m."""
    dx, dy = px - pose[0], py - pose[1]
    c, s = math.cos(pose[2]), math.sin(pose[2])
    u, v = c * dx + s * dy, abs(c * dy - s * dx) - wide
    u = u - long - gap if u > 0.0 else -u - long
    return math.hypot(max(u, 0.0), max(v, 0.0))


@compiled
def _place(other: Array, ways: Array, sigma: float) -> tuple[float, float]:
    """A place on the way of somebody, so far ahead of their middle; behind it they are as they stand."""
    if other[9] <= 0.0 or sigma <= 0.0:
        return other[0] + sigma * math.cos(other[2]), other[1] + sigma * math.sin(other[2])
    at = other[10] + sigma
    row = max(0, min(int(at + 0.5), int(other[9]) - 1))
    ahead = at - row
    row += int(other[8])
    c, s = math.cos(ways[row, 2]), math.sin(ways[row, 2])
    return ways[row, 0] + ahead * c - other[11] * s, ways[row, 1] + ahead * s + other[11] * c


@compiled
def _parted(pose: Array, front: float, back: float, wide: float, other: Array, side: float) -> bool:
    """True if a body, from so far behind its middle to so far ahead, is clear of one that stands: separating axes."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    dx, dy = other[0] - pose[0], other[1] - pose[1]
    u, v = c * dx + s * dy, c * dy - s * dx
    tc, ts = math.cos(other[2] - pose[2]), math.sin(other[2] - pose[2])
    a, b = other[4] / 2.0 + side, other[5] / 2.0 + side
    along, across = abs(tc) * a + abs(ts) * b, abs(ts) * a + abs(tc) * b
    if u - along >= front or u + along <= -back or abs(v) - across >= wide:
        return True
    middle, long = (front - back) / 2.0, (front + back) / 2.0
    x, y = tc * (u - middle) + ts * v, tc * v - ts * (u - middle)
    return abs(x) >= a + abs(tc) * long + abs(ts) * wide or abs(y) >= b + abs(ts) * long + abs(tc) * wide


@compiled
def _met_standing(poses: Array, car: Array, other: Array) -> int:
    """The first pose at which a car comes too close to somebody who stands; as many as there are for none.

    Who is too close already may not come closer; who touches may get away.
    """
    long, wide = car[2] / 2.0, car[3] / 2.0
    share = 1.0
    if not _parted(poses[0], long + _GAP_M, long, wide, other, other[6]):
        low, high = 0.0, 1.0
        if not _parted(poses[0], long, long, wide, other, 0.0):
            return len(poses)
        for _ in range(20):
            share = (low + high) / 2.0
            if _parted(poses[0], long + share * _GAP_M, long, wide, other, share * other[6]):
                low = share
            else:
                high = share
        share = low
    for i in range(1, len(poses)):
        if not _parted(poses[i], long + share * _GAP_M, long, wide, other, share * other[6]):
            return i
    return len(poses)


@compiled
def met(poses: Array, dt_s: float, car: Array, others: Array, ways: Array, braking_mps2: float) -> int:
    """The first row of the others whom a car may touch on its way; -1 for none.

    Somebody may be anywhere between where they get at their present speed and where they get if they brake at once, as
    long as the car moves; where it stands at last nobody may be who could not stop before it.
    """
    long, wide = car[2] / 2.0, car[3] / 2.0
    last = len(poses) - 1
    until = last * dt_s
    best, found = len(poses), -1
    for k in range(len(others)):
        other = others[k]
        speed = other[3]
        if speed < _STANDS_MPS:
            at = _met_standing(poses, car, other)
            if at < best:
                best, found = at, k
            continue
        step = min(_DISC_M, other[4])
        radius = math.hypot(step / 2.0, other[5] / 2.0) + other[6]
        half = other[4] / 2.0 - step / 2.0
        brakes = other[7] > 0.0
        stands_m = speed * speed / (2.0 * braking_mps2) if brakes else 0.0
        reach_m = max(speed * until, other[12], other[13])
        minds, enters = False, -1
        for d in range(math.ceil((2.0 * half + reach_m) / step) + 2):
            sigma = -half + d * step
            ahead = sigma - half
            if ahead > reach_m + step:
                break
            # The body is beyond the disc before this one, and has not gone too far yet.
            soonest = max(0.0, ahead - step) / speed
            px, py = _place(other, ways, sigma)
            if soonest <= until:
                far = sigma + half + step  # until then no other disc covers the body's end
                latest = math.inf
                if brakes and stands_m > far:
                    latest = (speed - math.sqrt(max(0.0, speed * speed - 2.0 * braking_mps2 * far))) / braking_mps2
                end = last if latest > until else math.ceil(latest / dt_s)
                for i in range(max(1, int(soonest / dt_s)), min(end, best - 1, last) + 1):
                    if _apart(poses[i], px, py, long, wide, _GAP_M) < radius:
                        best, found = i, k
                        break
            if ahead > 1e-9 and not minds:
                minds = _apart(poses[0], px, py, long, wide, 0.0) < radius  # it is in their way already
                if ahead <= other[13] and _apart(poses[1], px, py, long, wide, 0.0) < radius:
                    enters = 1
                elif enters < 0 and ahead <= other[12] and _apart(poses[last], px, py, long, wide, 0.0) < radius:
                    enters = last
        if enters >= 0 and not minds and enters < best:
            best, found = enters, k
    return found
