"""`reach-v1`: what it refuses, what it lets pass with a note, and that honest programs pass."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable

import pytest

from chauffeur.concept import (
    LAMPILOT_LIMITS,
    Instruction,
    Limits,
    Observation,
    Parameters,
    Plan,
    PlanRequest,
    Program,
    SystemMessage,
    Verdict,
)
from chauffeur.describe import describe
from chauffeur.planners.meaning import MeaningPlanner
from chauffeur.programs import check_source
from chauffeur.safety.checks import run_checks
from chauffeur.safety.reach import REACH_CHECK, check_reach
from chauffeur.worlds.highway.scenarios import BUILT_IN
from chauffeur.worlds.highway.world import HighwayWorld

Snap = Callable[..., Observation]
Make = Callable[..., Plan]
LIMITS = Limits()
CAPPED = Limits(max_speed_mps=20.0)
STRICT = Limits(min_time_headway_s=1.0, max_time_headway_s=3.0)


def program(body: str, library: str = "") -> Program:
    lines = "".join(f"    {line}\n" for line in body.splitlines())
    source = f"def policy():\n    ego = get_ego_vehicle()\n{lines}    yield autopilot()\n"
    return Program(source, library=library)


def judge(plan: Plan, observation: Observation, limits: Limits = LIMITS) -> Verdict:
    verdict = check_reach(plan, observation, limits)
    assert verdict.check == REACH_CHECK == "reach-v1"
    assert verdict.reason
    assert bool(verdict.remedy) is not verdict.passed
    return verdict


JUDGED = [
    # (limits, program, whether it passes, what the reason says, its line); the ego is at 25 m/s under a limit of 30 m/s
    (LIMITS, "set_target_speed(31)", True, "", None),
    (LIMITS, "set_target_speed(31.1)", False, "31.1 m/s (112 km/h) is more than 1 m/s (4 km/h) above", 3),
    (LIMITS, "set_target_speed(-1)", False, "-1 m/s (-4 km/h) is negative", 3),
    (LIMITS, "v = 20\nif detect_stop_sign_ahead() > 9:\n    v = v * 2\nset_target_speed(v)",
     False, "40 m/s (144 km/h), come to", 6),
    (LIMITS, "v = 20\nif v > 30:\n    set_target_speed(50)", True, "never reached", None),
    (LIMITS, "def fast(by):\n    set_target_speed(30 + by)\nfast(0)\nfast(12)", False, "42 m/s", 4),
    (LIMITS, "set_target_speed(get_speed_limit() + 5)", False, "35 m/s", 3),
    (LIMITS, "yield autopilot()\nset_target_speed(get_speed_limit() + 20)", False, "40 m/s (144 km/h) or more is", 4),
    (LIMITS, "yield autopilot()\nset_target_speed(get_speed_limit() + 5)",
     True, "line 4: the target speed cannot be foreseen", None),
    (LIMITS, "yield autopilot()\nset_target_speed(min(31, max(0, get_speed_of(ego) + 50)))", True, "", None),
    (LIMITS, "set_target_speed(get_speed_of(ego) + 50)", False, "74 m/s (266 km/h) or more", 3),
    (LIMITS, "yield autopilot()\nset_target_speed(get_speed_of(ego) + 50)", True, "cannot be foreseen", None),
    (LIMITS, "for v in (20, 30, 40):\n    set_target_speed(v)\n    yield autopilot()", False, "40 m/s", 4),
    (LIMITS, "set_target_speed(float('inf') if ego else 3)", True, "cannot be foreseen", None),
    (LIMITS, "v = 1e308 * 10\nset_target_speed(v)", False, "inf m/s", 4),
    (LIMITS, "v = 1e308 * 10\nset_target_speed(v - v)", False, "is nan, not a number", 4),
    (CAPPED, "v = 15 + 6\nset_target_speed(v)", False, "above the cap of 20 m/s (72 km/h)", 4),
    (CAPPED, "set_target_speed(20)", True, "", None),
    (LAMPILOT_LIMITS, "set_target_speed(38.3)", True, "", None),
    (STRICT, "h = 1.5\nh = h / 2\nset_desired_time_headway(h)", False, "0.75 s is outside 1 to 3 s", 5),
    (STRICT, "set_desired_time_headway(25 / max(50, get_speed_of(ego)))", False, "0.5 s is outside", 3),
    (STRICT, "yield autopilot()\nset_desired_time_headway(25 / max(1, get_speed_of(ego)))",
     True, "time headway cannot be foreseen", None),
    (LIMITS, "x = 4000\ndetect_front_vehicle_in(get_lane_of(ego), x + 1)", False, "4001 m is outside 0 to 2000", 4),
    (LIMITS, "set_target_lane(get_left_lane(ego))", True, "", None),
    (LIMITS, "front = None\nset_target_speed(get_speed_of(front))", False, "given None for its vehicle", 4),
    (LIMITS, "front = detect_front_vehicle_in(get_lane_of(ego))\nget_speed_of(front)",
     True, "fails if its vehicle is None", None),
    (LIMITS, "try:\n    get_speed_of(None)\nexcept TypeError:\n    pass", True, "", None),
    (LIMITS, "set_target_speed('fast')", False, "never a number", 3),
    (LIMITS, "while True:\n    if 1 > 2:\n        yield autopilot()", False, "never yields", 3),
    (LIMITS, "n = 0\nwhile n < 5:\n    n = get_speed_of(ego)", True, "line 4: of this loop", None),
    (LIMITS, "for _ in range(10 ** 6):\n    pass", True, "1000000 passes", None),
    (LIMITS, "set_target_speed(20)\nset_target_speed(25)",
     True, "line 3: the wish set_target_speed never takes effect", None),
    (LIMITS, "set_target_lane(get_left_lane(ego))\nset_target_lane(get_right_lane(ego))", True, "two lanes", None),
]  # fmt: skip


@pytest.mark.parametrize(("limits", "body", "passes", "says", "line"), JUDGED, ids=range(len(JUDGED)))
def test_verdicts(snap: Snap, plan: Make, limits: Limits, body: str, passes: bool, says: str, line: int | None) -> None:
    verdict = judge(plan(program(body)), snap(), limits)
    assert (verdict.passed, says in verdict.reason) == (passes, True), verdict
    if line is not None:
        assert verdict.line == line


def test_a_lane_that_is_not_there(snap: Snap, plan: Make) -> None:
    left = plan(program("set_target_lane(get_left_lane(ego))"))
    assert judge(left, snap(index=1)).passed
    verdict = judge(left, snap(index=0))
    assert (verdict.passed, verdict.line) == (False, 3)
    assert "None" in verdict.reason
    tested = plan(program("lane = get_left_lane(ego)\nif lane is not None:\n    set_target_lane(lane)"))
    verdict = judge(tested, snap(index=0))
    assert verdict.passed
    assert "never reached: the condition in line 4 is never true here" in verdict.reason


def test_other_policies_and_no_programs(snap: Snap, plan: Make) -> None:
    assert judge(plan(Parameters(99.0, 1.0, 1.0)), snap()).passed
    assert judge(plan(None), snap()).passed
    for source in ("def policy(:", "", "x = 3", "def policy():\n    return 1\n"):
        assert not judge(plan(Program(source)), snap()).passed


def test_helpers_are_judged_with_what_they_are_given(snap: Snap, plan: Make) -> None:
    library = "def cruise(speed):\n    set_target_speed(speed)\n    yield autopilot()\n"
    assert judge(plan(program("yield from cruise(20)", library)), snap()).passed
    verdict = judge(plan(program("yield from cruise(50)", library)), snap())
    assert (verdict.passed, verdict.line) == (False, None)
    assert "(In a helper function.)" in verdict.reason


def test_many_doubts_are_counted(snap: Snap, plan: Make) -> None:
    body = "yield autopilot()\n" + "set_target_speed(get_speed_of(ego) + 9)\nyield autopilot()\n" * 6
    verdict = judge(plan(program(body)), snap())
    assert verdict.passed
    assert "And 3 more." in verdict.reason


WISHES = (
    "Overtake the car in front of you.", "Leave a bit more room to the car ahead.", "Get much closer to the car ahead.",
    "Keep two seconds distance.", "Slow down to 90 km/h.", "Go a little faster.", "Change to the left lane.",
    "Move over to the right lane.", "Pull over on the shoulder, please.", "Turn left at the intersection.",
    "Go straight on at the intersection.", "Turn right at the intersection.",
    "Go faster and then change to the left lane.",
)  # fmt: skip


def test_no_program_of_the_meaning_planner_is_refused_that_passed_before() -> None:
    planner = MeaningPlanner()
    judged = 0
    for scenario in BUILT_IN:
        observation = HighwayWorld().reset(scenario)
        context = describe(observation)
        for wish in WISHES:
            for limits in (LIMITS, LAMPILOT_LIMITS):
                request = PlanRequest(Instruction(wish), context, SystemMessage(""), limits=limits)
                plan = asyncio.run(planner.plan(request))
                if plan.policy is None or not all(verdict.passed for verdict in run_checks(plan, observation, limits)):
                    continue
                judged += 1
                verdict = judge(plan, observation, limits)
                assert verdict.passed, f"{scenario.id}: {wish}: {verdict}"
    assert judged > 80


def test_an_ordinary_program_takes_milliseconds(snap: Snap, plan: Make) -> None:
    """The best of several runs of different texts, so that neither memory nor a busy machine decides."""
    best = 1.0
    for number in range(8):
        source = OVERTAKING.replace("9.0", f"{9 + number / 10}")
        assert check_source(source).passed
        begun = time.process_time()
        verdict = judge(plan(Program(source)), snap())
        best = min(best, time.process_time() - begun)
        assert verdict.passed
    assert best < 0.02


OVERTAKING = """
def overtake():
    ego = get_ego_vehicle()
    home = get_lane_of(ego)
    lead = detect_front_vehicle_in(home)
    if lead is None:
        say("There is nobody ahead.")
        return

    def free(lane):
        if lane is None or not is_safe_enter(lane, 5.0):
            return False
        front = detect_front_vehicle_in(lane)
        rear = detect_rear_vehicle_in(lane)
        if front is not None and get_distance_between_vehicles(front, ego) < 9.0:
            return False
        return rear is None or get_distance_between_vehicles(ego, rear) > 9.0 + 0.8 * max(0.0, get_speed_of(rear) - 20)

    cruise = min(30.0, max(5.0, get_speed_of(lead) + 5.0))
    set_target_speed(cruise)
    for side in ("left", "right"):
        lane = get_left_lane(ego) if side == "left" else get_right_lane(ego)
        waited = 0
        while waited < 100 and not free(lane):
            waited = waited + 1
            yield autopilot()
        if lane is not None and waited < 100:
            set_target_lane(lane)
            break
    while get_distance_between_vehicles(ego, lead) < 15.0:
        if get_speed_of(ego) < get_speed_of(lead):
            set_target_speed(min(cruise + 2.0, 31.0))
        yield autopilot()
    set_target_speed(cruise)
    for _ in range(20):
        yield autopilot()
"""
