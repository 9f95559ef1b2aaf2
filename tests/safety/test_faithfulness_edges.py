"""Edges of thoughts against programs: numbers that are no speeds, wishes that are no promises, short drives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest
from faithfulness_programs import HIGHWAY

from chauffeur.concept import Lead, Limits, Observation, Parameters, Plan, Program, Thoughts, Verdict
from chauffeur.safety.faithfulness import (
    Effect,
    FactSurroundings,
    Faithfulness,
    Mismatch,
    check_driven,
    check_faithfulness,
    judge,
    judge_drive,
    mismatch_words,
    read_facts,
    score_words,
)
from chauffeur.safety.faithfulness import lexicon as words
from chauffeur.safety.faithfulness.claims import claims_of

CROSSING = FactSurroundings(speed_mps=10.0, limit_mps=10.0, sign_m=50.0, crossing=True)


def program(*lines: str) -> str:
    body = "".join(f"    {line}\n" for line in ("ego = get_ego_vehicle()", *lines, "yield autopilot()"))
    return f"def drive():\n{body}"


LEFT = program(
    "lane = get_left_lane(ego)", "while not is_safe_enter(lane):", "    yield autopilot()", "set_target_lane(lane)"
)
LEFT_AT_ONCE = program("set_target_lane(get_left_lane(ego))")
EITHER_SIDE = program("lane = get_left_lane(ego) or get_right_lane(ego)", "set_target_lane(lane)")
LEFT_THEN_RIGHT = program(
    "set_target_lane(get_left_lane(ego))", "yield autopilot()", "set_target_lane(get_right_lane(ego))"
)
BEHIND = program(
    "rear = detect_rear_vehicle_in(get_left_lane(ego))",
    "if rear is not None and get_distance_between_vehicles(ego, rear) > 20.0:",
    "    set_target_lane(get_left_lane(ego))",
)
FASTER = program("set_target_speed(30.0)")
SLOWER = program("set_target_speed(20.0)")
STAND = program("set_target_speed(0.0)")
TURN_LEFT = program("turn_left_at_next_intersection()")
IDLE = program()


def found(text: str, source: str, where: FactSurroundings = HIGHWAY) -> dict[str, str]:
    """Kinds of mismatches, each with what is so instead."""
    return {one.kind: one.instead for one in judge(text, read_facts(source), where).mismatches}


# Numbers --------------------------------------------------------------------------------------------------------------


def test_a_limit_with_something_added_speaks_of_the_speed_but_promises_no_number() -> None:
    (claim,) = claims_of("I go with the limit plus 5.")
    assert (claim.matter, claim.aside, claim.quantities) == ("speed", True, ())
    assert found("I go with the limit plus 5.", FASTER) == {}
    assert found("I go with the flow.", FASTER) == {"not-claimed": "it drives faster"}


def test_numbers_of_a_sum_that_is_told_are_no_speeds() -> None:
    assert found("The target speed is 40 divided by 2.", FASTER) == {}
    assert found("The target speed is 40.", FASTER) == {"wrong-number": "it has 30 m/s, not 40"}


def test_how_hard_it_accelerates_or_brakes_is_not_which_way_the_speed_goes() -> None:
    assert found("I go to 20 m/s with an acceleration of 2 at most.", SLOWER) == {}
    assert found("I go to 30 m/s with a deceleration of 2 on the way.", FASTER) == {}
    assert found("I go to 20 m/s with acceleration.", SLOWER) == {"wrong-sign": "it drives slower"}


def test_a_distance_at_which_it_pulls_out_has_to_be_asked_for() -> None:
    text = "I pull out to the left at a distance of 30 m."
    ahead = "detect_front_vehicle_in(get_lane_of(ego))"
    asks = program(
        f"while get_distance_between_vehicles({ahead}, ego) > 30.0:",
        "    yield autopilot()",
        "set_target_lane(get_left_lane(ego))",
    )
    assert found(text, asks) == {}
    assert found(text, asks.replace("30.0", "15.0")) == {"wrong-number": "it has 15 m, not 30 m"}
    assert found(text, LEFT) == {"missing-condition": "nothing in it depends on the gap"}


def test_a_distance_to_who_is_behind_has_to_be_asked_for() -> None:
    text = "I go left once the nearest one behind is {} m away."
    assert found(text.format(20), BEHIND) == {}
    assert found(text.format(90), BEHIND).keys() == {"wrong-number"}
    assert found(text.format(20), LEFT) == {"missing-condition": "nothing in it depends on who is behind"}


def test_a_speed_told_by_the_limit_is_not_judged_by_its_side_of_the_present_one() -> None:
    """The car drives 25 m/s where 31 m/s are allowed: a little below the limit is still faster."""
    assert found("I set the target 1 m/s below the limit.", FASTER) == {}
    assert found("I set the target 9 m/s below the limit.", FASTER).keys() == {"wrong-number"}


# Wishes and conditions ------------------------------------------------------------------------------------------------


def test_a_check_in_somebodys_words_is_not_promised() -> None:
    assert found('"Unless the lane is free, stay." I change to the left lane.', LEFT_AT_ONCE) == {}
    assert found("Once the lane is free, I change to the left lane.", LEFT_AT_ONCE).keys() == {"missing-condition"}


def test_what_would_stop_a_deed_is_not_what_it_depends_on() -> None:
    assert found("I go left unless the car ahead is faster than 30 m/s.", LEFT) == {}
    assert found("I go left if the car ahead is faster than 30 m/s.", LEFT) == {
        "missing-condition": "nothing in it depends on the speed of another vehicle"
    }


def test_a_way_back_in_somebodys_words_is_not_promised_beside_other_deeds() -> None:
    both = program("set_target_lane(get_left_lane(ego))", "set_target_speed(30.0)")
    assert "not-done" not in found('You said "return to your lane". I speed up to 30 m/s.', both)
    assert found("I return to my old lane. I speed up to 30 m/s.", both)["not-done"].startswith("it never goes back")


def test_who_does_nothing_does_not_turn() -> None:
    assert found("I do nothing.", TURN_LEFT, CROSSING)["not-claimed"] == "it turns left"
    assert found("I do nothing.", IDLE, CROSSING) == {}


# Lanes, turns, stops --------------------------------------------------------------------------------------------------


def test_to_pull_over_means_to_the_right() -> None:
    assert found("I pull over.", LEFT) == {"wrong-side": "it changes lanes to the left"}
    assert found("I pull over.", LEFT.replace("left", "right")) == {}


def test_the_outermost_lane_is_no_number_of_lanes() -> None:
    assert found("I move to the leftmost lane.", LEFT) == {}
    assert found("I move two lanes to the left.", LEFT) == {"wrong-number": "it crosses 1 lane at most"}


def test_a_turn_that_is_denied_is_not_taken() -> None:
    assert found("We do not turn left.", TURN_LEFT, CROSSING) == {"not-claimed": "it turns left"}
    assert found("We do not turn right.", TURN_LEFT, CROSSING).keys() == {"not-claimed"}
    assert judge("We do not turn right.", read_facts(TURN_LEFT), CROSSING).mismatches[0].sentence == ""


def test_a_turn_may_be_driven_as_a_change_of_lanes_to_its_side() -> None:
    assert "not-done" not in found("We turn left.", LEFT, CROSSING)
    assert found("We turn right.", LEFT, CROSSING)["not-done"] == "it chooses no way over the intersection"


def test_a_stop_that_is_denied_is_not_made() -> None:
    (mismatch, *_) = judge("We do not stop.", read_facts(STAND), HIGHWAY).mismatches
    assert (mismatch.kind, mismatch.sentence, mismatch.instead) == ("not-claimed", "We do not stop.", "it stops")
    assert found("We do not stop here. We stop at the exit.", STAND) == {}
    assert found("We do not stop.", IDLE) == {}


def test_a_lane_that_reading_cannot_tell_is_the_one_that_was_driven_to() -> None:
    unknown = program("set_target_lane({'a': get_left_lane(ego)}['a'])")
    facts = read_facts(unknown)
    assert [event.sides for event in facts.events] == [frozenset()]
    went_left = Effect(-1, -1, 0, (25.0, 25.0), (25.0, 25.0))
    assert judge("I go right.", facts, HIGHWAY).aligned
    assert judge("I go left.", facts, HIGHWAY, [went_left]).aligned
    (mismatch,) = judge("I go right.", facts, HIGHWAY, [went_left]).mismatches
    assert (mismatch.kind, mismatch.instead) == ("wrong-side", "it changes lanes to the left")


# Honest texts ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "source"),
    [
        ("I slow down without changing lanes.", SLOWER),
        ("I come to a stop without going left.", STAND),
        ("You want to drive on without stopping. I stop.", STAND),
        ("I go no faster than 20 m/s.", SLOWER),
        ("I do not keep a gap of 30 m.", IDLE),
        ("I go by the limit.", program("set_target_speed(get_speed_limit())")),
        ("I check the speed limit and drive at it.", program("set_target_speed(get_speed_limit())")),
        ("With a gain of 0.5 I get to a speed of 20 m/s.", SLOWER),
        ("I keep a gap of 60 divided by 2.", program("set_desired_time_headway(2.0)")),
        ("The gap stays unchanged.", program("set_desired_time_headway(get_desired_time_headway())")),
    ],
)
def test_what_is_true_is_believed(text: str, source: str) -> None:
    assert found(text, source) == {}


# What then happened ---------------------------------------------------------------------------------------------------

STEADY = Effect(0, 0, 0, (25.0, 25.0), (25.0, 25.0), (40.0, 40.0))
WENT_LEFT = replace(STEADY, lanes_moved=-1, leftmost=-1)


def driven(text: str, source: str, effect: Effect) -> tuple[Mismatch, ...]:
    return judge_drive(text, read_facts(source), HIGHWAY, effect).mismatches


@pytest.mark.parametrize(
    ("text", "after_m", "told"),
    [
        ("I leave more room to the car ahead.", 20.0, "the gap went from 40 m to 20 m in this drive"),
        ("I leave more room to the car ahead.", 37.9, "the gap went from 40 m to 38 m in this drive"),
        ("I leave more room to the car ahead.", 38.0, None),
        ("I leave more room to the car ahead.", 0.5, "the gap went from 40 m to 0 m in this drive"),
        ("I leave more room to the car ahead.", 0.0, "the gap went from 40 m to 0 m in this drive"),
        ("I leave more room to the car ahead.", 60.0, None),
        ("I close up to the car ahead.", 60.0, "the gap went from 40 m to 60 m in this drive"),
        ("I close up to the car ahead.", 20.0, None),
        ("I leave more room to the car ahead.", -5.0, None),  # it is behind by now
        ("I leave more room to the car ahead.", None, None),
    ],
)
def test_a_gap_that_went_the_other_way(text: str, after_m: float | None, told: str | None) -> None:
    wanted = 3.0 if "more" in text else 1.0
    effect = replace(STEADY, gaps_m=(40.0, after_m))
    mismatches = driven(text, program(f"set_desired_time_headway({wanted})"), effect)
    assert [one.instead for one in mismatches] == ([] if told is None else [told])
    assert all(one.kind == "wrong-sign" for one in mismatches)
    assert not driven(text, program(f"set_desired_time_headway({wanted})"), replace(effect, cut=True))


def test_a_gap_to_nobody_is_not_judged() -> None:
    wider = program("set_desired_time_headway(3.0)")
    assert not driven("I leave more room to the car ahead.", wider, replace(STEADY, gaps_m=(None, 10.0)))


def test_of_two_lane_changes_the_one_that_was_not_driven_is_told() -> None:
    text = "I go left and then to the right lane."
    (mismatch,) = driven(text, LEFT_THEN_RIGHT, WENT_LEFT)
    assert (mismatch.kind, mismatch.instead) == ("not-done", "in this drive it only changed lanes to the left")
    assert not driven(text, LEFT_THEN_RIGHT, replace(WENT_LEFT, cut=True))
    assert not driven(text, LEFT_THEN_RIGHT, replace(WENT_LEFT, lanes_moved=0, rightmost=1))


def test_a_stop_that_did_not_come() -> None:
    (mismatch,) = driven("We stop.", STAND, STEADY)
    assert (mismatch.kind, mismatch.instead) == ("not-done", "it did not come to a stop in this drive")
    assert not driven("We stop.", STAND, replace(STEADY, cut=True))
    assert not driven("We stop.", STAND, replace(STEADY, speeds_mps=(25.0, 0.0), extremes_mps=(0.0, 25.0)))


def test_a_speed_that_changes_little_is_not_looked_for() -> None:
    little, much = program("set_target_speed(23.5)"), program("set_target_speed(22.5)")
    assert not driven("I slow down.", little, STEADY)
    (mismatch,) = driven("I slow down.", much, STEADY)
    assert mismatch.instead == "it was never slower than 25.0 m/s in this drive"


def test_what_reading_cannot_tell_is_told_after_the_drive_that_showed_it() -> None:
    """The program's speed is not known: that it fell is known only from the drive."""
    unknown = program("set_target_speed({'a': 1.0}['a'])")
    fell = replace(STEADY, speeds_mps=(25.0, 12.0), extremes_mps=(12.0, 25.0))
    assert [(one.kind, one.instead) for one in driven("I speed up.", unknown, fell)] == [
        ("wrong-sign", "it drives slower"),
        ("not-done", "it was never faster than 25.0 m/s in this drive"),
    ]


