"""Arithmetic on intervals: results that surely enclose what the program computes, rounding included.

The operations +, -, * and / round to the nearest float and are therefore monotone: the same operation on the bounds
gives the bounds. Powers and functions of the platform's library are not rounded so strictly and get some slack.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable
from typing import Final

from chauffeur.programs.verify.values import (
    BOOL,
    FALSE,
    FLOAT,
    INT,
    NAN,
    NUMBER,
    NUMERIC,
    TOP,
    TRUE,
    Value,
    number,
    outward,
)

_INF: Final = math.inf
_SLACK: Final = 1e-12
"""Relative error that a library function is granted."""
_EXACT: Final = 2.0**52


def as_number(value: Value) -> Value:
    """The numbers a value can be, its flags counted as 0 and 1."""
    bits = value.bits
    if not bits & BOOL:
        return value if not bits & ~NUMBER else value._replace(bits=bits & NUMBER)
    lo = min(value.lo, 0.0 if bits & FALSE else 1.0)
    hi = max(value.hi, 1.0 if bits & TRUE else 0.0)
    return Value((bits & NUMBER) | INT, lo, hi, False)


def negative(value: Value) -> Value:
    """`-value`."""
    value = as_number(value)
    return Value(value.bits, -value.hi, -value.lo, value.own)


def absolute(value: Value) -> Value:
    """`abs(value)`."""
    value = as_number(value)
    if value.lo >= 0:
        return value
    if value.hi <= 0:
        return negative(value)
    return Value(value.bits, 0.0, max(-value.lo, value.hi), False)


def binary(op: ast.operator, a: Value, b: Value) -> Value:
    """The result of an operator on what may be numbers and what may be something else."""
    if not (a.bits & NUMERIC and b.bits & NUMERIC):
        return TOP
    if not (a.only_numeric and b.only_numeric) and not _raises_otherwise(a, b):
        return TOP
    a, b = as_number(a), as_number(b)
    operation = _OPERATIONS.get(type(op))
    if operation is None:
        return number(-_INF, _INF, INT)
    if not (a.bits & (INT | FLOAT) and b.bits & (INT | FLOAT)):
        return Value(NAN | FLOAT, -_INF, _INF, False)
    return operation(a, b)


def _raises_otherwise(a: Value, b: Value) -> bool:
    """Whether one is a number, so that the other is one too or the operation fails (`*` and `%` know texts)."""
    return bool(a.only_numeric or b.only_numeric) and not (a.bits | b.bits) & ~(NUMERIC | 1)


def _kinds(a: Value, b: Value) -> int:
    bits = 0
    if a.bits & INT and b.bits & INT:
        bits |= INT
    if (a.bits | b.bits) & FLOAT:
        bits |= FLOAT
    return bits | ((a.bits | b.bits) & NAN)


def _own(a: Value, b: Value) -> bool:
    """Bounds are surely reached together where one of them does not vary."""
    return a.own and b.own and (a.lo == a.hi or b.lo == b.hi)


def _result(bits: int, lo: float, hi: float, own: bool) -> Value:
    if lo != lo:  # noqa: PLR0124 - NaN
        lo, own = -_INF, False
    if hi != hi:  # noqa: PLR0124 - NaN
        hi, own = _INF, False
    if bits & INT and (lo < -_EXACT or hi > _EXACT):
        lo, hi = outward(lo, hi)
    return Value(bits, lo, hi, own)


def _infinite(value: Value) -> bool:
    return value.lo == -_INF or value.hi == _INF


def _add(a: Value, b: Value) -> Value:
    bits = _kinds(a, b)
    if (a.hi == _INF and b.lo == -_INF) or (a.lo == -_INF and b.hi == _INF):
        bits |= NAN
        if a.lo == a.hi and b.lo == b.hi:  # nothing else
            return Value(NAN)
    value = _result(bits, a.lo + b.lo, a.hi + b.hi, _own(a, b))
    if a.origin is not None and _steady(b):
        return value._replace(origin=(*a.origin[:2], a.origin[2] + b.lo, a.origin[3] + b.hi))
    if b.origin is not None and _steady(a):
        return value._replace(origin=(*b.origin[:2], b.origin[2] + a.lo, b.origin[3] + a.hi))
    return value


def _steady(value: Value) -> bool:
    return not value.bits & NAN and not _infinite(value)


def _subtract(a: Value, b: Value) -> Value:
    return _add(a, Value(b.bits, -b.hi, -b.lo, b.own))


def _multiply(a: Value, b: Value) -> Value:
    bits = _kinds(a, b)
    if (_infinite(a) and b.lo <= 0 <= b.hi) or (_infinite(b) and a.lo <= 0 <= a.hi):
        bits |= NAN
    corners = [_times(x, y) for x in (a.lo, a.hi) for y in (b.lo, b.hi)]
    return _result(bits, min(corners), max(corners), _own(a, b))


def _times(x: float, y: float) -> float:
    return 0.0 if x == 0 or y == 0 else x * y


def _divide(a: Value, b: Value) -> Value:
    bits = FLOAT | ((a.bits | b.bits) & NAN)
    if _infinite(a) and _infinite(b):
        bits |= NAN
    if b.lo > 0 or b.hi < 0:
        corners = [_over(x, y) for x in (a.lo, a.hi) for y in (b.lo, b.hi)]
        return _result(bits, min(corners), max(corners), _own(a, b))
    # A divisor of exactly 0 raises; near 0 the quotient has no bound, but it has a sign where both have one.
    if b.lo < 0 < b.hi:
        return _result(bits, -_INF, _INF, False)
    if b.lo < 0:
        a, b = Value(a.bits, -a.hi, -a.lo), Value(b.bits, -b.hi, -b.lo)
    least = _over(a.lo, b.hi) if a.lo >= 0 else -_INF
    most = _over(a.hi, b.hi) if a.hi <= 0 else _INF
    return _result(bits, least, most, False)


def _over(x: float, y: float) -> float:
    if y == 0:
        return 0.0 if x == 0 else math.copysign(_INF, x)
    if math.isinf(x) and math.isinf(y):
        return math.copysign(1.0, x) * math.copysign(1.0, y)
    return x / y


def _floor_divide(a: Value, b: Value) -> Value:
    quotient = _divide(a, b)
    bits = _kinds(a, b) | (quotient.bits & NAN)
    lo, hi = _floor(quotient.lo), _floor(quotient.hi)
    exact = bits == INT and max(map(abs, (a.lo, a.hi, b.lo, b.hi))) < _EXACT
    if not exact:  # Python takes the remainder off first, and so may end up one lower
        lo, hi = lo - 1, hi + 1
    return _result(bits | NAN if bits & FLOAT and _infinite(a) else bits, lo, hi, False)


def _floor(x: float) -> float:
    return x if math.isinf(x) else float(math.floor(x))


def _modulo(a: Value, b: Value) -> Value:
    bits = _kinds(a, b)
    if bits & FLOAT and (_infinite(a) or b.lo <= 0 <= b.hi):
        bits |= NAN
    if a.lo >= 0 and b.lo > a.hi:
        return Value(bits, a.lo, a.hi, False)
    lo, hi = min(0.0, b.lo), max(0.0, b.hi)
    if bits == INT:
        lo, hi = min(0.0, lo + 1), max(0.0, hi - 1)
    return _result(bits, lo, hi, False)


def _power(a: Value, b: Value) -> Value:
    bits = _kinds(a, b)
    if bits & INT and b.lo < 0:
        bits |= FLOAT
    if a.lo >= 0:
        corners = [_raised(x, y) for x in (a.lo, a.hi) for y in (b.lo, b.hi)]
        lo, hi = min(corners), max(corners)
        if b.lo < 0 and a.lo == 0:
            hi = _INF
    elif b.lo == b.hi and b.lo in (1.0, 2.0, 3.0):
        lo, hi = _raised(a.lo, b.lo), _raised(a.hi, b.lo)
        if b.lo == 2:
            lo, hi = (0.0 if a.hi >= 0 else hi), max(lo, hi)
    else:
        return TOP  # a negative number to a broken power is complex
    if bits & FLOAT and (_infinite(a) or _infinite(b)):
        bits |= NAN
    exact = bits == INT and max(abs(lo), abs(hi)) < _EXACT
    if not exact:
        lo, hi = slackened(lo, hi)
    own = a.own and b.own and a.lo == a.hi and b.lo == b.hi
    return _result(bits, lo, hi, own)


def _raised(x: float, y: float) -> float:
    try:
        return float(x**y)
    except OverflowError:
        return _INF if x > 0 or y % 2 == 0 else -_INF
    except ZeroDivisionError:
        return _INF


def slackened(lo: float, hi: float) -> tuple[float, float]:
    """Bounds a little further out, for what the platform's library may round differently."""
    return lo - abs(lo) * _SLACK if lo > -_INF else lo, hi + abs(hi) * _SLACK if hi < _INF else hi


