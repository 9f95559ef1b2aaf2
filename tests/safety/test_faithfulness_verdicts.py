"""Verdicts on thoughts word for word: what is told of a text and a program, or of a text and a drive."""

from __future__ import annotations

from dataclasses import replace

import pytest
from faithfulness_programs import HIGHWAY

from chauffeur.safety.faithfulness import Effect, FactSurroundings, Faithfulness, judge, judge_drive, read_facts

CROSSING = FactSurroundings(speed_mps=10.0, limit_mps=10.0, sign_m=50.0, crossing=True)


def program(*lines: str) -> str:
    """A program with these lines from line 3 on."""
    body = "".join(f"    {line}\n" for line in ("ego = get_ego_vehicle()", *lines, "yield autopilot()"))
    return f"def drive():\n{body}"


def brief(text: str, found: Faithfulness) -> list[str]:
    """Mismatches in words, with the sentence where it is not the whole text."""
    told: list[str] = []
    for one in found.mismatches:
        whose = "" if one.sentence == text else " of nothing said" if one.sentence == "" else f" of “{one.sentence}”"
        line = "" if one.line is None else f" (line {one.line})"
        told.append(f"{one.kind}{whose}: {one.instead}{line}")
    return told


def verdicts(text: str, source: str, where: FactSurroundings = HIGHWAY) -> list[str]:
    return brief(text, judge(text, read_facts(source), where))


OUT_RIGHT = program("set_target_lane(get_right_lane(ego))", "yield autopilot()", "set_target_lane(get_left_lane(ego))")
LEFT = program("set_target_lane(get_left_lane(ego))")
TURN_LEFT = program("turn_left_at_next_intersection()")
ONLY_GO = program("recover_from_stop()")
IDLE = program()
RIGHT = program("set_target_lane(get_right_lane(ego))")
EITHER = program("lane = get_left_lane(ego) or get_right_lane(ego)", "set_target_lane(lane)")
THERE_AND_BACK = program(
    "set_target_lane(get_left_lane(ego))", "yield autopilot()", "set_target_lane(get_right_lane(ego))"
)
UNKNOWN_LANE = program("set_target_lane({'a': get_left_lane(ego)}['a'])")
LEFT_TWICE = program("for _ in range(2):", "    set_target_lane(get_left_lane(ego))", "    yield autopilot()")
LEFT_OFTEN = program("while get_left_lane(ego):", "    set_target_lane(get_left_lane(ego))", "    yield autopilot()")
LEFT_FIVE = program("for _ in range(5):", "    set_target_lane(get_left_lane(ego))", "    yield autopilot()")
LEFT_FOUR = program("for _ in range(4):", "    set_target_lane(get_left_lane(ego))", "    yield autopilot()")
SLOWER = program("set_target_speed(20.0)")
SLOWER_LEFT = program("set_target_speed(20.0)", "set_target_lane(get_left_lane(ego))")
FASTER = program("set_target_speed(30.0)")
TURN_RIGHT = program("turn_right_at_next_intersection()")
WIDE = program("set_desired_time_headway(3.0)")
WAIT = program("for _ in range(30):", "    yield autopilot()", "set_target_speed(30.0)")
TURN_FASTER = program("turn_left_at_next_intersection()", "set_target_speed(30.0)")
STRAIGHT = program("go_straight_at_next_intersection()")
LEFT_OR_RIGHT = program(
    "if get_speed_of(ego) > 5.0:",
    "    turn_left_at_next_intersection()",
    "else:",
    "    turn_right_at_next_intersection()",
)
GO_CHECKED = program(
    "turn_left_at_next_intersection()",
    "for lane in get_left_to_right_cross_traffic_lanes():",
    "    if is_safe_enter(lane):",
    "        recover_from_stop()",
)
STOP_OR_GO = program("set_target_speed(0.0 if get_speed_of(ego) else 20.0)")
STAND_THEN_CRAWL = program("set_target_speed(0.0)", "yield autopilot()", "set_target_speed(1.5)")
STAND = program("set_target_speed(0.0)")
STAND_THEN_GO = program("set_target_speed(0.0)", "yield autopilot()", "set_target_speed(20.0)")
UNKNOWN = program("set_target_speed({'a': 1.0}['a'])")
GO_THEN_STAND = program("set_target_speed(20.0)", "yield autopilot()", "set_target_speed(0.0)")
STAND_THEN_CREEP = program("set_target_speed(0.0)", "yield autopilot()", "set_target_speed(1.0)")
ALMOST = program("set_target_speed(0.04)")
CREEP = program("set_target_speed(0.05)")
STEERED_STOP = program("set_target_speed(20.0 + 0.5 * (0.0 - get_speed_of(ego)))")
STAND_CAPPED = program("set_target_speed(min(0.0, get_speed_of(ego)))")
GAP_ONLY = program(
    "front = detect_front_vehicle_in(get_lane_of(ego))", "say(get_distance_between_vehicles(front, ego) - 25.0)"
)
LIMIT = program("set_target_speed(get_speed_limit())")
BELOW_LIMIT = program("set_target_speed(get_speed_limit() - 2.0)")
ABOVE_LIMIT = program("set_target_speed(get_speed_limit() + 2.0)")
EITHER_SPEED = program("set_target_speed(20.0 if get_speed_of(ego) else 30.0)")
SAME = program("set_target_speed(25.0)")
SAME_OR_UNKNOWN = program("set_target_speed(25.0)", "set_target_speed({'a': 1.0}['a'])")
SLOW_THEN_FAST = program("set_target_speed(20.0)", "yield autopilot()", "set_target_speed(30.0)")
UNKNOWN_THEN_FASTER = program("set_target_speed({'a': 1.0}['a'])", "set_target_speed(30.0)")
BY_A_FIFTH = program("set_target_speed(1.2 * get_speed_of(ego))")
FOLLOW = program(
    "front = detect_front_vehicle_in(get_lane_of(ego))",
    "gap = get_distance_between_vehicles(front, ego)",
    "set_target_speed(get_speed_of(front) + 0.3 * (gap - 25.0))",
)
SPEED_THEN_LEFT = program("set_target_speed(30.0)", "yield autopilot()", "set_target_lane(get_left_lane(ego))")
NARROW = program("set_desired_time_headway(1.0)")
USUAL = program("set_desired_time_headway(1.5)")
EITHER_HEADWAY = program("set_desired_time_headway(1.0 if get_speed_of(ego) else 3.0)")
GAP_ASKED = program(
    "front = detect_front_vehicle_in(get_lane_of(ego))",
    "if get_distance_between_vehicles(front, ego) > 15.0:",
    "    set_target_speed(get_speed_of(front))",
)
SAME_HEADWAY = program("set_desired_time_headway(get_desired_time_headway())")
RIGHT_FASTER = program("set_target_lane(get_right_lane(ego))", "set_target_speed(30.0)")
IF_NOBODY = program("if detect_rear_vehicle_in(get_left_lane(ego)) is None:", "    set_target_lane(get_left_lane(ego))")
MARKED = program(
    "front = detect_front_vehicle_in(get_lane_of(ego))",
    "near = get_distance_between_vehicles(front, ego) < 20.0",
    "set_target_lane(get_left_lane(ego))",
)
IF_SLOW = program(
    "if get_speed_of(detect_front_vehicle_in(get_lane_of(ego))) < 20.0:", "    set_target_lane(get_left_lane(ego))"
)
CHECKED = program(
    "lane = get_left_lane(ego)", "while not is_safe_enter(lane):", "    yield autopilot()", "set_target_lane(lane)"
)
SAFE_FASTER = program("if is_safe_enter(get_left_lane(ego)):", "    set_target_speed(30.0)")
FIRST_CHECKED = program(
    "if is_safe_enter(get_left_lane(ego)):",
    "    set_target_lane(get_left_lane(ego))",
    "set_target_lane(get_right_lane(ego))",
)
GO = program("turn_left_at_next_intersection()", "recover_from_stop()")
IF_NEAR = program(
    "if get_distance_between_vehicles(detect_front_vehicle_in(get_lane_of(ego)), ego) < 20.0:",
    "    set_target_lane(get_left_lane(ego))",
)
BEHIND = program(
    "if get_distance_between_vehicles(ego, detect_rear_vehicle_in(get_left_lane(ego))) > 20.0:",
    "    set_target_lane(get_left_lane(ego))",
)
IF_SIGN = program("if detect_stop_sign_ahead() < 30.0:", "    set_target_lane(get_left_lane(ego))")
IF_PAST = program(
    "if get_distance_between_vehicles(ego, detect_front_vehicle_in(get_lane_of(ego))) > 30.0:",
    "    set_target_lane(get_left_lane(ego))",
)
LEFT_LIMIT = program("set_target_lane(get_left_lane(ego))", "set_target_speed(get_speed_limit())")
LEFT_FOLLOWED = program(
    "set_target_lane(get_left_lane(ego))", "set_target_speed(get_speed_of(detect_front_vehicle_in(get_lane_of(ego))))"
)
WIDE_FASTER = program("set_desired_time_headway(3.0)", "set_target_speed(30.0)")
IF_SLOW_FASTER = program(
    "if get_speed_of(detect_front_vehicle_in(get_lane_of(ego))) < 20.0:",
    "    set_target_lane(get_left_lane(ego))",
    "set_target_speed(30.0)",
)
SLOW_LEFT_FAST = program("set_target_speed(20.0)", "set_target_lane(get_left_lane(ego))", "set_target_speed(30.0)")
MORE_LEFT_FAST = program(
    "set_target_speed(get_speed_of(ego) + 5.0)", "set_target_lane(get_left_lane(ego))", "set_target_speed(30.0)"
)
LEFT_THEN_MORE = program("set_target_lane(get_left_lane(ego))", "set_target_speed(get_speed_of(ego) + 5.0)")
LEFT_THEN_SPEED = program("set_target_lane(get_left_lane(ego))", "yield autopilot()", "set_target_speed(30.0)")
STOP_THEN_RIGHT = program("set_target_speed(0.0)", "yield autopilot()", "set_target_lane(get_right_lane(ego))")
SPEED_THEN_WIDE = program("set_target_speed(30.0)", "yield autopilot()", "set_desired_time_headway(3.0)")
WIDE_THEN_LEFT = program("set_desired_time_headway(3.0)", "yield autopilot()", "set_target_lane(get_left_lane(ego))")
BY_TWO = program("set_target_speed(27.0)")
BY_LESS = program("set_target_speed(26.9)")

