"""Words become wishes in their order."""

from __future__ import annotations

import pytest

from chauffeur.concept import InstructionError, PersonId
from chauffeur.driving.talk.wish_queue import WishQueue, Words


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


def test_a_wish_to_which_a_question_led_is_handed_on_with_it() -> None:
    put = WishQueue(PersonId("ana"))
    put.put(Words("Drive at 100 km/h.", confirmed="Did you mean 100 km/h?"))
    put.put(Words("  yes "))
    assert _handed_on(put) == [("Drive at 100 km/h.", "Did you mean 100 km/h?"), ("yes", "")]


def test_what_is_no_wish_is_refused() -> None:
    with pytest.raises(InstructionError):
        WishQueue(PersonId("ana")).put(Words(" "))
