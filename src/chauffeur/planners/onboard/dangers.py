"""Wishes that are refused before any network is asked: what would hurt somebody is not left to a probability."""

from __future__ import annotations

import re
from typing import Final

from chauffeur.language.tokens import plain
from chauffeur.planners.onboard.words import words_file

_DANGERS: Final = tuple((group[0].strip("[]"), re.compile("|".join(group[1:]))) for group in words_file("dangers.txt"))
_NEGATED: Final = re.compile(
    r"\b(?:(?:do not|does not|did not|not allowed to|never|not|no|without|avoid|instead of|rather than|afraid|scared|"
    r"worried|fear|hate|stop|quit|careful|lest|keep from|in case|before|if (?:you|we)) "
    r"(?:you |we |to |of |they |him |them |have |want |need |us |going |people |that |about |he |please |ever |wanna |"
    r"i |actually |really |even )*|(?:nearly|almost|he|she|they|who|(?:we|you) are|might|gonna|could|will|would) )$"
)
"""What stands right in front of words that only sound dangerous: "do not run the red light", "he nearly hit us"."""
_GAP: Final = re.compile(r"\s+")


def danger(wish: str) -> str:
    """Why a wish is not carried out, in words for the person; empty when nothing in it is dangerous."""
    words = _GAP.sub(" ", re.sub(r"[^a-z0-9 .,;!?]", " ", plain(wish))).strip()
    for reason, pattern in _DANGERS:
        for found in pattern.finditer(words):
            if _NEGATED.search(words[: found.start()]) is None:
                return reason
    return ""
