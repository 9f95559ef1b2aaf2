"""Remembered wishes as columns of numbers, so that one recall looks at all of them at once.

A column holds one number of every wish. The vectors lie by dimension: a present wish has words in some forty of them,
and the others need not be looked at. No word of a person is in here, and what is removed is overwritten.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final, Generic, TypeVar

import numpy as np
import numpy.typing as npt

from chauffeur.memory.similarity import (
    CONFLICT,
    DIMENSIONS,
    MEANING_SHARE,
    NUMBERS_SHARE,
    STEEPNESS,
    TEXT_SHARE,
    Mark,
    Vector,
    opposed_to,
)

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]
Places = npt.NDArray[np.intp]
"""Where wishes stand in the columns."""

Signs = tuple[int, int, int]
"""What was said of a trip about speed, gap and comfort, with the signs of `Feedback`."""

GONE: Final = -1
"""Row of a wish that was removed."""

_ROOM: Final = 64
_CELL: Final = np.dtype([("dimension", "<u2"), ("value", "<f4")])
_DEAD_SHARE: Final = 0.25
"""Removed wishes take up at most this part of the columns, and `_ROOM`, before the others move together."""

T = TypeVar("T", bound=Hashable)


@dataclass(frozen=True, slots=True)
class Entry:
    """What the columns are made of: one remembered trip.

    Attributes:
        row: Its row in the profile; later trips have larger ones.
        vector: Encoded wish, as `packed` writes it.
        tags, quantities: As in `Mark`.
        world: World kind.
        weather: Bits of `chauffeur.memory.weather`.
        when: When it was driven.
        said: What the feedback says; None where there was none.
    """

    row: int
    vector: bytes
    tags: int
    quantities: tuple[tuple[str, float], ...]
    world: str
    weather: int
    when: datetime
    said: Signs | None


def packed(vector: Vector) -> bytes:
    """A vector without its zeros: pairs of dimension and value, some 200 bytes for a sentence."""
    found = np.flatnonzero(vector)
    cells = np.empty(len(found), _CELL)
    cells["dimension"], cells["value"] = found, vector[found]
    return cells.tobytes()


class Columns:
    """All wishes of one person, in the order of their rows. One thread at a time."""

    def __init__(self) -> None:
        self._rows, self._whens = _Column(np.int64), _Column(np.float64)
        self._tags, self._worlds, self._weathers = _Column(np.int32), _Column(np.int32), _Column(np.int32)
        self._judged, self._signs = _Column(np.bool_), tuple(_Column(np.int8) for _ in range(3))
        self._owners, self._measures, self._amounts = _Column(np.int64), _Column(np.int32), _Column(np.float64)
        self._vectors = np.zeros((DIMENSIONS, _ROOM), np.float32)
        self._tag_sets, self._weather_kinds = _Codes[int](), _Codes[int]()
        self._world_names, self._measure_names = _Codes[str](), _Codes[str]()
        self._dead = 0

    def __len__(self) -> int:
        return len(self.rows) - self._dead

    @property
    def rows(self) -> npt.NDArray[np.int64]:
        """Rows in the profile, rising; `GONE` for removed wishes."""
        return self._rows.values

    @property
    def whens(self) -> Floats:
        """Unix times, seconds."""
        return self._whens.values

    @property
    def judged(self) -> Bools:
        """Whether feedback was given."""
        return self._judged.values

    @property
    def signs(self) -> tuple[npt.NDArray[np.int8], ...]:
        """What the feedback says about speed, gap and comfort."""
        return tuple(column.values for column in self._signs)

    def by_world(self, value: Callable[[str], float], places: Places) -> Floats:
        """A number for each of some wishes, by its kind of world."""
        return self._world_names.table(value)[self._worlds.values[places]]

    def by_weather(self, value: Callable[[int], float], places: Places) -> Floats:
        """A number for each of some wishes, by its weather."""
        return self._weather_kinds.table(value)[self._weathers.values[places]]

    def same_world(self, place: int, places: Places) -> Bools:
        """Which of some wishes were made in the same kind of world as the one at a place."""
        return self._worlds.values[places] == self._worlds.values[place]

    def likeness(self, wish: Mark) -> Floats:
        """0..1 for each wish, 0 for removed ones; what `similarity.likeness` says of them one by one."""
        against = opposed_to(wish.tags)
        tags = self._tags.values
        same = self._tag_sets.table(lambda other: _same(wish.tags, other))
        text = self._tag_sets.table(lambda other: TEXT_SHARE if wish.tags | other else 1.0)
        left = self._tag_sets.table(lambda other: CONFLICT if against & other else 1.0)
        meaning = text[tags] * np.clip(self._cosines(wish.vector), 0.0, 1.0) + same[tags]
        self._draw_together(meaning, wish.quantities)
        return meaning * left[tags]

    def extend(self, entries: Sequence[Entry]) -> None:
        """Add wishes whose rows are larger than all that are there."""
        start = len(self.rows)
        self._rows.extend([one.row for one in entries])
        self._whens.extend([one.when.timestamp() for one in entries])
        self._tags.extend(self._tag_sets.of(one.tags for one in entries))
        self._worlds.extend(self._world_names.of(one.world for one in entries))
        self._weathers.extend(self._weather_kinds.of(one.weather for one in entries))
        self._judged.extend([one.said is not None for one in entries])
        for topic, column in enumerate(self._signs):
            column.extend([0 if one.said is None else one.said[topic] for one in entries])
        said = [(start + at, *pair) for at, one in enumerate(entries) for pair in one.quantities]
        self._owners.extend([owner for owner, _, _ in said])
        self._measures.extend(self._measure_names.of(measure for _, measure, _ in said))
        self._amounts.extend([amount for _, _, amount in said])
        self._place_vectors(start, [one.vector for one in entries])

    def judge(self, row: int, signs: Signs) -> None:
        """Feedback was given to a wish: what it says about a topic counts from now on."""
        for place in np.flatnonzero(self.rows == row):
            self.judged[place] = True
            for column, sign in zip(self.signs, signs, strict=True):
                column[place] = sign or column[place]

    def remove(self, rows: Collection[int]) -> None:
        """Overwrite wishes."""
        if not rows:
            return
        gone = np.isin(self.rows, list(rows))
        self._keep_quantities(~gone)
        self._vectors[:, np.flatnonzero(gone)] = 0.0
        self._dead += int(np.count_nonzero(gone))
        (nothing,) = self._tag_sets.of([0])
        for column, blank in (
            (self._rows, GONE), (self._whens, 0.0), (self._tags, nothing), (self._judged, False),
            *((column, 0) for column in self._signs),
        ):  # fmt: skip
            column.values[gone] = blank
        if self._dead > max(_ROOM, _DEAD_SHARE * len(self.rows)):
            self._move_together()

    def wipe(self) -> None:
        """Overwrite everything."""
        self._keep(np.zeros(len(self.rows), np.bool_))
        for codes in (self._tag_sets, self._weather_kinds, self._world_names, self._measure_names):
            codes.clear()

    def _cosines(self, vector: Vector) -> Vector:
        count = len(self.rows)
        total, part = np.zeros(count, np.float32), np.empty(count, np.float32)
        for dimension in np.flatnonzero(vector).tolist():
            np.multiply(self._vectors[dimension, :count], vector[dimension], out=part)
            total += part
        return total

    def _draw_together(self, meaning: Floats, quantities: tuple[tuple[str, float], ...]) -> None:
        """Numbers of the same measure count, where both wishes have some: the nearest two of them."""
        names = self._measure_names.known()
        nearest = np.full(len(meaning), -1.0)
        for measure, amount in quantities:
            if measure not in names:
                continue
            chosen = self._measures.values == names.index(measure)
            others = self._amounts.values[chosen]
            larger = np.maximum(np.abs(others), abs(amount))
            apart = np.abs(others - amount) / np.where(larger > 0.0, larger, 1.0)
            np.maximum.at(nearest, self._owners.values[chosen], np.exp(-STEEPNESS * apart))
        told = nearest >= 0.0
        meaning[told] = (1.0 - NUMBERS_SHARE) * meaning[told] + NUMBERS_SHARE * nearest[told]

    def _place_vectors(self, start: int, vectors: Sequence[bytes]) -> None:
        end = start + len(vectors)
        if end > self._vectors.shape[1]:
            roomy = np.zeros((DIMENSIONS, max(end + end // 4, 2 * self._vectors.shape[1])), np.float32)
            roomy[:, :start] = self._vectors[:, :start]
            self._vectors.fill(0.0)
            self._vectors = roomy
        cells = np.frombuffer(b"".join(vectors), _CELL)
        owners = np.repeat(np.arange(start, end), [len(one) // _CELL.itemsize for one in vectors])
        self._vectors[cells["dimension"], owners] = cells["value"]

    def _move_together(self) -> None:
        self._keep(self.rows != GONE)

    def _keep(self, kept: Bools) -> None:
        self._keep_quantities(kept)
        left = self._vectors[:, np.flatnonzero(kept)]
        self._vectors.fill(0.0)
        self._vectors[:, : left.shape[1]] = left
        left.fill(0.0)
        new_places = np.cumsum(kept) - 1
        self._owners.values[:] = new_places[self._owners.values]
        for column in (self._rows, self._whens, self._tags, self._worlds, self._weathers, self._judged, *self._signs):
            column.keep(kept)
        self._dead = 0

    def _keep_quantities(self, kept: Bools) -> None:
        whose = kept[self._owners.values]
        for column in (self._owners, self._measures, self._amounts):
            column.keep(whose)


def _same(tags: int, others: int) -> float:
    """What the tags that two wishes share add to their likeness."""
    union = tags | others
    return MEANING_SHARE * ((tags & others).bit_count() / union.bit_count()) if union else 0.0


class _Column:
    """Numbers that grow at the end; what is dropped is overwritten."""

    __slots__ = ("_cells", "_count")

    def __init__(self, kind: type[np.generic]) -> None:
        self._cells: npt.NDArray[Any] = np.zeros(_ROOM, kind)
        self._count = 0

    @property
    def values(self) -> npt.NDArray[Any]:
        return self._cells[: self._count]

    def extend(self, values: Sequence[Any]) -> None:
        end = self._count + len(values)
        if end > len(self._cells):
            cells = np.zeros(max(end, 2 * len(self._cells)), self._cells.dtype)
            cells[: self._count] = self.values
            self._cells.fill(0)
            self._cells = cells
        self._cells[self._count : end] = values
        self._count = end

    def keep(self, kept: Bools) -> None:
        left = self.values[kept]
        self._cells.fill(0)
        self._count = len(left)
        self._cells[: self._count] = left


class _Codes(Generic[T]):
    """Small numbers for values of which there are few: worlds, weathers, sets of tags."""

    __slots__ = ("_codes",)

    def __init__(self) -> None:
        self._codes: dict[T, int] = {}

    def of(self, values: Iterable[T]) -> list[int]:
        return [self._codes.setdefault(value, len(self._codes)) for value in values]

    def known(self) -> tuple[T, ...]:
        return tuple(self._codes)

    def table(self, value: Callable[[T], float]) -> Floats:
        """What a function says of each value, by its code."""
        return np.array([value(one) for one in self._codes], np.float64)

    def clear(self) -> None:
        self._codes.clear()
