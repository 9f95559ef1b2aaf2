"""Quantities as people say or write them: "sixty-five miles an hour", "65mph", "two and a half seconds"."""

from __future__ import annotations

from typing import Literal

import numpy as np

from chauffeur.language.quantities import ONES, TENS

Unit = Literal["mps", "mph", "kmh", "m", "ft", "yd", "car lengths", "s", "times", "lanes", ""]
"""`times` is a factor that fits before "our speed" and before "as fast", `lanes` a count before "lanes", the empty
unit a number alone."""


_FULL: dict[str, tuple[tuple[str, str], ...]] = {
    "mps": (
        ("meter per second", "meters per second"),
        ("metre per second", "metres per second"),
        ("meter a second", "meters a second"),
    ),
    "mph": (("mile per hour", "miles per hour"), ("mile an hour", "miles an hour"), ("mph", "mph")),
    "kmh": (
        ("kilometer per hour", "kilometers per hour"),
        ("kilometre per hour", "kilometres per hour"),
        ("kilometer an hour", "kilometers an hour"),
        ("kph", "kph"),
    ),
    "m": (("meter", "meters"), ("metre", "metres")),
    "ft": (("foot", "feet"),),
    "yd": (("yard", "yards"),),
    "car lengths": (("car length", "car lengths"),),
    "s": (("second", "seconds"),),
}
"""Names that go with digits and words: singular and plural."""
_SHORT: dict[str, tuple[str, ...]] = {
    "mps": ("m/s", "m/s", "mps"),
    "mph": ("mph", "mph", "mph", "mi/h"),
    "kmh": ("km/h", "km/h", "kmh", "kph"),
    "m": ("m",),
    "ft": ("ft",),
    "yd": ("yd", "yds"),
    "car lengths": ("car lengths",),
    "s": ("s", "sec", "secs"),
}
"""Names that go with digits."""
_SLOPPY: dict[str, tuple[str, ...]] = {
    "mps": ("meter per second", "meters/second", "m per second", "meters per sec", "metres/s", "M/S", "m / s"),
    "mph": ("MPH", "Mph", "miles/hour", "miles/h", "mile per hour", "miles per h", "mi per hour"),
    "kmh": ("KM/H", "Km/h", "kmph", "km per hour", "km an hour", "kilometers/hour", "k/h", "kilometer per hour"),
    "m": ("meter", "M", "metre", "Meters"),
    "ft": ("foot", "Feet", "FT"),
    "yd": ("yard", "Yards"),
    "car lengths": ("car length", "car-lengths", "carlengths", "vehicle lengths", "cars length"),
    "s": ("second", "S", "Sec", "Seconds"),
}
_FACTORS: dict[float, tuple[str, ...]] = {
    0.25: ("a quarter",),
    0.5: ("half", "half", "half", "one half"),
    0.75: ("three quarters",),
    2.0: ("twice", "twice", "twice", "two times", "2 times", "2x"),
}
_WORDED, _SLOPPILY, _GLUED = 0.35, 0.12, 0.4
_SPEEDS = ("mps", "mph", "kmh")


def spoken(value: float, unit: Unit, rng: np.random.Generator) -> str:
    """A quantity in a person's words; the number it names is exact for values with up to two decimals."""
    value = round(value, 2)
    if unit == "times":
        return _factor(value, rng)
    worded = rng.random() < _WORDED
    if unit in ("", "lanes"):
        return _in_words(value, rng) if worded else _digits(value)
    if worded:
        return _with_words(value, unit, rng)
    number = _digits(value)
    draw = rng.random()
    if draw < _SLOPPILY:
        return f"{number} {_of(_SLOPPY[unit], rng)}"
    if draw < 0.55:
        short = _of(_SHORT[unit], rng)
        if value == 1 and short.endswith("lengths"):
            short = short[:-1]
        glue = "" if rng.random() < _GLUED and short[0] in "mksfy" else " "
        return number + glue + short
    return f"{number} {_name(value, unit, rng)}"


def _name(value: float, unit: str, rng: np.random.Generator) -> str:
    names = _FULL[unit]
    return names[int(rng.integers(len(names)))][value != 1]


def _with_words(value: float, unit: str, rng: np.random.Generator) -> str:
    single, plural = _FULL[unit][int(rng.integers(len(_FULL[unit])))]
    draw = rng.random()
    if unit not in _SPEEDS:
        if value == 0.5 and draw < 0.8:
            return f"half a {single}"
        if value == 1 and draw < 0.5:
            return f"a {single}"
        if value == 2 and draw < 0.3:
            return f"a couple of {plural}"
        if value == 12 and draw < 0.2:
            return f"a dozen {plural}"
    return f"{_in_words(value, rng)} {single if value == 1 else plural}"


def _factor(value: float, rng: np.random.Generator) -> str:
    if value in _FACTORS and rng.random() < 0.8:
        return _of(_FACTORS[value], rng)
    number = _in_words(value, rng) if rng.random() < 0.5 else _digits(value)
    return f"{number} times"


def _digits(value: float) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".")


def _in_words(value: float, rng: np.random.Generator) -> str:
    """A number in words; digits where words would be laboured."""
    whole = int(value)
    rest = round(value - whole, 2)
    if value >= 1000:
        return _digits(value)
    if not rest:
        return _whole(whole, rng)
    if rest == 0.5 and whole and rng.random() < 0.75:
        return f"{_whole(whole, rng)} and a half"
    tenth = round(rest * 10, 1)
    if tenth.is_integer():
        return f"{_whole(whole, rng)} point {ONES[int(tenth)]}"
    return _digits(value)


def _whole(number: int, rng: np.random.Generator) -> str:
    hundreds, below = divmod(number, 100)
    small = _below_hundred(below, rng)
    if not hundreds:
        return small
    draw = rng.random()
    if hundreds == 1 and below >= 20 and draw < 0.2:
        return f"one {small}"
    one = "a hundred" if draw < 0.6 else "hundred" if draw < 0.7 else "one hundred"
    head = one if hundreds == 1 else f"{ONES[hundreds]} hundred"
    if not below:
        return head
    return f"{head} and {small}" if rng.random() < 0.6 else f"{head} {small}"


def _below_hundred(number: int, rng: np.random.Generator) -> str:
    if number < 20:
        return ONES[number]
    tens, ones = divmod(number, 10)
    if not ones:
        return TENS[tens - 2]
    return f"{TENS[tens - 2]}{'-' if rng.random() < 0.7 else ' '}{ONES[ones]}"


def _of(choices: tuple[str, ...], rng: np.random.Generator) -> str:
    return choices[int(rng.integers(len(choices)))]
