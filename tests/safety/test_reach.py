"""`reach-v1`: what it refuses, what it lets pass with a note, and that honest programs pass."""

from __future__ import annotations

import asyncio
import time
from typing import Any

import pytest
from check_scenes import judged_by, plan, program, snap
from golden_sentences import compare, outcome, row

from chauffeur.concept import (
    LAMPILOT_LIMITS,
    Instruction,
    Lead,
    Limits,
    Parameters,
    Plan,
    PlanRequest,
    Program,
    SystemMessage,
)
from chauffeur.describe import describe
from chauffeur.planners.meaning import MeaningPlanner
from chauffeur.programs import APIS, check_source
from chauffeur.safety.checks import run_checks
from chauffeur.safety.reach import check_reach
from chauffeur.worlds.highway.scenarios import BUILT_IN
from chauffeur.worlds.highway.world import HighwayWorld

LIMITS = Limits()
judge = judged_by(check_reach, "reach-v1")
STRICT = {"min_time_headway_s": 1.0, "max_time_headway_s": 3.0}
CAPPED = {"max_speed_mps": 20.0}
ON = "yield autopilot()\n"
"""After a period the road may answer anything; before it, it is what is seen."""


def helper(body: str) -> str:
    return "def go():\n" + "".join(f"    {line}\n" for line in [*body.splitlines(), ON.strip()])


REFUSED = (
    "set_target_speed(-1)", "set_target_speed(31.1)", "set_target_speed('x')", "set_target_speed(None)",
    "set_desired_time_headway(0.1)", "set_desired_time_headway(11)",
    "set_target_speed(get_speed_of(ego) + 50)", "set_target_speed(-5 - get_speed_of(ego))",
    "set_target_speed(get_speed_limit() + 5)", f"{ON}set_target_speed(get_speed_limit() + 20)",
    "v = 20\nif detect_stop_sign_ahead() > 9:\n    v = v * 2\nset_target_speed(v)",
    "v = 20\nif detect_stop_sign_ahead() > 9:\n    v = v - 30\nset_target_speed(v)",
    "def fast(by):\n    set_target_speed(30 + by)\nfast(0)\nfast(12)",
    f"for v in (20, 30, 40):\n    set_target_speed(v)\n    {ON}",
    "v = 1e308 * 10\nset_target_speed(v)", "v = 1e308 * 10\nset_target_speed(v - v)",
    "x = 4000\ndetect_front_vehicle_in(get_lane_of(ego), x + 1)",
    "is_safe_enter(get_left_lane(ego), 50)", "is_safe_enter(get_left_lane(ego), -1)",
    "is_safe_enter(get_left_lane(ego), 'x')",
    "get_speed_of(None)", "set_target_lane(None)", "front = None\nset_target_speed(get_speed_of(front))",
    "while True:\n    pass", "while get_speed_of(ego) > 3:\n    pass", f"while True:\n    if 1 > 2:\n        {ON}",
    "set_target_speed(40)\nset_target_speed(-1)\nset_target_speed(40)",
    "set_target_speed(other=500, target_speed=-1)", "set_target_speed(target_speed=500)",
)  # fmt: skip
REFUSED_IN_A_HELPER = (
    "set_target_speed(50)", "while True:\n    pass", "while get_speed_of(get_ego_vehicle()) > 3:\n    pass",
)  # fmt: skip
DOUBTED = (
    "set_target_speed(float('nan'))", "set_target_speed(float('inf') if ego else 3)",
    f"{ON}set_target_speed(get_speed_limit() + 5)", f"{ON}set_target_speed(get_speed_of(ego) + 50)",
    f"{ON}set_desired_time_headway(25 / max(1, get_speed_of(ego)))",
    f"{ON}set_target_lane(get_left_lane(ego))", "get_speed_of(detect_front_vehicle_in(get_lane_of(ego)))",
    "for i in range(200000):\n    pass", "n = 0\nwhile n < 5:\n    n = get_speed_of(ego)",
    "v = 20\nif v > 30:\n    set_target_speed(50)", "set_target_speed(20)\nset_target_speed(21)",
    "set_target_lane(get_left_lane(ego))\nset_target_lane(get_right_lane(ego))",
    f"{ON}v = get_speed_of(ego) + 50\nset_target_speed(v)\n{ON}set_desired_time_headway(25 / v)\n{ON}"
    f"set_target_lane(get_left_lane(ego))\n{ON}set_target_speed(v + 1)",
    ON + f"set_target_speed(get_speed_of(ego) + 9)\n{ON}" * 6,
    f"for i in range(200000):\n    pass\n{ON}set_target_speed(get_speed_of(ego) + 50)\n{ON}"
    "set_target_lane(get_left_lane(ego))",
    "import os\nasync def f():\n    pass\nset_target_speed(500)",
    "async def f():\n    pass\nwhile True:\n    pass",
)  # fmt: skip
DOUBTED_IN_A_HELPER = (
    "for i in range(200000):\n    pass", "set_target_speed(20)\nset_target_speed(21)",
    f"{ON}set_target_speed(get_speed_of(get_ego_vehicle()) + 50)",
)  # fmt: skip
FITTING = (
    "", "set_target_speed(31)", "is_safe_enter(None)", "get_left_lane(None)", "for i in range(100000):\n    pass",
    "return\nx = 1", "set_target_lane(get_left_lane(ego))", f"{ON}set_target_speed(get_speed_limit())",
    f"{ON}set_target_speed(min(31, max(0, get_speed_of(ego) + 50)))",
    "try:\n    get_speed_of(None)\nexcept TypeError:\n    pass",
    "try:\n    set_target_speed('fast')\nexcept TypeError:\n    pass",
    "set_target_speed(foo=500)",  # a keyword that no API has is the gate's business
)  # fmt: skip


