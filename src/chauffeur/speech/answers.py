"""Yes or no, as a person answers when the car asks whether it heard rightly."""

from __future__ import annotations

import re
from typing import Final

_LETTERS: Final = re.compile(r"[^a-z ]+")

_YES: Final = frozenset(
    {"yes", "yes please", "yeah", "yep", "sure", "right", "that's right", "that is right", "correct", "exactly",
     "do it", "do that", "go ahead", "ok", "okay", "confirm", "yes do it", "yes do that"}
)  # fmt: skip
_NO: Final = frozenset(
    {"no", "no thanks", "no thank you", "nope", "wrong", "that's wrong", "that is wrong", "cancel", "cancel that",
     "never mind", "forget it", "don't", "do not", "no don't", "don't do it", "don't do that"}
)  # fmt: skip


def answer_in(text: str) -> bool | None:
    """Whether words say yes (True) or no (False); None where they are something else. Nothing is guessed."""
    words = " ".join(_LETTERS.sub(" ", text.lower().replace("’", "'").replace("'", "")).split())
    if words in _EVEN_YES:
        return True
    return False if words in _EVEN_NO else None


def takes_back(text: str) -> bool:
    """Whether words say no to something and nothing else; "don't!" may be meant for what the car does."""
    return answer_in(text) is False and not _DONT.match(text.strip().lower())


_DONT: Final = re.compile(r"(?:no,? )?do(?:n['’]?t| not)\b")

_EVEN_YES: Final = frozenset(word.replace("'", "") for word in _YES)
_EVEN_NO: Final = frozenset(word.replace("'", "") for word in _NO)
