"""What a `for` loop walks, and how often."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from chauffeur.programs.verify import arithmetic
from chauffeur.programs.verify.values import (
    BOOL,
    INT,
    TOP,
    Value,
    constant,
    number,
)

_ANY_INTEGER: Final = number(-math.inf, math.inf, INT)


class Walked(NamedTuple):
    """What a loop goes through.

    Attributes:
        element: What its variable may hold.
        fewest, most: How many there are; `most` is None where it is not known.
        refs: Places of objects it walks; None where they are not known.
        finite: Whether it ends, unless what it walks grows meanwhile.
    """

    element: Value
    fewest: int
    most: int | None
    refs: frozenset[int] | None
    finite: bool


def range_of(given: list[Value]) -> Walked:
    """What a range of these arguments is."""
    unknown = Walked(_ANY_INTEGER, 0, None, frozenset(), False)
    if not all(value.only_numeric and value.bits & (INT | BOOL) for value in given):
        return unknown
    numbers = [arithmetic.as_number(value) for value in given]
    start, stop = (constant(0), numbers[0]) if len(numbers) == 1 else (numbers[0], numbers[1])
    step = numbers[2] if len(numbers) == 3 else constant(1)
    if step.lo != step.hi or step.lo == 0 or any(abs(one) > 1e15 for one in (step.lo, start.lo, stop.hi, start.hi)):
        return unknown
    size = int(step.lo)
    if size > 0:
        lo, hi = start.lo, stop.hi - 1
        most, fewest = _count(start.lo, stop.hi, size), _count(start.hi, stop.lo, size)
    else:
        lo, hi = stop.lo + 1, start.hi
        most, fewest = _count(stop.lo, start.hi, -size), _count(stop.hi, start.lo, -size)
    if most is None:
        return unknown._replace(element=number(lo, hi, INT))
    if most == 0:
        return Walked(TOP, 0, 0, frozenset(), True)
    own = start.own and stop.own and start.lo == start.hi and stop.lo == stop.hi and abs(size) == 1
    return Walked(number(lo, max(lo, hi), INT, own=own), fewest or 0, most, frozenset(), True)


def _count(start: float, stop: float, step: int) -> int | None:
    """Passes of a range; None where they are more than can be counted."""
    if abs(start) > 1e15 or abs(stop) > 1e15:
        return 0 if stop <= start else None
    return max(0, -((int(start) - int(stop)) // step))
