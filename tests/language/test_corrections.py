"""What is left of a wish whose speaker corrects themselves."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.language.corrections import last_said
from chauffeur.language.tokens import tokens_of


@pytest.mark.parametrize(
    ("text", "left"),
    [
        ("Stay behind, no wait, scratch that, overtake him.", "overtake him."),
        ("Go slower, uh sorry, I meant go past the slow one.", "go past the slow one."),
        ("Go past, hmm, actually forget it, hang back behind the trailer.", "hang back behind the trailer."),
        ("Faster, wait, no, sorry, slower, I said it wrong.", "slower, I said it wrong."),
        ("Near the exit, no, never mind, take the nearest one.", "take the nearest one."),
        ("Near the exit, sorry, near the stadium I meant, park there.", "near the stadium I meant, park there."),
        ("Take it easy, hmm, actually don’t, go a bit quicker.", "go a bit quicker."),
        ("Take your time, no, strike that, hurry.", "hurry."),
        ("I want, uh, actually, go past him", "go past him"),
        ("Drive at seventy, no wait, sixty", "drive at sixty"),
        ("Change of mind: to the church", "to the church"),
        ("No, I've changed my mind, take me to the bakery", "take me to the bakery"),
        ("Drive at 70 km/h, no, sorry, 60.", "drive at 60 km/h"),
        ("go 70 mph, I mean 60 mph please", "go 60 mph"),
        ("keep 40 m, make that 50", "keep 50 m"),
        ("seventy, no wait, sixty", "sixty"),
        ("Change to the right lane, sorry, I meant left", "Change to the left lane"),
        ("right, sorry, I meant left", "left"),
        ("turn right, no, left", "turn left"),
        ("Move over to the left, no wait, to the right, please.", "Move over to the right"),
    ],
)
def test_what_was_said_before_is_taken_back(text: str, left: str) -> None:
    assert last_said(text) == left


@pytest.mark.parametrize(
    "text",
    [
        "Never mind the truck, overtake.",
        "Stay behind him, I mean it.",
        "Pass him, sorry, I'm late.",
        "Sorry, can you pass him?",
        "No, no, stay here.",
        "Don't pass him, never mind.",
        "Actually, pass him.",
        "Slow down, actually.",
        "I'd rather stay behind him.",
        "Pass him, I'd actually go left.",
        "Could you actually go faster?",
        "He is, I mean, really slow.",
        "Go faster. Actually, no.",
        "Go left, no problem.",
        "Not the right lane, the left one.",
        "I'm sorry, 70 is too fast.",
        "Keep right, right?",
        "Stay at 60, no more.",
        "50 km/h, no faster.",
        "Go to the left lane and drive at 70.",
        "Leave 40 m, not 50.",
        "Get past that school bus, I mean the tour bus.",
        "",
    ],
)
def test_what_only_looks_like_it_stays_whole(text: str) -> None:
    assert last_said(text) == text


@given(st.text(max_size=80))
def test_nothing_is_left_that_was_not_said(text: str) -> None:
    left = last_said(text)
    whole = text.replace("’", "'")
    assert whole.endswith(left) or sorted(set(tokens_of(left)) - set(tokens_of(whole))) == []
    assert left or not text
