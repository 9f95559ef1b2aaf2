"""Spoken words made even: one spelling, no contractions, split into clauses."""

from __future__ import annotations

import re
import unicodedata

_EVEN: tuple[tuple[re.Pattern[str], str], ...] = (
    (re.compile(r"[\u2019\u02bc`]"), "'"),
    (re.compile(r"\bwon't\b"), "will not"),
    (re.compile(r"\bcan(?:'t|not)\b"), "can not"),
    (re.compile(r"n't\b"), " not"),
    (re.compile(r"\b(do|did|was|is)nt\b"), r"\1 not"),
    (re.compile(r"'d\b"), " would"),
    (re.compile(r"'m\b"), " am"),
    (re.compile(r"'re\b"), " are"),
    (re.compile(r"\b(it|that|there)'s\b"), r"\1 is"),
    (re.compile(r"\bgonna\b"), "going to"),
    (re.compile(r"\s+"), " "),
)
_BREAK = re.compile(
    r"[!?;:\n\u2014]|[.,](?!\d)| - |\b(?:but|however|although|though|yet|except|and then|and|then|because)\b"
)


def even(text: str) -> str:
    """Lower case, compatibility forms folded, contractions spelled out, single spaces."""
    text = unicodedata.normalize("NFKC", text).casefold()
    for pattern, replacement in _EVEN:
        text = pattern.sub(replacement, text)
    return text.strip()


def clauses(text: str) -> list[str]:
    """The clauses of an evened text; a negation reaches no further than its own."""
    return [part.strip() for part in _BREAK.split(text) if part.strip()]
