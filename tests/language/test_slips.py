"""Numbers that are not cleanly numbers are asked about, and never read as another number."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.language import read_quantities, slip_in


@pytest.mark.parametrize(
    ("text", "question", "corrected"),
    [
        ("Drive at l00 km/h.", "Did you mean 100 km/h?", "Drive at 100 km/h."),
        ("drive at 1 00 km/h please", "Did you mean 100 km/h?", "drive at 100 km/h please"),
        ("2OO km/h", "Did you mean 200 km/h?", "200 km/h"),
        ("Go 5O mph", "Did you mean 50 mph?", "Go 50 mph"),
        ("1OOkm/h", "Did you mean 100 km/h?", "100 km/h"),
        ("30 mm/s", "Did you mean 30 m/s?", "30 m/s"),
        ("go 50mhp", "Did you mean 50 mph?", "go 50 mph"),
        ("lOO km/h", "Did you mean 100 km/h?", "100 km/h"),
        ("one zero zero km/h", "Did you mean 100 km/h?", "100 km/h"),
        ("one oh five mph", "Did you mean 105 mph?", "105 mph"),
        ("2 hundred km/h", "Did you mean 200 km/h?", "200 km/h"),
        ("twenty 5 m/s", "Did you mean 25 m/s?", "25 m/s"),
        ("1.000 km/h", "Which speed do you mean?", ""),
        ("60-70 km/h", "Which speed do you mean?", ""),
        ("drive 00 km/h", "Which speed do you mean?", ""),
        ("1/2 mile behind", "Which distance do you mean?", ""),
        ("50 metres per minute", "Which speed do you mean?", ""),
        ("100 k m/h", "Which speed do you mean?", ""),
        ("drive 5O", "Which number do you mean?", ""),
    ],
)
def test_what_is_no_clean_number_is_asked_about(text: str, question: str, corrected: str) -> None:
    slip = slip_in(text)
    assert slip is not None
    assert (slip.question, slip.corrected) == (question, corrected)


@pytest.mark.parametrize(
    "text",
    [
        "95 km/h", "70mph", "3.5 m/s", "1,5 s", "2 seconds", "two hundred metres", "take the A1 motorway", "exit 12b",
        "the M25", "3rd lane", "1,200 m", "28,5 m/s", "at 50 m.p.h.", "keep 50 - 30 m is too little", "I-95 south",
        "twenty-five metres", "one hundred twenty km/h", "one twenty", "2x faster", "10%", "at 5pm", "(50 km/h)",
        "slow to 50, 30 m behind", "lane 2, 50 km/h", "2 and a half seconds", "1 point 5 m/s", "50 thx", ".5 s",
        "follow this one 30 m behind", "take the A1 second exit", "two hundred fifty feet", "7:30", "spot B7", "MP3",
        "-10 km/h", "50 km/h.", "a couple of seconds", "one or two lanes", "no number at all", "",
    ],
)  # fmt: skip
def test_clean_numbers_and_names_with_numbers_are_left_alone(text: str) -> None:
    assert slip_in(text) is None


def test_names_with_numbers_hold_no_quantity() -> None:
    assert [q for text in ("the A1", "exit 12b", "the M25", "go 5o") for q in read_quantities(text)] == []
    assert [(q.value, q.dimension) for q in read_quantities("the 3rd lane")] == [(3.0, "bare")]
    assert [q.value for q in read_quantities(".5 s")] == [0.5]


_UNITS = ("km/h", "mph", "m/s", "m", "metres", "seconds")


@st.composite
def _perturbed(draw: st.DrawFn) -> tuple[str, str, str]:
    """A clean number with its unit, and the same with one slip in it."""
    number, unit = str(draw(st.integers(10, 260))), draw(st.sampled_from(_UNITS))
    at = draw(st.integers(1, len(number) - 1))
    between = draw(st.sampled_from(("", " ")))
    how = draw(st.integers(0, 4))
    if how == 0:  # a letter typed for a digit
        wrong = number.replace("0", draw(st.sampled_from("oO")), 1).replace("1", draw(st.sampled_from("lI")), 1)
    elif how == 1:  # a space, or a sign, among the digits
        wrong = number[:at] + draw(st.sampled_from((" ", "'", "_", "/", "-", ":"))) + number[at:]
    elif how == 2:  # a letter among the digits
        wrong = number[:at] + draw(st.sampled_from("acdefghjknpqrtuvwxy")) + number[at:]
    elif how == 3:  # three decimals, or a thousand
        wrong = number + ".000"
    else:  # a nought in front
        wrong = "0 " + number
    return f"{number}{between}{unit}", f"{wrong}{between}{unit}", number


@given(_perturbed(), st.sampled_from(("{}", "Drive at {}.", "please keep {} now", "I'd like {}, thanks")))
def test_no_perturbed_number_is_read_as_another(case: tuple[str, str, str], frame: str) -> None:
    clean, wrong, number = case
    assert slip_in(frame.format(clean)) is None
    meant = [(q.dimension, round(q.value, 6)) for q in read_quantities(clean)]
    slip = slip_in(frame.format(wrong))
    read = [(q.dimension, round(q.value, 6)) for q in read_quantities(frame.format(wrong))]
    assert slip is not None or read in ([], meant, [("bare", float(number))]), (wrong, read)
    if slip is not None and slip.meant and not wrong.startswith("0 "):
        meant_by_slip = [(q.dimension, round(q.value, 6)) for q in read_quantities(slip.meant)]
        assert meant_by_slip == meant or ".000" in wrong


@given(st.text(max_size=60))
def test_any_text_is_looked_at(text: str) -> None:
    slip = slip_in(text)
    assert slip is None or slip.said


def test_the_longest_wish_takes_no_time() -> None:
    for text in ("1 " * 1000, "l" * 2000, "0o" * 1000, "1," * 1000, "one " * 500, "1/" * 1000 + "m"):
        slip_in(text)