# Scores and words -----------------------------------------------------------------------------------------------------


def test_what_cannot_be_read_is_compared_with_nothing() -> None:
    assert judge("I go left.", read_facts("def ("), HIGHWAY) == Faithfulness(True, 1.0, (), 0)


@pytest.mark.parametrize(
    ("text", "source", "score", "claims"),
    [
        ("I go left.", LEFT_AT_ONCE, 1.0, 1),
        ("It is sunny.", IDLE, 1.0, 0),
        ("I go right.", LEFT_AT_ONCE, 0.0, 1),
        ("I drive on.", LEFT_AT_ONCE, 0.0, 0),
        # One of three claims is wrong: the two that hold, against the one that counts twice.
        ("I go right. I speed up. I keep a headway of 2 seconds.", None, 0.5, 3),
        # Two of five are wrong.
        ("I go right. I slow down. I speed up. I keep a headway of 2 seconds. I go left.", None, 3 / 7, 5),
    ],
)
def test_a_mismatch_weighs_as_much_as_two_claims_that_hold(
    text: str, source: str | None, score: float, claims: int
) -> None:
    many = program("set_target_lane(get_left_lane(ego))", "set_target_speed(30.0)", "set_desired_time_headway(2.0)")
    found = judge(text, read_facts(source or many), HIGHWAY)
    assert (found.score, found.claims, found.aligned) == (pytest.approx(score), claims, score == 1.0)
    assert type(found.aligned) is bool


