"""Rollout of a command at a crossing: the ego under it and then under a plan, against all who cross.

Compiled, and all in this file, because numba checks only the file a function stands in when it reuses machine code.

The vehicle is the dynamic bicycle of LaMPilot's intersection (Rajamani, "Vehicle Dynamics and Control", 2011, Ch. 2),
stepped by one RK4 step of 0.1 s as there: below 5 m/s that step is longer than the tyres answer, and the car turns in
ways no bicycle of a textbook does. A shield that is to hold has to expect what the vehicle really does.

Arrays: a state is (x, y, heading, speed, lateral speed, yaw rate); a way has rows (x, y, heading) every `STEP_M`;
another is (x, y, cos, sin, speed, half length, half width).
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chauffeur.safety.shield.compiled import compiled

Array = NDArray[np.float64]

STEP_M: Final = 0.5
"""Distance between two points of a way."""
LAWS: Final = 4
"""Ways to steer back: lane keeping with a light hand, wheel straight, the best of nine wheels one period on, and lane
keeping with the whole wheel, which tight turns need."""

NONE, LEFT, MET, LATE = 0, 1, 2, 3
"""Ways a plan fails: the car leaves its way, it is where another agent may be, it does not get through in time."""

_HALF_LENGTH = 2.5
_INERTIA = 1.0 / 12.0 * 29.0
_GRIP = 15.0
_TOP_YAW_RATE = 2.0 * math.pi
_TOP_MPS = 15.0
_ROLLING_MPS = 1.0
"""Speed below which the wheel does nothing."""

_LIGHT_RAD = 0.3
_WHOLE_RAD = math.pi / 4
_APPROACH_RAD = 0.2
_LATERAL_GAIN = 1.0 / 0.6
_HEADING_GAIN = 5.0
_PREVIEW_S = 0.1
_WHEELS = (0.0, 0.2, -0.2, 0.4, -0.4, 0.6, -0.6, 0.78, -0.78)
_BACK_PER_M = 0.3
_CARRY_S = 0.15
_WHEEL_COST = 0.05

_FASTEST_MPS = 14.0
"""No crossing car is expected to go faster than this, or than it does already."""
_ALIGNED = math.cos(math.radians(40.0))
"""Cosine of `frame.CROSSING_RAD`: headings closer than that run along."""
_BEHIND_M = 1.0
_SETTLING = 14
_STILL_MPS = 1e-3
_WAITS_S = 6.0
_CARRIED_S = 0.5
_CARRIED = 6
_AHEAD_M = 45.0
_BESIDE_M = 2.0
_IN_STREAM_M = 1.5
_SLACK = 1e-3
MINDED, FOLLOWS, PAST = 1, 2, 0
"""State of another agent: it crosses, it follows in the ego's stream, or it is past."""
_LOOSE_M = 1.5


@compiled
def _wrapped(angle: float) -> float:
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


@compiled
def _rates(
    heading: float, speed: float, lateral: float, yaw: float, steering: float
) -> tuple[float, float, float, float, float]:
    if abs(speed) < _ROLLING_MPS:
        front = -lateral - _INERTIA / _HALF_LENGTH * yaw
        rear = -lateral + _INERTIA / _HALF_LENGTH * yaw
    else:
        front = 2.0 * _GRIP * (steering - math.atan2(lateral + _HALF_LENGTH * yaw, speed))
        rear = 2.0 * _GRIP * (0.0 - math.atan2(lateral - _HALF_LENGTH * yaw, speed))
    c, s = math.cos(heading), math.sin(heading)
    return (
        c * speed - s * lateral,
        s * speed + c * lateral,
        yaw,
        (front + rear) - yaw * speed,
        1.0 / _INERTIA * (_HALF_LENGTH * front - _HALF_LENGTH * rear),
    )