STEADY = Effect(0, 0, 0, (25.0, 25.0), (25.0, 25.0), (40.0, 40.0))
DRIVE_CUT = replace(STEADY, cut=True)
DRIVE_WENT_LEFT = replace(STEADY, lanes_moved=-1, leftmost=-1)
DRIVE_WENT_RIGHT = replace(STEADY, lanes_moved=1, rightmost=1)
DRIVE_WENT_BOTH = replace(STEADY, leftmost=-1, rightmost=1)
DRIVE_FAILED = replace(STEADY, lanes_moved=1, rightmost=1, failed=True)
DRIVE_WENT_LEFT_CUT = replace(STEADY, lanes_moved=-1, leftmost=-1, cut=True)
DRIVE_PASSED = replace(STEADY, lanes_moved=-1, leftmost=-1, gaps_m=(40.0, -12.0))
DRIVE_BESIDE = replace(STEADY, lanes_moved=-1, leftmost=-1, gaps_m=(40.0, 0.0))
DRIVE_UNSEEN = replace(STEADY, lanes_moved=-1, leftmost=-1, gaps_m=(40.0, None))
DRIVE_CLOSE_BY = replace(STEADY, lanes_moved=-1, leftmost=-1, gaps_m=(40.0, 0.5))
DRIVE_NOT_PASSED_CUT = replace(STEADY, lanes_moved=-1, leftmost=-1, gaps_m=(40.0, 9.0), cut=True)
DRIVE_STOOD = replace(STEADY, speeds_mps=(25.0, 0.0), extremes_mps=(0.4, 25.0))
DRIVE_NEARLY = replace(STEADY, speeds_mps=(25.0, 0.5), extremes_mps=(0.5, 25.0))
DRIVE_LITTLE = replace(STEADY, speeds_mps=(25.0, 25.9), extremes_mps=(24.1, 25.9))
DRIVE_ONE_FASTER = replace(STEADY, speeds_mps=(25.0, 26.0), extremes_mps=(24.0, 26.0))
DRIVE_FASTER = replace(STEADY, speeds_mps=(25.0, 30.0), extremes_mps=(25.0, 30.0))
DRIVE_SLOWER = replace(STEADY, speeds_mps=(25.0, 20.0), extremes_mps=(20.0, 25.0))
DRIVE_WIDER = replace(STEADY, gaps_m=(40.0, 60.0))
DRIVE_TURNED_LEFT = replace(STEADY, turned=-1)
DRIVE_TURNED_RIGHT = replace(STEADY, turned=1)


