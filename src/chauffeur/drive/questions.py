"""The car's open question: a yes to it is the wish it asked about, for as long as anybody knows what it meant."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import Final

from chauffeur.concept import Instruction, PersonId
from chauffeur.drive.session import parse_wish
from chauffeur.language.meaning.turns import answer_in

ANSWER_WITHIN_S: Final = 20.0
"""So long a yes is taken for an answer."""
NOT_MEANT: Final = "Then I do not."
NOTHING_ASKED: Final = "I have asked nothing, and go on as we are. Say what I am to do instead, or: “Stop!”"
"""To a no that answers nothing."""


class OpenQuestion:
    """At most one question at a time; whatever is said next settles it."""

    def __init__(self) -> None:
        """Nothing is asked."""
        self._question = self._wish = ""
        self._until_s = -math.inf

    def ask(self, question: str, wish: str) -> None:
        """The car has asked.

        Args:
            question: In words.
            wish: What a yes stands for; empty where it answers nothing.
        """
        self._question, self._wish = question, wish
        self._until_s = time.monotonic() + ANSWER_WITHIN_S if wish else -math.inf

    @property
    def open(self) -> bool:
        """Whether an answer is waited for."""
        return time.monotonic() <= self._until_s

    def settle(self, text: str, person: PersonId) -> Instruction | None:
        """What words wish for: what was asked about where they are a yes; None where they are a no.

        Raises:
            InstructionError: They are no wish.
        """
        answer = answer_in(text) if self.open else None
        question, wish = self._question, self._wish
        self.ask("", "")
        if answer is None:
            return parse_wish(text, person)
        return replace(parse_wish(wish, person), confirmed=question) if answer else None
