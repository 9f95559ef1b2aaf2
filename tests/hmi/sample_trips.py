"""Two made-up drives, one per kind of road, with every feature a page has to show. No simulator is needed."""

from __future__ import annotations

import math
from dataclasses import replace

from chauffeur.concept import (
    ApiCall,
    Causes,
    Command,
    Context,
    Faithfulness,
    Feedback,
    Frame,
    History,
    HistoryItem,
    Instruction,
    Intervention,
    Lane,
    Lead,
    Metric,
    Mismatch,
    Observation,
    PersonId,
    Plan,
    Program,
    Scenario,
    Setpoints,
    Situation,
    Thoughts,
    Trip,
    VehicleState,
    Verdict,
)
from chauffeur.driving.recording import RecordedTrip
from roads import a_lane, a_road

HOSTILE = "</script><img src=x onerror=alert(1)> & \u2028 '\" <!-- <script>"

OVERTAKE = '''def overtake_left():
    """Pass the slower car on the left, then keep the lane."""
    ego = get_ego_vehicle()
    lead = detect_front_vehicle_in(get_lane_of(ego), 100)
    left = get_left_lane(ego)
    set_target_speed(33.0)  # the limit is 31.3 m/s
    while not is_safe_enter(left):
        yield autopilot()
    say("Changing to the left lane.")
    set_target_lane(left)
    while lead is not None and get_distance_between_vehicles(lead, ego) > -10:
        yield autopilot()
    say(f"Passed. Thank you for waiting.")
    return
'''


def _vehicle(number: int, x: float, y: float, heading: float, speed: float, lane: tuple[str, str, int]) -> VehicleState:
    """Of places and headings to the right of +x, which the trips are written in."""
    return VehicleState(number, "car", x, -y, -heading, speed, 5.0, 2.0, lane)


def _trip(wish: str, frames: list[Frame], scenario: str, program: str, **more: object) -> Trip:
    situation = Situation("highway", 25.0, 31.2928, 3, 1, True, Lead(3, 42.0, 22.0), None)
    values: dict[str, object] = {
        "id": "9f2c41d07be3",
        "instruction": Instruction(wish, PersonId("ana")),
        "context": Context("My current speed is 25.0 m/s. I am driving on a highway with 3 lanes.", situation),
        "history": History(
            (
                HistoryItem(
                    "71aa",
                    "2026-11-02T08:15:00Z",
                    "Could you go a bit faster?",
                    "highway",
                    "highway",
                    "speed.increase",
                    "She likes brisk driving.",
                    "set_target_speed(30)",
                    (("target_speed_mps", 30.0),),
                    (Feedback("A bit too close for me.", gap=-1, strength=0.35),),
                    "success",
                    0.83,
                ),
            )
        ),
        "plan": Plan(
            Thoughts(
                "The passenger is in a hurry and the car ahead is slow. The left lane is open; I pass and keep a "
                "headway of 1.5 s."
            ),
            Program(program),
            intent="overtake.left",
            settings=(("target_speed_mps", 33.0),),
            planner="onboard",
            model="onboard-v1",
            latency_s=0.042,
        ),
        "verdicts": (
            Verdict("format-v1", True, "One generator function over the driving APIs."),
            Verdict("envelope-v1", False, "33.0 m/s is 1.7 m/s over the limit of 31.3 m/s.", 6, "Ask for 31.3 m/s."),
            Verdict("alignment-v1", True, "Thoughts and program both pass on the left."),
        ),
        "outcome": "success",
        "causes": Causes(detail=""),
        "metrics": (
            Metric("lampilot-ttc-v1", 89.4, "points"),
            Metric("lampilot-speed-variance-v1", 91.2, "points"),
            Metric("lampilot-time-efficiency-v1", 66.7, "points"),
            Metric("lampilot-score-v1", 85.3, "points"),
            Metric("stop-compliance-v1", math.nan, "points", False),
        ),
        "duration_s": len(frames) / 10,
        "scenario": scenario,
        "seed": 42,
        "said": tuple((f.observation.time_s, t) for f in frames for t in f.said),
        "record": (("chauffeur", "0.1.0"), ("engine", "highway core 1"), ("limits", {"name": "default"})),
    }
    return Trip(**(values | more))  # type: ignore[arg-type]


