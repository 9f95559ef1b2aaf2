"""Sentences from the on-board model's tables: wishes said outright, of which the sorter must take none for another.

Most of them are of kinds no hint is sorted as ("turn left", "keep three seconds"), or want nothing of the driving.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from chauffeur.models.onboard.wordings import levels, utter, wordings
from chauffeur.models.sorting.sentences import Sentence
from chauffeur.planners.talk2drive.hints import HINT_KINDS

WRITER: Final = "tables"

_SKILLS: Final[Mapping[str, tuple[str, ...]]] = {
    "pass": ("overtake", "overtake_left", "overtake_left_and_return", "overtake_and_return"),
    "stay": ("follow", "no_overtaking", "keep_lane"),
    "right": ("lane_right", "rightmost_lane"),
    "faster": ("faster", "a_bit_faster", "much_faster"),
    "slower": ("slower", "a_bit_slower", "much_slower"),
    "hurry": ("hurry", "sportily"),
    "calm": ("relax", "gently", "carefully"),
    "go": ("go_straight",),
    "none": ("refuse.offtopic", "refuse.question", "chatter"),
    "else": (
        "ask.again", "ask.amount", "ask.change", "ask.contradiction", "ask.gap_amount", "ask.gap_change",
        "ask.more_number", "ask.number", "ask.side", "ask.turn", "ask.unit", "ask.unit_gap", "ask.what", "at_least",
        "at_most", "back_on_the_road", "carry_on", "change_lane", "closer", "closer_by", "correction.gap_less",
        "correction.gap_more", "correction.gap_same", "correction.less", "correction.more", "correction.same",
        "correction.speed_less", "correction.speed_more", "correction.speed_same", "drive_at", "drive_at_limit",
        "drive_normally", "faster_by", "further", "further_by", "gap_at_least", "gap_at_most", "gap_of",
        "gap_of_seconds", "gap_times", "hold_gap", "hold_speed", "lane_left", "lane_left_patiently", "lanes_left",
        "leftmost_lane", "match_traffic", "middle_lane", "over_limit_by", "pull_over", "refuse.hands", "refuse.ram",
        "refuse.reverse", "refuse.sign", "refuse.unsafe_gap", "refuse.unsafe_speed", "refuse.wrong_way", "slower_by",
        "speed_times", "stop_here", "turn_left", "turn_right", "under_limit_by",
    ),
}  # fmt: skip
"""Skills of the tables by the kind of hint that says the same."""
_DIRECT: Final = ("refuse.", "ask.")
_VALUES: Final[Mapping[str, str]] = {"n": "80", "v": "25", "d": "30", "x": "30", "t": "2", "k": "two"}
_EACH, _EACH_LANE, _EACH_GAP, _EACH_ELSE = 60, 240, 100, 20
"""Sentences of a skill at most; of one that says which lane to be in, where it is the vehicles that are of many names;
of one for a gap, which is near to staying behind; and of one of the many others that no hint is sorted as."""
_GAPS: Final = ("closer", "further", "gap_of", "hold_gap")
_LANE: Final = ("pass", "stay", "right")
_ELSEWHERE: Final = 1.0 / 3.0
"""Share of what is said on a highway that is said in another world too, where it can be."""


def drawn(seed: int) -> tuple[Sentence, ...]:
    """Sentences of every skill and level of directness, reproducibly."""
    rng = np.random.default_rng(seed)
    tables = wordings()
    found: list[Sentence] = []
    for kind, skills in _SKILLS.items():
        for skill in skills:
            for section in (skill,) if skill.startswith(_DIRECT) else levels(skill):
                for _ in range(min(_most(kind, skill), len(tables.templates(section)))):
                    found += _said_in_worlds(utter(section, _VALUES, rng).text, kind, rng)
    return tuple(found)


def _most(kind: str, skill: str) -> int:
    if skill in _GAPS:
        return _EACH_GAP
    if kind in _LANE:
        return _EACH_LANE
    return _EACH_ELSE if kind == "else" else _EACH


def _said_in_worlds(text: str, kind: str, rng: np.random.Generator) -> list[Sentence]:
    return [
        Sentence(text, kind, kinds, WRITER, f"{world}/{kind}")
        for world, kinds in HINT_KINDS.items()
        if kind in kinds and (world == "highway" or kind == "go" or rng.random() < _ELSEWHERE)
    ]
