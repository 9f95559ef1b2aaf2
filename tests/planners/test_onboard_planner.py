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
from chauffeur.concept.utterance import Act, Utterance
from chauffeur.models.meaning.labelled import act_of
from chauffeur.planners.meaning import MeaningPlanner
from chauffeur.planners.onboard.exemplars import Filled, exemplars, program_of
from chauffeur.planners.onboard.exemplars.library import number
from chauffeur.programs import check_source
from chauffeur.programs.library import standalone

HIGHWAY = Situation("highway", 25.0, 31.2928, 3, 1, False, Lead(3, 43.0, 24.0), None)
EMPTY = replace(HIGHWAY, front=None)
SHOULDER = Situation("highway", 25.0, 31.2928, 4, 1, True, None, None)
CROSSING = Situation("intersection", 10.0, 10.0, 1, 0, False, None, 85.0, ("left", "straight", "right"))


def acts(said: str) -> tuple[Act, ...]:
    """Acts of a label, with its number behind a bar: `speed VALUE | 20 m/s`."""
    label, _, amount = said.partition(" | ")
    value, _, unit = amount.partition(" ")
    found = (act_of(part) for part in label.split(" + "))
    return tuple(replace(act, value=float(value), unit=unit) if valued else act for act, valued, _ in found)


def plan(said: str, situation: Situation = HIGHWAY, **fields: Any) -> Plan:
    """The plan for some acts."""
    request = PlanRequest(Instruction(said, source="benchmark"), Context("", situation), SystemMessage(""), **fields)
    return MeaningPlanner().plan_of(Utterance(said, acts(said)), request)


def source(made: Plan) -> str:
    """The bodies that drive, and the program over them."""
    assert isinstance(made.policy, Program), made.refusal
    return standalone(made.policy.source, "drive", made.policy.library)


def setting(made: Plan, name: str) -> float:
    return dict(made.settings)[name]


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
    "speed direction:faster measure:by VALUE | 5 mph": (HIGHWAY, "speed.increase", "target_speed_mps", 27.24),
    "speed VALUE | 20 m/s": (HIGHWAY, "speed.set", "target_speed_mps", 20.0),
    "speed measure:times VALUE | 0.5 share": (HIGHWAY, "speed.decrease", "target_speed_mps", 12.5),
    "speed direction:faster": (HIGHWAY, "overtake+speed.increase", "target_speed_mps", 28.0),
    "speed direction:faster degree:bit": (HIGHWAY, "overtake+speed.increase", "target_speed_mps", 26.5),
    "speed direction:slower": (HIGHWAY, "speed.decrease", "target_speed_mps", 22.0),
    "speed VALUE | 65": (HIGHWAY, "speed.set", "target_speed_mps", 29.06),
    "speed direction:same": (HIGHWAY, "speed.hold", "target_speed_mps", 25.0),
    "speed direction:same T K:vehicle where:ahead": (HIGHWAY, "speed.match", "target_speed_mps", 24.0),
    "speed aim:traffic": (EMPTY, "speed.match", "target_speed_mps", 31.29),
    "speed aim:limit": (HIGHWAY, "speed.limit", "target_speed_mps", 31.29),
    "speed measure:under_limit VALUE | 5 mph": (HIGHWAY, "speed.limit", "target_speed_mps", 29.06),
    "speed measure:at_most VALUE | 27 m/s": (HIGHWAY, "speed.cap", "target_speed_mps", 27.0),
    "gap VALUE | 30 m": (HIGHWAY, "gap.set", "gap_m", 30.0),
    "gap direction:less measure:by VALUE | 10 m": (HIGHWAY, "gap.decrease", "gap_m", 33.0),
    "gap direction:more measure:by VALUE | 10 m": (HIGHWAY, "gap.increase", "gap_m", 53.0),
    "gap measure:times VALUE | 2 share": (HIGHWAY, "gap.increase", "gap_m", 86.0),
    "gap direction:more": (HIGHWAY, "gap.increase", "gap_m", 60.2),
    "gap VALUE | 2 s": (HIGHWAY, "gap.time", "time_headway_s", 2.0),
    "gap direction:more T K:car": (EMPTY, "gap.increase", "time_headway_s", 1.9),
    "speed direction:faster style:hurry": (HIGHWAY, "overtake+style.hurry", "target_speed_mps", 28.75),
    "go style:relaxed": (HIGHWAY, "style.relax", "time_headway_s", 2.0),
    "pull_over": (SHOULDER, "pull_over", "target_speed_mps", 0.0),
    "stop": (CROSSING, "stop", "target_speed_mps", 0.0),
}


@pytest.mark.parametrize("words", _WISHES)
def test_intent_and_numbers_which_program_and_thoughts_name(words: str) -> None:
    situation, intent, name, value = _WISHES[words]
    made, again = (replace(plan(words, situation), latency_s=0.0) for _ in range(2))
    assert made == again
    assert made.intent == intent
    assert setting(made, name) == pytest.approx(value, abs=0.01)
    assert check_source(source(made)).findings == ()
    written = number(setting(made, name))
    assert not value or written in made.thoughts.text
    assert not value or intent in ("speed.match", "speed.limit") or written in source(made)


