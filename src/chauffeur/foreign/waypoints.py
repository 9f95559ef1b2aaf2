"""Waypoints out of a model's words, however it wrote them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from chauffeur.foreign.model_text import answer_in
from chauffeur.foreign.numbers import NUMBER, numbers_in, plain_signs

if TYPE_CHECKING:
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]

STEP_S: Final = 0.5
"""Time between waypoints: nuScenes' keyframes are taken at 2 Hz."""
FUTURE: Final = 6
"""Waypoints of 3 s, which the field's open-loop figures are about."""
Pair = tuple[float, float, float | None]
"""x and y, m, and the time, s, where it is told."""

READING: Final = "read-v2"
"""Id of the rules below; figures belong to them."""
_GROUP: Final = re.compile(r"[(\[{]([^()\[\]{}]{1,200})[)\]}]")
_LINE_CHARS: Final = 200
_COUNT: Final = re.compile(r"\A\s{0,9}\d{1,2}[.):]\s{1,9}(?=\S)")
_SIDE: Final = re.compile(r"\b(?:right|behind|back)\b", re.IGNORECASE)
"""A side in words, whose sign would have to be guessed."""
_BREAK: Final = re.compile(
    r"\n\s{0,9}\n|[.!?]\s{1,9}[A-Z]|\b(?:from|relative|origin|was|were|instead|or|better)\b|[\])}][^\[({]*\Z",
    re.IGNORECASE,
)
"""Separators of two lists of points: a sentence or paragraph that ends, a word that compares, the end of a list."""
_GAP_CHARS: Final = 80
_X, _Y = (re.compile(rf"\b{name}\b[\"'\s]{{0,4}}[:=]\s{{0,4}}({NUMBER.pattern})", re.IGNORECASE) for name in "xy")
_MOST_M: Final = 500.0
"""No vehicle gets farther in six seconds."""


def read_waypoints(words: str, steps: int = FUTURE) -> FloatArray | None:
    """Waypoints (steps, 2), m, of an answer; None where it has none that can be meant.

    Read are brackets of any kind that hold two numbers, with or without names (`(1, 0.2)`, `[1, 0.2]`, `{"x": 1, "y":
    0.2}`), or three of which the first is the time; else lines with two numbers. Points that follow each other are one
    list, whose last `steps` count: models go on from the past that they were told. What stands beside a list of so many
    is no part of it; two different lists are no answer, and neither are fewer points.
    """
    text = plain_signs(answer_in(words))
    times = tuple(STEP_S * (i + 1) for i in range(steps))
    pairs, ends = list[Pair](), list[int]()
    lists: list[list[Pair]] = []
    for one in _GROUP.finditer(text):
        if (pair := _pair(one[1], times)) is not None:
            gap = text[ends[-1] : one.start()] if ends else ""
            if not ends or len(gap) > _GAP_CHARS or _BREAK.search(gap):
                lists.append([])
            lists[-1].append(pair)
            pairs.append(pair)
            ends.append(one.end())
    found = {points for one in lists if (points := _points(one, times))}
    if not found and len(pairs) == steps:  # a sentence each
        found = {points for points in (_points(pairs, times),) if points}
    if not found:
        found = {points for one in _lines(text, times) if (points := _points(one, times))}
    if len(found) != 1:
        return None
    meant = np.array(found.pop(), np.float64)
    return meant if np.isfinite(meant).all() and float(np.abs(meant).max()) < _MOST_M else None


def _points(pairs: list[Pair], times: Sequence[float]) -> tuple[tuple[float, float], ...]:
    """The waypoints of a list, one a time; nothing where it has fewer."""
    timed = [pair for pair in pairs if pair[2] is not None][-len(times) :]
    meant = timed if [pair[2] for pair in timed] == list(times) else [pair for pair in pairs if pair[2] is None]
    return tuple(pair[:2] for pair in meant[-len(times) :]) if len(meant) >= len(times) else ()


def _lines(text: str, times: Sequence[float]) -> list[list[Pair]]:
    """Pairs of lines that follow each other."""
    lists: list[list[Pair]] = [[]]
    for line in text.splitlines():
        pair = _pair(_COUNT.sub("", line), times) if len(line) <= _LINE_CHARS else None
        if pair is not None:
            lists[-1].append(pair)
        elif line.strip():
            lists.append([])
    return lists


def _pair(text: str, times: Sequence[float]) -> Pair | None:
    """(x, y, time or None) of a bracket or line; None where it holds no pair."""
    if _SIDE.search(text):
        return None
    x, y = _X.search(text), _Y.search(text)
    if x is not None and y is not None:
        return float(x[1]), float(y[1]), None
    numbers = numbers_in(text)
    if len(numbers) == 2:
        return numbers[0], numbers[1], None
    if len(numbers) == 3 and numbers[0] in times:
        return numbers[1], numbers[2], numbers[0]
    return None
