"""Which of several junctions words mean."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.language.ordinals import nth_of


@pytest.mark.parametrize(
    ("words", "nth"),
    [
        ("Take the second street on the left", 2),
        ("turn left at the 2nd traffic light", 2),
        ("After two more junctions go right", 3),
        ("Two more sets of lights, then you want a left.", 2),
        ("Skip the first left and take the one after it", 2),
        ("pass the next turning and then go left", 2),
        ("Left at the lights. Oh, silly of me, it's the lights after these", 2),
        ("it's the third house, leave me there", 1),
        ("let two cars pass, then turn left", 1),
        ("in 2 minutes turn right", 1),
        ("turn left after the lights", 1),
    ],
)
def test_an_ordinal_counts_where_it_stands_with_a_way(words: str, nth: int) -> None:
    assert nth_of(words) == nth


@given(st.text(max_size=80))
def test_any_words_mean_one_of_a_few(words: str) -> None:
    assert 1 <= nth_of(words) <= 10