@pytest.mark.parametrize(
    ("words", "situation", "api"),
    [
        ("lane side:left", HIGHWAY, "get_left_lane"),
        ("lane side:right", HIGHWAY, "get_right_lane"),
        ("pass side:left", HIGHWAY, "get_left_lane"),
        ("turn side:left", CROSSING, "turn_left_at_next_intersection"),
        ("turn side:right", CROSSING, "turn_right_at_next_intersection"),
        ("lane side:left", CROSSING, "turn_left_at_next_intersection"),
        ("straight", CROSSING, "go_straight_at_next_intersection"),
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
        ("lane side:left", replace(HIGHWAY, lane_index=0), "leftmost"),
        ("lane side:right", replace(HIGHWAY, lane_index=2), "rightmost"),
        ("lane side:right", replace(SHOULDER, lane_index=2), "emergency lane"),
        ("lane", HIGHWAY, "left or right"),
        ("pass", EMPTY, "no vehicle ahead"),
        ("pass side:right", replace(HIGHWAY, lane_index=2), "cannot overtake on the right"),
        ("follow T K:car", EMPTY, "no vehicle ahead"),
        ("gap VALUE | 20 m", EMPTY, "no vehicle ahead"),
        ("turn side:left", HIGHWAY, "no junction ahead"),
        ("turn side:left", replace(CROSSING, turns=("straight", "right")), "cannot turn left"),
        ("pull_over", HIGHWAY, "no emergency lane"),
        ("stop", HIGHWAY, "do not stop in a lane"),
        ("speed direction:faster", replace(HIGHWAY, speed_mps=31.29), "already drive"),
        ("gap direction:less", replace(HIGHWAY, front=Lead(3, 20.0, 25.0)), "closer than"),
    ],
)
def test_impossible_wishes_are_refused_in_words(words: str, situation: Situation, says: str) -> None:
    made = plan(words, situation)
    assert made.policy is None
    assert says in made.refusal
    assert made.settings == ()


def test_what_the_person_names_is_not_edited() -> None:
    fast = plan("speed VALUE | 200 km/h")
    assert setting(fast, "target_speed_mps") == pytest.approx(55.56, abs=0.01)
    assert "55.56" in source(fast)
    close = plan("gap VALUE | 2 m")
    assert setting(close, "gap_m") == 2.0


# Limits -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("limits", [Limits(), LAMPILOT_LIMITS, Limits(min_time_headway_s=0.9)])
@pytest.mark.parametrize(
    "words",
    ["speed direction:faster", "gap direction:less", "lane side:left", "pass", "go style:hurry"],
)
def test_own_headways_stay_inside_the_limits(words: str, limits: Limits) -> None:
    text = source(plan(words, limits=limits))
    for line in text.splitlines():
        if "set_desired_time_headway(" in line:
            value = float(line.split("(")[1].rstrip(")"))
            assert value >= limits.min_time_headway_s


def test_own_speeds_respect_a_persons_cap() -> None:
    made = plan("speed direction:faster", limits=Limits(max_speed_mps=26.0))
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
    plain = plan("go style:hurry")
    told = plan("go style:hurry", history=History((item(Feedback("a bit too fast", speed=-1, strength=0.35)),)))
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
    made = plan("go style:hurry", history=History((first, later)))
    assert setting(made, "personal_speed_mps") == pytest.approx(-3.8)


def test_feedback_on_the_gap_and_on_other_wishes() -> None:
    close = item(Feedback("too close", gap=-1, strength=1.0))
    assert setting(plan("go style:hurry", history=History((close,))), "time_headway_s") == pytest.approx(1.7)
    other = item(Feedback("too fast", speed=-1, strength=1.0), intent="gap.decrease")
    assert plan("go style:hurry", history=History((other,))).settings == plan("go style:hurry").settings


def test_explicit_numbers_are_not_personalised() -> None:
    history = History((item(Feedback("too fast", speed=-1, strength=1.0), intent="speed.set"),))
    assert setting(plan("speed VALUE | 28 m/s", history=history), "target_speed_mps") == 28.0


def test_feedback_rounds_correct_the_same_wish() -> None:
    first = plan("speed direction:slower")
    second = plan("speed direction:slower", rounds=(Round("", "slower please"),))
    assert setting(second, "target_speed_mps") < setting(first, "target_speed_mps")


# Always -----------------------------------------------------------------------------------------------------------

_SITUATIONS = st.sampled_from([HIGHWAY, EMPTY, SHOULDER, CROSSING, replace(HIGHWAY, lane_index=0)])
_TEXTS = st.one_of(
    st.text(st.characters(exclude_categories=("C",)), max_size=80),
    st.sampled_from(["overtake, then pull over", "turn left", "faster"]),
)


@settings(max_examples=50, deadline=None)
@given(text=_TEXTS, situation=_SITUATIONS)
def test_every_plan_is_a_program_in_the_language_or_a_refusal(text: str, situation: Situation) -> None:
    request = PlanRequest(Instruction(text), Context("", situation), SystemMessage(""))
    made = asyncio.run(MeaningPlanner().plan(request))
    assert (made.policy is None) == bool(made.refusal)
    assert made.thoughts.text
    if made.policy is not None:
        assert check_source(source(made)).passed
        assert made.acts


def test_a_bare_number_takes_the_unit_that_fits_the_direction() -> None:
    # 80 mph would be a speed-up from 25 m/s; 80 km/h slows down, as the person said.
    slower = plan("speed direction:slower VALUE | 80", EMPTY)
    assert setting(slower, "target_speed_mps") == pytest.approx(80 / 3.6, abs=0.01)
    assert "km/h" in slower.thoughts.text
    faster = plan("speed direction:faster VALUE | 65", EMPTY)
    assert setting(faster, "target_speed_mps") == pytest.approx(65 * 0.44704, abs=0.01)


def test_overtaking_keeps_to_the_sign_unless_the_operator_allows_more() -> None:
    assert setting(plan("pass side:left"), "target_speed_mps") == pytest.approx(31.29, abs=0.01)
    wide = plan("pass side:left", limits=LAMPILOT_LIMITS)
    assert setting(wide, "target_speed_mps") > 31.3
