"""Columns find what plain Python finds, and keep nothing of what was removed."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_ranking import Remembered, columns_of, entry_of, rank, remembered, similarities

from chauffeur.memory import retrieval
from chauffeur.memory.columns import GONE, Columns, Entry, packed
from chauffeur.memory.retrieval import nearest
from chauffeur.memory.similarity import DIMENSIONS, encode, likeness, mark

NOW = datetime(2026, 3, 1, tzinfo=UTC)
WISHES = (
    "drive faster", "Drive faster, please", "hurry up", "drive slower", "slow down a bit", "keep more distance",
    "keep a distance of 20 meters", "keep a distance of 35 meters", "drive at 100 km/h", "drive at 0 km/h",
    "go 10 km/h faster", "turn left", "do not turn left", "turn right", "change to the left lane",
    "overtake the truck", "play some music", "", "Fahr bitte schneller", "What a lovely day",
)  # fmt: skip
SIGN = st.sampled_from((-1, 0, 1))


@st.composite
def memories(draw: st.DrawFn) -> list[Remembered]:
    count = draw(st.integers(0, 40))
    rows = np.cumsum(draw(st.lists(st.integers(1, 3), min_size=count, max_size=count))).tolist()
    return [
        remembered(
            row,
            draw(st.sampled_from(WISHES)),
            NOW - timedelta(hours=draw(st.integers(-5, 3000))),
            draw(st.sampled_from(("highway", "intersection"))),
            draw(st.sampled_from((0, 1, 2, 6, 8))),
            draw(st.none() | st.tuples(SIGN, SIGN, SIGN)),
        )
        for row in rows
    ]


def same_ranking(columns: Columns, entries: Sequence[Remembered], text: str, world: str, weather: int, k: int) -> None:
    """Equal but for rounding: entries whose similarities differ by less may change places."""
    wish = mark(text)
    found = nearest(columns, wish, world, weather, NOW, k)
    values = similarities(wish, world, weather, NOW, entries)
    wanted = rank(entries, values, k)
    if any(abs(value - 0.2) < 1e-6 for value in values):
        return
    assert [value for _, value in found] == pytest.approx([value for _, value in wanted], abs=1e-6)
    for (row, _), (other, value) in zip(found, wanted, strict=True):
        assert row == other or values[[one.row for one in entries].index(row)] == pytest.approx(value, abs=1e-6)


@settings(max_examples=80, deadline=None)
@given(
    entries=memories(),
    text=st.sampled_from(WISHES),
    world=st.sampled_from(("highway", "parking")),
    weather=st.sampled_from((0, 1, 2, 4)),
    k=st.integers(-1, 8),
    lanes=st.integers(1, 6),
    looked_at=st.integers(1, 6),
)
def test_columns_rank_as_plain_python_does(
    entries: list[Remembered], text: str, world: str, weather: int, k: int, lanes: int, looked_at: int
) -> None:
    """Also where few wishes make many parts of which only some are looked at."""
    with patch.multiple(retrieval, _LANES=lanes, _LOOKED_AT=looked_at):
        same_ranking(columns_of(entries), entries, text, world, weather, k)


@settings(max_examples=80, deadline=None)
@given(entries=memories(), text=st.sampled_from(WISHES))
def test_likeness_is_what_plain_python_finds_one_by_one(entries: list[Remembered], text: str) -> None:
    wish = mark(text)
    cosines = np.array([float(np.dot(one.mark.vector, wish.vector)) for one in entries], np.float32)
    wanted = list(likeness(wish, cosines, (one.mark for one in entries)))
    assert columns_of(entries).likeness(wish).tolist() == pytest.approx(wanted, abs=1e-6)


@given(
    values=st.lists(st.sampled_from((0.0, 0.2, 0.5, 0.9, 1.0)) | st.floats(0.0, 1.0), max_size=60),
    k=st.integers(1, 12),
    lanes=st.integers(1, 8),
)
def test_what_is_reached_by_so_many_is_never_more_than_that(values: list[float], k: int, lanes: int) -> None:
    with patch.multiple(retrieval, _LANES=lanes):
        reached = retrieval._reached(np.array(values), k)
    if len(values) < k:
        assert reached == 0.0
    else:
        assert sum(value >= reached for value in values) >= k
        assert reached >= min(values)


def test_of_thousands_the_same_are_found_as_in_plain_python() -> None:
    rng = np.random.default_rng(3)
    entries = [
        remembered(
            row,
            WISHES[int(rng.integers(len(WISHES)))],
            NOW - timedelta(hours=int(rng.integers(0, 2000))),
            ("highway", "intersection")[int(rng.integers(2))],
            (0, 1, 2)[int(rng.integers(3))],
            ((0, 0, 0), (1, 0, 0), (-1, 0, 0))[int(rng.integers(3))] if rng.random() < 0.01 else None,
        )
        for row in range(1, 6001)
    ]
    columns = columns_of(entries)
    for text in WISHES:
        same_ranking(columns, entries, text, "highway", 2, 5)


@settings(max_examples=40, deadline=None)
@given(entries=memories(), data=st.data(), text=st.sampled_from(WISHES))
def test_columns_follow_every_change(entries: list[Remembered], data: st.DataObject, text: str) -> None:
    columns = Columns()
    kept: list[Remembered] = []
    for one in entries:
        columns.extend([entry_of(one)])
        kept.append(one)
        match data.draw(st.sampled_from(("nothing", "nothing", "remove", "judge"))):
            case "remove":
                gone = set(data.draw(st.lists(st.sampled_from([each.row for each in kept]), max_size=5)))
                columns.remove(gone)
                kept = [each for each in kept if each.row not in gone]
            case "judge" if kept:
                signs = data.draw(st.tuples(SIGN, SIGN, SIGN))
                at = data.draw(st.integers(0, len(kept) - 1))
                old = kept[at].said or (0, 0, 0)
                columns.judge(kept[at].row, signs)
                said = tuple(new or before for new, before in zip(signs, old, strict=True))
                kept[at] = Remembered(**{**vars(kept[at]), "said": said})
            case _:
                pass
        assert len(columns) == len(kept)
        same_ranking(columns, kept, text, "highway", 2, 3)


def many(count: int) -> list[Remembered]:
    return [
        remembered(row, f"keep a distance of {row} meters", NOW - timedelta(days=row / 10), said=(0, -1, 0))
        for row in range(1, count + 1)
    ]


def test_what_is_removed_is_overwritten() -> None:
    columns = columns_of(many(300))
    columns.remove(range(1, 41))
    assert len(columns) == 260
    assert np.count_nonzero(columns.rows == GONE) == 40, "so few wait for others"
    marks = columns._marks
    assert not marks._vectors[:, 1:41].any()
    for column in (columns.whens, columns.judged, columns.circumstances, columns._kinds.values):
        assert not column[:40].any()
    assert not marks._cells.values[1:41].any()
    assert marks._owners.values.min() == 41
    columns.remove(range(41, 141))
    assert (len(columns), len(columns.rows), len(marks)) == (160, 160, 161), "then the others move together"
    assert not marks._vectors[:, 161:].any()
    for column in (
        columns._rows, columns._whens, columns._judged, columns._kinds, columns._circumstances, *columns._signs,
        marks._owners, marks._measures, marks._amounts, marks._cells, marks._tags,
    ):  # fmt: skip
        assert not column._cells[column._count :].any()
    same_ranking(columns, many(300)[140:], "keep a distance of 200 meters", "highway", 0, 3)


def test_the_same_words_are_kept_once_and_overwritten_with_the_last_of_them() -> None:
    said = ["drive at 100 km/h", "turn left", "drive at 100 km/h", "drive at 90 km/h", "", "turn left", "turn left"]
    entries = [remembered(row, text, NOW) for row, text in enumerate(said, start=1)]
    columns, marks = Columns(), 1
    for number, one in enumerate(entries):
        columns.extend([entry_of(one)])
        marks += said[number] not in (*said[:number], "")
        assert len(columns._marks) == marks
    together = columns_of(entries)
    assert together._kinds.values.tolist() == columns._kinds.values.tolist() == [1, 2, 1, 3, 0, 2, 2]
    assert np.array_equal(together._marks._vectors, columns._marks._vectors)
    columns.remove([1, 2])
    assert columns._marks._vectors[:, 1:4].any(axis=0).all()
    same_ranking(columns, entries[2:], "drive at 100 km/h", "highway", 0, 7)
    columns.remove([3, 6])
    assert columns._marks._vectors.any(axis=0)[1:4].tolist() == [False, True, True]
    assert columns._marks._amounts.values.tolist() == [pytest.approx(25.0)]
    columns.extend([entry_of(remembered(8, said[0], NOW))])
    same_ranking(columns, [entries[3], *entries[6:], remembered(8, said[0], NOW)], "turn left", "highway", 0, 7)
    columns.remove([4, 7, 8])
    assert not columns._marks._vectors.any()


def test_marks_that_differ_only_in_their_numbers_are_two() -> None:
    one, other = (
        Entry(row, packed(encode("as before")), 0, (("speed", speed),), "highway", 0, NOW, None)
        for row, speed in ((1, 10.0), (2, 20.0))
    )
    columns = Columns()
    for entry in (one, other, one):
        columns.extend([entry])
    assert columns._kinds.values.tolist() == [1, 2, 1]


def test_what_the_columns_outgrew_is_overwritten_too() -> None:
    columns = columns_of(many(60))
    vectors, whens, amounts = columns._marks._vectors, columns._whens._cells, columns._marks._amounts._cells
    columns.extend([entry_of(one) for one in many(200)[60:]])
    assert columns._marks._vectors is not vectors
    for old in (vectors, whens, amounts):
        assert not old.any()
    same_ranking(columns, many(200), "keep a distance of 20 meters", "highway", 0, 5)


def test_wiped_columns_hold_no_number() -> None:
    columns = columns_of(many(100))
    marks = columns._marks
    parts = [columns._rows._cells, columns._whens._cells, columns._kinds._cells, columns._circumstances._cells]
    parts += [marks._vectors, marks._cells._cells, marks._tags._cells, marks._owners._cells, marks._amounts._cells]
    columns.wipe()
    assert len(columns) == 0
    assert not any(part.any() for part in parts)
    assert nearest(columns, mark("keep a distance of 20 meters"), "highway", 0, NOW, 3) == []
    assert columns._circumstance_kinds.known() == ()
    assert (marks._tag_sets.known(), marks._measure_names.known()) == ((0,), ())
    columns.extend([entry_of(one) for one in many(5)])
    same_ranking(columns, many(5), "keep a distance of 20 meters", "highway", 0, 3)


def test_removing_nothing_and_what_is_not_there_changes_nothing() -> None:
    columns = columns_of(many(3))
    columns.remove([])
    columns.remove([77])
    columns.judge(77, (1, 1, 1))
    assert len(columns) == 3


def test_older_ones_than_asked_for_do_not_count() -> None:
    entries = [remembered(1, "drive faster", NOW - timedelta(days=9)), remembered(2, "drive faster", NOW)]
    found = nearest(columns_of(entries), mark("drive faster"), "highway", 0, NOW, 3, since=NOW - timedelta(days=1))
    assert [row for row, _ in found] == [2]


@given(st.text())
def test_packed_vectors_are_whole(text: str) -> None:
    vector = encode(text)
    cells = np.frombuffer(packed(vector), np.dtype([("dimension", "<u2"), ("value", "<f4")]))
    whole = np.zeros(DIMENSIONS, np.float32)
    whole[cells["dimension"]] = cells["value"]
    assert np.array_equal(whole, vector)
