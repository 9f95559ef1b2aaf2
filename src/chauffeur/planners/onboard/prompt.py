"""Text that the on-board model reads and writes: C and H in a few words, the wish, and the reply.

The same text is the training data's, the runtime's and, by way of the chat template, that of any server that runs the
exported model.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Final

from chauffeur.concept import Feedback, History, HistoryItem, ProgramError, Situation
from chauffeur.planners.onboard.dialect import DialectStep, read, tell, write

CONTEXT, HISTORY, WISH, DRAFT, REPLY = "<|context|>", "<|history|>", "<|wish|>", "<|draft|>", "<|reply|>"
END, BLANK = "<|end|>", "<|blank|>"
# Behind DRAFT stood what rules had read, in most examples that the shipped network learned from; nothing does now.
SPECIAL: Final = (END, CONTEXT, HISTORY, WISH, DRAFT, REPLY, BLANK)

ASK, REFUSE = "ASK: ", "REFUSE: "
"""Opening of a reply that drives nothing: a question back, or a reason."""

FENCE_OPEN, FENCE_CLOSE = "```python\n", "```\n"

MAX_WISH_CHARS: Final = 300
HISTORY_ITEMS: Final = 2

_SPACE = re.compile(r"\s+")


def prompt(situation: Situation | None, history: Sequence[str], wish: str) -> str:
    """The whole prompt.

    Args:
        situation: Where we are; None when it is not known.
        history: Remembered trips as `remembered` writes them, the most relevant first.
        wish: The passenger's words.
    """
    context = "unknown" if situation is None else context_words(situation)
    past = "; ".join(history[:HISTORY_ITEMS])
    return f"{CONTEXT}{context}{HISTORY}{past}{WISH}{wish_words(wish)}{DRAFT}{REPLY}"


def wish_words(wish: str) -> str:
    """A wish as the model reads it: one line of lower case, no longer than it can be."""
    words = wish.lower()  # first, or a mark in capitals would pass
    for mark in SPECIAL:
        words = words.replace(mark, " ")
    return _SPACE.sub(" ", words).strip()[:MAX_WISH_CHARS]


def context_words(situation: Situation) -> str:
    """C as far as it decides what words mean; its numbers are for linking, and would be taken for the wish's."""
    parts = [f"{situation.world} lane {situation.lane_index + 1}/{situation.lane_count}"]
    if situation.emergency_lane:
        parts.append("shoulder")
    if situation.front is not None:
        parts.append("ahead")
    if situation.stop_sign_m is not None:
        parts.append("sign")
    if situation.turns:
        parts.append(f"ways {' '.join(situation.turns)}")
    return " ".join(parts)


def history_words(history: History, steps_of: Callable[[str], Sequence[DialectStep]]) -> tuple[str, ...]:
    """H: the calls of remembered trips with what the passenger said of them, most relevant first.

    Args:
        history: What memory recalled.
        steps_of: What a wish asks for, for trips whose program is not of the dialect.
    """
    return tuple(words for item in history.items[:HISTORY_ITEMS] if (words := _item_words(item, steps_of)))


def remembered(steps: Sequence[DialectStep], said: str) -> str:
    """A remembered trip: what was driven, and what was said of it."""
    calls = ", ".join(step.call() for step in steps)
    return f"{calls}: {said}" if said else calls


def _item_words(item: HistoryItem, steps_of: Callable[[str], Sequence[DialectStep]]) -> str:
    try:
        steps: Sequence[DialectStep] = read(item.policy)
    except ProgramError:
        steps = steps_of(item.instruction)
    said = feedback_words(item.feedback[-1]) if item.feedback else ""
    return remembered(steps, said) if steps else ""


def feedback_words(feedback: Feedback) -> str:
    """Feedback in the words the model knows; `good` if nothing was wrong."""
    bit = "a bit " if feedback.strength < 0.5 else ""
    found: list[str] = []
    if feedback.speed:
        # feedback asks for a change: -1 wants less speed, so it was too fast
        found.append(f"{bit}too {'fast' if feedback.speed < 0 else 'slow'}")
    if feedback.gap:
        found.append(f"{bit}too {'close' if feedback.gap < 0 else 'far'}")
    if feedback.comfort < 0:
        found.append("too rough")
    return " and ".join(found) or "good"


def program_reply(steps: Sequence[DialectStep]) -> str:
    """The reply that drives: the program, and one sentence that says the same."""
    return f"{FENCE_OPEN}{write(steps)}{FENCE_CLOSE}{tell(steps)}"
