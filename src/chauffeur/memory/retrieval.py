"""Which remembered wishes bear on the present one: by meaning, kind of world and recency."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from chauffeur.memory.similarity import Mark, likeness

_LIKENESS, _WORLD, _RECENCY = 0.80, 0.12, 0.08
_HALF_LIFE_DAYS = 30.0
_FLOOR = 0.2
"""Below this a memory has nothing to do with the wish; showing it would only mislead."""


@dataclass(frozen=True, slots=True)
class Entry:
    """What the index holds of one remembered trip.

    Attributes:
        row: Its row in the profile; later trips have larger ones.
        mark: Encoded wish.
        world: World kind.
        when: When it was driven.
        judged: Whether feedback was given.
    """

    row: int
    mark: Mark
    world: str
    when: datetime
    judged: bool


def rank(wish: Mark, world: str, now: datetime, entries: Sequence[Entry], k: int) -> list[tuple[int, float]]:
    """Rows and similarities (0..1) of the `k` entries nearest to a wish, nearest first.

    The latest verdict on such wishes holds over older ones, so the newest entry with feedback is always among them.
    """
    if not entries or k <= 0:
        return []
    texts = np.stack([entry.mark.vector for entry in entries]) @ wish.vector
    scored: list[tuple[float, int, bool]] = []
    for entry, like in zip(entries, likeness(wish, texts, (entry.mark for entry in entries)), strict=True):
        age_days = max(0.0, (now - entry.when).total_seconds() / 86_400.0)
        circumstances = _LIKENESS + _WORLD * (entry.world == world) + _RECENCY * 0.5 ** (age_days / _HALF_LIFE_DAYS)
        similarity = like * circumstances
        if similarity >= _FLOOR:
            scored.append((similarity, entry.row, entry.judged))
    scored.sort(reverse=True)
    chosen = scored[:k]
    verdicts = [one for one in scored if one[2]]
    latest = max(verdicts, key=lambda one: one[1], default=None)
    if latest is not None and latest not in chosen:
        chosen[-1] = latest
    return [(row, similarity) for similarity, row, _ in chosen]
