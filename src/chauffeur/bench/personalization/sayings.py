"""Sayings of the simulated passengers: wishes at three levels of directness (paper Tab. VII), and feedback on a drive.

The words are two halves of the same shape, tables in `data/personalization` with a sentence a line: what it is, for
what, the sentence, its writer. `tuning` was written by the authors of the planner and may be looked at while a planner
is improved, or trained. `test` is what figures are reported on, and no planner is trained on it. It was written by
large language models that were given the aims, levels, topics and situations and had seen neither the planner nor the
tuning half, but for the ten direct wishes to overtake and a few sentences more, which writer b met. It was never looked
at while the planner was improved: whoever does makes it a tuning half.

Level I asks directly; level II comments on what the car does, or on the road; level III only hints at how the passenger
is or what awaits them.
"""

from __future__ import annotations

import hashlib
from functools import cache
from typing import Any, Final, Literal, get_args

from chauffeur.concept import DataError
from chauffeur.concept.data import read_data

Level = Literal["I", "II", "III"]
Half = Literal["test", "tuning"]
LEVELS: Final[tuple[Level, ...]] = ("I", "II", "III")

Aim = Literal[
    "overtake", "follow", "right_lane", "yield", "go",
    "park.nearest", "park.stadium", "park.exit", "pace.faster", "pace.slower",
]  # fmt: skip
"""Aims of a passenger; the parts behind the dot are their own choice."""

Topic = Literal[
    "too_fast", "too_slow", "too_close", "harsh", "swerving", "close_call", "no_overtake", "passed", "not_right",
    "waited", "not_parked", "wrong_spot", "parked", "fine",
]  # fmt: skip
"""Remarks of a passenger on a drive."""
Force = Literal["bit", "plain", "much"]


def _texts(half: Half, kind: Literal["wish", "feedback"]) -> dict[Any, tuple[str, ...]]:
    """Sentences of a half by what they are for and how they put it, in the table's order."""
    found: dict[tuple[str, str], tuple[str, ...]] = {}
    text = read_data("personalization", f"{half}.tsv").decode("utf-8")
    for number, line in enumerate(text.splitlines(), start=1):
        what, _, rest = line.partition("\t")
        label, _, rest = rest.partition("\t")
        sentence, _, writer = rest.partition("\t")
        name, _, how = label.partition("/")
        names, hows = (Aim, Level) if what == "wish" else (Topic, Force)
        if what not in ("wish", "feedback") or name not in get_args(names) or how not in get_args(hows) or not writer:
            raise DataError(f"Line {number} of {half}.tsv is no sentence with its aim and writer.")  # not what it says
        if what == kind:
            found[name, how] = (*found.get((name, how), ()), sentence)
    return found


PLACE_WORDS: Final[dict[str, str]] = {
    "nearest": "in the nearest free spot",
    "stadium": "near the stadium",
    "exit": "near the exit",
}
"""A place of parking as feedback names it."""


@cache
def wishes() -> dict[Half, dict[tuple[Aim, Level], tuple[str, ...]]]:
    """All wishes of both halves. Raises DataError."""
    return {half: _texts(half, "wish") for half in get_args(Half)}


@cache
def feedback() -> dict[Half, dict[tuple[Topic, Force], tuple[str, ...]]]:
    """All feedback of both halves. Raises DataError."""
    return {half: _texts(half, "feedback") for half in get_args(Half)}


def wishes_of(aim: Aim, level: Level, half: Half) -> tuple[str, ...]:
    """The wordings of one half."""
    return wishes()[half][aim, level]


def feedback_of(topic: Topic, force: Force, half: Half) -> tuple[str, ...]:
    """Sayings in the words of one half; plainly where nothing is written for that force."""
    table = feedback()[half]
    return table.get((topic, force)) or table[topic, "plain"]


def sayings_sha256() -> str:
    """Content hash of all words of both halves, for provenance."""
    parts = [
        f"{half}:{key}:{text}"
        for tables in (wishes(), feedback())
        for half, table in tables.items()
        for key, texts in table.items()
        for text in texts
    ]
    return hashlib.sha256("\n".join([*parts, *PLACE_WORDS.values()]).encode()).hexdigest()