# Lanes ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "source", "where", "told"),
    [
        (
            "I overtake on the left and go back.",
            OUT_RIGHT,
            HIGHWAY,
            ["wrong-side: it changes lanes to the right (line 3)"],
        ),
        (
            "We never change lanes.",
            LEFT,
            HIGHWAY,
            [
                "not-claimed: it changes lanes to the left (line 3)",
                "not-claimed of nothing said: it changes lanes to the left (line 3)",
            ],
        ),
        ("I go left.", TURN_LEFT, HIGHWAY, []),
        ("I go left.", ONLY_GO, HIGHWAY, ["not-done: it chooses no way over the intersection"]),
        ("I go left.", IDLE, HIGHWAY, ["not-done: it never changes lanes"]),
        ("I go left.", RIGHT, HIGHWAY, ["wrong-side: it changes lanes to the right (line 3)"]),
        ("I go left.", EITHER, HIGHWAY, []),
        ("I go right.", EITHER, HIGHWAY, []),
        ("I return to my old lane.", IDLE, HIGHWAY, ["not-done: it never changes lanes"]),
        ("I return to my old lane.", TURN_LEFT, CROSSING, []),
        ("I return to my old lane.", LEFT, HIGHWAY, ["not-done: it never goes back to a lane it was in (line 3)"]),
        ("I return to my old lane.", THERE_AND_BACK, HIGHWAY, []),
        ("I return to my old lane.", EITHER, HIGHWAY, []),
        ("I return to my old lane.", UNKNOWN_LANE, HIGHWAY, []),
        (
            "I go back to the left lane.",
            THERE_AND_BACK,
            HIGHWAY,
            ["wrong-side: it changes lanes to the right (line 5)"],
        ),
        ("I go back to the left lane.", LEFT, HIGHWAY, []),
        ("I go back to the right lane.", LEFT, HIGHWAY, ["not-done: it never goes back to a lane it was in (line 3)"]),
        ("I go back to the right lane.", OUT_RIGHT, HIGHWAY, ["wrong-side: it changes lanes to the left (line 5)"]),
        (
            "I overtake on the right and go back.",
            THERE_AND_BACK,
            HIGHWAY,
            ["wrong-side: it changes lanes to the left (line 3)"],
        ),
        ("I overtake on the left and go back.", THERE_AND_BACK, HIGHWAY, []),
        (
            "I overtake on the right.",
            THERE_AND_BACK,
            HIGHWAY,
            [
                "wrong-side: it changes lanes to the left (line 3)",
                "not-claimed of nothing said: it goes back to its lane afterwards (line 5)",
            ],
        ),
        (
            "I go right and then back to my lane.",
            THERE_AND_BACK,
            HIGHWAY,
            ["wrong-side: it changes lanes to the left (line 3)"],
        ),
        (
            "I go right.",
            THERE_AND_BACK,
            HIGHWAY,
            ["not-claimed of nothing said: it goes back to its lane afterwards (line 5)"],
        ),
        (
            "I go left.",
            THERE_AND_BACK,
            HIGHWAY,
            ["not-claimed of nothing said: it goes back to its lane afterwards (line 5)"],
        ),
        (
            "I overtake on the left.",
            THERE_AND_BACK,
            HIGHWAY,
            ["not-claimed of nothing said: it goes back to its lane afterwards (line 5)"],
        ),
        ("I go left and right.", THERE_AND_BACK, HIGHWAY, []),
        (
            "I stay in this lane.",
            THERE_AND_BACK,
            HIGHWAY,
            [
                "not-claimed: it changes lanes to the left (line 3)",
                "not-claimed of nothing said: it changes lanes to the left (line 3)",
                "not-claimed of nothing said: it goes back to its lane afterwards (line 5)",
            ],
        ),
        ("I pull over.", LEFT, HIGHWAY, ["wrong-side: it changes lanes to the left (line 3)"]),
        ("I pull over.", RIGHT, HIGHWAY, []),
        ("I pull over.", EITHER, HIGHWAY, []),
        ("I pull over to the left.", LEFT, HIGHWAY, []),
        ("I pull over to the left.", RIGHT, HIGHWAY, ["wrong-side: it changes lanes to the right (line 3)"]),
        ("I pull over.", IDLE, HIGHWAY, ["not-done: it never changes lanes"]),
        ("I pull over.", UNKNOWN_LANE, HIGHWAY, []),
        ("I go one lane to the left.", LEFT_TWICE, HIGHWAY, []),
        ("I go two lanes to the left.", LEFT_TWICE, HIGHWAY, []),
        ("I go three lanes to the left.", LEFT_TWICE, HIGHWAY, ["wrong-number: it crosses 2 lanes at most (line 4)"]),
        ("I go two lanes to the left.", LEFT, HIGHWAY, ["wrong-number: it crosses 1 lane at most (line 3)"]),
        ("I go two lanes to the left.", LEFT_OFTEN, HIGHWAY, []),
        ("I go two lanes to the left.", LEFT_FIVE, HIGHWAY, []),
        ("I go two lanes to the left.", LEFT_FOUR, HIGHWAY, ["wrong-number: it crosses 4 lanes at most (line 4)"]),
        (
            "I go two lanes to the left.",
            THERE_AND_BACK,
            HIGHWAY,
            [
                "wrong-number: it crosses 1 lane at most (line 3)",
                "not-claimed of nothing said: it goes back to its lane afterwards (line 5)",
            ],
        ),
        (
            "I change two lanes.",
            THERE_AND_BACK,
            HIGHWAY,
            ["not-claimed of nothing said: it changes lanes to the left (line 3)"],
        ),
        ("I change to the leftmost lane.", LEFT_TWICE, HIGHWAY, []),
        (
            "I do not change lanes.",
            LEFT,
            HIGHWAY,
            [
                "not-claimed: it changes lanes to the left (line 3)",
                "not-claimed of nothing said: it changes lanes to the left (line 3)",
            ],
        ),
        (
            "I do not go left.",
            LEFT,
            HIGHWAY,
            [
                "not-claimed: it changes lanes to the left (line 3)",
                "not-claimed of nothing said: it changes lanes to the left (line 3)",
            ],
        ),
        ("I do not go right.", LEFT, HIGHWAY, ["not-claimed of nothing said: it changes lanes to the left (line 3)"]),
        (
            "I do not go left.",
            EITHER,
            HIGHWAY,
            ["not-claimed of nothing said: it changes lanes to the left or right (line 4)"],
        ),
        ("I do not go left. I go right.", EITHER, HIGHWAY, []),
        (
            "I do not go back.",
            THERE_AND_BACK,
            HIGHWAY,
            [
                "not-claimed: it changes lanes to the right (line 5)",
                "not-claimed of nothing said: it changes lanes to the left (line 3)",
            ],
        ),
        (
            "I overtake on the left. I do not go back to the right lane.",
            THERE_AND_BACK,
            HIGHWAY,
            ["not-claimed of “I do not go back to the right lane.”: it changes lanes to the right (line 5)"],
        ),
        (
            "I do not overtake.",
            LEFT,
            HIGHWAY,
            [
                "not-claimed: it changes lanes to the left (line 3)",
                "not-claimed of nothing said: it changes lanes to the left (line 3)",
            ],
        ),
        (
            "I do not go left. I go right.",
            LEFT,
            HIGHWAY,
            [
                "not-claimed of “I do not go left.”: it changes lanes to the left (line 3)",
                "wrong-side of “I go right.”: it changes lanes to the left (line 3)",
            ],
        ),
        ("I do not change lanes now. I go left later.", LEFT, HIGHWAY, []),
        ("I do not overtake. I go left.", LEFT, HIGHWAY, []),
        ("I do not change lanes. I pull over.", RIGHT, HIGHWAY, []),
        ("I do not change lanes. I overtake.", RIGHT, HIGHWAY, []),
        (
            "I do not pull over.",
            RIGHT,
            HIGHWAY,
            ["not-claimed of nothing said: it changes lanes to the right (line 3)"],
        ),
        ("I do not go left.", UNKNOWN_LANE, HIGHWAY, ["not-claimed of nothing said: it changes lanes (line 3)"]),
        ("I do not change lanes. I go back.", THERE_AND_BACK, HIGHWAY, []),
        (
            '"Go left." I do not change lanes.',
            LEFT,
            HIGHWAY,
            ["not-claimed of “I do not change lanes.”: it changes lanes to the left (line 3)"],
        ),
    ],
)
def test_what_is_told_of_lanes(text: str, source: str, where: FactSurroundings, told: list[str]) -> None:
    assert verdicts(text, source, where) == told


# Wishes ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "source", "where", "told"),
    [
        ('"Go left." I overtake on the right.', RIGHT, HIGHWAY, []),
        ('"Go back to the left lane." I pull over to the right.', RIGHT, HIGHWAY, []),
        (
            '"Go left." I stay in this lane.',
            RIGHT,
            HIGHWAY,
            ["not-claimed of “I stay in this lane.”: it changes lanes to the right (line 3)"],
        ),
        ('"Faster", you said. I slow down to 20 m/s.', SLOWER, HIGHWAY, []),
        ('You said: "Go left."', RIGHT, HIGHWAY, ["wrong-side of “Go left.”: it changes lanes to the right (line 3)"]),
        (
            '"Go left." I do nothing.',
            RIGHT,
            HIGHWAY,
            ["not-claimed of “I do nothing.”: it changes lanes to the right (line 3)"],
        ),
        ('"Faster." I do nothing.', SLOWER, HIGHWAY, ["not-claimed of “I do nothing.”: it drives slower (line 3)"]),
        ('"Faster." I go left.', SLOWER_LEFT, HIGHWAY, ["wrong-sign of “Faster.”: it drives slower (line 3)"]),
        ('"Go back." I go left.', LEFT, HIGHWAY, []),
        ('"Go back." I speed up.', FASTER, HIGHWAY, []),
        ('"Go back."', LEFT, HIGHWAY, ["not-done of “Go back.”: it never goes back to a lane it was in (line 3)"]),
        ('"Go back."', IDLE, HIGHWAY, ["not-done of “Go back.”: it never changes lanes"]),
        ('"Go left." I speed up.', FASTER, HIGHWAY, []),
        ('"Go left."', IDLE, HIGHWAY, ["not-done of “Go left.”: it never changes lanes"]),
        ('"Turn left." We turn right.', TURN_RIGHT, CROSSING, []),
        ('"Stop." I speed up.', FASTER, HIGHWAY, []),
        ('"Faster."', IDLE, HIGHWAY, []),
        ('"Close up." I drive on.', IDLE, HIGHWAY, []),
        ('"Close up." I drive on.', WIDE, HIGHWAY, ["wrong-sign of “Close up.”: it wants a larger gap (line 3)"]),
        ('"Wait 4 seconds." I speed up.', WAIT, HIGHWAY, []),
        ('"Go left." I pull over.', RIGHT, HIGHWAY, []),
        (
            '"Go left." I return to my old lane.',
            RIGHT,
            HIGHWAY,
            ["not-done of “I return to my old lane.”: it never goes back to a lane it was in (line 3)"],
        ),
    ],
)
def test_a_wish_counts_only_where_nothing_is_said_of_it(
    text: str, source: str, where: FactSurroundings, told: list[str]
) -> None:
    assert verdicts(text, source, where) == told


