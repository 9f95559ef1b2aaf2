"""Reading what a text says of speed, gap, comfort and approval, with negations where they belong."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Literal

from chauffeur.memory.phrasebook import PHRASE_BOOK, Manner, Topic
from chauffeur.memory.plain_text import even, turned

_PATTERNS: tuple[tuple[re.Pattern[str], Topic, Literal[-1, 1], Manner], ...] = tuple(
    (re.compile(rf"\b(?:{'|'.join(phrases)})\b"), topic, sign, manner) for topic, sign, manner, phrases in PHRASE_BOOK
)
_CHUNK = 8
_CHUNKS = tuple(
    (
        re.compile("|".join(pattern.pattern for pattern, *_ in _PATTERNS[start : start + _CHUNK])),
        _PATTERNS[start : start + _CHUNK],
    )
    for start in range(0, len(_PATTERNS), _CHUNK)
)
"""Most patterns match nowhere in most clauses: one look tells it of several of them."""
_NEGATED = re.compile(r"\b(?<!why )(?:not|never|no|nothing|hardly|without|neither|nor)\b(?: [\w']+){0,4} ?$")
_ORDERED = re.compile(
    r"^(?:(?:please|just|so|next time|okay) )*(?:do not|never|avoid|stop)(?! (?:think|find|feel|believe|mind|know))\b"
    r"|\b(?:should|must|may|ought|try|rather|prefer) not\b"
)


@dataclass(frozen=True, slots=True)
class Want:
    """One thing said.

    Attributes:
        topic: What it is about.
        sign: Direction, as in `Feedback`.
        manner: How it was said; a negated complaint that orders something is a `request`.
        clause: The words it was said in.
        turn: How many turns ("X, but Y") its sentence had taken before it.
    """

    topic: Topic
    sign: Literal[-1, 1]
    manner: Manner
    clause: str
    turn: int = 0


def read_wants(text: str) -> tuple[Want, ...]:
    """Everything a text says about speed, gap, comfort and approval, in the order it is said."""
    return wants_in(even(text))


def speaks_of_the_drive(text: str) -> bool:
    """Whether any phrase of the book occurs, even one that a negation takes back."""
    said = even(text)
    return any(chunk.search(said) is not None for chunk, _ in _CHUNKS)


def wants_in(said: str) -> tuple[Want, ...]:
    """The same, of an evened text."""
    found: list[Want] = []
    for clause, turn in turned(said):
        left = clause
        here: list[tuple[int, Want]] = []
        for any_of_them, patterns in _CHUNKS:
            if any_of_them.search(left) is None:
                continue
            for pattern, topic, sign, manner in patterns:
                while (match := pattern.search(left)) is not None:
                    left = left[: match.start()] + "#" * (match.end() - match.start()) + left[match.end() :]
                    want = _negate(Want(topic, sign, manner, clause, turn), clause[: match.start()])
                    if want is not None:
                        here.append((match.start(), want))
        found += [want for _, want in sorted(here, key=lambda item: item[0])]
    return tuple(found)


def _negate(want: Want, before: str) -> Want | None:
    if want.manner == "nothing" or (want.manner == "aside" and not want.turn):
        return None
    if want.manner in ("fixed", "plea") or _NEGATED.search(before) is None:
        return want
    if want.manner in ("complaint", "remark", "aside"):
        ordered = "please" in want.clause or _ORDERED.search(before) is not None
        return replace(want, manner="request") if ordered else None
    return replace(want, sign=1 if want.sign < 0 else -1)
