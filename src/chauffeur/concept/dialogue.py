"""The state of a conversation between person and car: what was said last, what the car has asked, what still waits."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Final

from chauffeur.concept.utterance import Act, Condition, Utterance, Verb

ANSWERS: Final[frozenset[Verb]] = frozenset({"yes", "no", "cancel"})
"""Verbs that settle what is open, and ask for nothing to be driven."""
DIALOGUE: Final[frozenset[Verb]] = frozenset({"yes", "no", "cancel", "again", "undo", "pick", "unclear"})
"""Verbs that mean something only beside what was said before."""


def wishes(acts: Iterable[Act]) -> tuple[Act, ...]:
    """Acts without the turns of dialogue among them: what can be driven."""
    return tuple(act for act in acts if act.act not in DIALOGUE and act.act != "none")


def waits_for(acts: Iterable[Act]) -> Condition | None:
    """The first condition that acts wait for; None where they are for now."""
    kinds = ("once", "after", "if", "before")
    return next((one.when for one in acts if one.when is not None and one.when.type in kinds), None)


@dataclass(frozen=True, slots=True)
class Question:
    """A question of the car that an answer is waited for.

    Attributes:
        words: In words.
        wish: What a yes stands for.
        until_s: So long a yes is taken for an answer, by the monotonic clock.
    """

    words: str
    wish: str
    until_s: float


@dataclass(frozen=True, slots=True)
class Dialogue:
    """What a session knows of the conversation.

    Attributes:
        last: The last turn that asked for something, resolved.
        question: What the car has asked; None for nothing.
        pending: The wish that waits for its time or event, in the person's words; empty for none.
    """

    last: Utterance | None = None
    question: Question | None = None
    pending: str = ""

    def after(self, turn: Utterance) -> Dialogue:
        """The state after a turn: what asks for nothing leaves standing what was asked for."""
        if not wishes(turn.acts):
            return self
        return replace(self, last=turn, pending=turn.text if waits_for(turn.acts) else "")

    def cancelled(self) -> Dialogue:
        """The state after the last wish was taken back: "again" and "the other one" may still mean it."""
        return replace(self, question=None, pending="")

    def open_question(self, now_s: float) -> Question | None:
        """The question to which an answer is still waited for."""
        question = self.question
        return question if question is not None and question.wish and now_s <= question.until_s else None