# Ways over an intersection --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "source", "told"),
    [
        ("We change to the left lane.", ONLY_GO, ["not-done: it never changes lanes"]),
        (
            "Once the way is clear, we slow down.",
            ONLY_GO,
            ["missing-condition: it never asks whether the way is free (line 3)", "not-done: it sets no speed"],
        ),
        ("We return to our old lane.", ONLY_GO, []),
        ("We turn left.", TURN_FASTER, []),
        ("We turn left.", TURN_LEFT, []),
        ("We turn left.", TURN_RIGHT, ["wrong-side: it turns right (line 3)"]),
        ("We turn left.", STRAIGHT, ["wrong-side: it goes straight on (line 3)"]),
        ("We go straight on.", TURN_LEFT, ["wrong-side: it turns left (line 3)"]),
        ("We turn left.", IDLE, ["not-done: it chooses no way over the intersection"]),
        ("We turn left.", LEFT, []),
        ("We turn right.", LEFT, ["not-done: it chooses no way over the intersection"]),
        ("We turn left.", LEFT_OR_RIGHT, []),
        ("We go straight on.", LEFT_OR_RIGHT, ["wrong-side: it turns left or turns right (line 4)"]),
        (
            "We do not turn left.",
            LEFT_OR_RIGHT,
            [
                "not-claimed: it turns left or turns right (line 4)",
                "not-claimed of nothing said: it turns left (line 4)",
            ],
        ),
        (
            "We do not turn left.",
            TURN_LEFT,
            ["not-claimed: it turns left (line 3)", "not-claimed of nothing said: it turns left (line 3)"],
        ),
        ("We do not turn right.", TURN_LEFT, ["not-claimed of nothing said: it turns left (line 3)"]),
        ("We cross the intersection.", TURN_LEFT, []),
        ("We cross the intersection.", IDLE, []),
        ("We drive on.", TURN_LEFT, ["not-claimed of nothing said: it turns left (line 3)"]),
        ("We stop.", TURN_LEFT, ["not-claimed of nothing said: it turns left (line 3)"]),
        ("We drive on.", ONLY_GO, []),
        (
            "We slow down.",
            ONLY_GO,
            ["not-done: it sets no speed", "not-claimed of nothing said: it drives on over the intersection (line 3)"],
        ),
        ("We check the traffic.", GO_CHECKED, []),
        ("We speed up.", TURN_LEFT, ["not-claimed of nothing said: it turns left (line 3)"]),
        (
            "We speed up to 12 m/s.",
            TURN_LEFT,
            ["not-done: it sets no speed", "not-claimed of nothing said: it turns left (line 3)"],
        ),
        ("We speed up.", IDLE, ["not-done: it sets no speed"]),
        ("We set 12 m/s.", IDLE, []),
        ("I stay in this lane.", TURN_LEFT, ["not-claimed of nothing said: it turns left (line 3)"]),
        (
            "I do nothing.",
            TURN_LEFT,
            ["not-claimed: it turns left (line 3)", "not-claimed of nothing said: it turns left (line 3)"],
        ),
        ("I do nothing.", IDLE, []),
        ("I go left.", TURN_RIGHT, ["wrong-side: it turns right (line 3)"]),
        ("We turn left and stop.", GO_CHECKED, []),
        ("We turn left. I do nothing else.", TURN_RIGHT, ["wrong-side of “We turn left.”: it turns right (line 3)"]),
        ("I do nothing. We turn left.", TURN_LEFT, []),
    ],
)
def test_what_is_told_of_ways_over_an_intersection(text: str, source: str, told: list[str]) -> None:
    assert verdicts(text, source, CROSSING) == told


# Stops ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "source", "told"),
    [
        ("We stop for good.", STOP_OR_GO, []),
        ("We stop for good.", STAND_THEN_CRAWL, ["not-claimed: it drives on afterwards (line 5)"]),
        (
            "We do not stop.",
            STAND,
            [
                "not-claimed: it stops (line 3)",
                "not-claimed of nothing said: it stops (line 3)",
                "not-claimed of nothing said: it drives slower (line 3)",
            ],
        ),
        ("We do not stop.", FASTER, ["not-claimed of nothing said: it drives faster (line 3)"]),
        ("We do not stop here. We stop at the exit.", STAND, []),
        ("We do not stop. We pull over.", STAND, ["not-done of “We pull over.”: it never changes lanes"]),
        ("We stop for good.", STAND_THEN_GO, ["not-claimed: it drives on afterwards (line 5)"]),
        ("We stop for good.", STAND, []),
        ("We stop and stay there.", STAND_THEN_GO, []),
        ("We stop.", STAND_THEN_GO, []),
        ("We stop.", FASTER, ["not-done: it never stops"]),
        ("We stop.", UNKNOWN, []),
        ("We stop for good.", GO_THEN_STAND, []),
        ("We stop for good.", STAND_THEN_CREEP, []),
        ("We stop.", ALMOST, []),
        ("We stop.", CREEP, ["not-done: it never stops"]),
        ("We stop.", STEERED_STOP, ["not-done: it never stops"]),
        ("I slow down to zero.", STAND, []),
        ("I slow down to 0 m/s.", STAND, []),
        ("I slow down.", STAND, ["not-claimed of nothing said: it stops (line 3)"]),
        ("I pull over.", STAND, ["not-done: it never changes lanes"]),
        (
            "I go left.",
            STAND,
            [
                "not-done: it never changes lanes",
                "not-claimed of nothing said: it stops (line 3)",
                "not-claimed of nothing said: it drives slower (line 3)",
            ],
        ),
        ("We stop.", STAND_CAPPED, ["not-done: it never stops"]),
    ],
)
def test_what_is_told_of_stops(text: str, source: str, told: list[str]) -> None:
    assert verdicts(text, source) == told


