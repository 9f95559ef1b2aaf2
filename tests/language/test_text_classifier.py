"""Sorting short sentences: marks, shares, and files that are no sorters."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.concept import DataError
from chauffeur.language.text_classifier import BITS, TextClassifier, hashed_features, load_sorter


def sorter(**words: str) -> TextClassifier:
    """One that knows a single word of each kind."""
    kinds = tuple(words)
    weights = np.zeros((1 << BITS, len(kinds)), np.int8)
    for place, word in enumerate(words.values()):
        weights[hashed_features(word), place] = 100
    return TextClassifier(kinds, weights, np.full(len(kinds), 0.1), np.zeros(len(kinds)))


@given(st.text(max_size=120))
def test_marks_are_numbers_of_any_text(text: str) -> None:
    marks = hashed_features(text)
    assert marks.dtype == np.int64
    assert list(marks) == sorted(set(marks.tolist()))
    assert not len(marks) or (marks[0] >= 0 and marks[-1] < 1 << BITS)


def test_spelling_and_case_make_no_difference() -> None:
    assert list(hashed_features("DON’T overtake!")) == list(hashed_features("do not overtake!"))
    assert not len(hashed_features("")) and not len(hashed_features("…—"))


def test_a_negation_makes_other_words_of_what_follows_it() -> None:
    told = set(hashed_features("overtake that van").tolist())
    negated = set(hashed_features("do not overtake that van").tolist())
    elsewhere = set(hashed_features("no, overtake that van").tolist())  # punctuation ends its reach
    assert told - negated  # "<s> overtake"
    assert len(negated - told) > len(elsewhere - told)


def test_shares_sum_to_one_and_come_in_order() -> None:
    found = sorter(fast="quick", slow="lazy").shares("That was quick.")
    assert list(found) == ["fast", "slow"]
    assert sum(found.values()) == pytest.approx(1.0)
    assert found["fast"] > 0.6


@given(st.text(max_size=80))
def test_only_what_can_be_is_found(text: str) -> None:
    found = sorter(fast="quick", slow="lazy", left="port").shares(text, ("slow", "left"))
    assert set(found) == {"slow", "left"}
    assert sum(found.values()) == pytest.approx(1.0)


def test_without_words_nothing_but_what_is_usual_counts() -> None:
    usual = TextClassifier(("a", "b"), np.zeros((1 << BITS, 2), np.int8), np.ones(2), np.array([0.0, 1.0]))
    assert next(iter(usual.shares(""))) == "b"
    assert np.array_equal(usual.scores(""), usual.scores("anything at all"))


def test_a_sorter_is_stored_and_read(tmp_path: Path) -> None:
    one = sorter(fast="quick", slow="lazy")
    with (tmp_path / "one.npz").open("wb") as stream:
        one.store(stream)
    read = load_sorter(tmp_path / "one.npz")
    assert read.kinds == one.kinds
    assert read.shares("lazy bones") == one.shares("lazy bones")


def test_what_is_no_sorter_is_refused_in_words(tmp_path: Path) -> None:
    missing, text, short, other = (tmp_path / f"{name}.npz" for name in ("missing", "text", "short", "other"))
    text.write_text("hello")
    with (tmp_path / "whole.npz").open("wb") as stream:
        sorter(a="b").store(stream)
    short.write_bytes((tmp_path / "whole.npz").read_bytes()[:-40])
    with other.open("wb") as stream:
        np.savez_compressed(
            stream, kinds=np.array(["a"]), weights=np.zeros((4, 1), np.int8), steps=np.ones(1), bias=np.zeros(1)
        )
    for path in (missing, text, short):
        with pytest.raises(DataError, match="cannot be read") as refused:
            load_sorter(path)
        assert refused.value.hint
    with pytest.raises(DataError, match="shape"):
        load_sorter(other)
