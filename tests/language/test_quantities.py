from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.language import measured, plain, read_quantities, tokens_of


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("80 km/h", [("speed", 80 / 3.6)]),
        ("50 miles per hour", [("speed", 22.352)]),
        ("28.5 meters per second", [("speed", 28.5)]),
        ("65mph", [("speed", 65 * 0.44704)]),
        ("25 m", [("distance", 25.0)]),
        ("twenty-five metres and 2 seconds", [("distance", 25.0), ("time", 2.0)]),
        ("three car lengths", [("distance", 15.0)]),
        ("60 feet, 10 yards", [("distance", 18.288), ("distance", 9.144)]),
        ("a couple of seconds", [("time", 2.0)]),
        ("28,5 m/s", [("speed", 28.5)]),
        ("1,200 m", [("distance", 1200.0)]),
        ("25 minutes", []),
        ("lane 2", []),
    ],
)
def test_numbers_with_units(text: str, expected: list[tuple[str, float]]) -> None:
    assert [(dimension, pytest.approx(value)) for dimension, value in measured(text)] == expected


@given(st.text())
def test_any_text_is_read(text: str) -> None:
    measured(text)
    assert tokens_of(text) == tokens_of(text.upper().lower()) or not text.isascii()


def test_contractions_are_written_out() -> None:
    assert plain("Don't; I\u2019m late, can\u2019t wait") == "do not; i am late, can not wait"


_PARTS = (
    "a", "an", "one", "Two", "fourty", "hundred", "half", "of", "couple", "few", "second", "car length", "lane", "mile",
    "m/s", "30", "2.5", "minus", "point", "and", "drive", "can't", "it's", "'s", "in'", "-", "/", "_", "(", ",",
)  # fmt: skip


@given(st.lists(st.sampled_from(_PARTS), max_size=8), st.sampled_from((" ", "", "-", "/", "'", " 's ", "\n")))
def test_no_quantity_is_overlooked_where_a_glance_tells_that_there_is_no_number(parts: list[str], between: str) -> None:
    text = between.join(parts)
    kinds = ("speed", "distance", "time")
    assert measured(text) == tuple((q.dimension, q.value) for q in read_quantities(text) if q.dimension in kinds)