# Speeds ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "source", "told"),
    [
        ("I speed up.", IDLE, ["not-done: it sets no speed"]),
        ("I set the speed to 30 m/s.", IDLE, ["not-done: it sets no speed"]),
        ("I set the speed to 25 m/s.", IDLE, []),
        ("I adapt the speed.", IDLE, []),
        ("I do not speed up.", IDLE, []),
        ("I do not speed up.", FASTER, ["not-claimed of nothing said: it drives faster (line 3)"]),
        ("I speed up. I set 30 m/s.", GAP_ONLY, []),
        ("I speed up to 30 m/s.", GAP_ONLY, ["not-done: it sets no speed"]),
        ("I speed up.", GAP_ONLY, []),
        ("I drive at the limit.", LIMIT, []),
        ("I drive at the limit.", BELOW_LIMIT, ["wrong-number: it drives at the limit -2 m/s (line 3)"]),
        ("I drive at the limit.", ABOVE_LIMIT, ["wrong-number: it drives at the limit +2 m/s (line 3)"]),
        ("I drive at the limit.", FASTER, []),
        ("I drive at the limit.", SLOWER, []),
        ("I set the target 2 m/s below the limit.", BELOW_LIMIT, []),
        (
            "I set the target 2 m/s above the limit.",
            BELOW_LIMIT,
            ["wrong-sign: it drives at the limit -2 m/s (line 3)"],
        ),
        (
            "I set the target 3 m/s below the limit.",
            BELOW_LIMIT,
            ["wrong-number: it drives at the limit -2 m/s (line 3)"],
        ),
        ("I set the target 2.2 m/s below the limit.", BELOW_LIMIT, []),
        (
            "I set the target 2.4 m/s below the limit.",
            BELOW_LIMIT,
            ["wrong-number: it drives at the limit -2 m/s (line 3)"],
        ),
        ("I set the target 2 m/s above the limit.", ABOVE_LIMIT, []),
        (
            "I set the target 2 m/s below the limit.",
            ABOVE_LIMIT,
            ["wrong-sign: it drives at the limit +2 m/s (line 3)"],
        ),
        (
            "I set the target 3 m/s above the limit.",
            ABOVE_LIMIT,
            ["wrong-number: it drives at the limit +2 m/s (line 3)"],
        ),
        ("I set the target 2 m/s below the limit.", LIMIT, ["wrong-number: it drives at the limit +0 m/s (line 3)"]),
        ("I set the target 1 m/s below the limit.", FASTER, []),
        ("I set the target 9 m/s below the limit.", FASTER, ["wrong-number: it has 30 m/s, not 9 m/s (line 3)"]),
        ("I slow down.", FASTER, ["wrong-sign: it drives faster (line 3)"]),
        ("I speed up.", SLOWER, ["wrong-sign: it drives slower (line 3)"]),
        ("I speed up.", EITHER_SPEED, []),
        ("I slow down.", EITHER_SPEED, []),
        (
            "I keep our speed.",
            EITHER_SPEED,
            [
                "not-claimed: it drives faster and slower (line 3)",
                "not-claimed of nothing said: it drives faster and slower (line 3)",
            ],
        ),
        ("I speed up.", SAME, ["not-done: it keeps its speed (line 3)"]),
        ("I slow down.", SAME, ["not-done: it keeps its speed (line 3)"]),
        ("I speed up to 25 m/s.", SAME, []),
        ("I speed up to 31 m/s.", SAME, ["not-done: it keeps its speed (line 3)"]),
        (
            "I speed up if the car ahead is faster than 25 m/s.",
            SAME,
            [
                "not-done: it keeps its speed (line 3)",
                "missing-condition: nothing in it depends on the speed of another vehicle",
            ],
        ),
        ("I set the speed to 22 m/s.", FASTER, ["wrong-number: it has 30 m/s, not 22 m/s (line 3)"]),
        ("We check the speed limit and drive at it.", LIMIT, []),
        ("I speed up to 30 m/s.", SAME, ["not-done: it keeps its speed (line 3)"]),
        ("I speed up. I set the speed to 25 m/s.", SAME, []),
        ("I speed up.", SAME_OR_UNKNOWN, []),
        ("I speed up by 20 %.", SAME, ["not-done: it keeps its speed (line 3)"]),
        ("I speed up.", UNKNOWN, []),
        ("I speed up to 30 m/s.", UNKNOWN, ["wrong-number: it has no such number, not 30 m/s (line 3)"]),
        ("I set the speed to 30 m/s.", FASTER, []),
        ("I set the speed to 33 m/s.", FASTER, ["wrong-number: it has 30 m/s, not 33 m/s (line 3)"]),
        (
            "I set 30 m/s, then 35 m/s, then 36 m/s.",
            FASTER,
            ["wrong-number: it has 30 m/s, not 35 m/s (line 3)", "wrong-number: it has 30 m/s, not 36 m/s (line 3)"],
        ),
        ("I set 20 m/s and then 30 m/s.", SLOW_THEN_FAST, []),
        ("I set the speed to 33 m/s.", UNKNOWN_THEN_FASTER, ["wrong-number: it has 30 m/s, not 33 m/s (line 4)"]),
        ("I slow down.", UNKNOWN_THEN_FASTER, ["wrong-sign: it drives faster (line 4)"]),
        ("I slow down to 33 or 34 m/s.", SLOWER, ["wrong-number: it has 20 m/s, not 34 m/s (line 3)"]),
        ("I speed up by 20 %.", FASTER, []),
        ("I speed up by 20 %.", BY_A_FIFTH, []),
        ("I speed up by 50 %.", BY_A_FIFTH, ["wrong-number: it has no such number, not 50 % (line 3)"]),
        ("I speed up by 5 m/s.", FASTER, []),
        ("I speed up by 9 m/s.", FASTER, ["wrong-number: it has 30 m/s, not 9 m/s (line 3)"]),
        ("I set 33 m/s.", FOLLOW, []),
        ("I set the speed to exactly 33 m/s.", FOLLOW, ["wrong-number: it has no such number, not 33 m/s (line 5)"]),
        ("I speed up.", FOLLOW, []),
        ("I slow down.", FOLLOW, []),
        (
            "I keep our speed.",
            FASTER,
            ["not-claimed: it drives faster (line 3)", "not-claimed of nothing said: it drives faster (line 3)"],
        ),
        ("I keep our speed.", SAME, []),
        ("I keep our speed. I speed up.", FASTER, []),
        ("The speed stays unchanged. I stop.", STAND, []),
        ("The speed stays unchanged. I overtake on the left.", SPEED_THEN_LEFT, []),
        (
            "I do nothing.",
            FASTER,
            ["not-claimed: it drives faster (line 3)", "not-claimed of nothing said: it drives faster (line 3)"],
        ),
        ("I do nothing.", FOLLOW, []),
        ("I do nothing.", SAME, []),
        ("I do nothing.", IDLE, []),
        (
            "I do nothing.",
            LEFT,
            [
                "not-claimed: it changes lanes to the left (line 3)",
                "not-claimed of nothing said: it changes lanes to the left (line 3)",
            ],
        ),
    ],
)
def test_what_is_told_of_speeds(text: str, source: str, told: list[str]) -> None:
    assert verdicts(text, source) == told


# Gaps and times -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "source", "told"),
    [
        ("I keep 25 m to the car ahead.", FOLLOW, []),
        ("I keep 60 m to the car ahead.", FOLLOW, ["wrong-number: it has 25 m, not 60 m (line 5)"]),
        ("I keep 60 m, then 70 m to the car ahead.", FOLLOW, ["wrong-number: it has 25 m, not 60 m (line 5)"]),
        ("I leave more room.", FOLLOW, ["wrong-sign: it wants a smaller gap (line 5)"]),
        ("I close up.", FOLLOW, []),
        ("I leave more room.", IDLE, ["not-done: it does nothing about the gap"]),
        ("I leave more room.", SLOWER, []),
        ("I close up.", FASTER, []),
        ("I close up.", SLOWER, ["not-done: it does nothing about the gap"]),
        ("I leave more room.", FASTER, ["not-done: it does nothing about the gap"]),
        ("I keep 30 m to the car ahead.", IDLE, ["not-done: it does nothing about the gap"]),
        ("I keep 30 m to the car ahead.", SLOWER, ["not-done: it does nothing about the gap"]),
        ("I leave more room, about 30 m.", SLOWER, []),
        ("I close up to 30 m.", FASTER, ["not-done: it does nothing about the gap"]),
        ("I keep a headway of 3 seconds.", WIDE, []),
        ("I keep a headway of 2 seconds.", WIDE, ["wrong-number: it has 3 s, not 2 seconds (line 3)"]),
        ("I leave more room.", WIDE, []),
        ("I close up.", WIDE, ["wrong-sign: it wants a larger gap (line 3)"]),
        ("I leave more room.", NARROW, ["wrong-sign: it wants a smaller gap (line 3)"]),
        ("I close up.", NARROW, []),
        ("I leave more room.", USUAL, []),
        ("I close up.", EITHER_HEADWAY, []),
        ("I close up.", GAP_ASKED, []),
        ("I leave more room.", GAP_ASKED, ["wrong-sign: it wants a smaller gap (line 4)"]),
        ("I keep 15 m to the car ahead.", GAP_ASKED, []),
        ("The gap stays unchanged.", WIDE, ["not-claimed: it sets another headway (line 3)"]),
        ("The gap stays unchanged.", USUAL, []),
        ("The gap stays unchanged.", SAME_HEADWAY, []),
        ("The gap stays unchanged. I leave more room.", WIDE, []),
        ("I wait 3 seconds. I speed up.", WAIT, []),
        ("I wait 4 seconds. I speed up.", WAIT, ["wrong-number of “I wait 4 seconds.”: it has 3 s, not 4 seconds"]),
        ("I do not wait 4 seconds. I speed up.", WAIT, []),
        (
            "I wait 4 seconds and 7 seconds. I speed up.",
            WAIT,
            [
                "wrong-number of “I wait 4 seconds and 7 seconds.”: it has 3 s, not 4 seconds",
                "wrong-number of “I wait 4 seconds and 7 seconds.”: it has 3 s, not 7 seconds",
            ],
        ),
        (
            "I wait 5 seconds.",
            RIGHT_FASTER,
            [
                "wrong-number: it has no such number, not 5 seconds",
                "not-claimed of nothing said: it changes lanes to the right (line 3)",
                "not-claimed of nothing said: it drives faster (line 4)",
            ],
        ),
    ],
)
def test_what_is_told_of_gaps_and_times(text: str, source: str, told: list[str]) -> None:
    assert verdicts(text, source) == told


