"""Benign programs, as data: LaMPilot's exemplar kinds and the Python that models write around them.

Each must pass the gate and do in the sandbox exactly what it does in bare Python.
"""

from __future__ import annotations

from benign_python import BENIGN_PYTHON

BENIGN: dict[str, str] = {
    **BENIGN_PYTHON,
    "follow_at_25_m": '''
def keep_gap():
    """Keep 25 m behind the vehicle in front."""
    ego = get_ego_vehicle()
    while True:
        front = detect_front_vehicle_in(get_lane_of(ego))
        if front is not None:
            speed = get_speed_of(ego)
            headway = 25 / speed if speed > 1 else 1.5
            set_desired_time_headway(headway)
        yield autopilot()
''',
    "left_overtake": """
def left_overtake():
    ego = get_ego_vehicle()
    front = detect_front_vehicle_in(get_lane_of(ego))
    if front is None:
        say("There is nobody to overtake.")
        return
    original_lane = get_lane_of(ego)
    set_target_speed(get_speed_of(front) + 5.0)
    while get_lane_of(ego) == original_lane:
        left_lane = get_left_lane(ego)
        if left_lane is None:
            say("No lane on the left.")
            return
        if is_safe_enter(left_lane):
            set_target_lane(left_lane)
        yield autopilot()
    while get_distance_between_vehicles(ego, front) < 10:
        yield autopilot()
    say("Overtaken.")
    set_target_lane(original_lane)
    for _ in range(5):
        yield autopilot()
""",
    "go_straight": """
def go_straight():
    go_straight_at_next_intersection()
    ego = get_ego_vehicle()
    while detect_stop_sign_ahead() > 0 and get_speed_of(ego) >= 1:
        yield autopilot()
    say("I have stopped, or there is no stop sign.")
    lanes = get_left_to_right_cross_traffic_lanes() + get_right_to_left_cross_traffic_lanes()
    while not all(is_safe_enter(lane, safe_decel=3) for lane in lanes):
        yield autopilot()
    recover_from_stop()
    while True:
        yield autopilot()
""",
    "turn_left": """
def turn_left():
    turn_left_at_next_intersection()
    for lane in get_left_to_right_cross_traffic_lanes():
        say(f"clear: {is_safe_enter(lane)}")
    while True:
        if get_speed_of(get_ego_vehicle()) < 1:
            recover_from_stop()
        yield autopilot()
""",
    "turn_right": """
def turn_right():
    turn_right_at_next_intersection()
    while True:
        yield autopilot()
""",
    "faster": """
def faster():
    set_target_speed(get_target_speed() + 3)
    yield autopilot()
""",
    "slower_in_steps": """
def slower_in_steps():
    for speed in [24.0, 23.0, 22.0]:
        set_target_speed(speed)
        for _ in range(3):
            yield autopilot()
""",
    "speed_limit": """
def at_the_limit():
    set_target_speed(min(40, get_speed_limit()))
    while get_speed_of(get_ego_vehicle()) < get_speed_limit() - 0.5:
        yield autopilot()
    say(f"{get_speed_of(get_ego_vehicle()) * 3.6:.0f} km/h")
""",
    "bare_yield": """
def bare():
    say("one")
    yield
    say("two")
    yield None
    say("three")
""",
    "yield_pair": """
def pair():
    while True:
        acceleration, steering = autopilot()
        yield acceleration, steering
""",
    "yield_list": """
def lists():
    for i in range(4):
        action = autopilot()
        yield [*action]
""",
    "yield_value_is_none": """
def value():
    x = yield autopilot()
    say(str(x))
    y = (yield)
    say(f"{y!r} {(x is None)}")
    yield autopilot()
""",
    "helper_with_yield_from": """
def wait(ticks):
    for _ in range(ticks):
        yield autopilot()
    return ticks * 0.1

def main():
    waited = yield from wait(4)
    say(f"waited {waited:.1f} s")
    yield from wait(2)
""",
    "nested_helpers": """
def settle_down():
    def once():
        set_target_speed(22)
        yield autopilot()

    def twice():
        yield from once()
        yield from once()
        return "done"

    result = yield from twice()
    say(result)
    yield autopilot()
""",
    "two_candidates": """
def first():
    say("not me")
    yield autopilot()

def second():
    say("me")
    yield autopilot()
""",
    "helper_after_main_with_argument": """
def main():
    yield from cruise(26)

def cruise(speed, ticks=3):
    set_target_speed(speed)
    while ticks > 0:
        ticks -= 1
        yield autopilot()
""",
    "closure_nonlocal": """
def counting():
    count = 0

    def more():
        nonlocal count
        count += 1
        return count

    while more() < 6:
        yield autopilot()
    say(f"count {count}")
""",
    "globals_and_constants": """
GAP_M = 30.0
state = {"changes": 0}
passes = 0

def note(text):
    global passes
    passes += 1
    state["changes"] = state["changes"] + 1
    say(f"{passes}: {text} {GAP_M}")

def main():
    note("start")
    yield autopilot()
    note("end")
""",
    "import_math": """
import math

def main():
    ego = get_ego_vehicle()
    gap = math.hypot(3, 4) + math.floor(2.7) + math.sqrt(get_speed_of(ego))
    say(f"{gap:.3f} {math.pi:.4f} {math.isclose(0.1 + 0.2, 0.3)} {math.inf > 1}")
    set_desired_time_headway(max(0.5, min(2.0, math.exp(-1))))
    yield autopilot()
""",
    "from_math_import": """
from math import ceil, sqrt as root

def main():
    for _ in range(ceil(root(5))):
        yield autopilot()
""",
    "try_except": """
def main():
    try:
        say(str(1 / 0))
    except ZeroDivisionError as error:
        say(f"caught {error}")
    finally:
        say("finally")
    try:
        speed = float("fast")
    except (ValueError, TypeError):
        speed = 21.0
    else:
        speed = 1.0
    set_target_speed(speed)
    yield autopilot()
""",
    "api_errors_are_catchable": """
def main():
    nobody = detect_front_vehicle_in(get_lane_of(get_ego_vehicle()), 0.5)
    try:
        say(f"{get_speed_of(nobody)}")
    except TypeError:
        say("nobody there")
    try:
        set_target_speed(float("nan"))
    except ValueError as error:
        say(f"refused: {error}")
    yield autopilot()
""",
    "while_else": """
def main():
    n = 0
    while n < 3:
        n += 1
        yield autopilot()
    else:
        say("else")
    for i in range(5):
        if i == 2:
            break
        yield autopilot()
    else:
        say("never")
""",
    "lambda_sorted_dict": """
def main():
    ego = get_ego_vehicle()
    lanes = {"left": get_left_lane(ego), "own": get_lane_of(ego), "right": get_right_lane(ego)}
    gap = lambda front: 999.0 if front is None else get_distance_between_vehicles(front, ego)
    room = {name: gap(detect_front_vehicle_in(lane)) for name, lane in lanes.items() if lane is not None}
    best = sorted(room.items(), key=lambda item: (-item[1], item[0]))[0][0]
    say(f"most room: {best} {room[best]:.2f}")
    if best != "own" and is_safe_enter(lanes[best]):
        set_target_lane(lanes[best])
    while get_lane_of(ego) != lanes[best]:
        yield autopilot()
""",
    "comprehensions": """
def main():
    squares = [i * i for i in range(6) if i % 2 == 0]
    unique = {s % 3 for s in squares}
    pairs = [(a, b) for a in range(2) for b in "xy"]
    table = {k: v for k, v in zip("abc", squares)}
    say(f"{squares} {sorted(unique)} {pairs} {table}")
    say(str(sum(s for s in squares)) + str(any(s > 10 for s in squares)) + str(all(squares)))
    yield autopilot()
""",
    "short_circuit": """
def main():
    ego = get_ego_vehicle()
    left, right = get_left_lane(ego), get_right_lane(ego)
    if any(is_safe_enter(lane) for lane in (left, right)):
        say("a side is free")
    side = left if left is not None and is_safe_enter(left) else right
    front = side and detect_front_vehicle_in(side, 60)
    say("free" if not front else f"{get_speed_of(front):.1f}")
    yield autopilot()
""",
}