def highway_trip(
    wish: str = "I'm really in a hurry now.",
    seconds: float = 20.0,
    cars: int = 40,
    *,
    crash: bool = False,
    **more: object,
) -> RecordedTrip:
    """Three lanes and an emergency lane; the ego changes to the left lane at 6 s."""
    lanes = tuple(
        a_lane(f"a-b:{i}", ((0.0, -4.0 * i), (2000.0, -4.0 * i)), limit=31.2928, closed=i == 3, emergency=i == 3)
        for i in range(4)
    )
    frames: list[Frame] = []
    x, speed = 150.0, 25.0
    for tick in range(int(seconds * 10)):
        time = tick / 10
        change = 0.5 - 0.5 * math.cos(math.pi * min(max((time - 6) / 2.5, 0), 1))
        y = 4.0 - 4.0 * change
        target = 33.0 if time > 0.4 else None
        acceleration = 1.2 * ((target or 25.0) - speed) / 8
        ego = _vehicle(0, x, y, 0.0 if change in (0, 1) else -0.05, speed, f"a-b:{0 if y < 2 else 1}")
        if crash and time >= seconds - 0.3:
            ego = VehicleState(0, "car", x, -y, -0.1, speed, 5.0, 2.0, ego.lane, crashed=True)
        others = tuple(
            _vehicle(
                i,
                40.0 + 37.0 * i + (20.0 + 0.137 * (i * 7 % 13) + 0.4 * math.sin(time + i)) * time,
                4.0 * (i % 3),
                0.0,
                20.0 + 0.137 * (i * 7 % 13) + 0.4 * math.sin(time + i),
                f"a-b:{i % 3}",
            )
            for i in range(1, cars + 1)
        )
        ahead = [o for o in others if o.lane == ego.lane and o.x_m > x]
        lead = min(ahead, key=lambda o: o.x_m, default=None)
        front = Lead(lead.id, lead.x_m - x, lead.speed_mps) if lead else None
        running = time < seconds - 3
        said: tuple[str, ...] = ()
        calls: tuple[ApiCall, ...] = ()
        if tick == 60:
            said = ("Changing to the left lane.",)
        elif not running and frames and frames[-1].program == "running":
            said = ("Passed. Thank you for waiting.",)
        if running:
            calls = (ApiCall("get_distance_between_vehicles", "lead, ego", f"{30 - 2 * time:.1f}"),)
            if 0.4 <= time < 6:
                calls = (ApiCall("is_safe_enter", "left", "False"), ApiCall("autopilot", "", "(0.3, 0.0)"))
        frames.append(
            Frame(
                Observation(time, tick, "highway", ego, others, (), a_road(lanes), front, None, False, False),
                Setpoints(target, 1.5, f"a-b:{0 if time >= 6 else 1}"),
                Command(acceleration * 1.1, 0.0),
                Command(acceleration, 0.001 * tick),
                "running" if running else "finished",
                (6 if time < 0.4 else 8 if time < 6 else 12) if running else None,
                said,
                calls,
            )
        )
        x, speed = x + speed * 0.1, speed + acceleration * 0.1
    trip = _trip(wish, frames, "highway_hurry", OVERTAKE, **more)
    scenario = Scenario("highway_hurry", "highway", {"type": "dt-highway", "seed": 10**41}, 42, title="A busy motorway")
    return RecordedTrip(trip, tuple(frames), scenario)


def guarded(recorded: RecordedTrip) -> RecordedTrip:
    """The same drive as if the shield had acted: steering from 5.0 s for 1.0 s, braking at 5.2 s and from 9.0 s."""
    frames: list[Frame] = []
    for frame in recorded.frames:
        time, asked = frame.observation.time_s, frame.requested
        steered = replace(frame.applied, steering_rad=0.05)
        braked = replace(asked, acceleration_mps2=-1.0 - time / 10.0)
        found: list[Intervention] = []
        if 4.95 < time < 5.95:
            found.append(Intervention("lane", "The lane is not free: a car is beside.", frame.applied, steered))
        if 5.15 < time < 5.25 or 8.95 < time < 9.35:
            found.append(
                Intervention("gap", f"Too close to the car {time:.0f} m ahead to ask for more.", asked, braked)
            )
        frames.append(replace(frame, interventions=tuple(found)))
    return replace(recorded, frames=tuple(frames))


TOLD = Faithfulness(
    False,
    0.25,
    (
        Mismatch(
            "missing-condition", "The left lane is open; I pass and keep a headway of 1.5 s.", "it never asks", 10
        ),
        Mismatch("not-claimed", "", "it drives faster", 6),
    ),
    3,
)
"""What is found of a made-up explanation."""


def doubted(recorded: RecordedTrip) -> RecordedTrip:
    """The same drive with an explanation that does not fit."""
    told = Verdict("alignment-v1", False, "Score 0.25.", 10, "Say so.", vetoes=False, alignment=TOLD)
    again = replace(told, check="alignment-driven-v1", alignment=replace(TOLD, mismatches=TOLD.mismatches[1:]))
    verdicts = (*recorded.trip.verdicts[:2], told, again)
    return replace(recorded, trip=replace(recorded.trip, verdicts=verdicts))


