"""Numbers that are not cleanly numbers are asked about, and never read as another number."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from chauffeur.language import read_quantities, slip_in


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


def test_the_longest_wish_takes_no_time() -> None:
    for text in ("1 " * 1000, "l" * 2000, "0o" * 1000, "1," * 1000, "one " * 500, "1/" * 1000 + "m"):
        slip_in(text)
