"""Waypoints out of a model's words, however it wrote them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

import numpy as np

from chauffeur.bench.openloop.nuscenes import FUTURE, STEP_S

if TYPE_CHECKING:
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]

READING: Final = "read-v1"
"""Id of the rules below; figures belong to them."""
_GROUP: Final = re.compile(r"[(\[{]([^()\[\]{}]{1,120})[)\]}]")
_NUMBER: Final = re.compile(r"[-+]?(?:\d{1,9}\.?\d{0,12}|\.\d{1,12})(?:e[-+]?\d{1,3})?")
_TIMES: Final = tuple(STEP_S * (i + 1) for i in range(FUTURE))
_MOST_CHARS: Final = 50_000
_MOST_M: Final = 500.0
"""Nobody gets farther in three seconds."""


def read_waypoints(words: str) -> FloatArray | None:
    """Six waypoints (6, 2), m, of an answer; None where it has none that can be meant.

    Read are brackets of any kind that hold two numbers, with or without names (`(1, 0.2)`, `[1, 0.2]`, `{"x": 1, "y":
    0.2}`), or three of which the first is the time; else lines with two numbers. Of more than six in a row the last six
    count: models repeat the question first. Fewer are no answer.
    """
    text = words[-_MOST_CHARS:].replace("\u2212", "-")
    pairs = [pair for group in _GROUP.findall(text) if (pair := _pair(group))]
    if len(pairs) < FUTURE:
        pairs = [pair for line in text.splitlines() if (pair := _pair(line))]
    timed = [pair for pair in pairs if pair[2] is not None][-FUTURE:]
    said = [pair[2] for pair in timed]
    pairs = timed if said == list(_TIMES) else [pair for pair in pairs if pair[2] is None]
    if len(pairs) < FUTURE:
        return None
    found = np.array([pair[:2] for pair in pairs[-FUTURE:]], np.float64)
    return found if np.isfinite(found).all() and float(np.abs(found).max()) < _MOST_M else None


def _pair(text: str) -> tuple[float, float, float | None] | None:
    """(x, y, time or None) of a bracket or line; None where it holds no pair."""
    numbers = [float(one) for one in _NUMBER.findall(text.lower())]
    if len(numbers) == 2:
        return numbers[0], numbers[1], None
    if len(numbers) == 3 and numbers[0] in _TIMES:
        return numbers[1], numbers[2], numbers[0]
    return None
