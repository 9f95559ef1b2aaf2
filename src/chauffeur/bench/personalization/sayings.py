"""What the simulated passengers say: wishes at three levels of directness (seed Tab. VII), and feedback on a drive.

The words are two halves of the same shape, and no planner is trained on either. `tuning` was written by the authors of
the planner and may be looked at while a planner is improved. `test` is what figures are reported on: it was written
afterwards by a writer (a large language model) who had not seen the planner nor, but for a few sentences
(`sayings_test` says which), the tuning half, and was never looked at while the planner was improved.

Level I asks directly; level II comments on what the car does, or on the road; level III only hints at how the passenger
is or what awaits them.
"""

from __future__ import annotations

import hashlib
from typing import Final, Literal

from chauffeur.bench.personalization import sayings_test, sayings_tuning

Level = Literal["I", "II", "III"]
Half = Literal["test", "tuning"]
LEVELS: Final[tuple[Level, ...]] = ("I", "II", "III")

Aim = Literal[
    "overtake", "follow", "right_lane", "yield", "go",
    "park.nearest", "park.stadium", "park.exit", "pace.faster", "pace.slower",
]  # fmt: skip
"""What a passenger is after; the parts behind the dot are their own choice."""

Topic = Literal[
    "too_fast", "too_slow", "too_close", "harsh", "swerving", "close_call", "no_overtake", "passed", "not_right",
    "waited", "not_parked", "wrong_spot", "parked", "fine",
]  # fmt: skip
"""What a passenger has to say of a drive."""
Force = Literal["bit", "plain", "much"]

WISHES: Final[dict[Half, dict[tuple[Aim, Level], tuple[str, ...]]]] = {
    "test": sayings_test.WISHES,
    "tuning": sayings_tuning.WISHES,
}
FEEDBACK: Final[dict[Half, dict[tuple[Topic, Force], tuple[str, ...]]]] = {
    "test": sayings_test.FEEDBACK,
    "tuning": sayings_tuning.FEEDBACK,
}
PLACE_WORDS: Final[dict[str, str]] = {
    "nearest": "in the nearest free spot",
    "stadium": "near the stadium",
    "exit": "near the exit",
}
"""A place of parking as feedback names it."""


def wishes_of(aim: Aim, level: Level, half: Half) -> tuple[str, ...]:
    """The wordings of one half."""
    return WISHES[half][aim, level]


def feedback_of(topic: Topic, force: Force, half: Half) -> tuple[str, ...]:
    """What can be said in the words of one half; plainly where nothing is written for that force."""
    return FEEDBACK[half].get((topic, force)) or FEEDBACK[half][topic, "plain"]


def sayings_sha256() -> str:
    """Content hash of all words of both halves, for provenance."""
    parts = [
        f"{half}:{key}:{text}"
        for tables in (WISHES, FEEDBACK)
        for half, table in tables.items()
        for key, texts in table.items()
        for text in texts
    ]
    return hashlib.sha256("\n".join([*parts, *PLACE_WORDS.values()]).encode()).hexdigest()