@compiled
def move(state: Array, acceleration: float, steering: float, dt_s: float) -> None:
    """One control period of the vehicle, in place."""
    state[5] = min(max(state[5], -_TOP_YAW_RATE), _TOP_YAW_RATE)
    steering = min(max(steering, -math.pi / 2.0), math.pi / 2.0)
    if state[3] > _TOP_MPS:
        acceleration = min(acceleration, _TOP_MPS - state[3])
    h, v, lat, yaw = state[2], state[3], state[4], state[5]
    half = dt_s / 2.0
    a = _rates(h, v, lat, yaw, steering)
    b = _rates(h + a[2] * half, v + acceleration * half, lat + a[3] * half, yaw + a[4] * half, steering)
    c = _rates(h + b[2] * half, v + acceleration * half, lat + b[3] * half, yaw + b[4] * half, steering)
    d = _rates(h + c[2] * dt_s, v + acceleration * dt_s, lat + c[3] * dt_s, yaw + c[4] * dt_s, steering)
    sixth = dt_s / 6.0
    state[0] += sixth * (a[0] + 2.0 * b[0] + 2.0 * c[0] + d[0])
    state[1] += sixth * (a[1] + 2.0 * b[1] + 2.0 * c[1] + d[1])
    state[2] += sixth * (a[2] + 2.0 * b[2] + 2.0 * c[2] + d[2])
    state[3] += acceleration * dt_s
    state[4] += sixth * (a[3] + 2.0 * b[3] + 2.0 * c[3] + d[3])
    state[5] += sixth * (a[4] + 2.0 * b[4] + 2.0 * c[4] + d[4])


@compiled
def nearest(way: Array, x: float, y: float, guess: int) -> int:
    """The point of a way that is closest, searched downhill from a guess; a guess below 0 looks at all."""
    if guess < 0:
        best = 0
        least = math.inf
        for i in range(len(way)):
            d = (way[i, 0] - x) ** 2 + (way[i, 1] - y) ** 2
            if d < least:
                least, best = d, i
        return best
    i = guess
    here = (way[i, 0] - x) ** 2 + (way[i, 1] - y) ** 2
    while i + 1 < len(way):
        then = (way[i + 1, 0] - x) ** 2 + (way[i + 1, 1] - y) ** 2
        if then > here:
            break
        i, here = i + 1, then
    while i > 0:
        then = (way[i - 1, 0] - x) ** 2 + (way[i - 1, 1] - y) ** 2
        if then >= here:
            break
        i, here = i - 1, then
    return i


@compiled
def _local(way: Array, i: int, x: float, y: float) -> tuple[float, float]:
    """(distance along the way, distance across it) of a place whose nearest point is `i`."""
    c, s = math.cos(way[i, 2]), math.sin(way[i, 2])
    dx, dy = x - way[i, 0], y - way[i, 1]
    return i * STEP_M + c * dx + s * dy, -s * dx + c * dy


@compiled
def _keeping(state: Array, way: Array, i: int, across: float, most_rad: float) -> float:
    """Lane keeping (`control.lane_keeping_steering`) towards a way, with the shield's flat approach."""
    speed = state[3] if abs(state[3]) > 1e-2 else 1e-2
    ahead = min(len(way) - 1, i + round(speed * _PREVIEW_S / STEP_M))
    asked = min(max(-_LATERAL_GAIN * across / speed, -1.0), 1.0)
    approach = min(max(math.asin(asked), -_APPROACH_RAD), _APPROACH_RAD)
    rate = _HEADING_GAIN * _wrapped(way[ahead, 2] + approach - state[2])
    slip = math.asin(min(max(_HALF_LENGTH / speed * rate, -1.0), 1.0))
    return min(max(math.atan(2.0 * math.tan(slip)), -most_rad), most_rad)