def test_scores_and_claims_in_words() -> None:
    assert score_words(Faithfulness(True, 1.0, (), 2)) == "score 1.00 of 1, 2 claims compared"
    assert mismatch_words(Mismatch("wrong-side", "Left.", "right")) == "wrong side: “Left.”, but right"
    assert mismatch_words(Mismatch("not-done", "Left.", "not", 0)) == "claimed but not done: “Left.”, but not (line 0)"


REMEDY = "Let the thoughts say what the program does, or the program do what the thoughts say."


def test_the_check_in_full(snap: Callable[..., Observation]) -> None:
    def checked(text: str, source: str, library: str = "") -> Verdict:
        return check_faithfulness(Plan(Thoughts(text), Program(source, library=library)), snap(), Limits())

    parameters = check_faithfulness(Plan(Thoughts("I go."), Parameters(1.0, 1.0, 1.0)), snap(), Limits())
    not_compared = {
        "no-explanation": checked(" \n", LEFT),
        "no-program": parameters,
        "unreadable": checked("I go left.", "def ("),
        "no-claims": checked("Nice weather today.", LEFT),
    }
    assert {one.not_compared for one in not_compared.values()} == set(not_compared)
    assert all(one.mark == "not_compared" and not one.stops for one in not_compared.values())
    assert checked("I go left.", IDLE, "def (").not_compared == "unreadable"
    fits = checked("I go left.", LEFT_AT_ONCE)
    assert fits == Verdict(
        "alignment-v1", True, "The explanation fits the program (1 claim compared).",
        vetoes=False, alignment=Faithfulness(True, 1.0, (), 1),
    )  # fmt: skip
    found = (
        Mismatch("wrong-number", "I wait 5 seconds.", "it has no such number, not 5 seconds"),
        Mismatch("wrong-side", "I go right.", "it changes lanes to the left", 3),
    )
    assert checked("I wait 5 seconds. I go right.", LEFT_AT_ONCE) == Verdict(
        "alignment-v1",
        False,
        "The explanation does not fit the program (score 0.00 of 1, 2 claims compared). Wrong number: “I wait 5 "
        "seconds.”, but it has no such number, not 5 seconds. Wrong side: “I go right.”, but it changes lanes to the "
        "left (line 3).",
        3,
        REMEDY,
        vetoes=False,
        alignment=Faithfulness(False, 0.0, found, 2),
    )


