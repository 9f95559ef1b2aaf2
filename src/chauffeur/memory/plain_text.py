"""Spoken words made even: one spelling, no contractions, split into clauses."""

from __future__ import annotations

import re
import unicodedata

_QUOTES = str.maketrans(dict.fromkeys("\u2019\u02bc`", "'"))
_EVEN: tuple[tuple[str, re.Pattern[str], str], ...] = (
    ("won't", re.compile(r"\bwon't\b"), "will not"),
    ("can", re.compile(r"\bcan(?:'t|not)\b"), "can not"),
    ("n't", re.compile(r"n't\b"), " not"),
    ("nt", re.compile(r"\b(do|did|was|is)nt\b"), r"\1 not"),
    ("'d", re.compile(r"'d\b"), " would"),
    ("'m", re.compile(r"'m\b"), " am"),
    ("'re", re.compile(r"'re\b"), " are"),
    ("'s", re.compile(r"\b(it|that|there)'s\b"), r"\1 is"),
    ("gonna", re.compile(r"\bgonna\b"), "going to"),
)
"""Letters without which a pattern matches nowhere, the pattern, and what stands in its place."""
_TURNS = frozenset({"but", "however", "although", "even though", "though", "yet", "except"})
"""Words after which something else is said than before."""
_ENDS = frozenset("!?;.\n")
_BREAK = re.compile(rf"([!?;:\n\u2014]|[.,](?!\d)| - |\b(?:{'|'.join(sorted(_TURNS))}|and then|and|then|because)\b)")


def even(text: str) -> str:
    """Lower case, compatibility forms folded, contractions spelled out, single spaces."""
    text = unicodedata.normalize("NFKC", text).casefold().translate(_QUOTES)
    for letters, pattern, replacement in _EVEN:
        if letters in text:
            text = pattern.sub(replacement, text)
    return " ".join(text.split())


def clauses(text: str) -> list[str]:
    """The clauses of an evened text; a negation reaches no further than its own."""
    return [clause for clause, _ in turned(text)]


def turned(text: str) -> list[tuple[str, int]]:
    """The clauses, and how many turns ("X, but Y") their sentence has taken before each.

    A sentence that begins with a turn turns from the one before; one that ends with it ("..., though") is meant so.
    """
    found: list[tuple[str, int]] = []
    turns, turning = 0, False
    for number, part in enumerate([*_BREAK.split(text), "."]):
        if number % 2 == 0 and part.strip():
            turns, turning = turns + turning, False
            found.append((part.strip(), turns))
        elif part in _TURNS:
            turning = bool(found)
        elif part in _ENDS:
            if turning:
                found[-1] = found[-1][0], turns + 1
            turns, turning = 0, False
    return found
