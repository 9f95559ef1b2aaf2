"""What a value of a program can be said to be without running it: a number of something, a lane, a vehicle.

A number is a set of alternatives, each `factor * base + offset`, where the base is something the program asks the car
about (its own speed, the speed of another vehicle, the limit, a gap). So `get_speed_of(ego) + 5` is known to be 5 m/s
more than now although neither speed is known.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

Base = Literal["", "ego", "other", "limit", "gap", "past", "behind", "headway", "sign", "per speed"]
"""What a number counts from: nothing; the ego's speed; another vehicle's; the speed limit; the gap to a vehicle ahead;
the lead over one that was passed; the gap to one behind; the time headway; the way to the stop sign; a way divided by
the ego's speed."""

MAX_TERMS: Final = 12
"""Alternatives that are followed; of more than these the number is unknown."""


@dataclass(frozen=True, slots=True)
class Term:
    """One alternative of a number.

    Attributes:
        base: What it counts from.
        factor: Of the base; 0 where there is none.
        offset: Added, SI.
        bound: Whether it is only a highest or lowest value (an argument of min or max).
    """

    base: Base
    factor: float
    offset: float
    bound: bool = False


@dataclass(frozen=True, slots=True)
class LaneValue:
    """A lane by its side of the ego.

    Attributes:
        offset: -1 left, 0 own, +1 right of the lane the ego was in when the program asked.
        at: Where the ego was then: lanes moved to the right since the start, all that are possible.
    """

    offset: int
    at: frozenset[int]


@dataclass(frozen=True, slots=True)
class TracedValue:
    """A value of a program.

    Attributes:
        terms: Alternatives of a number; empty where it is none, or not known.
        tags: What it depends on: `safe:-1` (entering the lane on the left was asked about), `gap`, `speed`, ...
        lanes: Alternatives of a lane.
        vehicle: `ego`, `front`, `rear`, or empty.
        crossing: `left` or `right` for lanes that cross from there, `both` when they were put together.
        functions: Functions it may be.
        items: Members of a tuple or a list.
        open: Whether it may be another number than those known.
    """

    terms: frozenset[Term] = frozenset()
    tags: frozenset[str] = frozenset()
    lanes: frozenset[LaneValue] = frozenset()
    vehicle: str = ""
    crossing: str = ""
    functions: tuple[ast.AST, ...] = ()
    items: tuple[TracedValue, ...] = ()
    open: bool = False

    @property
    def constants(self) -> tuple[float, ...]:
        """Its alternatives that are plain numbers."""
        return tuple(sorted(term.offset for term in self.terms if not term.factor))


NOTHING: Final = TracedValue()
"""Not known."""


def number(value: float) -> TracedValue:
    """A plain number; nothing for one that is not finite."""
    return TracedValue(frozenset({Term("", 0.0, value)})) if math.isfinite(value) else NOTHING


def of(base: Base, *tags: str) -> TracedValue:
    """A number that the car is asked for."""
    return TracedValue(frozenset({Term(base, 1.0, 0.0)}), frozenset(tags))


def either(values: Iterable[TracedValue]) -> TracedValue:
    """One of several values."""
    found = list(values)
    if not found:
        return NOTHING
    if len(found) == 1:
        return found[0]
    functions: list[ast.AST] = []
    for value in found:
        functions += [one for one in value.functions if one not in functions]
    crossings = {value.crossing for value in found if value.crossing}
    return TracedValue(
        terms=_few(term for value in found for term in value.terms),
        tags=frozenset(tag for value in found for tag in value.tags),
        lanes=frozenset(lane for value in found for lane in value.lanes),
        vehicle=next((value.vehicle for value in found if value.vehicle), ""),
        crossing=next(iter(crossings)) if len(crossings) == 1 else "both" if crossings else "",
        functions=tuple(functions),
        items=max((value.items for value in found), key=len),
        open=any(value.open or not value.terms for value in found),
    )


def bounded(values: Iterable[TracedValue]) -> TracedValue:
    """Of min or max: one of several numbers, the plain ones among others as bounds."""
    found = list(values)
    unlike = any(not value.terms or any(term.factor for term in value.terms) for value in found)
    if len(found) <= 1 or not unlike:
        return either(found)
    marked = [
        replace(value, terms=frozenset(replace(t, bound=True) if not t.factor else t for t in value.terms))
        for value in found
    ]
    return either(marked)


def combined(left: TracedValue, op: ast.operator, right: TracedValue) -> TracedValue:
    """A sum, difference, product or quotient."""
    tags = left.tags | right.tags
    terms = _few(
        term for a in left.terms for b in right.terms for term in _arithmetic(a, op, b) if math.isfinite(term.offset)
    )
    crossing = left.crossing or right.crossing
    if left.crossing and right.crossing and left.crossing != right.crossing:
        crossing = "both"
    return TracedValue(
        terms,
        tags,
        open=left.open or right.open,
        crossing=crossing,
        items=left.items + right.items if isinstance(op, ast.Add) else (),
    )


def tags_of(values: Sequence[TracedValue]) -> frozenset[str]:
    """What any of some values depends on."""
    return frozenset(tag for value in values for tag in value.tags)


def negated(value: TracedValue) -> TracedValue:
    """Its opposite."""
    return replace(value, terms=frozenset(Term(t.base, -t.factor, -t.offset, t.bound) for t in value.terms))


def in_order(terms: Iterable[Term]) -> list[Term]:
    """Terms by size: those of a set stand in another order each time Python is started."""
    return sorted(terms, key=lambda term: (term.offset, term.factor, term.base, term.bound))


def _arithmetic(a: Term, op: ast.operator, b: Term) -> Iterable[Term]:
    bound = a.bound or b.bound
    match op:
        case ast.Add() if not a.factor or not b.factor:
            yield Term(a.base or b.base, a.factor + b.factor, a.offset + b.offset, bound)
        case ast.Sub() if not b.factor:
            yield Term(a.base, a.factor, a.offset - b.offset, bound)
        case ast.Sub() if not a.factor:
            yield Term(b.base, -b.factor, a.offset - b.offset, bound)
        case ast.Mult() if not b.factor:
            yield Term(a.base if b.offset else "", a.factor * b.offset, a.offset * b.offset, bound)
        case ast.Mult() if not a.factor:
            yield Term(b.base if a.offset else "", b.factor * a.offset, b.offset * a.offset, bound)
        case ast.Div() if not b.factor and b.offset:
            yield Term(a.base, a.factor / b.offset, a.offset / b.offset, bound)
        case ast.Div() if not a.factor and b == Term("ego", 1.0, 0.0):
            yield Term("per speed", 1.0, a.offset, bound)
        case ast.FloorDiv() if not a.factor and not b.factor and b.offset:
            yield Term("", 0.0, a.offset // b.offset, bound)
        case _:
            pass


def _few(terms: Iterable[Term]) -> frozenset[Term]:
    found = frozenset(terms)
    return found if len(found) <= MAX_TERMS else frozenset()