@compiled
def _best_wheel(state: Array, way: Array, i: int, acceleration: float, dt_s: float) -> float:
    """The wheel that leaves the car straightest on its way one period on, its turn carried on for a while."""
    best, least = 0.0, math.inf
    if abs(state[3]) < _ROLLING_MPS and abs(state[3] + acceleration * dt_s) < _ROLLING_MPS:
        return best  # no wheel turns it then: the one that costs least is the best
    trial = np.empty(6)
    for wheel in _WHEELS:
        trial[:] = state
        move(trial, acceleration, wheel, dt_s)
        at = nearest(way, trial[0], trial[1], i)
        across = _local(way, at, trial[0], trial[1])[1]
        wanted = min(max(-_BACK_PER_M * across, -_APPROACH_RAD), _APPROACH_RAD)
        cost = abs(_wrapped(trial[2] + _CARRY_S * trial[5] - way[at, 2] - wanted)) + _WHEEL_COST * abs(wheel)
        if cost < least:
            best, least = wheel, cost
    return best


@compiled
def wheel(law: int, state: Array, way: Array, i: int, acceleration: float, dt_s: float) -> float:
    """Steering angle, rad, of a law (see `LAWS`) that brings the car back to its way."""
    if law == 1:
        return 0.0
    if law == 2:
        return _best_wheel(state, way, i, acceleration, dt_s)
    return _keeping(state, way, i, _local(way, i, state[0], state[1])[1], _WHOLE_RAD if law == 3 else _LIGHT_RAD)


@compiled
def reach_m(speed: float, time_s: float, acceleration: float) -> float:
    """Longest way, m, that another agent can cover."""
    top = max(_FASTEST_MPS, speed)
    gaining = min(time_s, (top - speed) / acceleration)
    return (speed + 0.5 * acceleration * gaining) * gaining + top * (time_s - gaining)


@compiled
def following_m(speed: float, time_s: float, acceleration: float, response_s: float, braking: float) -> float:
    """Longest way, m, of a follower that responds in time (RSS)."""
    blind = min(time_s, response_s)
    then = speed + acceleration * blind
    return (speed + then) / 2.0 * blind + least_m(then, time_s - blind, braking)


@compiled
def least_m(speed: float, time_s: float, braking: float) -> float:
    """Shortest way, m, that another agent covers."""
    braked = min(time_s, speed / braking)
    return (speed - 0.5 * braking * braked) * braked


@compiled
def stretch(way: Array, at: int, size: tuple[float, float], others: Array, braking: float) -> tuple[int, int, float]:
    """(first, last) point ahead of the body where it may meet anybody who crosses, -1 for none; where a lead may stop.

    Args:
        way, at: The way, and its point nearest to the ego.
        size: Half length, half width of the ego.
        others: Everybody.
        braking: Hardest braking of a lead, m/s2; it then stands that far along the way, its rear end.
    """
    first, last = -1, -1
    hold = math.inf
    end = min(len(way), at + round(_AHEAD_M / STEP_M))
    begin = max(0, at - round(2.0 * size[0] / STEP_M))
    directions = np.empty((end - begin, 2))
    for i in range(begin, end):
        directions[i - begin, 0], directions[i - begin, 1] = math.cos(way[i, 2]), math.sin(way[i, 2])
    for j in range(len(others)):
        x, y, c, s = others[j, 0], others[j, 1], others[j, 2], others[j, 3]
        on, closest = -1, _BESIDE_M * _BESIDE_M
        for i in range(begin, end):
            dx, dy = way[i, 0] - x, way[i, 1] - y
            across = abs(-s * dx + c * dy)
            if across > others[j, 6] + size[0] + _LOOSE_M:
                continue
            cosine = directions[i - begin, 0] * c + directions[i - begin, 1] * s
            if cosine > _ALIGNED:
                if dx * dx + dy * dy < closest:
                    closest, on = dx * dx + dy * dy, i
                continue
            wide = math.sqrt(max(0.0, 1.0 - cosine * cosine)) * size[0] + abs(cosine) * size[1]
            if across < others[j, 6] + wide + _LOOSE_M and c * dx + s * dy > -others[j, 5] - size[0] - _LOOSE_M:
                if first < 0 or i < first:
                    first = i
                last = max(last, i)
        if on > at:
            hold = min(hold, on * STEP_M - others[j, 5] + others[j, 4] * others[j, 4] / (2.0 * braking))
    return first, last, hold


