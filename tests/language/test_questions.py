"""Questions by their form, what is said aside, and leave-taking: none of them is a wish to be driven at once."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.bench.passengers import load_wishes
from chauffeur.language.questions import ends_session, is_question, said_aside


@pytest.mark.parametrize(
    "text",
    [
        "Why are we standing?", "what's the limit here?", "are we there yet", "How long until we get there?",
        "Hey car, did you see that?", "is that a school", "So, where are we going?", "When do we arrive?",
        "Can you see the cyclist?", "Do you know the way?", "Tell me why we stopped.", "Have we passed it?",
        "Do that car and we have the same way?", "Is it far, please?", "Are you lost? Is this the right road?",
    ],
)  # fmt: skip
def test_a_question_has_its_form(text: str) -> None:
    assert is_question(text)
    assert said_aside(text)
    assert not ends_session(text)


@pytest.mark.parametrize(
    "text",
    [
        "Can you slow down?", "Could we overtake?", "Would you mind going faster?", "Will you please stop?",
        "Won't you let him in?", "How about the left lane?", "What about turning here?", "Why don't we turn left?",
        "Is it possible to go faster?", "Is there any chance you could hurry?", "Do that again.",
        "Have the truck pass.",
        "Do the next exit.", "What are you waiting for? Go!", "Why so slow, overtake him", "Turn left. Is that ok?",
        "When you can, turn left.", "Where it is safe, stop.", "Take the exit now.", "", "?",
    ],
)  # fmt: skip
def test_a_request_is_none(text: str) -> None:
    assert not is_question(text)
    assert not said_aside(text)


def test_no_wish_of_a_passenger_to_be_driven_is_said_aside() -> None:
    assert [one.wish for one in load_wishes() if one.right == "drive" and said_aside(one.wish)] == []


@pytest.mark.parametrize("text", ["ok", "Yes!", "Thank you very much.", "Great, thanks!", "I see.", "Hello car"])
def test_an_acknowledgement_is_said_aside(text: str) -> None:
    assert said_aside(text)
    assert not is_question(text)


@pytest.mark.parametrize(
    "text", ["stop", "right", "go ahead", "no", "never mind", "slower, thanks", "good grief, brake"]
)
def test_what_may_be_to_be_done_is_not(text: str) -> None:
    assert not said_aside(text)


@pytest.mark.parametrize(
    "text",
    ["quit", "Exit", "bye", "Good bye!", "ok, bye", "quit please", "end", ":q", "End the session.", "bye bye, car",
     "Please close the program.", "let's quit", "Thanks, bye!"],
)  # fmt: skip
def test_leave_is_taken(text: str) -> None:
    assert ends_session(text)


@pytest.mark.parametrize(
    "text",
    ["exit now", "exit the motorway", "Take the exit.", "quit tailgating", "end of the road", "go to the end",
     "stop", "bye the church", "by the church", "leave the lot", "close the gap", "Quit it!", ""],
)  # fmt: skip
def test_a_way_to_drive_is_no_leave(text: str) -> None:
    assert not ends_session(text)


@given(st.text(max_size=80))
def test_any_text_is_read(text: str) -> None:
    assert not (ends_session(text) and is_question(text))
