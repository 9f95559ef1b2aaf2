"""The rule-based system Talk2Drive is compared with (paper Sec. V-D): keywords, each with a fixed effect on parameters.

Two of them. `keyword` follows the baseline that was published with Talk2Drive, faults included: substrings, no case
folding, no negation, a misspelt stadium. `keyword-fair` is what somebody would build who meant well: whole words in any
case, more of them, negated ones passed over, and complaints ("too fast") turned round.

The published numbers are for a test track: 40 km/h, 50 when faster, 30 when slower; at an intersection 20, 30 and 15.
Here the first of each is the speed the car has, the others stand in the same proportion to it, and no rule goes above
the sign. The published rules know no speeds in a lot; here they have the highway's. A rule that says stop is no harm
here: the car stops at the line by itself and goes on when the way is free, under every planner alike.
"""

from __future__ import annotations

import re
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

from chauffeur.concept import Parameters, Plan, PlanRequest, Thoughts

KEYWORD_VERSION: Final = "keyword-parameters-v1"
FAIR_VERSION: Final = "keyword-fair-v1"

_LOOK_M, _LOOK_S = 18.0, 2.0
"""The published look-ahead."""
_LOOK_LOT_M, _LOOK_LOT_S = 4.0, 1.0
_FACTORS: Final[dict[str, tuple[float, float]]] = {
    "highway": (50.0 / 40.0, 30.0 / 40.0),
    "parking": (50.0 / 40.0, 30.0 / 40.0),
    "intersection": (30.0 / 20.0, 15.0 / 20.0),
}
"""Factors on the speed when faster and when slower."""


@dataclass(frozen=True, slots=True)
class _Words:
    """Lists of one system."""

    faster: tuple[str, ...]
    slower: tuple[str, ...]
    left: tuple[str, ...]
    right: tuple[str, ...]
    nearest: tuple[str, ...]
    stadium: tuple[str, ...]
    exit: tuple[str, ...]


_PUBLISHED: Final = _Words(
    faster=("speed up", "accelerat", "hurry", "rush", "quick", "fast"),
    slower=("slow", "deccelerat", "brake"),
    left=("left", "overtake", "over take", "pass"),
    right=("right",),
    nearest=("nearest", "fast", "quick", "hurry", "rush", "as soon as possible"),
    stadium=("statium",),
    exit=("exit", "leave", "go out", "out"),
)
_FAIR: Final = _Words(
    faster=("speed up", "accelerat", "hurry", "rush", "quick", "fast", "late", "swift", "brisk", "more speed", "pace"),
    slower=("slow", "decelerat", "brake", "less speed", "careful", "gentl", "eas", "calm", "sick", "dizzy"),
    left=("left", "overtak", "pass", "get past", "go past", "go around", "get ahead"),
    right=("right",),
    nearest=("nearest", "closest", "next", "first", "any", "near"),
    stadium=("stadium", "arena", "gate", "game", "match"),
    exit=("exit", "leave", "way out"),
)
_NOT: Final = re.compile(r"(?:\bnot\b|n't\b|\bno\b|\bnever\b|\bwithout\b)(?:\s+\w+){0,2}\s*$")
_TOO: Final = re.compile(r"(?:\btoo|\bso|\brather|\bvery|\boverly)\s*$")

Pace = Literal["faster", "slower", ""]


class KeywordParameters:
    """Plans parameters by rule."""

    def __init__(self, *, fair: bool = False) -> None:
        self._fair = fair
        self._words = _FAIR if fair else _PUBLISHED

    @property
    def id(self) -> str:
        """Name of the arm."""
        return "keyword-fair" if self._fair else "keyword"

    @property
    def model(self) -> str:
        """Rule set with its version."""
        return FAIR_VERSION if self._fair else KEYWORD_VERSION

    async def plan(self, request: PlanRequest) -> Plan:
        """One plan; where no rule applies, the car goes on as it is."""
        begun = time.perf_counter()
        text, situation = request.instruction.text, request.context.situation
        ground = situation.world if situation.world in _FACTORS else "highway"
        pace, found = self._pace(text)
        lane: Literal[-1, 0, 1] = 0
        route = "straight" if ground == "intersection" else ""
        if ground == "highway":
            if word := self._found(self._words.left, text):
                lane, pace, found = -1, "faster", word
            elif word := self._found(self._words.right, text):
                lane, pace, found = 1, "slower", word
            if not 0 <= situation.lane_index + lane < situation.lane_count:
                lane = 0  # a rule that has no lane to go to does the rest
        elif ground == "parking" and (word := self._place(text)):
            route, found = word
        up, down = _FACTORS[ground]
        factor = {"faster": up, "slower": down, "": 1.0}[pace]
        top = min(situation.speed_limit_mps, request.limits.most_mps(situation.speed_limit_mps))
        speed = round(min(situation.speed_mps * factor, max(top, 0.0)), 2)
        look = (_LOOK_LOT_M, _LOOK_LOT_S) if ground == "parking" else (_LOOK_M, _LOOK_S)
        why = f'The words contain "{found}".' if found else "No rule applies."
        return Plan(
            thoughts=Thoughts(f"{why} I set the target speed to {speed:g} m/s."),
            policy=Parameters(speed, *look, lane, route),
            intent="+".join(part for part in (pace, route, {-1: "left", 0: "", 1: "right"}[lane]) if part),
            settings=(("target_speed_mps", speed),),
            planner=self.id,
            model=self.model,
            latency_s=time.perf_counter() - begun,
        )

    def _pace(self, text: str) -> tuple[Pace, str]:
        lists: tuple[tuple[Pace, Pace, tuple[str, ...]], ...] = (
            ("faster", "slower", self._words.faster),
            ("slower", "faster", self._words.slower),
        )
        for pace, other, words in lists:
            if word := self._found(words, text):
                return (other, f"too {word}") if self._complains(word, text) else (pace, word)
        return "", ""

    def _place(self, text: str) -> tuple[str, str] | None:
        """Choose where to park; the published rules take the nearest spot where none is named."""
        if not self._fair:
            for place, words in (("nearest", self._words.nearest), ("stadium", self._words.stadium)):
                if word := self._found(words, text):
                    return place, word
            word = self._found(self._words.exit, text)
            return ("exit", word) if word else ("nearest", "")
        for place, words in (("stadium", self._words.stadium), ("exit", self._words.exit)):
            if word := self._found(words, text):
                return place, word
        if self._found(("park", "spot", "space", "place", "bay"), text):
            return "nearest", self._found(self._words.nearest, text)
        return None

    def _found(self, words: Sequence[str], text: str) -> str:
        if not self._fair:
            return next((word for word in words if word in text), "")
        even = text.lower().replace("\u2019", "'")
        for word in words:
            for match in re.finditer(rf"\b{re.escape(word)}", even):
                if not _NOT.search(even[: match.start()]):
                    return word
        return ""

    def _complains(self, word: str, text: str) -> bool:
        """True if the fair rules take it for a complaint: too fast, so slow."""
        even = text.lower()
        return self._fair and any(_TOO.search(even[: match.start()]) for match in re.finditer(re.escape(word), even))
