"""The conversation of a session: what words mean after those before them, and the car's open question: a yes to it is
the wish it asked about, for as long as anybody knows what it meant."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Final

from chauffeur.concept import Instruction, PersonId
from chauffeur.concept.dialogue import Dialogue, Question
from chauffeur.driving.session import parse_wish
from chauffeur.language.meaning.reader import Turn, turn_of
from chauffeur.language.meaning.turns import answer_in

ANSWER_WITHIN_S: Final = 20.0
"""So long a yes is taken for an answer."""
NOT_MEANT: Final = "Then I do not."
NOTHING_ASKED: Final = "I have asked nothing, and go on as we are. Say what I am to do instead, or: “Stop!”"
"""To a no that answers nothing."""
TAKEN_BACK: Final = "I take that back, and drive on as before it."
"""To a "never mind" about what is driven, or waits."""


class Conversing:
    """Holds the state of one conversation. At most one question is open; whatever is said next settles it."""

    def __init__(self) -> None:
        """Nothing is said or asked."""
        self.dialogue = Dialogue()

    def ask(self, question: str, wish: str) -> None:
        """The car has asked.

        Args:
            question: In words.
            wish: What a yes stands for; empty where it answers nothing.
        """
        self.dialogue = replace(self.dialogue, question=Question(question, wish, time.monotonic() + ANSWER_WITHIN_S))

    @property
    def open(self) -> bool:
        """Whether an answer is waited for."""
        return self.dialogue.open_question(time.monotonic()) is not None

    def settle(self, text: str, person: PersonId) -> Instruction | None:
        """What words wish for: what was asked about where they are a yes; None where they are a no.

        Raises:
            InstructionError: They are no wish.
        """
        question = self.dialogue.open_question(time.monotonic())
        self.dialogue = replace(self.dialogue, question=None)
        answer = None if question is None else answer_in(text)
        if answer is None or question is None:
            return parse_wish(text, person)
        return replace(parse_wish(question.wish, person), confirmed=question.words) if answer else None

    def turn(self, text: str) -> Turn:
        """Read words after those before them, and remember what they asked for."""
        found = turn_of(text, self.dialogue.last)
        self.dialogue = self.dialogue.after(found.utterance)
        return found

    def cancel(self) -> None:
        """The present wish is taken back."""
        self.dialogue = self.dialogue.cancelled()
