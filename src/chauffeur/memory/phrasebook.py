"""What people say of a drive, as a table (`phrasebook.txt`): phrase -> topic and direction.

Signs are those of `Feedback`: speed -1 is "too fast", gap -1 "too close", comfort -1 "too harsh". A request carries the
sign of the complaint it answers: "slower, please" is -1 like "too fast". So a sign is also the direction of a wish, and
opposite wishes have opposite signs.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final, Literal, cast

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

Phrases = tuple[Topic, Literal[-1, 1], Manner, tuple[str, ...]]


def _read(text: str) -> Iterator[Phrases]:
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


PHRASE_BOOK: Final = tuple(_read(Path(__file__).with_suffix(".txt").read_text(encoding="utf-8")))