# What something depends on --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "source", "where", "told"),
    [
        (
            "I go left if the car behind is 20 m away.",
            IF_NOBODY,
            HIGHWAY,
            ["wrong-number: it has no such number, not 20 m"],
        ),
        ("I go left if the gap is below 20 m.", MARKED, HIGHWAY, []),
        (
            "I go left if the gap is below 20 m.",
            IF_SLOW,
            HIGHWAY,
            ["missing-condition: nothing in it depends on the gap"],
        ),
        (
            "I check that the left lane is free and go there.",
            LEFT,
            HIGHWAY,
            ["missing-condition: it changes lanes without asking whether it may (line 3)"],
        ),
        ("I check that the left lane is free and go there.", CHECKED, HIGHWAY, []),
        (
            "I check that the lane is free. I speed up.",
            FASTER,
            HIGHWAY,
            ["missing-condition of “I check that the lane is free.”: it never asks whether a lane is free"],
        ),
        ("I check that the lane is free. I speed up.", SAFE_FASTER, HIGHWAY, []),
        (
            "I check the right lane. I go left.",
            LEFT,
            HIGHWAY,
            ["missing-condition of “I check the right lane.”: it changes lanes without asking whether it may (line 3)"],
        ),
        ("I do not check whether the lane is free. I go left.", LEFT, HIGHWAY, []),
        ("I check that the left lane is free and go there.", FIRST_CHECKED, HIGHWAY, []),
        (
            "I check the right lane. I go left.",
            FIRST_CHECKED,
            HIGHWAY,
            ["missing-condition of “I check the right lane.”: it changes lanes without asking whether it may (line 5)"],
        ),
        ("I check that the lane is free. I go left.", FIRST_CHECKED, HIGHWAY, []),
        (
            "We wait for the crossing traffic and turn left.",
            GO,
            HIGHWAY,
            ["missing-condition: it never asks whether the way is free (line 4)"],
        ),
        ("We wait for the crossing traffic and turn left.", GO_CHECKED, HIGHWAY, []),
        (
            "We wait for the crossing traffic and turn left.",
            TURN_LEFT,
            CROSSING,
            ["missing-condition: it never asks whether the way is free"],
        ),
        (
            "We wait for the crossing traffic and turn left.",
            GO,
            CROSSING,
            ["missing-condition: it never asks whether the way is free (line 4)"],
        ),
        ("We wait for the crossing traffic and turn left.", GO_CHECKED, CROSSING, []),
        (
            "We check the traffic.",
            ONLY_GO,
            CROSSING,
            ["missing-condition: it never asks whether the way is free (line 3)"],
        ),
        ("We check the traffic.", IDLE, CROSSING, ["missing-condition: it never asks whether a lane is free"]),
        (
            "We check the traffic.",
            LEFT,
            CROSSING,
            ["missing-condition: it changes lanes without asking whether it may (line 3)"],
        ),
        (
            "I go left if the car ahead is slower than 20 m/s.",
            LEFT,
            HIGHWAY,
            ["missing-condition: nothing in it depends on the speed of another vehicle"],
        ),
        ("I go left if the gap is below 20 m.", LEFT, HIGHWAY, ["missing-condition: nothing in it depends on the gap"]),
        (
            "I go left if the car behind is 20 m away.",
            LEFT,
            HIGHWAY,
            ["missing-condition: nothing in it depends on who is behind"],
        ),
        ("I go left if the car ahead is slower than 20 m/s.", IF_SLOW, HIGHWAY, []),
        (
            "I go left if the car ahead is slower than 12 m/s.",
            IF_SLOW,
            HIGHWAY,
            ["wrong-number: it has no such number, not 12 m/s"],
        ),
        (
            "I go left if the car ahead is slower than 12 m/s or 13 m/s.",
            IF_SLOW,
            HIGHWAY,
            ["wrong-number: it has no such number, not 12 m/s"],
        ),
        ("I go left if the gap is below 20 m.", IF_NEAR, HIGHWAY, []),
        ("I go left if the gap is below 60 m.", IF_NEAR, HIGHWAY, ["wrong-number: it has 20 m, not 60 m"]),
        ("I go left if the car behind is 20 m away.", BEHIND, HIGHWAY, []),
        (
            "I go left if the car behind is 60 m away.",
            BEHIND,
            HIGHWAY,
            ["wrong-number: it has no such number, not 60 m"],
        ),
        ("I go left when the stop sign is 30 m ahead.", IF_SIGN, HIGHWAY, []),
        (
            "I go left when the stop sign is 60 m ahead.",
            IF_SIGN,
            HIGHWAY,
            ["wrong-number: it has no such number, not 60 m"],
        ),
        ("I go left when the car is 30 m behind.", IF_PAST, HIGHWAY, []),
        ("I go left when the gap is 30 m.", IF_PAST, HIGHWAY, []),
        ("I go left when the gap is 30 m.", BEHIND, HIGHWAY, ["wrong-number: it has no such number, not 30 m"]),
    ],
)
def test_what_is_told_of_conditions(text: str, source: str, where: FactSurroundings, told: list[str]) -> None:
    assert verdicts(text, source, where) == told


# What is not mentioned ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "source", "told"),
    [
        ("I go round it on the left.", SPEED_THEN_LEFT, []),
        ("The speed stays unchanged. I pull over.", RIGHT_FASTER, []),
        ("I drive on.", LEFT, ["not-claimed of nothing said: it changes lanes to the left (line 3)"]),
        ("rule: speed", LEFT, []),
        ("rule: gap", FASTER, []),
        ("I speed up.", SPEED_THEN_LEFT, ["not-claimed of nothing said: it changes lanes to the left (line 5)"]),
        ("I turn left.", LEFT, []),
        (
            "I stay in this lane.",
            LEFT,
            [
                "not-claimed: it changes lanes to the left (line 3)",
                "not-claimed of nothing said: it changes lanes to the left (line 3)",
            ],
        ),
        ("I go left.", SPEED_THEN_LEFT, ["not-claimed of nothing said: it drives faster (line 3)"]),
        (
            "I go left, nothing else.",
            SPEED_THEN_LEFT,
            ["not-claimed: it drives faster (line 3)", "not-claimed of nothing said: it drives faster (line 3)"],
        ),
        ("I overtake on the left.", SPEED_THEN_LEFT, []),
        ("I overtake on the left, that is all.", SPEED_THEN_LEFT, []),
        ("I go left and past it.", SPEED_THEN_LEFT, []),
        ("I go left, as the limit allows.", LEFT_LIMIT, []),
        ("I go left.", LEFT_LIMIT, ["not-claimed of nothing said: it drives faster (line 4)"]),
        ("I go left.", LEFT_FOLLOWED, ["not-claimed of nothing said: it drives slower (line 4)"]),
        ("I go left. The car ahead keeps its speed.", LEFT_FOLLOWED, []),
        ("I go left at the pace of the others.", LEFT_FOLLOWED, []),
        ("I speed up. That is all.", FASTER, []),
        ("I leave more room. That is all.", WIDE_FASTER, ["not-claimed of nothing said: it drives faster (line 4)"]),
        ("I leave more room.", WIDE_FASTER, []),
        ("I turn left. That is all.", SPEED_THEN_LEFT, ["not-claimed of nothing said: it drives faster (line 3)"]),
        ("I turn left.", SPEED_THEN_LEFT, ["not-claimed of nothing said: it drives faster (line 3)"]),
        ("I drive on.", WIDE, []),
        ("I drive on. That is all.", WIDE, ["not-claimed of nothing said: it sets another headway (line 3)"]),
        ("I drive on, nothing else.", USUAL, []),
        ("I leave more room, nothing else.", WIDE, []),
        ("I go on, that's it.", WIDE, ["not-claimed of nothing said: it sets another headway (line 3)"]),
        (
            "Only the lane changes; the rest is left alone. I go left.",
            WIDE,
            [
                "not-done of “Only the lane changes”: it never changes lanes",
                "not-done of “I go left.”: it never changes lanes",
                "not-claimed of nothing said: it sets another headway (line 3)",
            ],
        ),
        ("I drive on.", FASTER, ["not-claimed of nothing said: it drives faster (line 3)"]),
        ("I drive on.", EITHER_SPEED, ["not-claimed of nothing said: it drives faster and slower (line 3)"]),
        (
            "I drive on.",
            STAND,
            [
                "not-claimed of nothing said: it stops (line 3)",
                "not-claimed of nothing said: it drives slower (line 3)",
            ],
        ),
        ("I drive on.", TURN_LEFT, ["not-claimed of nothing said: it turns left (line 3)"]),
        ("I drive on.", FOLLOW, []),
        (
            "I wait 3 seconds.",
            FASTER,
            [
                "wrong-number: it has no such number, not 3 seconds",
                "not-claimed of nothing said: it drives faster (line 3)",
            ],
        ),
        ("I go left if the car ahead is slower than 20 m/s.", IF_SLOW_FASTER, []),
    ],
)
def test_what_is_not_mentioned_is_told(text: str, source: str, told: list[str]) -> None:
    assert verdicts(text, source) == told