def test_the_check_goes_by_the_place_of_the_car(snap: Callable[..., Observation]) -> None:
    told = Plan(Thoughts("I speed up."), Program(FASTER))
    assert check_faithfulness(told, snap(speed=25.0), Limits()).passed
    assert "it drives slower" in check_faithfulness(told, snap(speed=35.0), Limits()).reason
    crossing = Plan(Thoughts("I go left."), Program(TURN_LEFT))
    assert check_faithfulness(crossing, snap(kind="intersection"), Limits()).passed


def test_the_check_of_a_drive_in_full(snap: Callable[..., Observation]) -> None:
    plan = Plan(Thoughts("I go left."), Program(LEFT_AT_ONCE))
    name = "alignment-driven-v1"
    assert check_driven(plan, snap(), WENT_LEFT) == Verdict(
        name, True, "The drive went as explained (1 claim compared).",
        vetoes=False, alignment=Faithfulness(True, 1.0, (), 1),
    )  # fmt: skip
    assert check_driven(plan, snap(), replace(WENT_LEFT, failed=True)).not_compared == "policy-failed"
    wrong = Mismatch("not-done", "I go left.", "it did not change lanes in this drive")
    assert check_driven(plan, snap(), STEADY) == Verdict(
        name,
        False,
        "The drive did not go as explained (score 0.00 of 1, 1 claim compared). Claimed but not done: “I go left.”, "
        "but it did not change lanes in this drive.",
        None,
        REMEDY,
        vetoes=False,
        alignment=Faithfulness(False, 0.0, (wrong,), 1),
    )
    crossing = Plan(Thoughts("We turn left."), Program(TURN_LEFT))
    assert check_driven(crossing, snap(kind="intersection"), replace(STEADY, turned=-1)).passed
    round_it_went = check_driven(crossing, snap(kind="intersection"), replace(STEADY, turned=2))
    assert round_it_went.state == "failed", "half a turn is none to the left, and no fault of the check"
    twice = Plan(Thoughts("We turn left. Then we turn right."), Program(TURN_LEFT))
    assert check_driven(twice, snap(kind="intersection"), replace(STEADY, turned=0)).state == "held"
    faster = Plan(Thoughts("I speed up."), Program(FASTER))
    risen = replace(STEADY, speeds_mps=(20.0, 30.0), extremes_mps=(20.0, 30.0))
    assert check_driven(faster, snap(speed=20.0), risen).passed


