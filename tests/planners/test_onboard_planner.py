"""From a wish and a situation to a program, or to a refusal that says why."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chauffeur.concept import (
    LAMPILOT_LIMITS,
    ConfigError,
    Context,
    Feedback,
    History,
    HistoryItem,
    Instruction,
    Lead,
    Limits,
    Plan,
    PlanRequest,
    Program,
    Round,
    Situation,
    SystemMessage,
)
from chauffeur.planners.base import Planner
from chauffeur.planners.onboard import RetrievalPlanner
from chauffeur.planners.onboard.exemplars import Filled, exemplars, program_of
from chauffeur.planners.onboard.exemplars.library import number
from chauffeur.programs import check_source

HIGHWAY = Situation("highway", 25.0, 31.2928, 3, 1, False, Lead(3, 43.0, 24.0), None)
EMPTY = replace(HIGHWAY, front=None)
SHOULDER = Situation("highway", 25.0, 31.2928, 4, 1, True, None, None)
CROSSING = Situation("intersection", 10.0, 10.0, 1, 0, False, None, 85.0, ("left", "straight", "right"))


def plan(words: str, situation: Situation = HIGHWAY, **fields: Any) -> Plan:
    """The plan, if need be after one yes."""
    request = PlanRequest(Instruction(words), Context("", situation), SystemMessage(""), **fields)
    made = asyncio.run(RetrievalPlanner().plan(request))
    if not made.offer:
        return made
    confirmed = Instruction(made.offer, confirmed=made.refusal)
    return asyncio.run(RetrievalPlanner().plan(replace(request, instruction=confirmed)))


def source(made: Plan) -> str:
    assert isinstance(made.policy, Program), made.refusal
    return made.policy.source


def setting(made: Plan, name: str) -> float:
    return dict(made.settings)[name]


def test_is_a_planner_with_versioned_rules() -> None:
    planner = RetrievalPlanner.from_spec("")
    assert isinstance(planner, Planner)
    assert (planner.id, planner.model) == ("retrieval", "meaning-v2")
    with pytest.raises(ConfigError):
        RetrievalPlanner.from_spec("large")


# Exemplars --------------------------------------------------------------------------------------------------------

_NUMBERS = {name: 1.5 for exemplar in exemplars().values() for name in exemplar.numbers}
_NUMBERS |= {"moves": 2, "right_allowed": True, "cross_ticks": 100}


def test_there_are_enough_exemplars_and_no_two_alike() -> None:
    assert len(exemplars()) >= 60
    assert len({exemplar.text for exemplar in exemplars().values()}) == len(exemplars())
    assert len({exemplar.title for exemplar in exemplars().values()}) == len(exemplars())


@pytest.mark.parametrize("name", exemplars())
def test_exemplar_passes_the_gate_and_explains_itself(name: str) -> None:
    text = program_of([Filled(name, _NUMBERS)])
    assert check_source(text).findings == ()
    assert "#" in text
    assert "$" not in text
    assert "@" not in text


@pytest.mark.parametrize("name", exemplars())
def test_exemplar_can_be_followed_by_another(name: str) -> None:
    text = program_of([Filled(name, _NUMBERS), Filled(name, _NUMBERS), Filled("pull_over.smooth", _NUMBERS)])
    assert check_source(text).passed


_WISHES = {
    "speed up by 5 mph": (HIGHWAY, "speed.increase", "target_speed_mps", 27.24),
    "drive at 20 m/s": (HIGHWAY, "speed.set", "target_speed_mps", 20.0),
    "go half as fast": (HIGHWAY, "speed.decrease", "target_speed_mps", 12.5),
    "faster": (HIGHWAY, "speed.increase", "target_speed_mps", 28.0),
    "a bit faster": (HIGHWAY, "speed.increase", "target_speed_mps", 26.5),
    "slow down": (HIGHWAY, "speed.decrease", "target_speed_mps", 22.0),
    "do 65": (HIGHWAY, "speed.set", "target_speed_mps", 29.06),
    "keep this speed": (HIGHWAY, "speed.hold", "target_speed_mps", 25.0),
    "match the car ahead's speed": (HIGHWAY, "speed.match", "target_speed_mps", 24.0),
    "match traffic": (EMPTY, "speed.match", "target_speed_mps", 31.29),
    "drive at the speed limit": (HIGHWAY, "speed.limit", "target_speed_mps", 31.29),
    "5 mph under the limit": (HIGHWAY, "speed.limit", "target_speed_mps", 29.06),
    "never faster than 27 m/s": (HIGHWAY, "speed.cap", "target_speed_mps", 27.0),
    "follow at 30 meters": (HIGHWAY, "gap.set", "gap_m", 30.0),
    "10 meters closer": (HIGHWAY, "gap.decrease", "gap_m", 33.0),
    "drop back by 10 m": (HIGHWAY, "gap.increase", "gap_m", 53.0),
    "double the gap": (HIGHWAY, "gap.increase", "gap_m", 86.0),
    "back off": (HIGHWAY, "gap.increase", "gap_m", 60.2),
    "two seconds behind please": (HIGHWAY, "gap.time", "time_headway_s", 2.0),
    "leave more room": (EMPTY, "gap.increase", "time_headway_s", 1.9),
    "I'm in a hurry": (HIGHWAY, "style.hurry", "target_speed_mps", 28.75),
    "no rush": (HIGHWAY, "style.relax", "time_headway_s", 2.0),
    "pull over": (SHOULDER, "pull_over", "target_speed_mps", 0.0),
    "stop": (CROSSING, "stop", "target_speed_mps", 0.0),
}


@pytest.mark.parametrize("words", _WISHES)
def test_intent_and_numbers(words: str) -> None:
    situation, intent, name, value = _WISHES[words]
    made = plan(words, situation)
    assert made.intent == intent
    assert setting(made, name) == pytest.approx(value, abs=0.01)
    assert check_source(source(made)).findings == ()


@pytest.mark.parametrize("words", _WISHES)
def test_thoughts_name_the_programs_numbers(words: str) -> None:
    situation, _, name, value = _WISHES[words]
    made = plan(words, situation)
    written = number(setting(made, name))
    if value:
        assert written in made.thoughts.text
        if made.intent not in ("speed.match", "speed.limit"):
            assert written in source(made)


@pytest.mark.parametrize(
    ("words", "situation", "api"),
    [
        ("change to the left lane", HIGHWAY, "get_left_lane"),
        ("change to the right lane", HIGHWAY, "get_right_lane"),
        ("overtake on the left", HIGHWAY, "get_left_lane"),
        ("turn left", CROSSING, "turn_left_at_next_intersection"),
        ("turn right", CROSSING, "turn_right_at_next_intersection"),
        ("go left", CROSSING, "turn_left_at_next_intersection"),
        ("go straight on", CROSSING, "go_straight_at_next_intersection"),
    ],
)
def test_the_side_asked_for_is_the_side_driven(words: str, situation: Situation, api: str) -> None:
    text = source(plan(words, situation))
    assert api in text
    opposite = {"left": "right", "right": "left"}
    for side, other in opposite.items():
        if f"get_{side}_lane" in api:
            assert f"set_target_lane(get_{other}_lane" not in text
        if f"turn_{side}" in api:
            assert f"turn_{other}" not in text


# Refusals ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "situation", "says"),
    [
        ("change to the left lane", replace(HIGHWAY, lane_index=0), "leftmost"),
        ("change to the right lane", replace(HIGHWAY, lane_index=2), "rightmost"),
        ("move right", replace(SHOULDER, lane_index=2), "emergency lane"),
        ("change lanes", HIGHWAY, "left or right"),
        ("overtake", EMPTY, "no vehicle ahead"),
        ("overtake on the right", replace(HIGHWAY, lane_index=2), "cannot overtake on the right"),
        ("follow that car", EMPTY, "no vehicle ahead"),
        ("keep 20 meters behind the car", EMPTY, "no vehicle ahead"),
        ("turn left", HIGHWAY, "no junction ahead"),
        ("turn left", replace(CROSSING, turns=("straight", "right")), "cannot turn left"),
        ("change to the left lane", CROSSING, "one lane"),
        ("pull over", HIGHWAY, "no emergency lane"),
        ("stop the car", HIGHWAY, "do not stop in a lane"),
        ("faster", replace(HIGHWAY, speed_mps=31.29), "already drive"),
        ("closer", replace(HIGHWAY, front=Lead(3, 20.0, 25.0)), "closer than"),
        ("play some jazz", HIGHWAY, "I only drive"),
        ("schneller bitte", HIGHWAY, "English only"),
        ("blah blah", HIGHWAY, "did not understand"),
    ],
)
def test_impossible_wishes_are_refused_in_words(words: str, situation: Situation, says: str) -> None:
    made = plan(words, situation)
    assert made.policy is None
    assert says in made.refusal
    assert made.settings == ()


def test_what_is_not_understood_lists_what_is_possible() -> None:
    refusal = plan("xyzzy plugh").refusal
    assert all(word in refusal for word in ("faster", "lanes", "overtake", "pull over"))


def test_what_the_person_names_is_not_edited() -> None:
    fast = plan("drive at 200 km/h")
    assert setting(fast, "target_speed_mps") == pytest.approx(55.56, abs=0.01)
    assert "55.56" in source(fast)
    close = plan("follow at two meters")
    assert setting(close, "gap_m") == 2.0


# Limits -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("limits", [Limits(), LAMPILOT_LIMITS, Limits(min_time_headway_s=0.9)])
@pytest.mark.parametrize(
    "words", ["faster", "closer", "15 m closer", "change lanes to the left", "overtake", "hurry up"]
)
def test_own_headways_stay_inside_the_limits(words: str, limits: Limits) -> None:
    text = source(plan(words, limits=limits))
    for line in text.splitlines():
        if "set_desired_time_headway(" in line:
            value = float(line.split("(")[1].rstrip(")"))
            assert value >= limits.min_time_headway_s


def test_own_speeds_respect_a_persons_cap() -> None:
    made = plan("go faster", limits=Limits(max_speed_mps=26.0))
    assert setting(made, "target_speed_mps") == 26.0


# Person -----------------------------------------------------------------------------------------------------------


def item(feedback: Feedback, when: str = "2026-01-01T10:00:00Z", **fields: Any) -> HistoryItem:
    base = HistoryItem(
        trip_id="t1",
        when=when,
        instruction="I'm in a hurry",
        context="",
        world="highway",
        intent="style.hurry",
        thoughts="",
        policy="",
        settings=(("target_speed_mps", 28.75),),
        feedback=(feedback,),
    )
    return replace(base, **fields)


def test_feedback_lowers_the_next_hurry_and_says_so() -> None:
    plain = plan("I am late for work")
    told = plan("I am late for work", history=History((item(Feedback("a bit too fast", speed=-1, strength=0.35)),)))
    assert setting(told, "target_speed_mps") < setting(plain, "target_speed_mps")
    assert "a bit too fast" in told.thoughts.text
    assert "2026-01-01" in told.thoughts.text


def test_feedback_adds_up_and_the_newest_counts() -> None:
    first = item(Feedback("too slow", speed=1, strength=1.0), when="2026-01-01T00:00:00Z")
    later = item(
        Feedback("too fast", speed=-1, strength=0.6),
        when="2026-02-01T00:00:00Z",
        settings=(("personal_speed_mps", -1.4),),
    )
    made = plan("I'm in a hurry", history=History((first, later)))
    assert setting(made, "personal_speed_mps") == pytest.approx(-3.8)


def test_feedback_on_the_gap_and_on_other_wishes() -> None:
    close = item(Feedback("too close", gap=-1, strength=1.0))
    assert setting(plan("hurry up", history=History((close,))), "time_headway_s") == pytest.approx(1.7)
    other = item(Feedback("too fast", speed=-1, strength=1.0), intent="gap.decrease")
    assert plan("hurry up", history=History((other,))).settings == plan("hurry up").settings


def test_explicit_numbers_are_not_personalised() -> None:
    history = History((item(Feedback("too fast", speed=-1, strength=1.0), intent="speed.set"),))
    assert setting(plan("drive at 28 m/s", history=history), "target_speed_mps") == 28.0


def test_feedback_rounds_correct_the_same_wish() -> None:
    first = plan("slow down")
    second = plan("slow down", rounds=(Round("", "still too fast, slower please"),))
    assert setting(second, "target_speed_mps") < setting(first, "target_speed_mps")


# Always -----------------------------------------------------------------------------------------------------------

_SITUATIONS = st.sampled_from([HIGHWAY, EMPTY, SHOULDER, CROSSING, replace(HIGHWAY, lane_index=0)])
_TEXTS = st.one_of(st.text(max_size=80), st.sampled_from([*_WISHES, "overtake, then pull over", "turn left"]))


@settings(max_examples=200, deadline=None)
@given(text=_TEXTS, situation=_SITUATIONS)
def test_every_plan_is_a_program_in_the_language_or_a_refusal(text: str, situation: Situation) -> None:
    made = plan(text, situation)
    assert (made.policy is None) == bool(made.refusal)
    assert made.thoughts.text
    if made.policy is not None:
        assert check_source(source(made)).passed


@pytest.mark.parametrize("words", _WISHES)
def test_same_request_same_plan_within_milliseconds(words: str) -> None:
    situation = _WISHES[words][0]
    plans = [replace(plan(words, situation), latency_s=0.0) for _ in range(2)]
    assert plans[0] == plans[1]
    assert min(plan(words, situation).latency_s for _ in range(5)) < 0.005


def test_a_bare_number_takes_the_unit_that_fits_the_direction() -> None:
    # 80 mph would be a speed-up from 25 m/s; 80 km/h slows down, as the person said.
    slower = plan("slow down to 80", EMPTY)
    assert setting(slower, "target_speed_mps") == pytest.approx(80 / 3.6, abs=0.01)
    assert "km/h" in slower.thoughts.text
    faster = plan("speed up to 65", EMPTY)
    assert setting(faster, "target_speed_mps") == pytest.approx(65 * 0.44704, abs=0.01)


@pytest.mark.parametrize(
    ("words", "gap_m"), [("keep 4 car lengths", 20.0), ("leave fifty feet", 15.24), ("keep 30 metres", 30.0)]
)
def test_a_distance_to_keep_is_a_gap(words: str, gap_m: float) -> None:
    assert setting(plan(words), "gap_m") == pytest.approx(gap_m, abs=0.01)


def test_neither_side_is_straight_on() -> None:
    assert plan("Turn neither left nor right.", CROSSING).intent == "turn.straight"


def test_overtaking_keeps_to_the_sign_unless_the_operator_allows_more() -> None:
    assert setting(plan("overtake on the left"), "target_speed_mps") == pytest.approx(31.29, abs=0.01)
    wide = plan("overtake on the left", limits=LAMPILOT_LIMITS)
    assert setting(wide, "target_speed_mps") > 31.3


LEFTMOST = replace(HIGHWAY, lane_index=0)


@pytest.mark.parametrize(
    ("words", "situation", "intent"),
    [
        ("leave the right lane", HIGHWAY, "lane.left"),
        ("get out of the left lane", LEFTMOST, "lane.right"),
        ("don't stay in this lane", LEFTMOST, "lane.right"),
        ("don't leave so much space", HIGHWAY, "gap.decrease"),
        ("I wouldn't mind a slower ride", HIGHWAY, "speed.decrease"),
        ("I wouldn't mind going a bit faster", HIGHWAY, "speed.increase"),
    ],
)
def test_leaving_and_not_minding_keep_their_direction(words: str, situation: Situation, intent: str) -> None:
    assert plan(words, situation).intent == intent
