"""What may be known of a value before a program runs: of each kind of thing, whether it may be one, and which.

A `Value` stands for a set of run-time values. Numbers are an interval; lanes are offsets from the lane the ego is in
during the present control period; what lists hold is not known. Every operation here may only make the set larger than
it has to be, never smaller.
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

NONE: Final = 1
TRUE: Final = 2
FALSE: Final = 4
INT: Final = 8
FLOAT: Final = 16
NAN: Final = 32
EGO: Final = 64
CAR: Final = 128
LANE: Final = 256
TEXT: Final = 512
TUPLE: Final = 1024
OBJECT: Final = 2048
"""A list, dict, set, view or exception: something that may change or hold others."""
FUNCTION: Final = 4096

BOOL: Final = TRUE | FALSE
NUMBER: Final = INT | FLOAT | NAN
NUMERIC: Final = NUMBER | BOOL
"""What can be computed and compared with: a flag counts as 0 or 1."""
ANYTHING: Final = 2 * FUNCTION - 1

_MAX_TEXTS: Final = 8
_EXACT: Final = 2.0**53
"""Beyond it not every integer is a float."""

Key = tuple[int, str]
"""A variable: number of its frame, and name."""

Origin = tuple[int, Key, float, float]
"""(loop, variable, least, most): what the variable held when the loop's pass began, plus something in between."""

Callee = tuple[Any, ...]
"""("own", function, its frame), ("api", name), ("builtin", name), ("math", name), ("module", "math") or `UNKNOWN`."""


class Value(NamedTuple):
    """A set of run-time values.

    Attributes:
        bits: Kinds it may be of.
        lo, hi: Interval of its numbers; inf and -inf where it is none. An infinite bound includes infinity.
        own: Whether both bounds are reached by constants of the program alone, on some way through it.
        offsets: Lanes from the ego's own in this control period (-1 left); None where it is not known.
        texts: Texts it may be; None where they are not known.
        items: What a tuple holds; None where it is not known.
        refs: Places of the program where the object may have been made; None where they are not known.
        callees: Functions it may be that can be called by name.
        origin: How it came from a variable of the present pass through a loop, if it did.
    """

    bits: int
    lo: float = math.inf
    hi: float = -math.inf
    own: bool = True
    offsets: frozenset[int] | None = frozenset()
    texts: frozenset[str] | None = frozenset()
    items: tuple[Value, ...] | None = ()
    refs: frozenset[int] | None = frozenset()
    callees: frozenset[Callee] = frozenset()
    origin: Origin | None = None

    @property
    def known(self) -> bool:
        """Whether some kind of thing is ruled out."""
        return self.bits != ANYTHING

    @property
    def only_numeric(self) -> bool:
        """Whether it can be nothing but a number or a flag."""
        return not self.bits & ~NUMERIC

    @property
    def may_be_none(self) -> bool:
        """Whether it can be None."""
        return bool(self.bits & NONE)

    @property
    def is_none(self) -> bool:
        """Whether it can be nothing but None."""
        return self.bits == NONE

    @property
    def may_be_number(self) -> bool:
        """Whether it can be a number."""
        return bool(self.bits & NUMBER)

    @property
    def may_be_nan(self) -> bool:
        """Whether it can be no number by name (NaN)."""
        return bool(self.bits & NAN)

    def holds(self, value: object) -> bool:
        """Whether a run-time value is in the set, as far as values outside the interpreter can tell."""
        if value is None:
            return bool(self.bits & NONE)
        if isinstance(value, bool):
            return bool(self.bits & (TRUE if value else FALSE))
        if isinstance(value, int | float):
            if value != value:  # noqa: PLR0124 - NaN
                return bool(self.bits & NAN)
            return bool(self.bits & (INT if isinstance(value, int) else FLOAT)) and self.lo <= value <= self.hi
        if isinstance(value, str):
            return self._holds_text(value)
        return bool(self.bits & (OBJECT | TUPLE))

    def _holds_text(self, value: str) -> bool:
        if value.startswith("veh:") and self.bits & (EGO if value == "veh:0" else CAR):
            return True
        if value.startswith("lane:") and self.bits & LANE:
            return True
        if self.bits & (OBJECT | FUNCTION):  # ranges, views, functions and modules leave the sandbox as descriptions
            return True
        return bool(self.bits & TEXT) and (self.texts is None or value in self.texts)


TOP: Final = Value(ANYTHING, -math.inf, math.inf, False, None, None, None, None)
"""Anything at all."""
NOTHING: Final = Value(NONE)
"""None."""
FLAG: Final = Value(BOOL)
YES: Final = Value(TRUE)
NO: Final = Value(FALSE)
ANY_TEXT: Final = Value(TEXT, texts=None)
UNKNOWN: Final[Callee] = ("unknown",)
"""A function that is not followed."""
CALLABLE: Final = Value(FUNCTION, callees=frozenset({UNKNOWN}))
"""A function of which nothing is known."""


def number(lo: float, hi: float, bits: int = FLOAT, *, own: bool = False) -> Value:
    """Numbers from `lo` to `hi`."""
    return Value(bits, lo, hi, own)


def constant(value: object) -> Value:
    """A constant of the program."""
    if value is None:
        return NOTHING
    if isinstance(value, bool):
        return YES if value else NO
    if isinstance(value, int):
        lo, hi = outward(value, value)
        return Value(INT, lo, hi)
    if isinstance(value, float):
        return Value(NAN) if math.isnan(value) else Value(FLOAT, value, value)
    if isinstance(value, str):
        # The sandbox puts other characters in the place of lone surrogates, so that such a text is not known there.
        return Value(TEXT, texts=frozenset({value}) if _is_utf8(value) else None)
    return Value(OBJECT)


