"""`parameters-v1` at and around every bound."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import pytest

from chauffeur.concept import (
    LAMPILOT_LIMITS,
    ActionMatrix,
    Lead,
    Limits,
    Observation,
    Parameters,
    Plan,
    Program,
    Trajectory,
    Verdict,
)
from chauffeur.safety.envelope import PARAMETERS_CHECK, check_parameters

Snap = Callable[..., Observation]
Make = Callable[..., Plan]
LIMITS = Limits()
CAPPED = Limits(max_speed_mps=20.0)


def program(body: str) -> Program:
    return Program(
        "def policy():\n    ego = get_ego_vehicle()\n" + "".join(f"    {line}\n" for line in body.splitlines())
    )


def judge(plan: Plan, observation: Observation, limits: Limits = LIMITS) -> Verdict:
    verdict = check_parameters(plan, observation, limits)
    assert verdict.check == PARAMETERS_CHECK == "parameters-v1"
    assert verdict.reason
    assert bool(verdict.remedy) is not verdict.passed
    return verdict


SPEEDS = [
    (LIMITS, 0.0, True), (LIMITS, -0.0, True), (LIMITS, -1e-9, False), (LIMITS, -5.0, False),
    (LIMITS, 30.0, True), (LIMITS, 31.0, True), (LIMITS, 31.0 + 9e-7, True), (LIMITS, 31.0 + 1.1e-6, False),
    (LIMITS, 31.01, False), (LIMITS, 1e308, False),
    (CAPPED, 19.9, True), (CAPPED, 20.0, True), (CAPPED, 20.01, False), (CAPPED, 31.5, False),
    (LAMPILOT_LIMITS, 38.3, True), (LAMPILOT_LIMITS, 39.0, True), (LAMPILOT_LIMITS, 39.01, False),
    (LIMITS, math.inf, False), (LIMITS, -math.inf, False), (LIMITS, math.nan, False),
]  # fmt: skip


@pytest.mark.parametrize(("limits", "speed", "passes"), SPEEDS)
def test_speed_bounds_hold_in_every_place_a_speed_is_written(
    snap: Snap, plan: Make, limits: Limits, speed: float, passes: bool
) -> None:
    text = f"float('{speed}')" if not math.isfinite(speed) else repr(speed)
    plans = [
        plan(program(f"set_target_speed({text})\nyield autopilot()")),
        plan(Parameters(speed, 10.0, 2.0)),
        plan(program("yield autopilot()"), settings=(("target_speed_mps", speed),)),
    ]
    for one in plans:
        assert judge(one, snap(), limits).passed is passes


def test_the_reason_says_what_where_and_what_would_do(snap: Snap, plan: Make) -> None:
    verdict = judge(plan(program("yield autopilot()\nset_target_speed(140 / 3.6)")), snap())
    assert verdict == Verdict(
        "parameters-v1",
        False,
        "A target speed of 38.89 m/s (140 km/h) is more than 1 m/s (4 km/h) above the speed limit of 30 m/s (108 km/h) "
        "here.",
        4,
        "Use a target speed from 0 to 31 m/s (112 km/h).",
    )
    assert judge(plan(program("set_target_speed(25)")), snap(), CAPPED).reason == (
        "A target speed of 25 m/s (90 km/h) is above the cap of 20 m/s (72 km/h)."
    )
    assert judge(plan(program("set_target_speed(-5)")), snap()).reason == (
        "A target speed of -5 m/s (-18 km/h) is negative."
    )
    assert (
        judge(plan(program("set_target_speed(float('nan'))")), snap()).reason == "The target speed is nan, not a speed."
    )


def test_the_limit_is_the_ego_lane_s(snap: Snap, plan: Make) -> None:
    fast = plan(program("set_target_speed(25)"))
    assert judge(fast, snap(limits=(10.0, 25.0, 10.0))).passed
    assert not judge(fast, snap(limits=(25.0, 10.0, 25.0))).passed


def test_without_a_known_lane_the_strictest_sign_holds(snap: Snap, plan: Make) -> None:
    assert judge(plan(program("set_target_speed(21)")), snap(index=None)).passed
    assert not judge(plan(program("set_target_speed(21.1)")), snap(index=None)).passed
    assert not judge(plan(program("set_target_speed(21.1)")), snap(index=9)).passed
    assert not judge(plan(program("set_target_speed(1.1)")), snap(index=None, road=False)).passed


@pytest.mark.parametrize(
    ("limits", "headway", "passes"),
    [
        (LIMITS, 0.5, True), (LIMITS, 0.499, False), (LIMITS, 0.0, False), (LIMITS, -1.0, False), (LIMITS, 10.0, True),
        (LIMITS, 10.001, False), (LIMITS, math.nan, False), (LIMITS, math.inf, False), (LAMPILOT_LIMITS, 0.01, True),
        (LAMPILOT_LIMITS, 0.009, False),
    ],
)  # fmt: skip
def test_headway_bounds(snap: Snap, plan: Make, limits: Limits, headway: float, passes: bool) -> None:
    text = f"float('{headway}')" if not math.isfinite(headway) else repr(headway)
    one = plan(program(f"set_desired_time_headway({text})"))
    assert judge(one, snap(), limits).passed is passes
    assert judge(plan(None, settings=(("time_headway_s", headway),)), snap(), limits).passed is passes


def test_headway_reason(snap: Snap, plan: Make) -> None:
    verdict = judge(plan(program("set_desired_time_headway(0.2)")), snap())
    assert verdict.reason == "A time headway of 0.2 s is outside 0.5 to 10 s."
    assert verdict.remedy == "Use a time headway from 0.5 to 10 s."
    assert verdict.line == 3


@pytest.mark.parametrize(
    ("limits", "gap", "speed", "passes"),
    [
        (LAMPILOT_LIMITS, 15.0, 30.0, True), (LIMITS, 15.0, 30.0, False), (LIMITS, 20.0, 30.0, True),
        (LIMITS, 19.99, 30.0, False), (LIMITS, 5.0, 0.0, False), (LIMITS, 5.01, 0.0, True), (LIMITS, 4.0, 0.0, False),
        (LIMITS, 6.0, -3.0, True), (LAMPILOT_LIMITS, 5.29, 30.0, False), (LAMPILOT_LIMITS, 5.3, 30.0, True),
        (LIMITS, math.nan, 0.0, False), (LIMITS, math.inf, 0.0, False), (LIMITS, -10.0, 30.0, False),
    ],
)  # fmt: skip
def test_gap_bounds_count_the_car_length(
    snap: Snap, plan: Make, limits: Limits, gap: float, speed: float, passes: bool
) -> None:
    one = plan(program("yield autopilot()"), settings=(("gap_m", gap),))
    assert judge(one, snap(speed=speed), limits).passed is passes
    assert judge(one, snap(speed=99.0, front=Lead(1, 40.0, speed)), limits).passed is passes


def test_gap_reason(snap: Snap, plan: Make) -> None:
    verdict = judge(plan(None, settings=(("gap_m", 15.0),)), snap(speed=30.0))
    assert verdict.reason == (
        "A gap of 15 m centre to centre leaves 10.0 m between the bumpers; at 30 m/s (108 km/h) at least 15.0 m "
        "(0.5 s) and more than 0 m are needed."
    )
    assert verdict.remedy == "Keep more than 20.0 m."


@pytest.mark.parametrize(("value", "passes"), [(1.0, True), (math.nan, False), (math.inf, False), ("1", False)])
def test_other_settings_must_be_numbers(snap: Snap, plan: Make, value: float, passes: bool) -> None:
    assert judge(plan(None, settings=(("decel_mps2", value),)), snap()).passed is passes


LEFT = "set_target_lane(get_left_lane(ego))"
RIGHT = "set_target_lane(get_right_lane(ego))"


@pytest.mark.parametrize(
    ("body", "index", "passes"),
    [
        (LEFT, 0, False), (LEFT, 1, True), (LEFT, 2, True), (RIGHT, 2, False), (RIGHT, 1, True), (RIGHT, 0, True),
        ("set_target_lane(get_lane_of(ego))", 0, True),
        ("l = get_left_lane(ego)\nwhile not is_safe_enter(l):\n    yield autopilot()\nset_target_lane(l)", 0, False),
        ("left = get_left_lane(ego)\nif left is None:\n    return\nset_target_lane(left)", 0, True),
        (f"if is_safe_enter(get_left_lane(ego)):\n    {LEFT}\nelse:\n    {RIGHT}", 0, True),
        (f"{RIGHT}\nyield autopilot()\n{LEFT}", 0, True),
        (f"{LEFT}\nyield autopilot()\n{RIGHT}", 0, False),
        (f"set_target_lane(lane)\n{LEFT}", 0, True),
        (f"def back():\n    {LEFT}\n{RIGHT}\nback()", 0, True),
        (f"def more():\n    {LEFT}\n{LEFT}\nmore()", 0, False),
        ("yield autopilot()", 0, True),
    ],
)  # fmt: skip
def test_lane_moves_off_the_road(snap: Snap, plan: Make, body: str, index: int, passes: bool) -> None:
    assert judge(plan(program(body)), snap(index=index)).passed is passes


def test_lane_move_reason(snap: Snap, plan: Make) -> None:
    verdict = judge(plan(program(LEFT)), snap(index=0))
    assert verdict.reason == "It moves to the left, but the ego is already in the leftmost lane."
    assert verdict.remedy == "Stay in the lane, or test first that the lane to the left is not None."
    assert verdict.line == 3
    unknown = judge(plan(program(RIGHT)), snap(index=None))
    assert unknown.reason == "It moves to the right, but it is not known which lane the ego is in."


@pytest.mark.parametrize(
    ("lane", "index", "passes"),
    [(-1, 0, False), (-1, 1, True), (0, 0, True), (1, 2, False), (1, 1, True), (0, None, True), (1, None, False)],
)
def test_parameter_lane_wish(snap: Snap, plan: Make, lane: int, index: int | None, passes: bool) -> None:
    assert judge(plan(Parameters(15.0, 10.0, 2.0, lane)), snap(index=index)).passed is passes


@pytest.mark.parametrize(
    ("intent", "index", "passes"),
    [
        ("lane.left", 0, False), ("lane_change.left", 0, False), ("overtake.left", 0, False),
        ("Overtake.Left", 0, False),
        ("overtake.left", 1, True), ("overtake.right", 2, False), ("lane.right", 1, True), ("overtake", 0, True),
        ("speed.increase", 0, True), ("look.left", 0, True), ("", 0, True), ("turn.left", 1, False),
        ("go.straight", 1, False),
        ("lane.left+lane.right", 2, True), ("lane.right+lane.left", 2, False), ("overtake.left+speed.set", 0, False),
    ],
)  # fmt: skip
def test_the_intent_must_fit_the_road(snap: Snap, plan: Make, intent: str, index: int, passes: bool) -> None:
    assert judge(plan(program("yield autopilot()"), intent=intent), snap(index=index)).passed is passes


def test_a_refused_plan_s_intent_is_not_judged(snap: Snap, plan: Make) -> None:
    assert judge(plan(None, intent="overtake.left"), snap(index=0)).passed


@pytest.mark.parametrize("api", ["turn_left_at", "turn_right_at", "go_straight_at"])
def test_turns_need_an_intersection(snap: Snap, plan: Make, api: str) -> None:
    one = plan(program(f"{api}_next_intersection()"), intent="turn.left")
    assert judge(one, snap(kind="intersection")).passed
    verdict = judge(one, snap())
    assert verdict.line == 3
    assert "but there is no intersection ahead." in verdict.reason


def test_a_turn_is_for_an_intersection(snap: Snap, plan: Make) -> None:
    turning = plan(Parameters(8.0, 10.0, 2.0, 0, "left"))
    found = judge(turning, snap())
    assert not found.passed
    assert "no intersection ahead to turn left at" in found.reason
    assert judge(turning, snap(kind="intersection")).passed


@pytest.mark.parametrize(
    ("parameters", "passes"),
    [
        (Parameters(15.0, 0.1, 0.0), True), (Parameters(15.0, 0.0, 2.0), False), (Parameters(15.0, math.nan, 2.0),
        False),
        (Parameters(15.0, 10.0, -0.1), False), (Parameters("15", 10.0, 2.0), False), (Parameters(True, 10.0, 2.0),
        False),
        (Parameters(15.0, "10", 2.0), False), (Parameters(15.0, 10.0, None), False),
        (Parameters(15.0, 10.0, 2.0, 7), True),
    ],
)  # fmt: skip
def test_look_ahead_and_values_of_wrong_type(snap: Snap, plan: Make, parameters: Parameters, passes: bool) -> None:
    assert judge(plan(parameters), snap()).passed is passes


@pytest.mark.parametrize(
    ("gains", "passes"), [((0.5, 0.0, 0.0), True), ((0.5, -0.1, 0.0), False), ((math.nan, 0.0, 0.0), False)]
)
def test_action_matrix_has_no_negative_gain(
    snap: Snap, plan: Make, gains: tuple[float, float, float], passes: bool
) -> None:
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
def test_trajectory_speed(
    snap: Snap, plan: Make, points: tuple[tuple[float, float], ...], period: float, passes: bool
) -> None:
    """Malformed trajectories pass here: they are for `format-v1` to refuse. Where a body may be is asked elsewhere."""
    verdict = judge(plan(Trajectory(points, period)), snap(speed=30.0))
    assert ("speed" in verdict.reason) is not passes, verdict.reason
    assert passes or not verdict.passed


def test_all_faults_are_told_the_first_line_leads(snap: Snap, plan: Make) -> None:
    one = plan(
        program("set_target_speed(99)\nset_desired_time_headway(0.1)\nset_target_speed(99)"),
        settings=(("time_headway_s", 0.1), ("target_speed_mps", 98.0)),
    )
    verdict = judge(one, snap())
    assert verdict.line == 3
    assert verdict.reason.count("99 m/s") == 1
    assert verdict.reason.count("time headway of 0.1 s") == 1
    assert "98 m/s" in verdict.reason
    assert verdict.remedy == "Use a target speed from 0 to 31 m/s (112 km/h)."


def test_a_check_never_edits_the_plan(snap: Snap, plan: Make) -> None:
    one = plan(program("set_target_speed(99)"), settings=(("gap_m", 1.0),))
    before = replace(one)
    judge(one, snap())
    assert one == before


def test_text_that_is_no_program_is_left_to_the_format_check(snap: Snap, plan: Make) -> None:
    assert judge(plan(Program("def (")), snap()).passed
