"""What `reach-v1` says, word by word, of one program for each thing it looks at."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from chauffeur.concept import Lead, Limits, Observation, Plan, Program, Verdict
from chauffeur.safety.reach import REACH_CHECK, check_reach

Make = Callable[..., Plan]
Snap = Callable[..., Observation]

FITS = "Everything the program can come to fits the situation."
USE_SPEED = "Use a target speed from 0 to 31 m/s (112 km/h)."
USE_HEADWAY = "Use a time headway from 0.5 to 10 s."
YIELD = "Put `yield autopilot()` into the loop, or leave it."
TEST = "Test first that it is not None."


def program(body: str, library: str = "") -> Program:
    lines = "".join(f"    {line}\n" for line in body.splitlines())
    source = f"def policy():\n    ego = get_ego_vehicle()\n{lines}    yield autopilot()\n"
    return Program(source, library=library)


REFUSED: list[tuple[str, str, str, int | None, str]] = [
    # (program, library, reason, line, remedy); the ego is at 25 m/s under a limit of 30 m/s
    ("set_target_speed(-1)", "", "A target speed of -1 m/s (-4 km/h) is negative.", 3, USE_SPEED),
    (
        "set_target_speed(40)",
        "",
        "A target speed of 40 m/s (144 km/h) is more than 1 m/s (4 km/h) above the speed limit "
        "of 30 m/s (108 km/h) here.",
        3,
        USE_SPEED,
    ),
    ("set_target_speed('x')", "", "The target speed is never a number there.", 3, USE_SPEED),
    ("set_target_speed(None)", "", "The target speed is never a number there.", 3, USE_SPEED),
    ("set_desired_time_headway(0.1)", "", "A time headway of 0.1 s is outside 0.5 to 10 s.", 3, USE_HEADWAY),
    ("set_desired_time_headway(11)", "", "A time headway of 11 s is outside 0.5 to 10 s.", 3, USE_HEADWAY),
    (
        "set_target_speed(get_speed_of(ego) + 50)",
        "",
        "A target speed of 74 m/s (266 km/h) or more is more than 1 m/s (4 km/h) above the "
        "speed limit of 30 m/s (108 km/h) here.",
        3,
        USE_SPEED,
    ),
    (
        "set_target_speed(-5 - get_speed_of(ego))",
        "",
        "A target speed of -29 m/s (-104 km/h) or less is negative.",
        3,
        USE_SPEED,
    ),
    (
        "v = 20\nif detect_stop_sign_ahead() > 9:\n    v = v * 2\nset_target_speed(v)",
        "",
        "A target speed of 40 m/s (144 km/h), come to on one way through the program, is more "
        "than 1 m/s (4 km/h) above the speed limit of 30 m/s (108 km/h) here.",
        6,
        USE_SPEED,
    ),
    (
        "v = 20\nif detect_stop_sign_ahead() > 9:\n    v = v - 30\nset_target_speed(v)",
        "",
        "A target speed of -10 m/s (-36 km/h), come to on one way through the program, is negative.",
        6,
        USE_SPEED,
    ),
    (
        "detect_front_vehicle_in(get_lane_of(ego), 4001)",
        "",
        "A distance of detect_front_vehicle_in of 4001 m is outside 0 to 2000.",
        3,
        "Use a distance of detect_front_vehicle_in from 0 to 2000 m.",
    ),
    (
        "is_safe_enter(get_left_lane(ego), 50)",
        "",
        "A safe_decel of is_safe_enter of 50 m/s^2 is outside 0 to 15.",
        3,
        "Use a safe_decel of is_safe_enter from 0 to 15 m/s^2.",
    ),
    (
        "is_safe_enter(get_left_lane(ego), -1)",
        "",
        "A safe_decel of is_safe_enter of -1 m/s^2 is outside 0 to 15.",
        3,
        "Use a safe_decel of is_safe_enter from 0 to 15 m/s^2.",
    ),
    (
        "is_safe_enter(get_left_lane(ego), 'x')",
        "",
        "The safe_decel of is_safe_enter is never a number there.",
        3,
        "Use a safe_decel of is_safe_enter from 0 to 15 m/s^2.",
    ),
    ("get_speed_of(None)", "", "get_speed_of is given None for its vehicle there, and fails.", 3, TEST),
    ("set_target_lane(None)", "", "set_target_lane is given None for its lane there, and fails.", 3, TEST),
    ("while True:\n    pass", "", "A loop never yields, and nothing but an error ends it.", 3, YIELD),
    ("while get_speed_of(ego) > 3:\n    pass", "", "A loop never yields, and nothing but an error ends it.", 3, YIELD),
    (
        "yield from go()",
        "def go():\n    set_target_speed(50)\n    yield autopilot()\n",
        "A target speed of 50 m/s (180 km/h) is more than 1 m/s (4 km/h) above the speed limit "
        "of 30 m/s (108 km/h) here. (In a helper function.)",
        None,
        USE_SPEED,
    ),
    (
        "yield from go()",
        "def go():\n    while True:\n        pass\n    yield autopilot()\n",
        "A loop never yields, and nothing but an error ends it. (In a helper function.)",
        None,
        YIELD,
    ),
    (
        "yield from go()",
        "def go():\n    while get_speed_of(get_ego_vehicle()) > 3:\n        pass\n    yield autopilot()\n",
        "A loop never yields, and nothing but an error ends it. (In a helper function.)",
        None,
        YIELD,
    ),
    (
        "set_target_speed(40)\nset_target_speed(-1)\nset_target_speed(40)",
        "",
        "A target speed of 40 m/s (144 km/h) is more than 1 m/s (4 km/h) above the speed limit "
        "of 30 m/s (108 km/h) here. A target speed of -1 m/s (-4 km/h) is negative.",
        3,
        USE_SPEED,
    ),
    (
        "yield from go()\nset_target_speed(40)",
        "def go():\n    set_target_speed(50)\n    yield autopilot()\n",
        "A target speed of 40 m/s (144 km/h) is more than 1 m/s (4 km/h) above the speed limit "
        "of 30 m/s (108 km/h) here. A target speed of 50 m/s (180 km/h) is more than 1 m/s (4 km/h) above the speed "
        "limit of 30 m/s (108 km/h) here. (In a helper function.)",
        4,
        USE_SPEED,
    ),
    (
        "set_target_speed(other=500, target_speed=-1)",
        "",
        "A target speed of -1 m/s (-4 km/h) is negative.",
        3,
        USE_SPEED,
    ),
]

DOUBTED: list[tuple[str, str, str]] = [
    # (program, library, what is not proven or odd)
    (
        "set_target_speed(float('nan'))",
        "",
        "line 3: the target speed cannot be foreseen; that it stays from 0 to 31 m/s (112 km/h) is not proven.",
    ),
    (
        "yield autopilot()\nset_desired_time_headway(25 / max(1, get_speed_of(ego)))",
        "",
        "line 4: the time headway cannot be foreseen; that it stays from 0.5 to 10 s is not proven.",
    ),
    (
        "yield autopilot()\nset_target_speed(get_speed_of(ego) + 50)",
        "",
        "line 4: the target speed cannot be foreseen; that it stays from 0 to 31 m/s (112 km/h) is not proven.",
    ),
    (
        "yield autopilot()\nset_target_lane(get_left_lane(ego))",
        "",
        "line 4: set_target_lane fails if its lane is None.",
    ),
    (
        "get_speed_of(detect_front_vehicle_in(get_lane_of(ego)))",
        "",
        "line 3: get_speed_of fails if its vehicle is None.",
    ),
    ("for i in range(200000):\n    pass", "", "line 3: this loop may make 200000 passes without a yield."),
    (
        "v = 20\nif v > 30:\n    set_target_speed(50)",
        "",
        "line 5: the wish set_target_speed is never reached: the condition in line 4 is never true here.",
    ),
    (
        "set_target_speed(20)\nset_target_speed(21)",
        "",
        "line 3: the wish set_target_speed never takes effect: line 4 wishes otherwise before the next yield.",
    ),
    (
        "set_target_lane(get_left_lane(ego))\nset_target_lane(get_right_lane(ego))",
        "",
        "line 3: the wish set_target_lane never takes effect: line 4 wishes otherwise before "
        "the next yield. line 4: two lanes are wished in one control period: line 3 wishes one "
        "to the other side.",
    ),
    (
        "yield from go()",
        "def go():\n    for i in range(200000):\n        pass\n    yield autopilot()\n",
        "this loop may make 200000 passes without a yield. (In a helper function.)",
    ),
    (
        "yield from go()",
        "def go():\n    set_target_speed(20)\n    set_target_speed(21)\n    yield autopilot()\n",
        "the wish set_target_speed never takes effect: line 3 wishes otherwise before the next "
        "yield. (In a helper function.)",
    ),
    (
        "yield from go()",
        "def go():\n    yield autopilot()\n    "
        "set_target_speed(get_speed_of(get_ego_vehicle()) + 50)\n    yield autopilot()\n",
        "the target speed cannot be foreseen; that it stays from 0 to 31 m/s (112 km/h) is not "
        "proven. (In a helper function.)",
    ),
    (
        "yield autopilot()\nv = get_speed_of(ego) + 50\nset_target_speed(v)\nyield "
        "autopilot()\nset_desired_time_headway(25 / v)\nyield autopilot()\n"
        "set_target_lane(get_left_lane(ego))\nyield autopilot()\nset_target_speed(v + 1)",
        "",
        "line 5: the target speed cannot be foreseen; that it stays from 0 to 31 m/s (112 "
        "km/h) is not proven. line 7: the time headway cannot be foreseen; that it stays from "
        "0.5 to 10 s is not proven. line 9: set_target_lane fails if its lane is None. And 1 "
        "more.",
    ),
    (
        "for i in range(200000):\n    pass\nyield autopilot()\nset_target_speed(get_speed_of(ego) + 50)\n"
        "yield autopilot()\nset_target_lane(get_left_lane(ego))",
        "",
        "line 3: this loop may make 200000 passes without a yield. line 6: the target speed cannot be foreseen; that "
        "it stays from 0 to 31 m/s (112 km/h) is not proven. line 8: set_target_lane fails if its lane is None.",
    ),
    (
        "import os\nasync def f():\n    pass\nset_target_speed(500)",
        "",
        "the program was not followed to its end (line 4 has what the language does not know). "
        "line 6: the target speed cannot be foreseen; that it stays from 0 to 31 m/s (112 "
        "km/h) is not proven.",
    ),
]

FITTING = [
    "",
    "is_safe_enter(None)",
    "get_left_lane(None)",
    "try:\n    get_speed_of(None)\nexcept TypeError:\n    pass",
    "for i in range(100000):\n    pass",
    "return\nx = 1",
]


@pytest.mark.parametrize(("body", "library", "reason", "line", "remedy"), REFUSED)
def test_what_is_said_of_a_fault(
    plan: Make, snap: Snap, body: str, library: str, reason: str, line: int | None, remedy: str
) -> None:
    found = check_reach(plan(program(body, library)), snap(), Limits())
    assert found == Verdict(REACH_CHECK, False, reason, line, remedy)


@pytest.mark.parametrize(("body", "library", "doubts"), DOUBTED)
def test_what_is_said_of_a_doubt(plan: Make, snap: Snap, body: str, library: str, doubts: str) -> None:
    found = check_reach(plan(program(body, library)), snap(), Limits())
    known = "Nothing is known to be beyond the limits. Not proven or odd: "
    assert found == Verdict(REACH_CHECK, True, known + doubts, proven=False)


@pytest.mark.parametrize("body", FITTING)
def test_what_is_said_of_what_fits(plan: Make, snap: Snap, body: str) -> None:
    assert check_reach(plan(program(body)), snap(), Limits()) == Verdict(REACH_CHECK, True, FITS)


def test_what_is_said_of_other_plans(plan: Make, snap: Snap) -> None:
    assert check_reach(plan(None), snap(), Limits()) == Verdict(
        REACH_CHECK, True, "There is no program to follow.", not_compared="no-program"
    )
    assert check_reach(plan(Program("x")), snap(), Limits()) == Verdict(
        REACH_CHECK,
        False,
        "The program cannot be followed: The program has no main function.",
        None,
        "Write a program.",
    )
    assert check_reach(plan(Program("x = (")), snap(), Limits()).line == 1


def test_a_cap_is_named(plan: Make, snap: Snap) -> None:
    found = check_reach(plan(program("set_target_speed(25)")), snap(), Limits(max_speed_mps=20.0))
    assert found.reason == "A target speed of 25 m/s (90 km/h) is above the cap of 20 m/s (72 km/h)."
    assert found.remedy == "Use a target speed from 0 to 20 m/s (72 km/h)."


def test_off_the_lanes_the_lowest_limit_of_the_road_holds(plan: Make, snap: Snap) -> None:
    found = check_reach(plan(program("set_target_speed(21.5)")), snap(index=None), Limits())
    assert "above the speed limit of 20 m/s (72 km/h) here" in found.reason
    assert check_reach(plan(program("set_target_speed(21)")), snap(index=None), Limits()).reason == FITS


@pytest.mark.parametrize(
    ("body", "limits", "passes"),
    [
        ("set_target_speed(31.000001)", Limits(), True),
        ("set_target_speed(31.000002)", Limits(), False),
        ("set_target_speed(-0.000001)", Limits(), True),
        ("set_target_speed(-0.000002)", Limits(), False),
        ("set_target_speed(20.000001)", Limits(max_speed_mps=20.0), True),
        ("set_target_speed(20.000002)", Limits(max_speed_mps=20.0), False),
        ("set_target_speed(31)", Limits(max_speed_mps=31.0), True),
        ("set_desired_time_headway(0.499999)", Limits(), True),
        ("set_desired_time_headway(0.499998)", Limits(), False),
        ("set_desired_time_headway(10.000001)", Limits(), True),
        ("set_desired_time_headway(10.000002)", Limits(), False),
        ("detect_front_vehicle_in(get_lane_of(ego), 2000)", Limits(), True),
        ("detect_front_vehicle_in(get_lane_of(ego), 2000.1)", Limits(), False),
    ],
)
def test_bounds_to_the_last_digit(plan: Make, snap: Snap, body: str, limits: Limits, passes: bool) -> None:
    found = check_reach(plan(program(body)), snap(), limits)
    assert found.passed is passes
    assert not passes or found.reason == FITS


@pytest.mark.parametrize(
    ("body", "limits", "passes"),
    [
        # What depends on the road is held against the highest sign of the road, and the cap.
        ("yield autopilot()\nset_target_speed(get_speed_limit())", {}, True),
        ("yield autopilot()\nset_target_speed(get_speed_limit() + 12)", {}, False),
        ("yield autopilot()\nset_target_speed(get_speed_limit() + 10)", {}, True),
        ("yield autopilot()\nset_target_speed(get_speed_limit() + 1)", {"max_speed_mps": 20.5}, False),
        ("yield autopilot()\nset_target_speed(get_speed_limit() + 1)", {"max_speed_mps": 21.5}, True),
    ],
)
def test_what_depends_on_the_road(plan: Make, snap: Snap, body: str, limits: dict[str, Any], passes: bool) -> None:
    assert check_reach(plan(program(body)), snap(front=Lead(1, 40.0, 20.0)), Limits(**limits)).passed is passes
