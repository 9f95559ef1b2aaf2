"""Reading what a text says of speed, gap, comfort and approval, with negations where they belong.

Phrases stand in a table, `phrasebook.txt`: phrase -> topic and direction. Signs are those of `Feedback`: speed -1 is
"too fast", gap -1 "too close", comfort -1 "too harsh". A request carries the sign of the complaint it answers: "slower,
please" is -1 like "too fast". So a sign is also the direction of a wish, and opposite wishes have opposite signs.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, Literal, cast

from chauffeur.memory.plain_text import even, turned

Topic = Literal["speed", "gap", "comfort", "approval"]
Manner = Literal["complaint", "request", "remark", "aside", "opinion", "fixed", "plea", "nothing"]
"""How a phrase takes a negation, and what it weighs.

complaint: "not too fast" is none, but "do not drive too fast" asks for less.
request: "do not go faster" asks for the opposite.
remark: "really fast" is a complaint unless the drive is praised with it.
aside: "you were slow" is a complaint only after a turn: "fine, but you were slow".
opinion: "not good" is the opposite.
fixed: a complaint or opinion with the negation inside: "not fast enough".
plea: a request with the negation inside: "not so fast".
nothing: looks like one of the others and says nothing.
"""

_Phrases = tuple[Topic, Literal[-1, 1], Manner, tuple[str, ...]]


def _read(text: str) -> Iterator[_Phrases]:
    """Sections of the table; `<NAME>` in a phrase stands for the part of that name."""
    parts: dict[str, str] = {}
    for section in re.split(r"\n(?=\[)", text):
        lines = [line for line in section.splitlines() if line and not line.startswith("#")]
        if not section.startswith("["):
            for line in lines:
                name, _, meant = line.partition(" = ")
                parts[name] = _whole(meant, parts)
            continue
        topic, sign, manner = lines[0].strip("[]").split()
        phrases = tuple(_whole(line, parts) for line in lines[1:])
        yield cast(Topic, topic), 1 if sign == "+" else -1, cast(Manner, manner), phrases


def _whole(phrase: str, parts: dict[str, str]) -> str:
    return re.sub(r"<([A-Z_]+)>", lambda found: parts[found[1]], phrase)


_PHRASE_BOOK: Final = tuple(_read(Path(__file__).with_name("phrasebook.txt").read_text(encoding="utf-8")))

_PATTERNS: tuple[tuple[re.Pattern[str], Topic, Literal[-1, 1], Manner], ...] = tuple(
    (re.compile(rf"\b(?:{'|'.join(phrases)})\b"), topic, sign, manner) for topic, sign, manner, phrases in _PHRASE_BOOK
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