@pytest.mark.parametrize(
    ("expected", "bodies", "helpers"),
    [("refused", REFUSED, REFUSED_IN_A_HELPER), ("not proven", DOUBTED, DOUBTED_IN_A_HELPER), ("fits", FITTING, ())],
)
def test_what_is_found_in_programs(expected: str, bodies: tuple[str, ...], helpers: tuple[str, ...]) -> None:
    """The ego is at 25 m/s under a limit of 30 m/s; a line within a helper is not told."""
    found = {body: judge(plan(program(body)), snap()) for body in bodies}
    within = {f"go: {body}": judge(plan(program("yield from go()", helper(body))), snap()) for body in helpers}
    assert {outcome(one) for one in (*found.values(), *within.values())} == {expected}
    assert {one.line for one in within.values()} <= {None}
    compare(f"reach-v1: {expected}", {body: row(one) for body, one in (found | within).items()})


ELSEWHERE: dict[str, tuple[Plan, dict[str, Any], Limits]] = {
    "no policy": (plan(None), {}, LIMITS),
    "parameters": (plan(Parameters(99.0, 1.0, 1.0)), {}, LIMITS),
    "no main function": (plan(Program("x = 3")), {}, LIMITS),
    "no Python": (plan(Program("x = (")), {}, LIMITS),
    "own and helper": (plan(program("yield from go()\nset_target_speed(40)", helper("set_target_speed(50)"))), {},
                       LIMITS),
    "a cap": (plan(program("v = 15 + 6\nset_target_speed(v)")), {}, Limits(**CAPPED)),
    "a cap below a crawl": (plan(program("set_target_speed(0.5)")), {}, Limits(max_speed_mps=0.2)),
    "a cap that is the limit": (plan(program("set_target_speed(40)")), {}, Limits(max_speed_mps=31.0)),
    "a cap just below it": (plan(program("set_target_speed(40)")), {}, Limits(max_speed_mps=30.5)),
    "a headway of one's own": (plan(program("h = 1.5\nh = h / 2\nset_desired_time_headway(h)")), {}, Limits(**STRICT)),
    "on no lane": (plan(program("set_target_speed(21.5)")), {"index": None}, LIMITS),
    "a faster lane beside": (plan(program("set_target_speed(35)")), {"limits": (40.0, 30.0, 30.0)}, LIMITS),
    "no lane there": (plan(program("set_target_lane(get_left_lane(ego))")), {"index": 0}, LIMITS),
    "tested first": (
        plan(program("lane = get_left_lane(ego)\nif lane is not None:\n    set_target_lane(lane)")), {"index": 0},
        LIMITS,
    ),
}  # fmt: skip


