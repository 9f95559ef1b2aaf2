"""What the checks say, word by word: it is read by the person and by the model that has to repair its plan."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from typing import Any

import pytest

from chauffeur.concept import ActionMatrix, Lead, Limits, Observation, Parameters, Plan, Program, Trajectory, Verdict
from chauffeur.safety.checks import DEFAULT_CHECKS, DRIVE_CHECKS, run_checks
from chauffeur.safety.envelope import PARAMETERS_CHECK, check_parameters
from chauffeur.safety.format import FORMAT_CHECK, check_format
from chauffeur.safety.reach import check_reach

Snap = Callable[..., Observation]
Make = Callable[..., Plan]
END = "    yield autopilot()\n"


def program(body: str, library: str = "") -> Program:
    lines = "".join(f"    {line}\n" for line in body.splitlines())
    return Program(f"def policy():\n    ego = get_ego_vehicle()\n{lines}{END}", library=library)


def parameters(lane: Any = 0, speed: Any = 20.0, ahead: Any = 20.0, ratio: Any = 1.0) -> Parameters:
    return Parameters(target_speed_mps=speed, look_ahead_m=ahead, look_ahead_ratio=ratio, lane=lane)


FORM_FAULTS: list[tuple[Any, str, str]] = [
    (None, "The planner gave no policy.", "Say the wish in other words, or ask for less at once."),
    (parameters(lane=2), "The lane wish is 2.", "Give -1 (left), 0 (stay) or 1 (right)."),
    (parameters(speed="x"), "target_speed_mps of the parameters is 'x', not a finite number.",
     "Give target_speed_mps as a plain number."),
    (parameters(ahead=math.inf), "look_ahead_m of the parameters is inf, not a finite number.",
     "Give look_ahead_m as a plain number."),
    (parameters(ratio=None), "look_ahead_ratio of the parameters is None, not a finite number.",
     "Give look_ahead_ratio as a plain number."),
    (ActionMatrix((1.0, 2.0), (1.0, 2.0, 3.0)), "The action matrix has rows of 2 and 3 numbers.",
     "Give [[Kp, Ki, Kd], [Wl, Wh, Ws]]: two rows of three numbers."),
    *((ActionMatrix(tuple("?" if i == place else 1.0 for i in range(3)), (1.0,) * 3),
       f"{name} of the action matrix is '?', not a finite number.", f"Give {name} as a plain number.")
      for place, name in enumerate(("Kp", "Ki", "Kd"))),
    *((ActionMatrix((1.0,) * 3, tuple("?" if i == place else 1.0 for i in range(3))),
       f"{name} of the action matrix is '?', not a finite number.", f"Give {name} as a plain number.")
      for place, name in enumerate(("Wl", "Wh", "Ws"))),
    (Trajectory((), 0.5), "The trajectory has no waypoints.", "Give at least one waypoint."),
    (Trajectory(((1.0, 0.0),), 0.0), "The waypoints are 0.0 s apart.",
     "Give a time between waypoints greater than 0 s."),
    (Trajectory(((1.0, 0.0), (2.0,)), 0.5), "Waypoint 2 has 1 coordinates.",
     "Give (x forward, y left) in metres."),
    (Trajectory(((1.0, 0.0), (2.0, math.nan)), 0.5), "waypoint 2 y of the trajectory is nan, not a finite number.",
     "Give waypoint 2 y as a plain number."),
    ({"a": 1}, "The policy is a dict, which no executor knows.",
     "Give a program, parameters, an action matrix or a trajectory."),
]  # fmt: skip


@pytest.mark.parametrize(("policy", "reason", "remedy"), FORM_FAULTS)
def test_what_is_said_of_a_form(plan: Make, snap: Snap, policy: Any, reason: str, remedy: str) -> None:
    assert check_format(plan(policy), snap(), Limits()) == Verdict(FORMAT_CHECK, False, reason, None, remedy)


@pytest.mark.parametrize(
    ("policy", "reason"),
    [
        (program("pass"), "The program keeps to the driving language."),
        (parameters(), "All numbers of the parameters are finite."),
        (ActionMatrix((1.0,) * 3, (1.0,) * 3), "All numbers of the action matrix are finite."),
        (Trajectory(((1.0, 0.0),), 0.5), "All numbers of the trajectory are finite."),
    ],
)
def test_what_is_said_of_a_good_form(plan: Make, snap: Snap, policy: Any, reason: str) -> None:
    assert check_format(plan(policy), snap(), Limits()) == Verdict(FORMAT_CHECK, True, reason)


TOO_FAST = (
    "A target speed of 40 m/s (144 km/h) is more than 1 m/s (4 km/h) above the speed limit of 30 m/s (108 km/h) here."
)
SPEED_REMEDY = "Use a target speed from 0 to 31 m/s (112 km/h)."
TURN = "The program wants to {} at the next intersection, but there is no intersection ahead."
GAP = (
    "A gap of {} centre to centre leaves {} between the bumpers; at 25 m/s (90 km/h) at least {} and more than 0 m are "
    "needed."
)
UNKNOWN_LANE = "It moves to the left, but it is not known which lane the ego is in."
LEFTMOST = "It moves to the left, but the ego is already in the leftmost lane."
RIGHTMOST = "It moves to the right, but the ego is already in the rightmost lane."
STAY = "Stay in the lane, or test first that the lane to the {} is not None."

FAULTS: list[tuple[Any, dict[str, Any], dict[str, Any], str, int | None, str]] = [
    # (policy, fields of the plan, the observation, reason, line, remedy)
    (program("set_target_speed(-1)"), {}, {}, "A target speed of -1 m/s (-4 km/h) is negative.", 3, SPEED_REMEDY),
    (program("set_target_speed(40)"), {}, {}, TOO_FAST, 3, SPEED_REMEDY),
    (program("set_target_speed(float('nan'))"), {}, {}, "The target speed is nan, not a speed.", 3, SPEED_REMEDY),
    (program("set_desired_time_headway(0.1)"), {}, {}, "A time headway of 0.1 s is outside 0.5 to 10 s.", 3,
     "Use a time headway from 0.5 to 10 s."),
    (program("turn_left_at_next_intersection()"), {}, {}, TURN.format("turn left"), 3, "Leave out the turn."),
    (program("turn_right_at_next_intersection()"), {}, {}, TURN.format("turn right"), 3, "Leave out the turn."),
    (program("go_straight_at_next_intersection()"), {}, {}, TURN.format("go straight on"), 3, "Leave out the turn."),
    (program("set_target_lane(get_left_lane(ego))"), {}, {"index": 0}, LEFTMOST, 3, STAY.format("left")),
    (program("set_target_lane(get_right_lane(ego))"), {}, {"index": 2}, RIGHTMOST, 3, STAY.format("right")),
    (program("set_target_lane(get_left_lane(ego))"), {}, {"index": None}, UNKNOWN_LANE, 3, STAY.format("left")),
    (program("yield from go()", "def go():\n    set_target_speed(-1)\n    yield autopilot()\n"), {}, {},
     "A target speed of -1 m/s (-4 km/h) is negative. (In a helper function.)", None, SPEED_REMEDY),
    (parameters(speed=-1.0), {}, {}, "A target speed of -1 m/s (-4 km/h) is negative.", None, SPEED_REMEDY),
    (parameters(lane=-1), {}, {"index": 0}, LEFTMOST, None, STAY.format("left")),
    (parameters(lane=1), {}, {"index": 2}, RIGHTMOST, None, STAY.format("right")),
    (parameters(ahead=0.0), {}, {}, "A look-ahead of 0.0 m is none.", None, "Look ahead more than 0 m."),
    (parameters(ratio=-0.5), {}, {}, "A look-ahead ratio of -0.5 s is negative.", None, "Use a ratio of 0 s or more."),
    (ActionMatrix((1.0, -1.0, 1.0), (1.0,) * 3), {}, {}, "The action matrix has a negative gain or weight.", None,
     "Use gains and weights of 0 or more."),
    (ActionMatrix((1.0,) * 3, (1.0, 1.0, -1.0)), {}, {}, "The action matrix has a negative gain or weight.", None,
     "Use gains and weights of 0 or more."),
    (Trajectory(((0.0, 40.0),), 1.0), {}, {}, "A speed along the trajectory of 40 m/s (144 km/h) is more than 1 m/s "
     "(4 km/h) above the speed limit of 30 m/s (108 km/h) here.", None, SPEED_REMEDY),
    (Trajectory(((10.0, 0.0), (math.nan, 0.0)), 1.0), {}, {}, "The speed along the trajectory is nan, not a speed.",
     None, SPEED_REMEDY),
    (program("pass"), {"settings": (("target_speed_mps", 40.0),)}, {}, TOO_FAST, None, SPEED_REMEDY),
    (program("pass"), {"settings": (("time_headway_s", 11.0),)}, {}, "A time headway of 11 s is outside 0.5 to 10 s.",
     None, "Use a time headway from 0.5 to 10 s."),
    (program("pass"), {"settings": (("gap_m", 10.0),)}, {}, GAP.format("10 m", "5.0 m", "12.5 m (0.5 s)"), None,
     "Keep more than 17.5 m."),
    (program("pass"), {"settings": (("gap_m", math.inf),)}, {}, GAP.format("inf m", "inf m", "12.5 m (0.5 s)"), None,
     "Keep more than 17.5 m."),
    (program("pass"), {"settings": (("patience", "much"),)}, {}, "The setting patience is 'much', not a number.", None,
     "Give patience as a plain number."),
    (program("pass"), {"intent": "turn left"}, {},
     "It was understood as a turn at an intersection, but there is no intersection ahead.", None,
     "Ask for a lane change instead, or wait for an intersection."),
    (program("pass"), {"intent": "Go straight"}, {},
     "It was understood as a turn at an intersection, but there is no intersection ahead.", None,
     "Ask for a lane change instead, or wait for an intersection."),
    (program("pass"), {"intent": "change lane left"}, {"index": 0}, LEFTMOST, None, STAY.format("left")),
    (program("pass"), {"intent": "overtake_right"}, {"index": 2}, RIGHTMOST, None, STAY.format("right")),
    *((program("pass"), {"intent": f"{word} left + turn right"}, {"index": 0}, LEFTMOST, None, STAY.format("left"))
      for word in ("lane", "change", "overtake", "pass", "merge", "move")),
]  # fmt: skip


@pytest.mark.parametrize(("policy", "fields", "road", "reason", "line", "remedy"), FAULTS)
def test_what_is_said_of_numbers_and_manoeuvres(
    plan: Make,
    snap: Snap,
    policy: Any,
    fields: dict[str, Any],
    road: dict[str, Any],
    reason: str,
    line: int | None,
    remedy: str,
) -> None:
    found = check_parameters(plan(policy, **fields), snap(**road), Limits())
    assert found == Verdict(PARAMETERS_CHECK, False, reason, line, remedy)


def test_what_is_said_of_a_cap(plan: Make, snap: Snap) -> None:
    found = check_parameters(plan(program("set_target_speed(25)")), snap(), Limits(max_speed_mps=20.0))
    assert (found.reason, found.line) == (
        "A target speed of 25 m/s (90 km/h) is above the cap of 20 m/s (72 km/h).", 3)  # fmt: skip
    assert found.remedy == "Use a target speed from 0 to 20 m/s (72 km/h)."


def test_several_faults_are_told_in_order_and_the_first_is_remedied(plan: Make, snap: Snap) -> None:
    policy = program("turn_left_at_next_intersection()\nset_target_speed(-1)\nset_target_speed(-1)")
    found = check_parameters(plan(policy, intent="turn left"), snap(), Limits())
    assert found.line == 3
    assert found.remedy == "Leave out the turn."
    assert found.reason == (
        f"{TURN.format('turn left')} A target speed of -1 m/s (-4 km/h) is negative. "
        "It was understood as a turn at an intersection, but there is no intersection ahead."
    )


@pytest.mark.parametrize("intent", ["lane.left", "Lane.left+turn.right", "change lane left.", " move left + stop "])
def test_the_first_step_of_an_intent_is_judged(plan: Make, snap: Snap, intent: str) -> None:
    found = check_parameters(plan(program("pass"), intent=intent), snap(index=0), Limits())
    assert (found.passed, found.reason) == (False, LEFTMOST)


@pytest.mark.parametrize("intent", ["speed.up + lane.left", "lane", "left", "lane.left.later", "follow left", ""])
def test_other_intents_are_not(plan: Make, snap: Snap, intent: str) -> None:
    assert check_parameters(plan(program("pass"), intent=intent), snap(index=0), Limits()).passed
    assert check_parameters(plan(None, intent="lane.left"), snap(index=0), Limits()).passed  # there is no policy


@pytest.mark.parametrize("intent", ["turn.left", "go.straight", "Turn right + lane.left"])
def test_turns_are_judged_by_the_road(plan: Make, snap: Snap, intent: str) -> None:
    assert not check_parameters(plan(program("pass"), intent=intent), snap(), Limits()).passed
    assert check_parameters(plan(program("pass"), intent=intent), snap(kind="intersection", index=0), Limits()).passed


def test_a_check_that_breaks_refuses_and_is_logged(plan: Make, snap: Snap, caplog: pytest.LogCaptureFixture) -> None:
    def check_luck(plan: Plan, observation: Observation, limits: Limits) -> Verdict:
        raise ZeroDivisionError("no luck")

    class Fortune:
        def __call__(self, plan: Plan, observation: Observation, limits: Limits) -> Verdict:
            raise KeyError("wheel")

    remedy = "Ask again; if it stays so, the plan's values are of the wrong types."
    with caplog.at_level(logging.WARNING):
        found = run_checks(plan(program("pass")), snap(), Limits(), (check_luck, check_format, Fortune()))
    assert found[0] == Verdict(
        "check_luck", False, "The check check_luck could not judge this plan (ZeroDivisionError).", None, remedy,
        not_compared="check-broke",
    )  # fmt: skip
    assert found[1].passed
    assert found[0].stops, "what nothing was compared by has vouched for nothing"
    assert found[2] == Verdict(
        "Fortune",
        False,
        "The check Fortune could not judge this plan (KeyError).",
        None,
        remedy,
        not_compared="check-broke",
    )
    assert [record.getMessage() for record in caplog.records] == [
        "safety check check_luck failed: ZeroDivisionError('no luck')",
        "safety check Fortune failed: KeyError('wheel')",
    ]


def test_the_checks_are_those_of_the_seeds_and_the_one_that_follows() -> None:
    assert (check_format, check_parameters) == DEFAULT_CHECKS
    assert (*DEFAULT_CHECKS, check_reach) == DRIVE_CHECKS[:3]


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_lane_that_the_observation_does_not_show_is_not_known(plan: Make, snap: Snap, side: str) -> None:
    found = check_parameters(plan(program(f"set_target_lane(get_{side}_lane(ego))")), snap(index=7), Limits())
    assert found.reason == UNKNOWN_LANE.replace("left", side)
    fast = check_parameters(plan(program("set_target_speed(22)")), snap(index=7), Limits())
    assert "above the speed limit of 20 m/s (72 km/h) here" in fast.reason  # the lowest of the whole road


def test_faults_are_told_in_the_order_of_their_lines(plan: Make, snap: Snap) -> None:
    policy = program("set_target_lane(get_left_lane(ego))\nset_target_speed(-1)")
    found = check_parameters(plan(policy), snap(index=0), Limits())
    assert found.line == 3
    assert found.reason == f"{LEFTMOST} A target speed of -1 m/s (-4 km/h) is negative."


def test_what_fits(plan: Make, snap: Snap) -> None:
    found = check_parameters(plan(program("set_target_speed(31)")), snap(), Limits())
    assert found == Verdict(PARAMETERS_CHECK, True, "Every number and manoeuvre that can be read fits the situation.")


# Bounds, to the last digit ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("speed", "passes"),
    [(0, True), (-1e-9, False), (31.0, True), (31.0 + 1e-6, True), (31.1, False), (31.0 + 2e-6, False)],
)
def test_speed_bounds(plan: Make, snap: Snap, speed: float, passes: bool) -> None:
    assert check_parameters(plan(parameters(speed=speed)), snap(), Limits()).passed is passes


@pytest.mark.parametrize(("speed", "passes"), [(20.0, True), (20.0 + 1e-6, True), (20.0 + 2e-6, False)])
def test_cap_bounds(plan: Make, snap: Snap, speed: float, passes: bool) -> None:
    assert check_parameters(plan(parameters(speed=speed)), snap(), Limits(max_speed_mps=20.0)).passed is passes


@pytest.mark.parametrize(
    ("headway", "passes"),
    [(0.5, True), (0.5 - 1e-6, True), (0.5 - 2e-6, False), (10.0, True), (10.0 + 1e-6, True), (10.0 + 2e-6, False)],
)
def test_headway_bounds(plan: Make, snap: Snap, headway: float, passes: bool) -> None:
    settings = (("time_headway_s", headway),)
    assert check_parameters(plan(program("pass"), settings=settings), snap(), Limits()).passed is passes


@pytest.mark.parametrize(
    ("gap", "front", "passes"),
    [
        (17.5, None, True),
        (17.5 - 9e-7, None, True),
        (17.5 - 2e-6, None, False),
        (7.499999, Lead(1, 40.0, 5.0), True),
        (7.499997, Lead(1, 40.0, 5.0), False),
        (10.0, Lead(1, 40.0, 10.0), True),
        (9.9, Lead(1, 40.0, 10.0), False),
        (5.1, Lead(1, 40.0, 0.0), True),
        (5.0, Lead(1, 40.0, 0.0), False),
        (5.1, Lead(1, 40.0, -3.0), True),
    ],
)
def test_gap_bounds(plan: Make, snap: Snap, gap: float, front: Lead | None, passes: bool) -> None:
    settings = (("gap_m", gap),)
    assert check_parameters(plan(program("pass"), settings=settings), snap(front=front), Limits()).passed is passes