_OPERATIONS: Final[dict[type[ast.operator], Callable[[Value, Value], Value]]] = {
    ast.Add: _add,
    ast.Sub: _subtract,
    ast.Mult: _multiply,
    ast.Div: _divide,
    ast.FloorDiv: _floor_divide,
    ast.Mod: _modulo,
    ast.Pow: _power,
}


def least(values: list[Value]) -> Value:
    """`min` of numbers."""
    return _extreme(values, min)


def greatest(values: list[Value]) -> Value:
    """`max` of numbers."""
    return _extreme(values, max)


def _extreme(values: list[Value], best: Callable[[list[float]], float]) -> Value:
    if not all(value.bits & NUMERIC and not value.bits & ~(NUMERIC | 1) for value in values):
        return TOP
    numbers = [as_number(value) for value in values]
    bits = 0
    for value in numbers:
        bits |= value.bits
    real = [value for value in numbers if value.bits & (INT | FLOAT)]
    if not real:
        return Value(NAN)
    own = all(value.own for value in real) and sum(value.lo != value.hi for value in real) <= 1
    if bits & NAN:  # which of them comes out then depends on their order
        return Value(bits, min(value.lo for value in real), max(value.hi for value in real), False)
    return Value(bits, best([value.lo for value in real]), best([value.hi for value in real]), own)


