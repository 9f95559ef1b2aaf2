"""Each reader of words beside the one reader, row by row: what it makes of a sentence, and what only sounds alike."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.bench.passengers import load_wishes
from chauffeur.language.corrections import last_said
from chauffeur.language.emergency import read_emergency, tells_of_alarm
from chauffeur.language.ordinals import nth_of
from chauffeur.language.questions import ends_session, is_question, said_aside
from chauffeur.language.slips import slip_in
from chauffeur.language.text_classifier import load_sorter
from chauffeur.language.tokens import tokens_of
from chauffeur.language.weather import SAID_WEATHERS, WEIGHTS, said_weather
from chauffeur.planners.arbitration import denied_intent
from chauffeur.planners.onboard.doubts import foreign
from chauffeur.planners.talk2drive.explicit_overtake import told
from chauffeur.planners.talk2drive.style import destination_of
from chauffeur.safety.dangers import danger


def form_of(text: str) -> str:
    """Whether words are a question, said aside, a leave-taking, or may be a wish."""
    kinds = {"question": is_question(text), "leave": ends_session(text)}
    assert sum(kinds.values()) < 2
    assert said_aside(text) or not kinds["question"]
    return next((kind for kind, holds in kinds.items() if holds), "aside" if said_aside(text) else "wish")


def slip_of(text: str) -> str:
    """The question about the first number that is not cleanly one, and the text that a yes stands for."""
    slip = slip_in(text)
    return "clean" if slip is None else f"{slip.question} {slip.corrected}".strip()


def danger_of(text: str) -> str:
    """Whether a wish is refused, with a sentence that says why."""
    why = danger(text)
    assert not why or why.endswith(".")
    return "refused" if why else "harmless"


READERS: dict[str, Callable[[str], str]] = {
    "alarm told": lambda text: "alarm" if tells_of_alarm(text) else "none",
    "corrected": lambda text: "=" if last_said(text) == text else last_said(text),
    "danger": danger_of,
    "denied": lambda text: "denied" if denied_intent(*text.rpartition(" | ")[::2]) else "wanted",
    "destination": lambda text: destination_of(text) or "none",
    "emergency": lambda text: "none" if (found := read_emergency(text)) is None else found.kind,
    "form": form_of,
    "language": lambda text: "other" if foreign(text) else "english",
    "nth": lambda text: str(nth_of(text)),
    "overtake": lambda text: told(text) or "neither",
    "slip": slip_of,
    "weather": said_weather,
}
ROWS = [line.split("\t") for line in Path(__file__).with_name("wordings.tsv").read_text("utf-8").splitlines()]


@pytest.mark.parametrize(("reader", "text", "expected"), ROWS)
def test_a_reader_makes_of_words_what_stands_beside_them(reader: str, text: str, expected: str) -> None:
    assert READERS[reader](text) == expected


@given(st.sampled_from(sorted(READERS)), st.text(max_size=80))
def test_any_text_is_read(reader: str, text: str) -> None:
    assert READERS[reader](text) or not text


@given(st.text(max_size=80))
def test_what_is_read_of_any_text_stays_within_bounds(text: str) -> None:
    left, whole = last_said(text), text.replace("’", "'")
    assert whole.endswith(left) or sorted(set(tokens_of(left)) - set(tokens_of(whole))) == []
    assert left or not text
    assert 1 <= nth_of(text) <= 10
    slip = slip_in(text)
    assert slip is None or slip.said


def test_no_wish_of_a_passenger_to_be_driven_is_said_aside() -> None:
    assert [one.wish for one in load_wishes() if one.right == "drive" and said_aside(one.wish)] == []


def test_the_sorter_that_ships_knows_the_kinds_of_weather() -> None:
    assert load_sorter(WEIGHTS).kinds == SAID_WEATHERS
