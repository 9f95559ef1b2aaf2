"""What a comparison says about the two sides once it has come out true, or false."""

from __future__ import annotations

import ast
import math
from typing import Final

from chauffeur.programs.verify.arithmetic import as_number
from chauffeur.programs.verify.values import (
    BOOL,
    FALSE,
    FLOAT,
    INT,
    NAN,
    NONE,
    NUMBER,
    NUMERIC,
    TEXT,
    TRUE,
    Value,
    without_numbers,
)

Sides = tuple[Value, Value] | None
"""Both sides in that case; None where it cannot come to it."""

_SWAPPED: Final[dict[type[ast.cmpop], type[ast.cmpop]]] = {ast.Gt: ast.Lt, ast.GtE: ast.LtE}


def compared(op: ast.cmpop, left: Value, right: Value) -> tuple[Sides, Sides]:
    """Both sides where the comparison holds, and where it does not."""
    kind = type(op)
    if kind in (ast.Lt, ast.LtE):
        return _ordered(left, right, strict=kind is ast.Lt)
    if kind in _SWAPPED:
        holds, fails = _ordered(right, left, strict=kind is ast.Gt)
        return _swap(holds), _swap(fails)
    if kind in (ast.Eq, ast.Is):
        return _equal(left, right)
    if kind in (ast.NotEq, ast.IsNot):
        fails, holds = _equal(left, right)
        return holds, fails
    return (left, right), (left, right)


def _swap(sides: Sides) -> Sides:
    return None if sides is None else (sides[1], sides[0])


def _ordered(left: Value, right: Value, *, strict: bool) -> tuple[Sides, Sides]:
    both = (left, right)
    if not (left.bits & NUMERIC and right.bits & NUMERIC):
        return both, both
    if right.only_numeric:
        left = _numeric(left)  # a number has an order with numbers only: anything else has raised
    elif left.only_numeric:
        right = _numeric(right)
    else:
        return both, both
    a, b = as_number(left), as_number(right)
    has_numbers = bool(a.bits & (INT | FLOAT) and b.bits & (INT | FLOAT))
    can_hold = has_numbers and (a.lo < b.hi if strict else a.lo <= b.hi)
    can_fail = bool((a.bits | b.bits) & NAN) or not has_numbers or (a.hi >= b.lo if strict else a.hi > b.lo)
    holds: Sides = None
    if can_hold:
        holds = _at_most(left, b.hi, strict, nan=False), _at_least(right, a.lo, strict, nan=False)
    fails: Sides = None
    if can_fail:
        left_nan, right_nan = bool(right.bits & NAN), bool(left.bits & NAN)
        fails = (
            left if left_nan else _at_least(left, b.lo, not strict, nan=True),
            right if right_nan else _at_most(right, a.hi, not strict, nan=True),
        )
    return holds, fails


def _numeric(value: Value) -> Value:
    return value if value.only_numeric else value._replace(bits=value.bits & NUMERIC)


def _at_most(value: Value, bound: float, strict: bool, *, nan: bool) -> Value:
    bits = value.bits if nan else value.bits & ~NAN
    if strict and value.bits & NUMBER and bound < math.inf:
        bound = math.ceil(bound) - 1 if not bits & FLOAT and abs(bound) < 1e15 else math.nextafter(bound, -math.inf)
    if value.hi <= bound:
        return value if bits == value.bits else value._replace(bits=bits)
    return _cut(value, bits, value.lo, bound)


def _at_least(value: Value, bound: float, strict: bool, *, nan: bool) -> Value:
    bits = value.bits if nan else value.bits & ~NAN
    if strict and value.bits & NUMBER and bound > -math.inf:
        bound = math.floor(bound) + 1 if not bits & FLOAT and abs(bound) < 1e15 else math.nextafter(bound, math.inf)
    if value.lo >= bound:
        return value if bits == value.bits else value._replace(bits=bits)
    return _cut(value, bits, bound, value.hi)


def _cut(value: Value, bits: int, lo: float, hi: float) -> Value:
    if lo > hi or not bits & (INT | FLOAT):
        return without_numbers(value, bits & ~(INT | FLOAT))
    return value._replace(bits=bits, lo=lo, hi=hi, own=False)


def _equal(left: Value, right: Value) -> tuple[Sides, Sides]:
    holds: Sides = (left, right)
    fails: Sides = (left, right)
    if right.bits == NONE:
        return _none(left, right)
    if left.bits == NONE:
        holds, fails = _none(right, left)
        return _swap(holds), _swap(fails)
    if not right.bits & NONE:
        left_held = left._replace(bits=left.bits & ~NONE)
        holds = (left_held, right)
    if not left.bits & NONE:
        holds = (holds[0], right._replace(bits=right.bits & ~NONE))
    may_differ_by_none = holds != fails
    left, right = holds
    if not left.bits or not right.bits:
        return None, fails
    narrowed = holds, fails
    if not (left.bits | right.bits) & ~NUMBER:
        narrowed = _equal_numbers(left, right, fails)
    elif left.bits == TEXT == right.bits:
        narrowed = _equal_texts(left, right, fails)
    elif not (left.bits | right.bits) & ~BOOL:
        narrowed = _equal_flags(left, right, fails)
    return narrowed[0], fails if may_differ_by_none else narrowed[1]


def _none(value: Value, none: Value) -> tuple[Sides, Sides]:
    rest = value.bits & ~NONE
    holds = (without_numbers(value, NONE), none) if value.bits & NONE else None
    return holds, (value._replace(bits=rest), none) if rest else None


def _equal_numbers(left: Value, right: Value, fails: Sides) -> tuple[Sides, Sides]:
    lo, hi = max(left.lo, right.lo), min(left.hi, right.hi)
    holds = None
    if lo <= hi:
        holds = _between(left, lo, hi), _between(right, lo, hi)
    same = left.lo == left.hi == right.lo == right.hi
    if same and not (left.bits | right.bits) & NAN:
        fails = None
    return holds, fails


def _between(value: Value, lo: float, hi: float) -> Value:
    own = value.own and (value.lo, value.hi) == (lo, hi)
    return value._replace(bits=value.bits & ~NAN, lo=lo, hi=hi, own=own)


def _equal_texts(left: Value, right: Value, fails: Sides) -> tuple[Sides, Sides]:
    if left.texts is None or right.texts is None:
        return (left, right), fails
    common = left.texts & right.texts
    holds = (left._replace(texts=common), right._replace(texts=common)) if common else None
    if fails is not None and len(right.texts) == 1:
        rest = left.texts - right.texts
        fails = (left._replace(texts=rest), right) if rest else None
    return holds, fails


def _equal_flags(left: Value, right: Value, fails: Sides) -> tuple[Sides, Sides]:
    common = left.bits & right.bits
    holds = (left._replace(bits=common), right._replace(bits=common)) if common else None
    if right.bits in (TRUE, FALSE):
        rest = left.bits & ~right.bits
        fails = (left._replace(bits=rest), right) if rest else None
    return holds, fails