@compiled
def expected(numbers: Array, on: NDArray[np.int64], lines: Array, aligned: float, far_m: float) -> Array:
    """The others as this file wants them, without those of whom nothing can be said, far away as they are.

    Along a straight lane one goes on as the lane does, and keeps the room between the lane's middle and where it is.

    Args:
        numbers: `everybody.Everybody.numbers`, the ego first.
        on: Row of `lines` each of the others is on, -1 for none.
        lines: Straight lanes: a point, heading, cos, sin.
        aligned: Cosine of the angle against its lane from which on one crosses it.
        far_m: Who is on no such lane is not minded farther away than this.
    """
    rows = np.empty((len(on), 7))
    count = 0
    for j in range(len(on)):
        x, y, heading = numbers[j + 1, 0], numbers[j + 1, 1], numbers[j + 1, 2]
        long, wide = numbers[j + 1, 4] / 2.0, numbers[j + 1, 5] / 2.0
        line = on[j]
        if line >= 0 and math.cos(heading - lines[line, 2]) > aligned:
            c, s = lines[line, 3], lines[line, 4]
            off = -s * (x - lines[line, 0]) + c * (y - lines[line, 1])
            wide += abs(off) / 2.0 + abs(math.sin(heading - lines[line, 2])) * long
            x, y = x + s * off / 2.0, y - c * off / 2.0
        elif math.sqrt((x - numbers[0, 0]) ** 2 + (y - numbers[0, 1]) ** 2) > far_m:
            continue
        else:
            c, s = math.cos(heading), math.sin(heading)
        rows[count, 0], rows[count, 1], rows[count, 2], rows[count, 3] = x, y, c, s
        rows[count, 4], rows[count, 5], rows[count, 6] = max(numbers[j + 1, 3], 0.0), long, wide
        count += 1
    return rows[:count]


@compiled
def _joined(cosine: float, across: float) -> bool:
    """True if the ego drives in the stream of another, who then follows and looks after the gap itself."""
    return cosine > _ALIGNED and abs(across) < _IN_STREAM_M


@compiled
def _followed_by(state: Array, other: Array) -> bool:
    """True if another comes from behind in the stream the ego is in."""
    ch, sh = math.cos(state[2]), math.sin(state[2])
    c, s = other[2], other[3]
    dx, dy = state[0] - other[0], state[1] - other[1]
    return c * dx + s * dy > 0.0 and _joined(c * ch + s * sh, -s * dx + c * dy)


@compiled
def followed(state: Array, others: Array) -> bool:
    """True if any agent comes from behind in the stream the ego is in."""
    count = 0
    for j in range(len(others)):
        count += _followed_by(state, others[j])
    return count > 0


