"""`parameters-v1` at and around every bound, and each fault that it names."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest
from check_scenes import judged_by, parameters, plan, program, snap
from golden_sentences import compare, outcome, row

from chauffeur.concept import (
    LAMPILOT_LIMITS,
    ActionMatrix,
    Lead,
    Limits,
    Parameters,
    Program,
    Trajectory,
)
from chauffeur.safety.envelope import check_parameters
from chauffeur.safety.format import check_format

LIMITS = Limits()
judge = judged_by(check_parameters, "parameters-v1")
CAPPED = Limits(max_speed_mps=20.0)
IDLE = program("pass")


Case = tuple[Any, dict[str, Any], dict[str, Any]]
"""A policy, further fields of its plan, and the road."""
LEFT, RIGHT = "set_target_lane(get_left_lane(ego))", "set_target_lane(get_right_lane(ego))"
GO_FAST = "def go():\n    set_target_speed(-1)\n    yield autopilot()\n"
FAULTS: dict[str, Case] = {
    "program, negative": (program("set_target_speed(-1)"), {}, {}),
    "program, too fast": (program("yield autopilot()\nset_target_speed(140 / 3.6)"), {}, {}),
    "program, no speed": (program("set_target_speed(float('nan'))"), {}, {}),
    "program, headway": (program("set_desired_time_headway(0.1)"), {}, {}),
    **{f"program, {name}": (program(f"{name}_next_intersection()"), {}, {})
       for name in ("turn_left_at", "turn_right_at", "go_straight_at")},
    "program, left of the leftmost": (program(LEFT), {}, {"index": 0}),
    "program, right of the rightmost": (program(RIGHT), {}, {"index": 2}),
    "program, left of no lane": (program(LEFT), {}, {"index": None}),
    "program, right of a lane that is not shown": (program(RIGHT), {}, {"index": 7}),
    "helper, negative": (program("yield from go()", GO_FAST), {}, {}),
    "parameters, negative": (parameters(speed=-1.0), {}, {}),
    "parameters, left": (parameters(lane=-1), {}, {"index": 0}),
    "parameters, right": (parameters(lane=1), {}, {"index": 2}),
    "parameters, a turn": (parameters(route="left"), {}, {}),
    "parameters, no look-ahead": (parameters(ahead=0.0), {}, {}),
    "parameters, ratio": (parameters(ratio=-0.5), {}, {}),
    "gain": (ActionMatrix((1.0, -1.0, 1.0), (1.0,) * 3), {}, {}),
    "weight": (ActionMatrix((1.0,) * 3, (1.0, 1.0, -1.0)), {}, {}),
    "trajectory, too fast": (Trajectory(((0.0, 40.0),), 1.0), {}, {}),
    "trajectory, no speed": (Trajectory(((10.0, 0.0), (math.nan, 0.0)), 1.0), {}, {}),
    "setting, speed": (IDLE, {"settings": (("target_speed_mps", 40.0),)}, {}),
    "setting, headway": (IDLE, {"settings": (("time_headway_s", 11.0),)}, {}),
    "setting, gap": (IDLE, {"settings": (("gap_m", 10.0),)}, {}),
    "setting, no gap": (IDLE, {"settings": (("gap_m", math.inf),)}, {}),
    "setting, no number": (IDLE, {"settings": (("patience", "much"),)}, {}),
    "intent, a turn": (IDLE, {"intent": "turn left"}, {}),
    "intent, straight on": (IDLE, {"intent": "Go straight"}, {}),
    "intent, left": (IDLE, {"intent": "change lane left"}, {"index": 0}),
    "intent, right": (IDLE, {"intent": "overtake_right"}, {"index": 2}),
    "several, in the order of lines": (program(f"{LEFT}\nset_target_speed(-1)"), {}, {"index": 0}),
    "several, each once, those without a line last": (
        program("turn_left_at_next_intersection()\nset_target_speed(99)\nset_desired_time_headway(0.1)\n"
                "set_target_speed(99)"),
        {"settings": (("time_headway_s", 0.1), ("target_speed_mps", 98.0)), "intent": "turn left"}, {},
    ),
}  # fmt: skip


def test_what_is_said_of_each_fault() -> None:
    found = {name: judge(plan(policy, **more), snap(**road)) for name, (policy, more, road) in FAULTS.items()}
    capped = judge(plan(program("set_target_speed(25)")), snap(), CAPPED)
    assert {outcome(one) for one in (*found.values(), capped)} == {"refused"}
    assert {one.line for name, one in found.items() if name.startswith(("program", "several"))} <= {3, 4}
    called = [policy for name, (policy, *_) in FAULTS.items() if name.startswith("program") and "negative" not in name]
    assert all(check_format(plan(policy), snap(), LIMITS).passed for policy in called), "the APIs watched are there"
    fits = judge(plan(program("set_target_speed(31)")), snap())
    more = {"program, above the cap": row(capped), "nothing": row(fits)}
    compare("parameters-v1", {name: row(one) for name, one in found.items()} | more)


SPEEDS = [
    (LIMITS, 0.0, True), (LIMITS, 0, True), (LIMITS, -0.0, True), (LIMITS, -1e-9, False), (LIMITS, -5.0, False),
    (LIMITS, 30.0, True), (LIMITS, 31.0, True), (LIMITS, 31.0 + 9e-7, True), (LIMITS, 31.0 + 1.1e-6, False),
    (LIMITS, 31.01, False), (LIMITS, 1e308, False),
    (CAPPED, 20.0, True), (CAPPED, 20.0 + 9e-7, True), (CAPPED, 20.0 + 2e-6, False), (CAPPED, 31.5, False),
    (LAMPILOT_LIMITS, 38.3, True), (LAMPILOT_LIMITS, 39.0, True), (LAMPILOT_LIMITS, 39.01, False),
    (LIMITS, math.inf, False), (LIMITS, -math.inf, False), (LIMITS, math.nan, False),
]  # fmt: skip


@pytest.mark.parametrize(("limits", "speed", "passes"), SPEEDS)
def test_speed_bounds_hold_in_every_place_a_speed_is_written(limits: Limits, speed: float, passes: bool) -> None:
    text = f"float('{speed}')" if not math.isfinite(speed) else repr(speed)
    plans = [
        plan(program(f"set_target_speed({text})")),
        plan(Parameters(speed, 10.0, 2.0)),
        plan(IDLE, settings=(("target_speed_mps", speed),)),
    ]
    for one in plans:
        assert judge(one, snap(), limits).passed is passes


@pytest.mark.parametrize(
    ("speed", "road", "passes"),
    [
        (25.0, {"limits": (10.0, 25.0, 10.0)}, True), (25.0, {"limits": (25.0, 10.0, 25.0)}, False),
        # Without a known lane the strictest sign holds.
        (21.0, {"index": None}, True), (21.1, {"index": None}, False), (21.1, {"index": 9}, False),
        (1.1, {"index": None, "road": False}, False),
    ],
)  # fmt: skip
def test_the_limit_is_that_of_the_ego_s_lane(speed: float, road: dict[str, Any], passes: bool) -> None:
    assert judge(plan(program(f"set_target_speed({speed})")), snap(**road)).passed is passes


@pytest.mark.parametrize(
    ("limits", "headway", "passes"),
    [
        (LIMITS, 0.5 - 9e-7, True), (LIMITS, 0.5 - 2e-6, False), (LIMITS, 0.0, False), (LIMITS, -1.0, False),
        (LIMITS, 10.0 + 9e-7, True), (LIMITS, 10.0 + 2e-6, False), (LIMITS, math.nan, False),
        (LIMITS, math.inf, False), (LAMPILOT_LIMITS, 0.01, True), (LAMPILOT_LIMITS, 0.009, False),
    ],
)  # fmt: skip
def test_headway_bounds(limits: Limits, headway: float, passes: bool) -> None:
    text = f"float('{headway}')" if not math.isfinite(headway) else repr(headway)
    one = plan(program(f"set_desired_time_headway({text})"))
    assert judge(one, snap(), limits).passed is passes
    assert judge(plan(None, settings=(("time_headway_s", headway),)), snap(), limits).passed is passes


@pytest.mark.parametrize(
    ("limits", "gap", "speed", "passes"),
    [
        (LAMPILOT_LIMITS, 15.0, 30.0, True), (LIMITS, 15.0, 30.0, False), (LIMITS, 17.5 - 9e-7, 25.0, True),
        (LIMITS, 17.5 - 2e-6, 25.0, False), (LIMITS, 5.0, 0.0, False), (LIMITS, 5.01, 0.0, True),
        (LIMITS, 4.0, 0.0, False), (LIMITS, 5.1, -3.0, True), (LAMPILOT_LIMITS, 5.29, 30.0, False),
        (LAMPILOT_LIMITS, 5.3, 30.0, True), (LIMITS, math.nan, 0.0, False), (LIMITS, math.inf, 0.0, False),
        (LIMITS, -10.0, 30.0, False),
    ],
)  # fmt: skip
def test_gap_bounds_count_the_car_length(limits: Limits, gap: float, speed: float, passes: bool) -> None:
    one = plan(IDLE, settings=(("gap_m", gap),))
    assert judge(one, snap(speed=speed), limits).passed is passes
    assert judge(one, snap(speed=99.0, front=Lead(1, 40.0, speed)), limits).passed is passes


@pytest.mark.parametrize(("value", "passes"), [(1.0, True), (math.nan, False), (math.inf, False), ("1", False)])
def test_other_settings_must_be_numbers(value: float, passes: bool) -> None:
    assert judge(plan(None, settings=(("decel_mps2", value),)), snap()).passed is passes


@pytest.mark.parametrize(
    ("body", "index", "passes"),
    [
        (LEFT, 0, False),
        (LEFT, 1, True),
        (LEFT, 2, True),
        (RIGHT, 2, False),
        (RIGHT, 1, True),
        (RIGHT, 0, True),
        ("set_target_lane(get_lane_of(ego))", 0, True),
        ("l = get_left_lane(ego)\nwhile not is_safe_enter(l):\n    yield autopilot()\nset_target_lane(l)", 0, False),
        ("left = get_left_lane(ego)\nif left is None:\n    return\nset_target_lane(left)", 0, True),
        (f"if is_safe_enter(get_left_lane(ego)):\n    {LEFT}\nelse:\n    {RIGHT}", 0, True),
        (f"{RIGHT}\nyield autopilot()\n{LEFT}", 0, True),
        (f"{LEFT}\nyield autopilot()\n{RIGHT}", 0, False),
        (f"set_target_lane(lane)\n{LEFT}", 0, True),
        (f"def back():\n    {LEFT}\n{RIGHT}\nback()", 0, True),
        (f"def more():\n    {LEFT}\n{LEFT}\nmore()", 0, False),
    ],
)
def test_lane_moves_off_the_road(body: str, index: int, passes: bool) -> None:
    assert judge(plan(program(body)), snap(index=index)).passed is passes


@pytest.mark.parametrize(
    ("lane", "index", "passes"),
    [(-1, 0, False), (-1, 1, True), (0, 0, True), (1, 2, False), (1, 1, True), (0, None, True), (1, None, False)],
)
def test_parameter_lane_wish(lane: int, index: int | None, passes: bool) -> None:
    assert judge(plan(parameters(lane=lane)), snap(index=index)).passed is passes


@pytest.mark.parametrize(
    ("intent", "index", "passes"),
    [
        *((f"{word} left + turn right", 0, False) for word in ("lane", "change", "overtake", "pass", "merge", "move")),
        ("Overtake.Left", 0, False), ("change lane left.", 0, False), (" move left + stop ", 0, False),
        ("overtake.left", 1, True), ("overtake.right", 2, False), ("lane.right", 1, True), ("overtake", 0, True),
        ("speed.increase", 0, True), ("look.left", 0, True), ("", 0, True), ("turn.left", 1, False),
        ("go.straight", 1, False), ("Turn right + lane.left", 1, False),
        ("lane.left+lane.right", 2, True), ("lane.right+lane.left", 2, False), ("overtake.left+speed.set", 0, False),
        ("speed.up + lane.left", 0, True), ("lane", 0, True), ("left", 0, True), ("lane.left.later", 0, True),
        ("follow left", 0, True),
    ],
)  # fmt: skip
def test_the_first_step_of_an_intent_must_fit_the_road(intent: str, index: int, passes: bool) -> None:
    assert judge(plan(IDLE, intent=intent), snap(index=index)).passed is passes
    assert judge(plan(None, intent=intent), snap(index=index)).passed, "without a policy there is none to fit"


@pytest.mark.parametrize("intent", ["turn.left", "go.straight", "Turn right + lane.left"])
@pytest.mark.parametrize("api", ["turn_left_at", "turn_right_at", "go_straight_at"])
def test_at_an_intersection_turns_fit(api: str, intent: str) -> None:
    one = plan(program(f"{api}_next_intersection()"), intent=intent)
    assert judge(one, snap(kind="intersection", index=0)).passed
    assert judge(plan(parameters(route="left")), snap(kind="intersection")).passed


@pytest.mark.parametrize(
    ("parameters", "passes"),
    [
        (Parameters(15.0, 0.1, 0.0), True), (Parameters(15.0, 0.0, 2.0), False),
        (Parameters(15.0, math.nan, 2.0), False), (Parameters(15.0, 10.0, -0.1), False),
        (Parameters("15", 10.0, 2.0), False), (Parameters(True, 10.0, 2.0), False),
        (Parameters(15.0, "10", 2.0), False), (Parameters(15.0, 10.0, None), False),
        (Parameters(15.0, 10.0, 2.0, 7), True),
    ],
)  # fmt: skip
def test_look_ahead_and_values_of_wrong_type(parameters: Parameters, passes: bool) -> None:
    assert judge(plan(parameters), snap()).passed is passes


@pytest.mark.parametrize(
    ("gains", "passes"), [((0.5, 0.0, 0.0), True), ((0.5, -0.1, 0.0), False), ((math.nan, 0.0, 0.0), False)]
)
def test_action_matrix_has_no_negative_gain(gains: tuple[float, float, float], passes: bool) -> None:
    assert judge(plan(ActionMatrix(gains, (8.0, 20.0, 150.0))), snap()).passed is passes
    assert not judge(plan(ActionMatrix((0.5, 0.0, 0.0), (8.0, gains[1] - 1.0, 150.0))), snap()).passed


@pytest.mark.parametrize(
    ("points", "period", "passes"),
    [
        (((15.0, 0.0), (30.0, 0.0)), 0.5, True), (((15.5, 0.0),), 0.5, True), (((15.6, 0.0),), 0.5, False),
        (((0.0, 0.0), (15.6, 0.0)), 0.5, False), (((-10.0, 12.0),), 0.5, False), (((math.nan, 0.0),), 0.5, False),
        ((), 0.5, True), (((99.0, 0.0),), 0.0, True), (((99.0, 0.0),), -1.0, True), (((99.0, 0.0, 0.0),), 0.5, True),
        (((99.0, 0.0),), math.nan, True), (((99.0, 0.0), (0.0,)), 0.5, True),
    ],
)  # fmt: skip
def test_trajectory_speed(points: tuple[tuple[float, float], ...], period: float, passes: bool) -> None:
    """Malformed trajectories pass here: they are for `format-v1` to refuse. Where a body may be is asked elsewhere."""
    verdict = judge(plan(Trajectory(points, period)), snap(speed=30.0))
    assert ("speed" in verdict.reason) is not passes, verdict.reason
    assert passes or not verdict.passed


def test_a_check_never_edits_the_plan() -> None:
    one = plan(program("set_target_speed(99)"), settings=(("gap_m", 1.0),))
    before = replace(one)
    judge(one, snap())
    assert one == before


@pytest.mark.parametrize("policy", [Program("def ("), Program("#" * 100_001 + "\nset_target_speed(99)")])
def test_text_that_cannot_be_read_is_left_to_the_format_check(policy: Program) -> None:
    assert judge(plan(policy), snap()).passed
