"""Retrieval one entry at a time, in plain Python: what the columns are held to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from chauffeur.memory.columns import Columns, Entry, Signs, packed
from chauffeur.memory.similarity import Mark, likeness, mark


@dataclass(frozen=True)
class Remembered:
    """A wish with all that counts."""

    row: int
    mark: Mark
    world: str
    weather: int
    when: datetime
    said: Signs | None


def remembered(
    row: int, text: str, when: datetime, world: str = "highway", weather: int = 0, said: Signs | None = None
) -> Remembered:
    return Remembered(row, mark(text), world, weather, when, said)


def columns_of(entries: Sequence[Remembered]) -> Columns:
    columns = Columns()
    columns.extend([entry_of(one) for one in entries])
    return columns


def entry_of(one: Remembered) -> Entry:
    return Entry(
        one.row, packed(one.mark.vector), one.mark.tags, one.mark.quantities, one.world, one.weather, one.when, one.said
    )


def similarities(wish: Mark, world: str, weather: int, now: datetime, entries: Sequence[Remembered]) -> list[float]:
    """Similarity of each entry, also of those below the floor."""
    cosines = np.array([float(np.dot(one.mark.vector, wish.vector)) for one in entries], np.float32)
    found: list[float] = []
    for one, like in zip(entries, likeness(wish, cosines, (each.mark for each in entries)), strict=True):
        age_days = max(0.0, (now - one.when).total_seconds() / 86_400.0)
        circumstances = 0.80 + 0.12 * (one.world == world) + 0.08 * 0.5 ** (age_days / 30.0)
        if weather and not weather & one.weather:
            circumstances -= 0.11 if one.weather else 0.09
        found.append(like * circumstances)
    return found


def rank(entries: Sequence[Remembered], similarities: Sequence[float], k: int) -> list[tuple[int, float]]:
    """The `k` nearest above the floor, with both sides of the newest verdict."""
    scored = sorted(((value, one.row) for value, one in zip(similarities, entries, strict=True) if value >= 0.2))[::-1]
    if k <= 0 or not scored:
        return []
    value_of, entry_of_row = {row: value for value, row in scored}, {one.row: one for one in entries}
    judged = sorted((row for row in value_of if entry_of_row[row].said is not None), reverse=True)
    wanted = judged[:1]
    for row in judged[1:]:
        newest, other = entry_of_row[judged[0]], entry_of_row[row]
        assert newest.said is not None
        assert other.said is not None
        clash = any(a * b < 0 for a, b in zip(newest.said, other.said, strict=True))
        if clash and newest.world == other.world:
            wanted.append(row)
            break
    wanted = wanted[:k]
    chosen = [row for _, row in scored[:k]]
    others = [row for row in chosen if row not in wanted][: k - len(wanted)]
    rows = [row for row in chosen if row in wanted or row in others] + [row for row in wanted if row not in chosen]
    return [(row, value_of[row]) for row in rows]
