"""Remembered wishes as columns of numbers, so that one recall looks at all of them at once.

A column holds one number of every wish. People repeat themselves, so what the words of a wish come to (its mark) is
kept and compared once for all trips with the same one. The vectors of the marks lie by dimension: a present wish has
words in some forty of them, and the others need not be looked at. No word of a person is in here, and what is removed
is overwritten.
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

Quantities = tuple[tuple[str, float], ...]
"""As in `Mark`."""

_Mark = tuple[bytes, int, Quantities]
"""A mark as it is written: vector, tags, quantities."""

GONE: Final = -1
"""Row of a wish that was removed."""

_BLANK: Final = 0
"""Mark of removed wishes: no words, no meaning, no numbers, so that nothing is like it."""

_ROOM: Final = 64
_CELL: Final = np.dtype([("dimension", "<u2"), ("value", "<f4")])
_AT_ONCE: Final = 4096
"""So many vectors are multiplied in one piece; of more, the pieces would not fit into the processor's cache."""
_NOTHING: Final[_Mark] = (b"", 0, ())
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
        weather: Bits of `chauffeur.language.weather`.
        when: When it was driven.
        said: What the feedback says; None where there was none.
    """

    row: int
    vector: bytes
    tags: int
    quantities: Quantities
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
        self._rows, self._whens, self._kinds = _Column(np.int64), _Column(np.float64), _Column(np.intp)
        self._judged, self._signs = _Column(np.bool_), tuple(_Column(np.int8) for _ in range(3))
        self._circumstances, self._circumstance_kinds = _Column(np.intp), _Codes[tuple[str, int]]()
        self._marks = _Marks()
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

    @property
    def circumstances(self) -> Places:
        """Kind of world and weather, by their place in what `of_circumstances` returns."""
        return self._circumstances.values

    def of_circumstances(self, value: Callable[[str, int], float]) -> Floats:
        """What a function says of each kind of world and weather there is."""
        return np.array([value(*kind) for kind in self._circumstance_kinds.known()], np.float64)

    def same_world(self, place: int, places: Places) -> Bools:
        """Which of some wishes were made in the same kind of world as the one at a place."""
        kinds = self._circumstance_kinds.known()
        world, _ = kinds[self.circumstances[place]]
        return np.array([name == world for name, _ in kinds])[self.circumstances[places]]

    def likeness(self, wish: Mark) -> Floats:
        """0..1 for each wish, 0 for removed ones; what `similarity.likeness` says of them one by one."""
        return self._marks.likeness(wish).take(self._kinds.values)

    def extend(self, entries: Sequence[Entry]) -> None:
        """Add wishes whose rows are larger than all that are there."""
        self._kinds.extend(self._marks.of([(one.vector, one.tags, one.quantities) for one in entries]))
        self._rows.extend([one.row for one in entries])
        self._whens.extend([one.when.timestamp() for one in entries])
        self._circumstances.extend(self._circumstance_kinds.of((one.world, one.weather) for one in entries))
        self._judged.extend([one.said is not None for one in entries])
        for topic, column in enumerate(self._signs):
            column.extend([0 if one.said is None else one.said[topic] for one in entries])

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
        self._dead += int(np.count_nonzero(gone))
        for column, blank in (
            (self._rows, GONE), (self._whens, 0.0), (self._kinds, _BLANK), (self._circumstances, 0),
            (self._judged, False),
            *((column, 0) for column in self._signs),
        ):  # fmt: skip
            column.values[gone] = blank
        self._marks.blank(self._used())
        if self._dead > max(_ROOM, _DEAD_SHARE * len(self.rows)):
            self._keep(self.rows != GONE)

    def wipe(self) -> None:
        """Overwrite everything."""
        self._keep(np.zeros(len(self.rows), np.bool_))
        self._circumstance_kinds.clear()

    def _keep(self, kept: Bools) -> None:
        for column in (self._rows, self._whens, self._kinds, self._circumstances, self._judged, *self._signs):
            column.keep(kept)
        self._kinds.values[:] = self._marks.keep(self._used())[self._kinds.values]
        self._dead = 0

    def _used(self) -> Bools:
        """Which marks any wish has."""
        return np.bincount(self._kinds.values, minlength=len(self._marks)) > 0


class _Marks:
    """Every mark that wishes have, once; the first is `_BLANK`."""

    def __init__(self) -> None:
        self._vectors = np.zeros((DIMENSIONS, _ROOM), np.float32)
        self._cells, self._tags = _Column(np.int16), _Column(np.intp)
        self._owners, self._measures, self._amounts = _Column(np.int64), _Column(np.int32), _Column(np.float64)
        self._tag_sets, self._measure_names = _Codes[int](), _Codes[str]()
        self._add([_NOTHING])

    def __len__(self) -> int:
        return len(self._tags.values)

    def of(self, marks: Sequence[_Mark]) -> list[int]:
        """Where some marks stand; those that are new are added."""
        known = dict.fromkeys(marks, _BLANK)
        if len(self) > 1:
            known = {mark: self._found(mark) for mark in known}
        new = [mark for mark, place in known.items() if place == _BLANK and mark != _NOTHING]
        known.update(zip(new, range(len(self), len(self) + len(new)), strict=True))
        self._add(new)
        return [known[mark] for mark in marks]

    def likeness(self, wish: Mark) -> Floats:
        """0..1 for each mark."""
        against = opposed_to(wish.tags)
        shares = [
            (TEXT_SHARE if wish.tags | other else 1.0, _same(wish.tags, other), CONFLICT if against & other else 1.0)
            for other in self._tag_sets.known()
        ]
        text, same, left = np.array(shares).T.take(self._tags.values, axis=1)
        meaning = text * np.minimum(np.maximum(self._cosines(wish.vector), 0.0), 1.0) + same
        self._draw_together(meaning, wish.quantities)
        return meaning * left

    def blank(self, used: Bools) -> None:
        """Overwrite the marks that are no longer used; the others stay where they are."""
        nothing = self._tags.values[_BLANK]
        unused = np.flatnonzero(~used & ((self._cells.values > 0) | (self._tags.values != nothing)))
        self._keep_quantities(used)
        self._vectors[:, unused] = 0.0
        self._cells.values[unused] = 0
        self._tags.values[unused] = nothing

    def keep(self, used: Bools) -> Places:
        """Overwrite the marks that are not used and move the others together; where those stand now."""
        used[_BLANK] = True
        self._keep_quantities(used)
        left = self._vectors[:, np.flatnonzero(used)]
        self._vectors.fill(0.0)
        self._vectors[:, : left.shape[1]] = left
        left.fill(0.0)
        for column in (self._cells, self._tags):
            column.keep(used)
        new_places = np.cumsum(used) - 1
        self._owners.values[:] = new_places[self._owners.values]
        if len(self) == 1:
            self._tag_sets.clear()
            self._measure_names.clear()
            self._tags.values[:] = self._tag_sets.of([0])
        return new_places

    def _found(self, mark: _Mark) -> int:
        """Where a mark stands; `_BLANK` where it is not there."""
        vector, tags, quantities = mark
        cells = np.frombuffer(vector, _CELL)
        (tag_set,) = self._tag_sets.of([tags])
        alike = np.flatnonzero((self._tags.values == tag_set) & (self._cells.values == len(cells)))
        for dimension, value in cells.tolist():
            alike = alike[self._vectors[dimension, alike] == value]
        return next((place for place in alike.tolist() if self._numbers(place) == quantities), _BLANK)

    def _numbers(self, place: int) -> tuple[tuple[str, float], ...]:
        names, own = self._measure_names.known(), self._owners.values == place
        measures, amounts = self._measures.values[own].tolist(), self._amounts.values[own].tolist()
        return tuple((names[measure], amount) for measure, amount in zip(measures, amounts, strict=True))

    def _cosines(self, vector: Vector) -> Vector:
        """The dot products. The order of the sum is that of the dimensions either way: the same bits."""
        count, said = len(self), np.flatnonzero(vector)
        if count <= _AT_ONCE:
            parts = self._vectors[said, :count]
            parts *= vector[said][:, np.newaxis]
            return np.add.reduce(parts, axis=0)
        total, part = np.zeros(count, np.float32), np.empty(count, np.float32)
        for dimension in said.tolist():
            np.multiply(self._vectors[dimension, :count], vector[dimension], out=part)
            total += part
        return total

    def _draw_together(self, meaning: Floats, quantities: Quantities) -> None:
        """Numbers of the same measure count, where both wishes have some: the nearest two of them."""
        names = self._measure_names.known()
        quantities = tuple(one for one in quantities if one[0] in names)
        if not quantities:
            return
        nearest = np.full(len(meaning), -1.0)
        for measure, amount in quantities:
            chosen = self._measures.values == names.index(measure)
            others = self._amounts.values[chosen]
            larger = np.maximum(np.abs(others), abs(amount))
            apart = np.abs(others - amount) / np.where(larger > 0.0, larger, 1.0)
            np.maximum.at(nearest, self._owners.values[chosen], np.exp(-STEEPNESS * apart))
        told = nearest >= 0.0
        meaning[told] = (1.0 - NUMBERS_SHARE) * meaning[told] + NUMBERS_SHARE * nearest[told]

    def _add(self, marks: Sequence[_Mark]) -> None:
        start = len(self)
        self._tags.extend(self._tag_sets.of(tags for _, tags, _ in marks))
        said = [(start + at, *pair) for at, (_, _, quantities) in enumerate(marks) for pair in quantities]
        self._owners.extend([owner for owner, _, _ in said])
        self._measures.extend(self._measure_names.of(measure for _, measure, _ in said))
        self._amounts.extend([amount for _, _, amount in said])
        self._place_vectors(start, [vector for vector, _, _ in marks])

    def _place_vectors(self, start: int, vectors: Sequence[bytes]) -> None:
        end = start + len(vectors)
        if end > self._vectors.shape[1]:
            roomy = np.zeros((DIMENSIONS, max(end + end // 4, 2 * self._vectors.shape[1])), np.float32)
            roomy[:, :start] = self._vectors[:, :start]
            self._vectors.fill(0.0)
            self._vectors = roomy
        counts = [len(one) // _CELL.itemsize for one in vectors]
        cells = np.frombuffer(b"".join(vectors), _CELL)
        self._vectors[cells["dimension"], np.repeat(np.arange(start, end), counts)] = cells["value"]
        self._cells.extend(counts)

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
    """Small numbers for values of which there are few: circumstances, sets of tags."""

    __slots__ = ("_codes",)

    def __init__(self) -> None:
        self._codes: dict[T, int] = {}

    def of(self, values: Iterable[T]) -> list[int]:
        return [self._codes.setdefault(value, len(self._codes)) for value in values]

    def known(self) -> tuple[T, ...]:
        return tuple(self._codes)

    def clear(self) -> None:
        self._codes.clear()