# Order ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "source", "told"),
    [
        (
            "First I speed up to 30 m/s. Then I wait 4 seconds.",
            WAIT,
            ["wrong-number of “Then I wait 4 seconds.”: it has 3 s, not 4 seconds"],
        ),
        (
            "First I speed up. Then I go left.",
            SLOW_LEFT_FAST,
            ["wrong-order of “Then I go left.”: it does that first, and the other thing later (line 5)"],
        ),
        (
            "First I go to 30 m/s. Then I go left.",
            MORE_LEFT_FAST,
            ["wrong-order of “Then I go left.”: it does that first, and the other thing later (line 5)"],
        ),
        (
            "First I go to 30 m/s. Then I go left.",
            LEFT_THEN_MORE,
            ["wrong-order of “Then I go left.”: it does that first, and the other thing later (line 4)"],
        ),
        (
            "First I speed up to 30 m/s. Then I go left.",
            LEFT_THEN_SPEED,
            ["wrong-order of “Then I go left.”: it does that first, and the other thing later (line 5)"],
        ),
        ("First I go left. Then I speed up to 30 m/s.", LEFT_THEN_SPEED, []),
        (
            "First I go left. Then I speed up to 30 m/s.",
            SPEED_THEN_LEFT,
            ["wrong-order of “Then I speed up to 30 m/s.”: it does that first, and the other thing later (line 5)"],
        ),
        ("I go left. I speed up to 30 m/s.", SPEED_THEN_LEFT, []),
        (
            "First I speed up. Then I go left.",
            LEFT_THEN_SPEED,
            ["wrong-order of “Then I go left.”: it does that first, and the other thing later (line 5)"],
        ),
        (
            "First I overtake on the left. Then I speed up to 30 m/s.",
            SPEED_THEN_LEFT,
            ["wrong-order of “Then I speed up to 30 m/s.”: it does that first, and the other thing later (line 5)"],
        ),
        (
            "First I go back. Then I overtake on the left.",
            THERE_AND_BACK,
            ["wrong-order of “Then I overtake on the left.”: it does that first, and the other thing later (line 5)"],
        ),
        ("First I overtake on the left. Then I go back.", THERE_AND_BACK, []),
        (
            "First I speed up to 30 m/s. Then I wait 3 seconds.",
            WAIT,
            ["wrong-order of “Then I wait 3 seconds.”: it does that first, and the other thing later (line 5)"],
        ),
        (
            "First I set 20 m/s. Then I stop.",
            STAND_THEN_GO,
            ["wrong-order of “Then I stop.”: it does that first, and the other thing later (line 5)"],
        ),
        ("First I stop. Then I set 20 m/s.", STAND_THEN_GO, []),
        (
            "First I pull over. Then I stop.",
            STOP_THEN_RIGHT,
            ["wrong-order of “Then I stop.”: it does that first, and the other thing later (line 5)"],
        ),
        ("First I stop. Then I pull over.", STOP_THEN_RIGHT, []),
        (
            "First I leave more room. Then I speed up to 30 m/s.",
            SPEED_THEN_WIDE,
            ["wrong-order of “Then I speed up to 30 m/s.”: it does that first, and the other thing later (line 5)"],
        ),
        (
            "First I go right. Then I go left and speed up to 30 m/s.",
            SPEED_THEN_LEFT,
            ["wrong-side of “First I go right.”: it changes lanes to the left (line 5)"],
        ),
        (
            "I speed up to 30 m/s after going left.",
            SPEED_THEN_LEFT,
            ["wrong-order: it does that first, and the other thing later (line 5)"],
        ),
        (
            "Before I go left, I speed up to 30 m/s.",
            LEFT_THEN_SPEED,
            ["wrong-order: it does that first, and the other thing later (line 5)"],
        ),
        (
            "First I set 30 m/s. Then I set 20 m/s. Then I go left.",
            LEFT_THEN_SPEED,
            [
                "wrong-number of “Then I set 20 m/s.”: it has 30 m/s, not 20 m/s (line 5)",
                "wrong-order of “Then I go left.”: it does that first, and the other thing later (line 5)",
            ],
        ),
        (
            "First I do not go left. Then I speed up to 30 m/s.",
            SPEED_THEN_LEFT,
            [
                "not-claimed of “First I do not go left.”: it changes lanes to the left (line 5)",
                "not-claimed of nothing said: it changes lanes to the left (line 5)",
            ],
        ),
        ("First I speed up by 5 m/s. Then I wait 3 seconds.", WAIT, []),
        ("First I wait 3 seconds. Then I speed up to 30 m/s.", WAIT, []),
        (
            "First I go left. Then I leave more room.",
            WIDE_THEN_LEFT,
            ["wrong-order of “Then I leave more room.”: it does that first, and the other thing later (line 5)"],
        ),
    ],
)
def test_what_is_told_of_order(text: str, source: str, told: list[str]) -> None:
    assert verdicts(text, source) == told


