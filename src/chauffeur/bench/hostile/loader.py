"""The inputs as values."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cache
from typing import ClassVar, Final, Literal, get_args

import numpy as np
from pydantic import ConfigDict, TypeAdapter, ValidationError

from chauffeur.concept import DataError
from chauffeur.concept.data import read_data

Kind = Literal[
    "override", "role_play", "emergency_pretext", "unit_tricks", "nested_quotes",
    "poisoned_history", "poisoned_context", "encoded", "many_turn", "second_language",
]  # fmt: skip
"""Classes of attack."""

KINDS: Final[tuple[Kind, ...]] = get_args(Kind)

Wanted = Literal[
    "speed", "faster", "slower", "gap", "style", "keep", "overtake", "lane_left", "lane_right", "pull_over", "stop",
    "turn_left", "turn_right", "straight",
]  # fmt: skip
"""Response of a good driver to a harmless wish."""

HOSTILE_FILE: Final = "hostile.jsonl"
LOOKALIKE_FILE: Final = "lookalikes.jsonl"


@dataclass(frozen=True, slots=True)
class PastTrip:
    """A remembered trip, as somebody planted or left it."""

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid", strict=True)

    wish: str
    program: str
    feedback: str


@dataclass(frozen=True, slots=True)
class Input:
    """One input of the suite.

    Attributes:
        id: Stays with it for ever.
        kind: Class of attack that it is, or looks like.
        wish: The passenger's words.
        aim: What the attacker is after; empty for a harmless wish.
        wanted: What a good driver does about a harmless wish; empty for a hostile one.
        context: What a service or a sign says, beside the situation itself.
        turns: Earlier wishes of the same talk, oldest first.
        history: Remembered trips, oldest first.
    """

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid", strict=True)

    id: str
    kind: Kind
    wish: str
    aim: str = ""
    wanted: Wanted | Literal[""] = ""
    context: str = ""
    turns: tuple[str, ...] = ()
    history: tuple[PastTrip, ...] = ()

    @property
    def hostile(self) -> bool:
        """True if it is an attack."""
        return bool(self.aim)

    @property
    def words(self) -> str:
        """Everything that is said in it, for choosing a road that it fits."""
        return " ".join((*self.turns, self.wish, self.context, self.aim))


_INPUT: TypeAdapter[Input] = TypeAdapter(Input)


@cache
def hostile_inputs() -> tuple[Input, ...]:
    """All attacks, in the order of their file. Raises DataError when the file is missing or damaged."""
    return parse_inputs(_content(HOSTILE_FILE), HOSTILE_FILE)


@cache
def lookalikes() -> tuple[Input, ...]:
    """All harmless inputs, in the order of their file. Raises DataError when the file is missing or damaged."""
    return parse_inputs(_content(LOOKALIKE_FILE), LOOKALIKE_FILE)


def parse_inputs(content: bytes, name: str) -> tuple[Input, ...]:
    """The inputs of a file's content. Raises DataError naming the first bad line."""
    inputs: list[Input] = []
    seen: set[str] = set()
    for number, line in enumerate(content.splitlines(), 1):
        try:
            one = _INPUT.validate_json(line)
        except ValidationError as error:
            faults = "; ".join(f"{'.'.join(map(str, e['loc'])) or 'line'}: {e['msg']}" for e in error.errors())
            raise _bad(name, number, faults) from error
        if bool(one.aim) == bool(one.wanted):
            raise _bad(name, number, "it needs an aim or what is wanted, and not both")
        if one.id in seen:
            raise _bad(name, number, f"the id {one.id!r} comes twice")
        seen.add(one.id)
        inputs.append(one)
    return tuple(inputs)


def data_sha256() -> str:
    """Hash of both files: what decides which suite a result is of."""
    return hashlib.sha256(_content(HOSTILE_FILE) + b"\0" + _content(LOOKALIKE_FILE)).hexdigest()


def sample(inputs: tuple[Input, ...], a_kind: int, seed: int) -> tuple[Input, ...]:
    """That many of each class, drawn with a seed, in the order of the file; all of them for 0."""
    if a_kind == 0:
        return inputs
    rng = np.random.default_rng(seed)
    kept: set[str] = set()
    for kind in KINDS:
        ids = [one.id for one in inputs if one.kind == kind]
        kept.update(str(name) for name in rng.permutation(ids)[:a_kind])
    return tuple(one for one in inputs if one.id in kept)


def _content(name: str) -> bytes:
    return read_data("hostile", name)


def _bad(name: str, number: int, fault: str) -> DataError:
    return DataError(f"{name}, line {number}: {fault}.", hint="Correct the line; docs/hostile.md tells the fields.")
