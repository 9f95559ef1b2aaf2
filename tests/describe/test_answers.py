"""Questions about the situation are answered from C; nothing else is taken for one."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.bench.passengers import load_wishes
from chauffeur.concept import Context, Lead, Situation
from chauffeur.describe.answers import answer_to, with_doing, with_way
from chauffeur.language.inquiries import asks_to_know
from chauffeur.worlds.places import Destination

ROAD = Situation("highway", 28.0, 31.2928, 4, 1, True, Lead(2, 40.0, 24.0), None)
WET = replace(ROAD, scene=(("weather", "Weather: rain 2.0 mm/h."), ("road", "Road: A 7.")))


@pytest.mark.parametrize(
    ("question", "holds"),
    [
        ("What is the speed limit here?", "113 km/h"),
        ("whats the limit", "113 km/h"),
        ("Can you tell me how fast I may drive here?", "113 km/h"),
        ("How fast can we go here?", "113 km/h"),
        ("How fast are we going?", "101 km/h"),
        ("What's our speed?", "101 km/h"),
        ("How far is the car in front?", "40 m"),
        ("How fast is he going?", "86 km/h"),
        ("Is there anybody ahead?", "40 m"),
        ("Which lane am I in?", "second from the left of 4 lanes"),
        ("How many lanes are there?", "4 lanes"),
        ("Is there a stop sign ahead?", "No stop sign"),
        ("What's the weather like?", "rain 2.0 mm/h"),
        ("What road is this?", "A 7"),
    ],
)
def test_what_c_holds_is_told(question: str, holds: str) -> None:
    assert holds in answer_to(question, WET)


SEEN = "There is no car ahead of me in my lane within 100 m. The traffic light 24 m ahead is {}. We go on."


@pytest.mark.parametrize(
    "question",
    [
        "Why are we standing?",
        "why did you stop here",
        "Why aren't we moving?",
        "Why are you braking?",
        "why have we stopped",
    ],
)
def test_why_the_car_stands_is_read_off_what_is_ahead(question: str) -> None:
    assert "traffic light 24 m ahead is red" in answer_to(question, ROAD, SEEN.format("red"))
    assert "40 m" not in answer_to(question, ROAD, SEEN.format("green"))
    assert "12 m" in answer_to(question, replace(ROAD, front=Lead(2, 12.0, 0.0)), SEEN.format("green"))
    assert "no light" in answer_to(question, replace(ROAD, front=None), SEEN.format("green"))


@pytest.mark.parametrize(
    "question",
    [
        "Are we there yet?",
        "how long until we get there",
        "When do we arrive?",
        "Are we nearly there?",
        "How much longer?",
    ],
)
def test_how_far_it_is_is_told_while_the_car_goes_somewhere(question: str) -> None:
    context = Context("", ROAD)
    going = with_way(context, Destination("Old Library", 0.0, 0.0, 1240.0))
    assert answer_to(question, going.situation) == "It is about 1.2 km by road to Old Library."
    assert with_way(context, None) is context
    assert answer_to(question, ROAD) == ""


def test_what_c_does_not_hold_is_not_made_up() -> None:
    for question in ("What's the weather?", "What is the capital of France?", "What time is it?", "Who won the game?"):
        assert asks_to_know(question)
        assert answer_to(question, ROAD) == ""
    assert "Nobody is ahead" in answer_to("How far is the car in front?", replace(ROAD, front=None))


@pytest.mark.parametrize(
    "wish",
    [
        "Could you drive faster?", "Can we overtake?", "How about the left lane?", "What are you waiting for? Go!",
        "Why are we so slow?", "Keep a gap of 40 m to the car ahead.", "When the left lane is free, overtake.",
        "Is this the best speed you can manage?", "What if we took the right lane?", "Drive at the speed limit.",
    ],
)  # fmt: skip
def test_a_wish_is_no_question(wish: str) -> None:
    assert answer_to(wish, WET) == ""


def test_no_wish_of_a_passenger_to_be_driven_is_taken_for_a_question() -> None:
    assert [w.wish for w in load_wishes() if w.right == "drive" and asks_to_know(w.wish)] == []


@given(st.text(max_size=80))
def test_any_text_is_read(text: str) -> None:
    answer_to(text, ROAD)


@pytest.mark.parametrize(
    ("question", "asks"),
    [
        ("What are you doing?", True), ("what did you just do", True), ("Did you do that already?", True),
        ("Why did you change lanes?", True), ("why are we turning left?", True), ("What are you waiting for?", False),
        ("Why so slow?", False), ("Do that again", False),
    ],
)  # fmt: skip
def test_what_is_done_is_told_by_the_execution(question: str, asks: bool) -> None:
    doing = "You asked: “overtake him” I am at it."
    assert (answer_to(question, with_doing(Context("", ROAD), doing).situation) == doing) == asks
    assert answer_to(question, ROAD) != doing