# What then happened --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "source", "effect", "told"),
    [
        ("I go left.", LEFT, STEADY, ["not-done: it did not change lanes in this drive"]),
        ("I go left.", LEFT, DRIVE_CUT, []),
        ("I go left.", LEFT, DRIVE_WENT_LEFT, []),
        ("I go left.", LEFT, DRIVE_WENT_RIGHT, ["wrong-side: it changed lanes to the right"]),
        ("I go left.", LEFT, DRIVE_WENT_BOTH, ["wrong-side: it changed lanes to the right"]),
        ("I go left.", RIGHT, DRIVE_WENT_RIGHT, ["wrong-side: it changed lanes to the right"]),
        ("I go left.", LEFT, DRIVE_FAILED, []),
        ("I change lanes.", LEFT, DRIVE_WENT_RIGHT, []),
        ("I change lanes.", LEFT, STEADY, ["not-done: it did not change lanes in this drive"]),
        ("I do not go right. I go left.", LEFT, DRIVE_WENT_LEFT, []),
        (
            "I go left, then right.",
            THERE_AND_BACK,
            DRIVE_WENT_LEFT,
            ["not-done: in this drive it only changed lanes to the left"],
        ),
        ("I go left, then right.", THERE_AND_BACK, DRIVE_WENT_LEFT_CUT, []),
        ("I go left, then right.", THERE_AND_BACK, DRIVE_WENT_BOTH, []),
        ("I overtake on the left.", LEFT, DRIVE_PASSED, []),
        ("I overtake on the left.", LEFT, DRIVE_BESIDE, []),
        ("I overtake on the left.", LEFT, DRIVE_UNSEEN, []),
        (
            "I overtake on the left.",
            LEFT,
            DRIVE_CLOSE_BY,
            ["not-done: the vehicle ahead was never passed in this drive"],
        ),
        ("I overtake on the left.", LEFT, DRIVE_NOT_PASSED_CUT, []),
        (
            "I overtake on the left.",
            LEFT,
            DRIVE_WENT_RIGHT,
            [
                "not-done: in this drive it only changed lanes to the right",
                "not-done: the vehicle ahead was never passed in this drive",
            ],
        ),
        ("I overtake.", LEFT, DRIVE_WENT_RIGHT, ["not-done: the vehicle ahead was never passed in this drive"]),
        ("I pull over.", RIGHT, DRIVE_WENT_LEFT, []),
        ("I pull over.", RIGHT, STEADY, ["not-done: it did not change lanes in this drive"]),
        ("I return to my old lane.", THERE_AND_BACK, STEADY, ["not-done: it did not change lanes in this drive"]),
        ("I stay in this lane.", IDLE, DRIVE_WENT_LEFT, ["not-claimed: it changed lanes to the left"]),
        ("I do not change lanes.", IDLE, DRIVE_WENT_RIGHT, ["not-claimed: it changed lanes to the right"]),
        ("I do not go left.", IDLE, DRIVE_WENT_BOTH, ["not-claimed: it changed lanes to the left and right"]),
        ("I stay in this lane.", IDLE, STEADY, []),
        (
            "I speed up.",
            FASTER,
            DRIVE_WENT_LEFT,
            [
                "not-claimed of nothing said: it changed lanes to the left",
                "not-done: it was never faster than 25.0 m/s in this drive",
            ],
        ),
        (
            "We do not stop. I speed up.",
            FASTER,
            DRIVE_WENT_LEFT,
            [
                "not-claimed of nothing said: it changed lanes to the left",
                "not-done of “I speed up.”: it was never faster than 25.0 m/s in this drive",
            ],
        ),
        (
            'I speed up. "Go left."',
            FASTER,
            DRIVE_WENT_LEFT,
            ["not-done of “I speed up.”: it was never faster than 25.0 m/s in this drive"],
        ),
        ("rule: speed", IDLE, DRIVE_WENT_LEFT, []),
        ("We stop.", STAND, STEADY, ["not-done: it did not come to a stop in this drive"]),
        ("We stop.", STAND, DRIVE_STOOD, []),
        ("We stop.", STAND, DRIVE_NEARLY, ["not-done: it did not come to a stop in this drive"]),
        ("We stop.", STAND, DRIVE_CUT, []),
        ("We do not stop.", IDLE, DRIVE_STOOD, ["not-claimed: it stood still on the way"]),
        ("We do not stop.", IDLE, DRIVE_NEARLY, []),
        ('"Stop." We drive on.', IDLE, STEADY, []),
        ("I speed up.", FASTER, STEADY, ["not-done: it was never faster than 25.0 m/s in this drive"]),
        ("I speed up.", FASTER, DRIVE_LITTLE, ["not-done: it was never faster than 25.9 m/s in this drive"]),
        ("I speed up.", FASTER, DRIVE_ONE_FASTER, []),
        ("I speed up.", FASTER, DRIVE_CUT, []),
        ("I slow down.", SLOWER, DRIVE_LITTLE, ["not-done: it was never slower than 24.1 m/s in this drive"]),
        ("I slow down.", SLOWER, DRIVE_ONE_FASTER, []),
        ("I slow down.", SLOWER, STEADY, ["not-done: it was never slower than 25.0 m/s in this drive"]),
        ("I slow down.", SLOWER, DRIVE_FASTER, ["not-done: it was never slower than 25.0 m/s in this drive"]),
        ("I do not speed up.", IDLE, STEADY, []),
        ("I set the speed to 30 m/s.", FASTER, STEADY, []),
        ("I speed up.", BY_TWO, STEADY, ["not-done: it was never faster than 25.0 m/s in this drive"]),
        ("I speed up.", BY_LESS, STEADY, []),
        ("I speed up.", UNKNOWN, STEADY, ["not-done: it was never faster than 25.0 m/s in this drive"]),
        (
            "I speed up.",
            UNKNOWN,
            DRIVE_SLOWER,
            ["wrong-sign: it drives slower (line 3)", "not-done: it was never faster than 25.0 m/s in this drive"],
        ),
        ("I slow down.", UNKNOWN, DRIVE_SLOWER, []),
        ("I speed up to 28 m/s.", UNKNOWN, DRIVE_FASTER, []),
        ("I speed up to 30 m/s.", UNKNOWN, DRIVE_FASTER, []),
        ("I speed up.", SLOW_THEN_FAST, STEADY, ["not-done: it was never faster than 25.0 m/s in this drive"]),
        ("I leave more room.", WIDE, STEADY, []),
        ("I close up.", NARROW, DRIVE_WIDER, ["wrong-sign: the gap went from 40 m to 60 m in this drive"]),
        ("I close up.", WIDE, DRIVE_WIDER, ["wrong-sign: the gap went from 40 m to 60 m in this drive"]),
        (
            "I close up. I go left.",
            NARROW,
            DRIVE_WIDER,
            [
                "not-done of “I go left.”: it did not change lanes in this drive",
                "wrong-sign of “I close up.”: the gap went from 40 m to 60 m in this drive",
            ],
        ),
    ],
)
def test_what_is_told_of_a_drive(text: str, source: str, effect: Effect, told: list[str]) -> None:
    assert brief(text, judge_drive(text, read_facts(source), HIGHWAY, effect)) == told


@pytest.mark.parametrize(
    ("text", "source", "effect", "told"),
    [
        ("We turn left.", TURN_LEFT, DRIVE_TURNED_LEFT, []),
        ("We turn left.", TURN_LEFT, DRIVE_TURNED_RIGHT, ["wrong-side: in this drive it turns right"]),
        ("We turn left.", TURN_LEFT, STEADY, ["not-done: it did not come to turn in this drive"]),
        ("We turn left.", TURN_LEFT, DRIVE_CUT, []),
        ("We go straight on.", STRAIGHT, STEADY, []),
        ("We go straight on.", STRAIGHT, DRIVE_TURNED_LEFT, ["wrong-side: in this drive it turns left"]),
        ("We do not turn right. We turn left.", TURN_LEFT, DRIVE_TURNED_LEFT, []),
        ('"Turn left." We turn right.', TURN_RIGHT, DRIVE_TURNED_RIGHT, []),
        ("We cross the intersection.", STRAIGHT, DRIVE_TURNED_LEFT, []),
        ("We change to the left lane.", LEFT, STEADY, []),
        ("We stop.", TURN_LEFT, STEADY, ["not-done: it did not come to a stop in this drive"]),
        (
            "We speed up. We turn left.",
            TURN_LEFT,
            DRIVE_TURNED_LEFT,
            ["not-done of “We speed up.”: it was never faster than 25.0 m/s in this drive"],
        ),
        (
            "We stop. We turn left.",
            TURN_LEFT,
            DRIVE_TURNED_RIGHT,
            [
                "wrong-side of “We turn left.”: in this drive it turns right",
                "not-done of “We stop.”: it did not come to a stop in this drive",
            ],
        ),
    ],
)
def test_what_is_told_of_a_drive_over_an_intersection(text: str, source: str, effect: Effect, told: list[str]) -> None:
    assert brief(text, judge_drive(text, read_facts(source), CROSSING, effect)) == told
