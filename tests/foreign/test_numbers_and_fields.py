"""Numbers in any typography, objects as models write them, and fields that say that they are empty."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.foreign.fields import objects_in, says_nothing
from chauffeur.foreign.numbers import numbers_in, plain_signs


@pytest.mark.parametrize(
    ("text", "numbers"),
    [
        ("2.5, -0.1", [2.5, -0.1]),
        ("2.5, \u22120.1", [2.5, -0.1]),
        ("2.5, \u20130.1", [2.5, -0.1]),
        ("2.5, \u20140.1", [2.5, -0.1]),
        ("2.5, \u20110.1", [2.5, -0.1]),
        ("2.5, \uff0d0.1", [2.5, -0.1]),
        ("2.5, \ufe630.1", [2.5, -0.1]),
        ("2.5, - 0.1", [2.5, -0.1]),
        ("2.5, \u2212 0.1", [2.5, -0.1]),
        ("2.5, \u2212\u20090.1", [2.5, -0.1]),
        ("x: 2.5, y: - 0.1", [2.5, -0.1]),
        ("２．５，－０．１", [2.5, -0.1]),
        ("٢٫٥، -٠٫١", [2.5, -0.1]),
        ("۲.۵, ۰.۱", [2.5, 0.1]),
        ("२.५, ०.१", [2.5, 0.1]),
        ("𝟐.𝟓, 𝟎.𝟏", [2.5, 0.1]),
        ("2,5; -0,1", [2.5, -0.1]),
        ("2,5, -0,1", [2.5, -0.1]),
        ("2,5 -0,1", [2.5, -0.1]),
        ("2,5", [2.0, 5.0]),
        ("12.5,0.1", [12.5, 0.1]),
        ("2.5、0.1", [2.5, 0.1]),
        ("0.30000000000000004, 0.6000000000000001", [0.30000000000000004, 0.6000000000000001]),
        ("2.5e0, -1.0E-01", [2.5, -0.1]),
        ("2.5 × 10⁻¹, 1×10^-1", [0.25, 0.1]),
        ("1\u202f000, 2\u00a0500.5", [1000.0, 2500.5]),
        ("1,000.5, 2", [1000.5, 2.0]),
        ("+2.5, +.1", [2.5, 0.1]),
        ("2.5m, -0.1 m", [2.5, -0.1]),
        ("2.5, minus 0.1", [2.5, -0.1]),
        ("x1: 2.5, y_2: 0.1", [2.5, 0.1]),
        ("2.5\u200b, \u200e-0.1", [2.5, -0.1]),
    ],
)
def test_a_number_is_read_with_its_sign_however_it_is_set(text: str, numbers: list[float]) -> None:
    assert numbers_in(plain_signs(text)) == numbers


@pytest.mark.parametrize("text", ["2½, 0.1", "10², 0.1", "2.5-0.1", "1.2.3, 0.1"])
def test_what_is_no_plain_number_is_not_read_as_another(text: str) -> None:
    assert len(numbers_in(plain_signs(text))) < 2


@given(st.text(max_size=200))
def test_plain_signs_of_plain_signs_are_the_same(text: str) -> None:
    once = plain_signs(text)
    assert all(isinstance(number, float) for number in numbers_in(once))


NOTHING = (
    "", " ", "N/A", "n/a.", "NA", "None", "none.", "**none**", "no", "No.", "NULL", "nil", "-", "—", "...", "(none)",
    "[none]", "not applicable", "Not applicable.", "nothing", "No refusal", "no refusal needed",
    "N/A - the wish is safe",
    "None; this is harmless", "none (safe)", "<the reason in one sentence, addressed to the passenger>", "{reason}",
    "[reason]", "ｎｏｎｅ", '"none"', "false", "I do not refuse.", None, False,
)  # fmt: skip
SOMETHING = (
    "No lane", "No lane is free.", "None of the lanes is free", "Not here.", "no, too fast", "unsafe",
    "Nothing is free",
    "Nobody may do that.", "Not possible", "not safe", "It is unlawful.", "-10 degrees is too cold", True, 5,
)  # fmt: skip


@pytest.mark.parametrize("value", NOTHING)
def test_an_empty_field_may_be_written_out(value: object) -> None:
    assert says_nothing(value)


@pytest.mark.parametrize("value", SOMETHING)
def test_a_reason_that_begins_with_no_is_one(value: object) -> None:
    assert not says_nothing(value)


@pytest.mark.parametrize(
    "text",
    [
        '{"a": -2}', 'Here: {"a": -2}.', "```json\n{'a': -2, 'b': None}\n```", '{"a": -2,}', "｛＂a＂：－2｝",
        "{“a”: −2}",
        '{"a": \u20132}', "{'a': -2, }",
    ],
)  # fmt: skip
def test_an_object_is_read_as_it_is_meant(text: str) -> None:
    (found,) = objects_in(text)
    assert found["a"] == -2


def test_several_objects_come_in_order_and_floods_are_none() -> None:
    assert objects_in('{"a": {"b": 1}} and {"a": 2}') == [{"a": {"b": 1}}, {"a": 2}]
    for flood in ("{" * 200_000, '{"a":' * 60_000, "{'a'" * 60_000, "[{" * 100_000):
        assert objects_in(flood) == []


@given(st.text(alphabet="{}[]\"':,a1− None", max_size=80))
def test_no_text_makes_objects_fail(text: str) -> None:
    assert all(isinstance(one, dict) for one in objects_in(text))
