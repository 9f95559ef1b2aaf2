"""A case of the alignment benchmark, and the two sets: generated, and written by hand."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Final, Literal, get_args

from chauffeur.concept import DataError
from chauffeur.concept.data import read_data
from chauffeur.safety.faithfulness import FactSurroundings, Kind

Half = Literal["tuning", "test"]

ALIGNED: Final = "aligned"
KINDS: Final = (ALIGNED, *get_args(Kind))
"""Kinds of case; all but the first are mismatches."""

SCENES: Final[Mapping[str, FactSurroundings]] = {
    "highway": FactSurroundings(speed_mps=25.0, limit_mps=31.3, gap_m=40.0, other_mps=22.0),
    "intersection": FactSurroundings(speed_mps=10.0, limit_mps=10.0, sign_m=50.0, crossing=True),
}
"""Where the programs of the hand-written cases begin."""


@dataclass(frozen=True, slots=True)
class FaithfulnessCase:
    """A text, a program, and whether the one describes the other.

    Attributes:
        id: Stays with the case.
        thoughts: R.
        program: P.
        kind: `aligned`, or what is wrong.
        where: Where the ego is when the program begins.
        changed: `R` or `P`: which of the two was altered; empty in aligned and in hand-written cases.
        intent: What the planner of a generated case understood.
        scenario, seed: The scene of a generated case.
    """

    id: str
    thoughts: str
    program: str
    kind: str
    where: FactSurroundings
    changed: str = ""
    intent: str = ""
    scenario: str = ""
    seed: int = 0

    @property
    def aligned(self) -> bool:
        """True if the text describes the program."""
        return self.kind == ALIGNED


@cache
def handwritten() -> tuple[FaithfulnessCase, ...]:
    """The cases written by hand. Raises DataError for a file that is not as it was published."""
    text = read_data("faithfulness", "handwritten.jsonl").decode("utf-8")
    cases = tuple(_case(json.loads(line)) for line in text.splitlines() if line)
    if len({case.id for case in cases}) != len(cases):
        raise DataError("Two hand-written alignment cases have the same id.", hint="Restore it: git checkout -- data")
    return cases


def half_of(case: FaithfulnessCase) -> Half:
    """Half a hand-written case belongs to, by the hash of its id: rules may be tuned on one of them only."""
    return "test" if hashlib.sha256(case.id.encode()).digest()[0] & 1 else "tuning"


def of_half(cases: Iterable[FaithfulnessCase], half: Half) -> tuple[FaithfulnessCase, ...]:
    """The cases of one half."""
    return tuple(case for case in cases if half_of(case) == half)


def _case(row: Mapping[str, Any]) -> FaithfulnessCase:
    try:
        case = FaithfulnessCase(row["id"], row["thoughts"], row["program"], row["kind"], SCENES[row["scene"]])
    except KeyError as error:
        raise DataError(
            f"A hand-written alignment case lacks {error}.", hint="Restore it: git checkout -- data"
        ) from error
    if case.kind not in KINDS or case.aligned != row["aligned"]:
        raise DataError(
            f"The hand-written alignment case {case.id} contradicts itself.", hint="Restore it: git checkout -- data"
        )
    return case
