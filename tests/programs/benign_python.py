"""Benign programs, second part: corners of Python that models use around the driving APIs."""

from __future__ import annotations

BENIGN_PYTHON: dict[str, str] = {
    "strings": """
def main():
    words = "change to the left lane".split()
    say(" ".join(word.upper() for word in words[-2:]))
    say("{:.2f} m/s and %d cars".format(get_speed_of(get_ego_vehicle())) % 3)
    say(f"{'a':>5}|{3.14159:8.3f}|{42:05d}|{1e6:,.0f}|{0.25:.0%}|{True!s}|{None!r}")
    say("left" in "left lane" and "yes" or "no")
    yield autopilot()
""",
    "numbers": """
def main():
    say(f"{7 // 2} {-7 // 2} {-7 % 3} {2 ** 10} {2 ** -1} {round(2.5)} {round(3.14159, 2)} {divmod(17, 5)}")
    say(f"{abs(-3.5)} {int(3.9)} {float('1e3')} {min(3, 1, 2)} {max([1, 5, 2])} {sum([0.1] * 3)}")
    say(f"{1 < 2 < 3} {not True} {5 & 3} {5 | 3} {5 ^ 3} {1 << 4} {~5}")
    yield autopilot()
""",
    "lists": """
def main():
    speeds = []
    for _ in range(4):
        speeds.append(round(get_speed_of(get_ego_vehicle()), 3))
        yield autopilot()
    first, *rest = speeds
    rest.reverse()
    speeds[0], speeds[-1] = speeds[-1], speeds[0]
    say(f"{first} {rest} {speeds[1:3]} {len(speeds)} {speeds.index(first)}")
    say(f"{list(enumerate(rest))[:1]} {list(zip(rest, speeds))[:1]} {list(map(int, rest))} {list(reversed([1, 2]))}")
""",
    "walrus_and_ternary": """
def main():
    ego = get_ego_vehicle()
    while (front := detect_front_vehicle_in(get_lane_of(ego))) is not None and (n := get_speed_of(front)) < 30:
        set_target_speed(n + 2 if n < 25 else n)
        if get_distance_between_vehicles(front, ego) < 40:
            break
        yield autopilot()
    yield autopilot()
""",
    "defaults_and_keywords": """
def approach(speed=20.0, *, headway=1.0, ticks: int = 2) -> float:
    set_target_speed(target_speed=speed)
    set_desired_time_headway(headway)
    for _ in range(ticks):
        yield autopilot()
    return speed / headway

def main():
    a = yield from approach()
    b = yield from approach(22.0, headway=1.8, ticks=1)
    say(text=f"{a} {b} {detect_rear_vehicle_in(lane=get_lane_of(veh=get_ego_vehicle()), distance=80) is None}")
""",
    "star_arguments": """
def mean(*values, **options):
    return sum(values) / len(values) + options.get("offset", 0)

def main():
    say(f"{mean(1, 2, 3)} {mean(*[4, 6], offset=1)} {mean(*(1,), **{'offset': 2})}")
    yield autopilot()
""",
    "flags_and_states": """
def main():
    state = "approach"
    ticks = 0
    done = False
    while not done:
        ticks += 1
        if state == "approach":
            set_target_speed(27)
            if ticks >= 3:
                state = "hold"
        elif state == "hold":
            set_target_speed(25)
            if ticks >= 6:
                state = "leave"
        else:
            done = True
        yield autopilot()
    say(f"{state} after {ticks}")
""",
    "early_return": """
def main():
    if get_right_lane(get_ego_vehicle()) is None:
        say("I am on the right already.")
        return
    yield autopilot()
    if get_speed_of(get_ego_vehicle()) > 1:
        return
    say("never")
    yield autopilot()
""",
    "raises_in_the_end": """
def main():
    yield autopilot()
    speeds = {"slow": 10}
    set_target_speed(speeds["slow"] + 10)
    yield autopilot()
    set_target_speed(speeds["fast"])
    yield autopilot()
""",
    "leaves_road_by_exception_in_helper": """
def check(limit):
    if get_speed_of(get_ego_vehicle()) < limit:
        raise RuntimeError(f"slower than {limit}")

def main():
    yield autopilot()
    check(5)
    yield autopilot()
    check(500)
    yield autopilot()
""",
    "multi_line_expressions": """
def main():
    ego = get_ego_vehicle()
    value = (
        get_speed_of(ego)
        + 1.0  # a comment with a yield in it
        - 0.5
    )
    say("a # yield autopilot() in a string "
        f"{value:.1f}")
    yield (
        autopilot()
    )
    yield autopilot(), \\
        value
    if value > 1: yield autopilot(); say("one line")
    yield(autopilot())
""",
    "unicode": """
def main():
    größe = 3.5
    say(f"Größe {größe} · 速度 ✓"); yield autopilot(); say("é" * 3)
    say("後"); x = yield autopilot()
""",
    "cut_in_watch": """
def main():
    ego = get_ego_vehicle()
    lane = get_lane_of(ego)
    seen = set()
    for _ in range(12):
        front = detect_front_vehicle_in(lane, distance=60)
        rear = detect_rear_vehicle_in(lane, 60)
        for vehicle in (front, rear):
            if vehicle is not None and vehicle not in seen:
                seen.add(vehicle)
                say(f"new neighbour at {get_distance_between_vehicles(vehicle, ego):.1f} m")
        if lane != get_lane_of(ego):
            lane = get_lane_of(ego)
            seen.clear()
        yield autopilot()
""",
    "none_lane_is_own_lane": """
def main():
    ego = get_ego_vehicle()
    outside = get_left_lane(ego)
    while outside is not None and is_safe_enter(outside):
        set_target_lane(outside)
        yield autopilot()
        if get_lane_of(ego) == outside:
            outside = get_left_lane(ego)
    say(f"{is_safe_enter(None)} {detect_front_vehicle_in(None) == detect_front_vehicle_in(get_lane_of(ego))}")
    yield autopilot()
""",
    "iterators": """
def main():
    steps = iter([26, 27, 28])
    speed = next(steps, None)
    while speed is not None:
        set_target_speed(speed)
        speed = next(steps, None)
        yield autopilot()
    big = list(filter(lambda s: s > 26, [25, 27, 29]))
    say(f"{big} {isinstance(big, list)} {tuple(sorted(big, reverse=True))} {pow(2, 5)}")
""",
    "asserts_and_pass": """
def main():
    assert get_speed_of(get_ego_vehicle()) >= 0, "speeds are not negative"
    for _ in range(2):
        pass
    while True:
        yield autopilot()
        break
    assert 1 + 1 == 3, "arithmetic"
""",
    "chained_handles": """
def main():
    say(str(get_lane_of(get_ego_vehicle()) == get_lane_of(veh=get_ego_vehicle())))
    right = get_right_lane()
    set_target_lane(right if right is not None else get_lane_of(get_ego_vehicle()))
    while get_lane_of(get_ego_vehicle()) != right and right is not None:
        yield autopilot()
    yield autopilot()
""",
    "keys_that_ask_the_road": """
def main():
    ego = get_ego_vehicle()
    lanes = [lane for lane in (get_left_lane(ego), get_lane_of(ego), get_right_lane(ego)) if lane is not None]

    def room(lane):
        front = detect_front_vehicle_in(lane)
        return 1000.0 if front is None else get_distance_between_vehicles(front, ego)

    best = max(lanes, key=room)
    worst = min(lanes, key=lambda lane: room(lane))
    ordered = sorted(lanes, key=room, reverse=True)
    lanes.sort(key=room)
    (lanes).sort(reverse=True, key=lambda lane: (is_safe_enter(lane), room(lane)))
    say(f"{best == ordered[0]} {worst == ordered[-1]} {[room(lane) for lane in lanes]}")
    safe = list(filter(is_safe_enter, lanes))
    rooms = list(map(room, safe))
    say(f"{len(safe)} {rooms} {max(rooms, default=0)} {min([], key=room, default=None)} {sum(map(room, lanes)):.3f}")
    set_target_lane(best)
    yield autopilot()
""",
    "lazy_searches": """
def main():
    ego = get_ego_vehicle()
    lanes = [get_left_lane(ego), get_lane_of(ego), get_right_lane(ego)]
    free = next((lane for lane in lanes if lane is not None and is_safe_enter(lane)), None)
    say("none free" if free is None else "one free")
    first = next(get_speed_of(v) for v in [ego, ego] if get_speed_of(v) >= 0)
    say(f"{first:.2f}")
    everyone = all(
        front is None or get_distance_between_vehicles(front, ego) > gap  # a comment
        for gap, lane in zip((5, 10, 20), lanes)
        if lane is not None
        for front in [detect_front_vehicle_in(lane)]
    )
    anyone = any(all(is_safe_enter(lane, decel) for lane in lanes if lane) for decel in (9, 5, 1))
    nobody = not any([is_safe_enter(lane) for lane in lanes])
    say(f"{everyone} {anyone} {nobody} {any(())} {all([])} {any(map(bool, lanes))}")
    while not any(is_safe_enter(lane) for lane in lanes if lane is not None): yield autopilot()
    try:
        next(lane for lane in lanes if lane == "nowhere")
    except StopIteration:
        say("nowhere")
    yield autopilot()
    set_target_speed(next(speed for speed in (20, 21) if speed > 20))
""",
    "sorting": """
def main():
    rows = [("b", 2), ("a", 2), ("c", 1)]
    say(str(sorted(rows, key=lambda row: row[1], reverse=True)) + str(sorted(rows, key=lambda row: -row[1])))
    say(f"{sorted([3, 1, 2])} {sorted('bca', reverse=True)} {min(3, 1)} {max('b', 'a', key=ord_of)} {min(rows)}")
    rows.sort()
    say(str(rows))
    rows.sort(key=lambda row: row[1])
    rows.sort(reverse=True)
    say(str(rows))
    yield autopilot()

def ord_of(letter):
    return "abc".index(letter)
""",
}