@compiled
def met(
    state: Array,
    size: tuple[float, float],
    time_s: float,
    standing: bool,
    others: Array,
    minded: NDArray[np.int64],
    side_m: float,
    after_s: float,
    merge_s: float,
    of_others: tuple[float, float, float, float],
) -> bool:
    """True if the ego's body is where somebody may be; one it has merged in front of is not minded any more."""
    acceleration, braking, response_s, sure_braking = of_others
    ch, sh = math.cos(state[2]), math.sin(state[2])
    for j in range(len(others)):
        if minded[j] == PAST:
            continue
        c, s = others[j, 2], others[j, 3]
        dx, dy = state[0] - others[j, 0], state[1] - others[j, 1]
        along, across = c * dx + s * dy, -s * dx + c * dy
        cosine, sine = c * ch + s * sh, abs(c * sh - s * ch)
        wide = sine * size[0] + abs(cosine) * size[1]
        if abs(across) >= others[j, 6] + wide + side_m:
            continue
        long = abs(cosine) * size[0] + sine * size[1]
        speed = others[j, 4]
        if along + long + _BEHIND_M <= least_m(speed, time_s, braking) - others[j, 5]:
            continue
        if cosine > _ALIGNED and along <= 0.0:
            continue  # a lead: the gap to it is kept elsewhere
        if minded[j] == FOLLOWS:
            if along - long - others[j, 5] < following_m(speed, time_s, acceleration, response_s, sure_braking):
                return True
            continue
        joined = _joined(cosine, across)
        left_s = time_s + (merge_s if joined else _WAITS_S if standing else after_s)
        if along - long - others[j, 5] < reach_m(speed, left_s, acceleration):
            return True
        if joined:
            minded[j] = PAST
    return False


@compiled
def in_a_lane(state: Array, size: tuple[float, float], lanes: Array, side_m: float) -> bool:
    """True if the ego's body is in a lane other than its own, or in the way of it: nobody may be there yet."""
    ch, sh = math.cos(state[2]), math.sin(state[2])
    for k in range(len(lanes)):
        c, s = lanes[k, 2], lanes[k, 3]
        dx, dy = state[0] - lanes[k, 0], state[1] - lanes[k, 1]
        along, across = c * dx + s * dy, -s * dx + c * dy
        cosine, sine = c * ch + s * sh, abs(c * sh - s * ch)
        beside = abs(across) >= size[1] + sine * size[0] + abs(cosine) * size[1] + side_m
        reach = abs(cosine) * size[0] + sine * size[1]
        if not (beside or along < -reach or along > lanes[k, 4] + reach or _joined(cosine, across)):
            return True
    return False


@compiled
def _beside_m(across: float, turned: float, size: tuple[float, float]) -> float:
    """Lateral reach of a body from its way, m."""
    return abs(across) + abs(math.sin(turned)) * size[0] + abs(math.cos(turned)) * size[1]


def beside_m(state: Array, way: Array, i: int, size: tuple[float, float]) -> float:
    """Lateral reach of the ego's body from a way, m; `i` is the nearest point."""
    across = _local(way, i, state[0], state[1])[1]
    return float(_beside_m(across, state[2] - way[i, 2], size))