def intersection_trip(wish: str = "Take the next left, please.", seconds: float = 22.0) -> RecordedTrip:
    """Four arms, two crossing cars, a stop sign; the ego stops and turns left."""
    lanes: list[Lane] = []
    for arm in range(4):
        angle = math.pi / 2 * arm
        c, s = math.cos(angle), math.sin(angle)

        def rot(x: float, y: float, c: float = c, s: float = s) -> tuple[float, float]:
            return (x * c - y * s, x * s + y * c)

        def road(a: str, b: str, points: list[tuple[float, float]]) -> None:
            lanes.append(a_lane(f"{a}-{b}:0", [(x, -y) for x, y in points], limit=10.0))

        road(f"o{arm}", f"ir{arm}", [rot(2, 111), rot(2, 11)])
        arc = [(11 - 9 * math.cos(t), 11 - 9 * math.sin(t)) for t in (i * math.pi / 40 for i in range(21))]
        road(f"ir{arm}", f"il{(arm - 1) % 4}", [rot(x, y) for x, y in arc])
        arc = [(-11 + 13 * math.cos(t), 11 - 13 * math.sin(t)) for t in (i * math.pi / 40 for i in range(21))]
        road(f"ir{arm}", f"il{(arm + 1) % 4}", [rot(x, y) for x, y in arc])
        road(f"ir{arm}", f"il{(arm + 2) % 4}", [rot(2, 11), rot(2, -11)])
        road(f"il{(arm - 1) % 4}", f"o{(arm - 1) % 4}", [rot(11, 2), rot(111, 2)])
    sign = VehicleState(1000, "stop_sign", 2.0, -16.0, math.pi / 2, 0.0, 2.0, 2.0, "o0-ir0:0")
    frames: list[Frame] = []
    travelled, speed = 0.0, 10.0
    for tick in range(int(seconds * 10)):
        time = tick / 10
        stop = 81.0 - travelled
        want = 0.0 if time < 13 and stop < speed * speed / 4 + 1 else 8.0
        acceleration = max(-3.0, min(1.5, (want - speed) * 1.5))
        if travelled < 90:
            x, y, heading = 2.0, 101.0 - travelled, -math.pi / 2
        elif travelled < 90 + 13 * math.pi / 2:
            t = (travelled - 90) / 13
            x, y, heading = -11 + 13 * math.cos(t), 11 - 13 * math.sin(t), -math.pi / 2 - t
        else:
            x, y, heading = -11 - (travelled - 90 - 13 * math.pi / 2), -2.0, -math.pi
        lane = "o0-ir0:0" if travelled < 90 else "ir0-il1:0" if x > -11 else "il1-o1:0"
        ego = _vehicle(0, x, y, heading, speed, lane)
        others = tuple(
            _vehicle(i, sgn * (-70 - 22 * i + 8.2 * time), sgn * 2, 0 if sgn > 0 else math.pi, 8.2, "o1-ir1:0")
            for i, sgn in ((1, 1), (2, 1), (3, -1), (4, -1))
        )
        stop_m = max(85.0 - travelled, 0.0) or None
        shot = Observation(
            time, tick, "intersection", ego, others, (sign,), a_road(tuple(lanes)), None, stop_m, False, False
        )
        command = Command(acceleration, 0.0)
        served = frozenset({1000}) if time > 13 else frozenset[int]()
        said = ("Waiting for the crossing traffic.",) if tick == 110 else ()
        setpoints = Setpoints(8.0, 1.5, None, "left", served)
        frames.append(Frame(shot, setpoints, command, command, "running", 5 if time < 13 else 8, said, ()))
        speed = max(0.0, speed + acceleration * 0.1)
        travelled += speed * 0.1
    program = OVERTAKE.replace("overtake_left", "turn_left")
    causes = Causes(fallback_used=True, detail="The program ended early; the autopilot drove on.")
    trip = _trip(wish, frames, "intersection_left", program, outcome="timeout", causes=causes)
    return RecordedTrip(trip, tuple(frames), Scenario("intersection_left", "highway", {}, 7))


def refused_trip(wish: str = "Drive through the wall.") -> RecordedTrip:
    """Nothing was driven: no frame, no program."""
    plan = Plan(Thoughts(""), None, refusal="There is a wall.", planner="onboard", model="onboard-v1")
    trip = _trip(wish, [], "overtake", "", plan=plan, outcome="refused", verdicts=(), metrics=())
    return RecordedTrip(trip, (), Scenario("overtake", "highway", {}, 17))
