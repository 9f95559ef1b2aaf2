"""What a fuzzing target is."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable
from dataclasses import dataclass


class BrokenError(Exception):
    """An invariant of a target does not hold; the text says which, and names no input."""


@dataclass(frozen=True, slots=True)
class Target:
    """Something that is given bytes from outside.

    Attributes:
        name: As `run.py` takes it.
        invariant: What must hold for every input, in one sentence.
        reads: Packages and modules whose branches guide the fuzzer.
        seeds: Inputs to begin with.
        changed: A new input made of one, which a change of single bytes would hardly come to.
        examine: Gives an input to the code and says in a word what became of it; raises where the invariant does not
            hold, whatever it raises.
    """

    name: str
    invariant: str
    reads: tuple[str, ...]
    seeds: Callable[[], Iterable[bytes]]
    changed: Callable[[bytes, random.Random], bytes]
    examine: Callable[[bytes], str]


def text_of(data: bytes) -> str:
    """Bytes as text, lone surrogates included: a JSON escape in a reply can bring them. Never raises."""
    try:
        return data.decode("utf-8", "surrogatepass")
    except UnicodeDecodeError:
        return data.decode("utf-8", "surrogateescape")


def bytes_of(text: str) -> bytes:
    """The bytes that `text_of` makes the text of."""
    return text.encode("utf-8", "surrogatepass")


def expect(holds: object, what: str) -> None:
    """Raise where an invariant does not hold."""
    if not holds:
        raise BrokenError(what)
