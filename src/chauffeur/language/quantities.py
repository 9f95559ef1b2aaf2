"""Numbers and units in words: "twenty-five metres", "65mph", "two and a half seconds", "a couple of car lengths".

Works on lower-case tokens. Each quantity found is replaced by a mark `#k`, so that later rules see where it stood
without seeing its words.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final, Literal

from chauffeur.concept import units
from chauffeur.language.tokens import tokens_of

Dimension = Literal["speed", "distance", "time", "share", "lanes", "bare", "other"]
"""`share` is a factor (half is 0.5), `bare` a number without unit, `other` a unit no manoeuvre takes (minutes)."""

ONES: Final = (
    "zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve",
    "thirteen", "fourteen", "fifteen", "sixteen", "seventeen", "eighteen", "nineteen",
)  # fmt: skip
"""Words of the numbers from 0 to 19."""
TENS: Final = ("twenty", "thirty", "forty", "fifty", "sixty", "seventy", "eighty", "ninety")
"""Words of the tens from 20."""

_ONES = {word: float(value) for value, word in enumerate(ONES)}
_TENS = {word: 10.0 * (2 + k) for k, word in enumerate(TENS)}
_TENS["fourty"] = 40.0
_SHARES = {"half": 0.5, "quarter": 0.25}
_VAGUE = {"couple": 2.0, "few": 3.0, "several": 4.0, "dozen": 12.0}
"""Counts people use loosely; the plan says which number it took."""

_PER = ("per", "a", "an", "each", "/")
_MPS, _KMH, _MPH = 1.0, units.MPS_PER_KMH, units.MPS_PER_MPH

_SIMPLE: dict[str, tuple[Dimension, float]] = {
    **dict.fromkeys(("mps", "m/s", "ms", "meters/second", "metres/second"), ("speed", _MPS)),
    **dict.fromkeys(("kmh", "kph", "km/h", "kmph", "kilometers/hour", "kilometres/hour", "k/h"), ("speed", _KMH)),
    **dict.fromkeys(("mph", "mi/h", "miles/hour", "m.p.h"), ("speed", _MPH)),
    **dict.fromkeys(("knot", "knots"), ("speed", units.MPS_PER_KNOT)),
    **dict.fromkeys(("m", "meter", "meters", "metre", "metres"), ("distance", 1.0)),
    **dict.fromkeys(("cm", "centimeter", "centimeters", "centimetre", "centimetres"), ("distance", 0.01)),
    **dict.fromkeys(("mm", "millimeter", "millimeters", "millimetre", "millimetres"), ("distance", 0.001)),
    **dict.fromkeys(("inch", "inches"), ("distance", units.M_PER_FOOT / 12.0)),
    **dict.fromkeys(("ft", "foot", "feet"), ("distance", units.M_PER_FOOT)),
    **dict.fromkeys(("yd", "yds", "yard", "yards"), ("distance", units.M_PER_YARD)),
    **dict.fromkeys(("km", "kms", "kilometer", "kilometers", "kilometre", "kilometres"), ("distance", units.M_PER_KM)),
    **dict.fromkeys(("mi", "mile", "miles"), ("distance", units.M_PER_MILE)),
    **dict.fromkeys(("carlength", "carlengths"), ("distance", units.M_PER_CAR_LENGTH)),
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), ("time", 1.0)),
    **dict.fromkeys(("percent", "%", "pct"), ("share", 0.01)),
    "times": ("share", 1.0),
    **dict.fromkeys(("lane", "lanes"), ("lanes", 1.0)),
    **dict.fromkeys(
        ("minute", "minutes", "min", "mins", "hour", "hours", "day", "days", "degrees", "oclock", "pm", "am", "kids",
         "people", "dollars", "years", "exits", "exit"),
        ("other", 1.0),
    ),
}  # fmt: skip
_PAIRS: dict[tuple[str, str], tuple[Dimension, float]] = {
    **{(a, b): ("speed", _MPS) for a in ("meter", "meters", "metre", "metres", "m") for b in ("second", "sec", "s")},
    **{
        (a, b): ("speed", _KMH)
        for a in ("kilometer", "kilometers", "kilometre", "kilometres", "km", "kms")
        for b in ("hour", "h")
    },
    **{(a, b): ("speed", _MPH) for a in ("mile", "miles", "mi") for b in ("hour", "h")},
    **{
        (a, b): ("distance", units.M_PER_CAR_LENGTH)
        for a in ("car", "cars", "vehicle", "vehicles", "truck")
        for b in ("length", "lengths")
    },
}
_EXTRA = ("more", "extra", "additional", "further", "full", "whole", "less", "fewer")
"""Words that may stand between a number and its unit."""

_ONE_MEANS_UNIT = ("second", "sec", "car", "carlength", "meter", "metre", "foot", "yard", "mile", "lane", "kilometer")

_COUNTS = re.compile(
    rf"\d|{'|'.join((*_ONES, *_TENS, *_VAGUE, *_SHARES, 'hundred'))}"
    rf"|an?(?:[^a-z]+s)*[^a-z]+(?:{'|'.join(_ONE_MEANS_UNIT)})"
)
"""Found in every lower-case ASCII text in which there is a number, and in some others."""


@dataclass(frozen=True, slots=True)
class Quantity:
    """A number with a unit, found in a text.

    Attributes:
        value: SI value; the plain number where there is no unit.
        dimension: What it measures.
        said: The words.
        inner: A word found between number and unit ("ten more metres"), or empty.
    """

    value: float
    dimension: Dimension
    said: str
    inner: str = ""


_SPEED_UNITS: Final = (("mph", units.MPS_PER_MPH, ("mph", "mi")), ("km/h", units.MPS_PER_KMH, ("k",)), ("m/s", 1.0, ()))
_LENGTH_UNITS: Final = (
    ("lengths", units.M_PER_CAR_LENGTH, ("length",)), ("ft", units.M_PER_FOOT, ("ft", "foot", "feet")),
    ("yd", units.M_PER_YARD, ("yd", "yard")), ("km", 1000.0, ("km", "kilo")), ("m", 1.0, ()),
)  # fmt: skip


def mark_quantities(tokens: list[str]) -> tuple[list[str], list[Quantity]]:
    """Replace every quantity in the tokens by a mark `#k`; k counts from 0."""
    out: list[str] = []
    found: list[Quantity] = []
    i = 0
    while i < len(tokens):
        hit = _quantity(tokens, i)
        if hit is None:
            out.append(tokens[i])
            i += 1
        else:
            out.append(f"#{len(found)}")
            found.append(hit[0])
            i = hit[1]
    return out, found


def read_quantities(text: str) -> tuple[Quantity, ...]:
    """All quantities of a text, in order."""
    return tuple(mark_quantities(tokens_of(text))[1])


def amount_said(quantity: Quantity) -> tuple[float, str]:
    """A quantity in the unit in which it was said."""
    if quantity.dimension == "speed":
        known = _SPEED_UNITS
    elif quantity.dimension == "distance":
        known = _LENGTH_UNITS
    else:
        return quantity.value, {"time": "s", "share": "share", "lanes": "lanes"}.get(quantity.dimension, "")
    words = quantity.said.lower().split()
    for unit, factor, marks in known:
        if not marks or any(word.startswith(mark) for word in words for mark in marks):
            return round(quantity.value / factor, 6), unit
    raise AssertionError("the last unit of each list has no marks")


def number_of(tokens: list[str]) -> list[str]:
    """The number with which the tokens of a quantity begin, without its unit."""
    found = _number(tokens, 0)
    return tokens if found is None else tokens[: found[1]]


def measured(text: str) -> tuple[tuple[str, float], ...]:
    """(dimension, SI value) of every speed, distance and time span in a text; other numbers are left out."""
    if text.isascii() and _COUNTS.search(text.lower()) is None:
        return ()
    kinds = ("speed", "distance", "time")
    return tuple((q.dimension, q.value) for q in read_quantities(text) if q.dimension in kinds)


def _quantity(tokens: list[str], i: int) -> tuple[Quantity, int] | None:
    """Quantity starting at token i and the index after it, or None."""
    number = _number(tokens, i)
    if number is None:
        return None
    value, j, sure = number
    inner = ""
    k = j
    if k < len(tokens) and tokens[k] in ("of", "a", "an"):
        k += 1
    if k < len(tokens) - 1 and tokens[k] in _EXTRA:
        inner = tokens[k]
        k += 1
        if k < len(tokens) - 1 and tokens[k] == "of":
            k += 1
    unit = unit_of(tokens, k)
    if unit is not None:
        dimension, factor, end = unit
        return Quantity(value * factor, dimension, " ".join(tokens[i:end]), inner), end
    if not sure:
        return None
    return Quantity(value, "bare", " ".join(tokens[i:j])), j


def unit_of(tokens: list[str], k: int) -> tuple[Dimension, float, int] | None:
    """The unit at token k as (dimension, factor to SI, index after it); None where there is none."""
    if k >= len(tokens):
        return None
    first = tokens[k]
    second = tokens[k + 1] if k + 1 < len(tokens) else ""
    third = tokens[k + 2] if k + 2 < len(tokens) else ""
    if second in _PER and (first, third) in _PAIRS:
        dimension, factor = _PAIRS[first, third]
        return dimension, factor, k + 3
    if (first, second) in _PAIRS:
        dimension, factor = _PAIRS[first, second]
        return dimension, factor, k + 2
    if first in _SIMPLE:
        dimension, factor = _SIMPLE[first]
        return dimension, factor, k + 1
    return None


def _digits(token: str) -> float | None:
    """Value of a numeral; None for other tokens and for numbers too long to mean anything."""
    if not token or len(token) > 12 or (not token[0].isdigit() and token[0] != "."):
        return None
    if not token.isascii() or not token.replace(".", "", 1).isdigit():
        return None
    return float(token)


def _number(tokens: list[str], i: int) -> tuple[float, int, bool] | None:
    """Number at i as (value, next index, whether it counts without a unit)."""
    word = tokens[i]
    if word in ("minus", "negative") and i + 1 < len(tokens) and tokens[i + 1] not in ("minus", "negative"):
        positive = _number(tokens, i + 1)
        return None if positive is None else (-positive[0], positive[1], positive[2])
    value = _digits(word)
    if value is not None:
        return _tail(tokens, value, i + 1, sure=True)
    if word in _SHARES and i + 1 < len(tokens):
        return _share(tokens, i)
    if word in ("a", "an") and i + 1 < len(tokens):
        return _after_article(tokens, i)
    if word in _VAGUE:
        return _VAGUE[word], i + 1, False
    if word == "hundred":  # "another hundred feet"
        words = _spelled(["one", *tokens[i:]], 0)
        return None if words is None else (words[0], i + words[1] - 1, True)
    words = _spelled(tokens, i)
    if words is None:
        return None
    value, j = words
    # "one" alone is a pronoun far more often than a number ("this one", "the one ahead")
    return _tail(tokens, value, j, sure=not (word == "one" and j == i + 1))


def _share(tokens: list[str], i: int) -> tuple[float, int, bool] | None:
    """Parts of a unit: half a mile, a quarter of a mile, another quarter mile."""
    after = tokens[i + 1]
    if tokens[i] == "half" and after in ("a", "an", "of"):
        return _SHARES[tokens[i]], i + 1, False
    if after == "of" and tokens[i + 2 : i + 3] in (["a"], ["an"]):
        return _SHARES[tokens[i]], i + 2, False
    return (_SHARES[tokens[i]], i + 1, False) if unit_of(tokens, i + 1) is not None else None


def _after_article(tokens: list[str], i: int) -> tuple[float, int, bool] | None:
    """Numbers that begin with "a": a hundred, a couple of, a second."""
    following = tokens[i + 1]
    if following in _SHARES and i + 2 < len(tokens):
        return _share(tokens, i + 1)
    if following in _VAGUE:
        return _VAGUE[following], i + 2, False
    if following == "hundred":
        words = _spelled(["one", *tokens[i + 1 :]], 0)
        return None if words is None else (words[0], i + words[1], True)
    if following in _ONE_MEANS_UNIT and unit_of(tokens, i + 1) is not None:
        return 1.0, i + 1, False
    return None


def _tail(tokens: list[str], value: float, j: int, *, sure: bool) -> tuple[float, int, bool]:
    """Adds "point five" and "and a half" behind a number."""
    if j + 1 < len(tokens) and tokens[j] == "point" and (tokens[j + 1] in _ONES or tokens[j + 1].isdecimal()):
        digit = _ONES.get(tokens[j + 1], _digits(tokens[j + 1]) or 0.0)
        return value + (digit / 10.0 if digit < 10 else digit / 100.0), j + 2, True
    if tokens[j : j + 3] == ["and", "a", "half"]:
        return value + 0.5, j + 3, True
    return value, j, sure


def _spelled(tokens: list[str], i: int) -> tuple[float, int] | None:
    """A number in words below a thousand, as (value, next index)."""
    j = i
    total = 0.0
    seen = False
    if j < len(tokens) and tokens[j] in _ONES:
        ones = _ONES[tokens[j]]
        j += 1
        if j < len(tokens) and tokens[j] == "hundred":
            total, j = ones * 100.0, j + 1
            if j + 1 < len(tokens) and tokens[j] == "and" and (tokens[j + 1] in _ONES or tokens[j + 1] in _TENS):
                j += 1
            seen = True
        elif ones < 10 and j < len(tokens) and tokens[j] in _TENS and ones == 1:
            total, seen = 100.0, True  # "one twenty" is 120
        else:
            return ones, j
    if j < len(tokens) and tokens[j] in _TENS:
        total += _TENS[tokens[j]]
        j += 1
        seen = True
        if j < len(tokens) and 0 < _ONES.get(tokens[j], 0.0) < 10:
            total += _ONES[tokens[j]]
            j += 1
    elif seen and j < len(tokens) and tokens[j] in _ONES:
        total += _ONES[tokens[j]]
        j += 1
    return (total, j) if seen else None
