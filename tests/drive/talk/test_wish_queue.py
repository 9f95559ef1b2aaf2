"""A yes to the car's question is the wish it asked about; anything else is a wish of its own."""

from __future__ import annotations

import pytest

from chauffeur.concept import PersonId
from chauffeur.drive import questions
from chauffeur.drive.questions import NOT_MEANT
from chauffeur.drive.talk.wish_queue import WishQueue, Words


class _Asked:
    """Takes down what is handed on."""

    next_wish = "w1"

    def __init__(self) -> None:
        self.wishes: list[tuple[str, str]] = []

    def ask(self, text: str, person: str = "", *, confirmed: str = "") -> str:
        del person
        self.wishes.append((text, confirmed))
        return f"w{len(self.wishes)}"


def _handed_on(put: WishQueue) -> list[tuple[str, str]]:
    runtime = _Asked()
    while put.busy:
        put.look(runtime)  # pyright: ignore[reportArgumentType]
    return runtime.wishes


def _offering() -> WishQueue:
    put = WishQueue(PersonId("ana"))
    put.offer("Did you mean 100 km/h?", "Drive at 100 km/h.")
    return put


def test_a_yes_is_the_wish_that_was_asked_about() -> None:
    put = _offering()
    assert put.put(Words("Yes, please!")) == ""
    assert _handed_on(put) == [("Drive at 100 km/h.", "Did you mean 100 km/h?")]


def test_a_no_is_no_wish() -> None:
    put = _offering()
    assert put.put(Words("no")) == NOT_MEANT
    assert _handed_on(put) == []


def test_another_wish_takes_the_place_of_the_question() -> None:
    put = _offering()
    put.put(Words("Drive at 90 km/h."))
    put.put(Words("yes"))
    assert _handed_on(put) == [("Drive at 90 km/h.", ""), ("yes", "")]


def test_a_question_is_not_answered_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(questions, "ANSWER_WITHIN_S", -1.0)
    put = _offering()
    put.put(Words("yes"))
    assert _handed_on(put) == [("yes", "")]