@compiled
def rollout(
    start: Array,
    first: tuple[float, float],
    then_mps2: float,
    top_mps: float,
    law: int,
    way: Array,
    at: int,
    beyond: int,
    hold_m: float,
    size: tuple[float, float],
    others: Array,
    lanes: Array,
    room_m: float,
    turn_rad: float,
    side_m: float,
    after_s: float,
    merge_s: float,
    followers: bool,
    of_others: tuple[float, float, float, float],
    braking: float,
    dt_s: float,
    periods: int,
) -> tuple[float, int]:
    """Time until trouble, s, and what it is; the time is infinite where the plan ends well.

    Args:
        start: State now.
        first: (acceleration, steering) of the command to be judged, for one period.
        then_mps2: Acceleration of the plan after it: below 0 to stop, above to clear the crossing.
        top_mps: Speed up to which it is.
        law: How it steers (`wheel`).
        way, at: Way of the plan, and its point nearest to the ego.
        beyond: Point of the way from which on nobody crosses.
        hold_m: Distance along the way that the front must not pass: a lead may stop there.
        size: Half length, half width of the ego.
        others: Those who cross.
        lanes: Straight lanes, rows of (x, y, cos, sin, length): to stand in one that is not the ego's ends badly.
        room_m, turn_rad: How far to the side of its way the body may get, and how far it may be turned against it;
            or as far as it is already.
        side_m: Clear distance to the side of anybody's way.
        after_s, merge_s: Time before somebody else arrives where they cross, where they then drive behind.
        followers: Whether those are minded, too, who follow in the stream the ego is in.
        of_others: Their hardest acceleration, hardest braking, time to respond, and the braking they are sure of.
        braking: Of the ego.
        dt_s, periods: Control period, and how many are looked at.
    """
    state = start.copy()
    minded = np.full(len(others), MINDED)
    for j in range(len(others)):
        if _followed_by(state, others[j]):
            minded[j] = FOLLOWS if followers else PAST
    i = at
    along, across = _local(way, i, state[0], state[1])
    off = abs(_wrapped(state[2] - way[i, 2]))
    room = max(room_m, _beside_m(across, off, size) + _SLACK)
    turn = max(turn_rad, off + _SLACK)
    for period in range(periods):
        speed = state[3]
        if period == 0:
            acceleration, steering = first[0], first[1]
        else:
            acceleration = then_mps2 if then_mps2 < 0.0 or speed < top_mps else 0.0
            front = along + size[0] + speed * dt_s
            if front + speed * speed / (2.0 * braking) + 0.5 * speed * dt_s > hold_m:
                acceleration = -braking
            acceleration = max(acceleration, -max(speed, 0.0) / dt_s)
            steering = wheel(law, state, way, i, acceleration, dt_s)
        move(state, acceleration, steering, dt_s)
        time_s = (period + 1) * dt_s
        standing = period > 0 and state[3] < _STILL_MPS and (then_mps2 < 0.0 or acceleration <= 0.0)
        sliding, turning = state[4], state[5]
        for part in range(_CARRIED + 1 if standing else 1):
            if part > 0:  # below 1 m/s the tyres carry a slide and a turn on, each by half a second of it
                state[2] += _CARRIED_S / _CARRIED * turning
                state[0] -= _CARRIED_S / _CARRIED * sliding * math.sin(state[2])
                state[1] += _CARRIED_S / _CARRIED * sliding * math.cos(state[2])
            i = nearest(way, state[0], state[1], i)
            along, across = _local(way, i, state[0], state[1])
            off = abs(_wrapped(state[2] - way[i, 2]))
            if off > turn or _beside_m(across, off, size) > room:
                return time_s, LEFT
            if standing and in_a_lane(state, size, lanes, side_m):
                return time_s, MET
            if met(state, size, time_s, standing, others, minded, side_m, after_s, merge_s, of_others):
                return time_s, MET
        if standing or (i > beyond and then_mps2 > 0.0 and period >= _SETTLING):
            return math.inf, NONE
    return (math.inf, NONE) if i > beyond else (periods * dt_s, LATE)


def warm_up() -> None:
    """Load the machine code of everything above that is called from outside, or make it where there is none yet.

    It takes a third of a second to load, which a control period must never wait for: whoever drives in real time calls
    this before anything moves, whatever road comes first. Steering back, above all, is met for the first time in the
    very period in which it is needed.
    """
    state = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0])
    way = np.zeros((8, 3))
    way[:, 0] = STEP_M * np.arange(8)
    size, others, lanes = (2.5, 1.0), np.zeros((0, 7)), np.zeros((0, 5))
    at = nearest(way, state[0], state[1], -1)
    _, last, hold_m = stretch(way, at, size, others, 1.0)
    expected(np.zeros((1, 6)), np.zeros(0, dtype=np.int64), lanes, 1.0, 1.0)
    followed(state, others)
    beside_m(state, way, at, size)
    for law in range(LAWS):
        wheel(law, state, way, at, -1.0, 0.1)
    rollout(
        state, (-1.0, 0.0), -1.0, 1.0, 0, way, at, last, hold_m, size, others, lanes, 1.0, 1.0, 1.0, 1.0, 1.0, True,
        (1.0, 1.0, 1.0, 1.0), 1.0, 0.1, 1,
    )  # fmt: skip
    move(state.copy(), -1.0, 0.0, 0.1)
