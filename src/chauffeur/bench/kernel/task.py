"""Long work that is no run of a benchmark: making data, training a model.

A function does it, whose arguments are the options of its command (`chauffeur bench scenes`, `chauffeur model`): with a
sentence each in its `Args:`. One called `told` is told how far it is; what comes of it is a TaskResult.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated

from annotated_types import Ge

Told = Callable[[str, int, int], None]
"""Is told (stage, done, of how many)."""

Count = Annotated[int, Ge(0)]
Positive = Annotated[int, Ge(1)]


@dataclass(frozen=True, slots=True)
class TextTable:
    """A table in words: names at the left, figures at the right."""

    title: str
    header: Sequence[str]
    lines: Sequence[Sequence[str]]


@dataclass(frozen=True, slots=True)
class TaskResult:
    """What came of it: sentences and tables for people, in their order; `faulty` where something is wrong with it."""

    parts: tuple[str | TextTable, ...]
    faulty: bool = False