def _is_utf8(text: str) -> bool:
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True


def outward(lo: float, hi: float) -> tuple[float, float]:
    """Bounds of integers as floats that surely enclose them."""
    return _below(lo), _above(hi)


def _below(number_: float) -> float:
    try:
        as_float = float(number_)
    except OverflowError:
        return math.inf if number_ < 0 else 1.7e308 if number_ > 0 else 0.0
    return as_float if abs(as_float) < _EXACT else math.nextafter(as_float, -math.inf)


def _above(number_: float) -> float:
    try:
        as_float = float(number_)
    except OverflowError:
        return math.inf if number_ > 0 else -1.7e308
    return as_float if abs(as_float) < _EXACT else math.nextafter(as_float, math.inf)


def fresh(site: int, bits: int = OBJECT) -> Value:
    """An object just made at a place of the program."""
    return Value(bits, refs=frozenset({site}))


def join(a: Value, b: Value) -> Value:
    """Everything that either may be."""
    if a is b or a == b:
        return a
    return Value(
        a.bits | b.bits,
        min(a.lo, b.lo),
        max(a.hi, b.hi),
        a.own and b.own,
        None if a.offsets is None or b.offsets is None else a.offsets | b.offsets,
        _texts(a, b),
        _items(a, b),
        None if a.refs is None or b.refs is None else a.refs | b.refs,
        a.callees | b.callees,
        _origin(a, b),
    )


def join_all(values: list[Value]) -> Value:
    """Everything that any of them may be; `TOP` for none."""
    if not values:
        return TOP
    result = values[0]
    for value in values[1:]:
        result = join(result, value)
    return result


def _texts(a: Value, b: Value) -> frozenset[str] | None:
    if a.texts is None or b.texts is None:
        return None
    both = a.texts | b.texts
    return both if len(both) <= _MAX_TEXTS else None


def _items(a: Value, b: Value) -> tuple[Value, ...] | None:
    if not a.bits & TUPLE:
        return b.items
    if not b.bits & TUPLE:
        return a.items
    if a.items is None or b.items is None or len(a.items) != len(b.items):
        return None
    return tuple(join(one, other) for one, other in zip(a.items, b.items, strict=True))


def _origin(a: Value, b: Value) -> Origin | None:
    if a.origin is None or b.origin is None or a.origin[:2] != b.origin[:2]:
        return None
    return (*a.origin[:2], min(a.origin[2], b.origin[2]), max(a.origin[3], b.origin[3]))


def widen(a: Value, b: Value) -> Value:
    """A value that holds `a` and `b`, and that cannot grow for ever when this is repeated."""
    both = join(a, b)
    if both == a:
        return a
    lo, hi, own = both.lo, both.hi, both.own
    if a.lo <= a.hi:  # it was a number before
        if lo < a.lo:
            lo, own = (0.0 if lo >= 0 else -math.inf), False
        if hi > a.hi:
            hi, own = (0.0 if hi <= 0 else math.inf), False
    items = both.items if both.items == a.items else None
    origin = both.origin if both.origin == a.origin else None
    return both._replace(lo=lo, hi=hi, own=own, items=items, origin=origin)


def may_be_true(value: Value) -> bool:
    """Whether a test of it can come out true."""
    bits = value.bits
    if bits & (TRUE | NAN | EGO | CAR | LANE | OBJECT | FUNCTION):
        return True
    if bits & (INT | FLOAT) and (value.lo != 0 or value.hi != 0):
        return True
    if bits & TEXT and (value.texts is None or any(value.texts)):
        return True
    return bool(bits & TUPLE and (value.items is None or value.items))


def may_be_false(value: Value) -> bool:
    """Whether a test of it can come out false."""
    bits = value.bits
    if bits & (NONE | FALSE | OBJECT):
        return True
    if bits & (INT | FLOAT) and value.lo <= 0 <= value.hi:
        return True
    if bits & TEXT and (value.texts is None or "" in value.texts):
        return True
    return bool(bits & TUPLE and not value.items)


def where_true(value: Value) -> Value:
    """What it is once a test of it came out true."""
    bits = value.bits & ~(NONE | FALSE)
    if value.lo == 0 == value.hi:
        return without_numbers(value, bits & ~(INT | FLOAT))
    return value if bits == value.bits else value._replace(bits=bits)


def where_false(value: Value) -> Value:
    """What it is once a test of it came out false."""
    bits = value.bits & ~(TRUE | NAN | EGO | CAR | LANE | FUNCTION)
    if bits & (INT | FLOAT):
        if value.lo <= 0 <= value.hi:
            return value._replace(bits=bits, lo=0.0, hi=0.0, own=value.own and value.lo == 0 == value.hi)
        return without_numbers(value, bits & ~NUMBER)
    return without_numbers(value, bits)


def without_numbers(value: Value, bits: int) -> Value:
    """The same with other kinds, none of them an interval."""
    return value._replace(bits=bits, lo=math.inf, hi=-math.inf, own=True, origin=None)


def without_period(value: Value) -> Value:
    """What is left of it after a yield: a lane is no longer known by its offset from the ego's."""
    items = value.items
    if items and value.bits & TUPLE:
        items = tuple(without_period(item) for item in items)
    if value.bits & LANE and value.offsets is not None:
        return value._replace(offsets=None, items=items)
    return value if items is value.items else value._replace(items=items)