def test_what_is_found_elsewhere() -> None:
    found = {name: judge(one, snap(**road), limits) for name, (one, road, limits) in ELSEWHERE.items()}
    codes = ["no-program"] * 2 + ["refused"] * 11 + ["not proven"]
    assert [outcome(one) for one in found.values()] == codes
    compare("reach-v1: elsewhere", {name: row(one) for name, one in found.items()})


@pytest.mark.parametrize(
    ("body", "limits", "passes"),
    [
        ("set_target_speed(31.000001)", {}, True), ("set_target_speed(31.000002)", {}, False),
        ("set_target_speed(-0.000001)", {}, True), ("set_target_speed(-0.000002)", {}, False),
        ("set_target_speed(20.000001)", CAPPED, True), ("set_target_speed(20.000002)", CAPPED, False),
        ("set_target_speed(31)", {"max_speed_mps": 31.0}, True),
        ("set_target_speed(38.3)", {"max_over_limit_mps": 9.0}, True),
        ("set_desired_time_headway(0.499999)", {}, True), ("set_desired_time_headway(0.499998)", {}, False),
        ("set_desired_time_headway(10.000001)", {}, True), ("set_desired_time_headway(10.000002)", {}, False),
        ("set_desired_time_headway(25 / max(50, get_speed_of(ego)))", STRICT, False),
        (f"{ON}set_desired_time_headway(25 / max(1, get_speed_of(ego)))", STRICT, True),
        ("detect_front_vehicle_in(get_lane_of(ego), 2000)", {}, True),
        ("detect_front_vehicle_in(get_lane_of(ego), 2000.1)", {}, False),
        # What depends on the road is held against the highest sign of the road, and the cap.
        (f"{ON}set_target_speed(get_speed_limit() + 12)", {}, False),
        (f"{ON}set_target_speed(get_speed_limit() + 10)", {}, True),
        (f"{ON}set_target_speed(get_speed_limit() + 1)", {"max_speed_mps": 20.5}, False),
        (f"{ON}set_target_speed(get_speed_limit() + 1)", {"max_speed_mps": 21.5}, True),
    ],
)  # fmt: skip
def test_bounds_to_the_last_digit(body: str, limits: dict[str, Any], passes: bool) -> None:
    observation = snap(front=Lead(1, 40.0, 20.0))
    assert judge(plan(program(body)), observation, Limits(**limits)).passed is passes


@pytest.mark.parametrize(("more", "passes"), [(10.5, True), (11.5, False)])
def test_what_depends_on_the_road_may_be_what_the_fastest_lane_allows(more: float, passes: bool) -> None:
    """The ego's lane allows 30 m/s, the one beside it 40, and a little more is tolerated on each."""
    body = f"set_target_speed(get_speed_limit(get_left_lane(ego)) + {more})"
    assert judge(plan(program(body)), snap(limits=(40.0, 30.0, 30.0))).passed is passes


def test_off_the_lanes_the_lowest_limit_of_the_road_holds() -> None:
    assert judge(plan(program("set_target_speed(21)")), snap(index=None)).passed


def test_every_number_of_the_catalogue_has_bounds() -> None:
    """`reach-v1` holds every number against them."""
    numbers = [param for api in APIS.values() for param in api.params if param.kind == "number"]
    assert numbers
    assert all(param.low is not None and param.high is not None and param.low < param.high for param in numbers)
    assert all(param.unit for param in numbers), "the verdict says it"


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
                planned = asyncio.run(planner.plan(request))
                if planned.policy is None or not all(one.passed for one in run_checks(planned, observation, limits)):
                    continue
                judged += 1
                verdict = judge(planned, observation, limits)
                assert verdict.passed, f"{scenario.id}: {wish}: {verdict}"
    assert judged > 80


def test_an_ordinary_program_takes_milliseconds() -> None:
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