def rounded(value: Value, digits: Value | None) -> Value:
    """`round(value)`, or `round(value, digits)`."""
    value = as_number(value)
    if digits is None or digits.may_be_none:
        whole = _whole(value, math.floor, math.ceil)
        return whole if digits is None else Value(whole.bits | value.bits, value.lo - 1, value.hi + 1, False)
    if digits.only_numeric and digits.lo >= 0:
        return Value(value.bits, value.lo - 1, value.hi + 1, False)
    return number(-_INF, _INF, value.bits)


def truncated(value: Value) -> Value:
    """`int(value)` of a number."""
    value = as_number(value)
    return _whole(value, math.trunc, math.trunc)


def floored(value: Value) -> Value:
    """`math.floor(value)`."""
    return _whole(as_number(value), math.floor, math.floor)


def raised_to_whole(value: Value) -> Value:
    """`math.ceil(value)`."""
    return _whole(as_number(value), math.ceil, math.ceil)


def _whole(value: Value, down: Callable[[float], int], up: Callable[[float], int]) -> Value:
    lo = value.lo if math.isinf(value.lo) else down(value.lo)
    hi = value.hi if math.isinf(value.hi) else up(value.hi)
    if lo > hi:  # no number but NaN: the call fails
        return number(-_INF, _INF, INT)
    return Value(INT, *outward(lo, hi), own=value.own and value.lo == value.hi)


def _only(bits: int, lo: float, hi: float) -> Callable[[Value], Value]:
    return lambda value: Value(bits | (value.bits & NAN), lo, hi, False)


def _root(value: Value) -> Value:
    lo, hi = slackened(math.sqrt(max(0.0, value.lo)), math.sqrt(max(0.0, value.hi)))
    return Value(FLOAT | (value.bits & NAN), lo, hi, False)


def to_float(value: Value) -> Value:
    """`float(value)` of a number."""
    return Value(FLOAT | (value.bits & NAN), value.lo, value.hi, value.own)


_MATH: Final[dict[str, Callable[[Value], Value]]] = {
    "sqrt": _root,
    "floor": floored,
    "ceil": raised_to_whole,
    "trunc": truncated,
    "fabs": lambda value: to_float(absolute(value)),
    "sin": _only(FLOAT | NAN, -1.0, 1.0),
    "cos": _only(FLOAT | NAN, -1.0, 1.0),
    "tanh": _only(FLOAT, -1.0, 1.0),
    "atan": _only(FLOAT, -1.6, 1.6),
}


def math_function(name: str, arguments: list[Value]) -> Value:
    """The result of a function of `math`."""
    known = _MATH.get(name)
    if known is not None and len(arguments) == 1 and arguments[0].bits & NUMERIC:
        return known(as_number(arguments[0]))
    if name == "atan2":
        return number(-3.2, 3.2, FLOAT | NAN)
    if name in {"isnan", "isinf", "isfinite", "isclose"}:
        return Value(BOOL)
    return TOP


def math_constant(name: str) -> Value | None:
    """A number of `math`; None where the name is none."""
    found = getattr(math, name, None)
    if not isinstance(found, float):
        return None
    return Value(NAN) if math.isnan(found) else Value(FLOAT, found, found)