@pytest.mark.parametrize(
    ("text", "end_mps", "told"),
    [
        ("I speed up.", 24.0, ["it drives slower"]),
        ("I speed up.", 24.1, []),
        ("I speed up.", 25.0, []),
        ("I slow down.", 25.0, []),
        ("I slow down.", 25.9, []),
        ("I slow down.", 26.0, ["it drives faster"]),
    ],
)
def test_a_speed_that_hardly_changed_where_it_was_run_went_no_way(text: str, end_mps: float, told: list[str]) -> None:
    unknown = read_facts(program("set_target_speed({'a': 1.0}['a'])"))
    ran = replace(STEADY, speeds_mps=(25.0, end_mps))
    assert [one.instead for one in judge(text, unknown, HIGHWAY, [ran]).mismatches] == told


@pytest.mark.parametrize(
    ("end_mps", "told"),
    [
        (28.0, []),
        (27.1, []),
        (27.0, ["it has no such number, not 28 m/s"]),
        (-28.0, ["it has no such number, not 28 m/s"]),
        (30.0, ["it has no such number, not 28 m/s"]),
    ],
)
def test_a_number_that_reading_cannot_find_is_the_speed_that_was_driven(end_mps: float, told: list[str]) -> None:
    unknown = read_facts(program("set_target_speed({'a': 1.0}['a'])"))
    ran = replace(STEADY, speeds_mps=(20.0, end_mps))
    assert [one.instead for one in judge("I set the speed to 28 m/s.", unknown, HIGHWAY, [ran]).mismatches] == told


# Words ----------------------------------------------------------------------------------------------------------------


def test_words_and_phrases_are_listed_in_plain_text() -> None:
    assert words.listed("a  b\nc b") == {"a", "b", "c"}
    assert words.phrases(" if/as soon as/ \nonce ") == (("if",), ("as", "soon", "as"), ("once",))


# Where the car is -----------------------------------------------------------------------------------------------------


def test_the_surroundings_are_those_of_the_observation(snap: Callable[..., Observation]) -> None:
    lead = Lead(7, 40.0, 22.0)
    there = replace(snap(speed=25.0, limits=(20.0, 31.0, 33.0), front=lead), stop_sign_m=50.0)
    assert FactSurroundings.of(there) == FactSurroundings(25.0, 31.0, 40.0, 22.0, 50.0, False)
    bare = snap(speed=10.0, index=None, kind="intersection")
    assert FactSurroundings.of(bare) == FactSurroundings(10.0, None, None, None, None, True)


def test_events_are_given_with_their_places() -> None:
    facts = read_facts(program("set_target_speed(30.0)", "set_target_lane(get_left_lane(ego))", "say('there')"))
    assert [(place, event.deed) for place, event in facts.of("lane")] == [(1, "lane")]
    assert [(place, event.deed) for place, event in facts.of("say", "speed")] == [(0, "speed"), (2, "say")]
    assert list(facts.of("turn")) == []
