"""Numbers of a program held against the numbers that were said: each must be one of them, and of the same kind.

A small network may copy a number wrongly ("ninety-five km/h and sixty-five feet" as twice 65). Where the words hold one
number of a kind that the program leaves out, and the program one of that kind that they do not hold, it is that one.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from chauffeur.language.quantities import Quantity, read_quantities
from chauffeur.language.tokens import split_units
from chauffeur.planners.onboard.dialect import CONDITIONS, SKILLS, UNITS, DialectStep, Kind, Number, plain

_DIGITS: Final = re.compile(r"(?<![^\W_])\d+(?:\.\d+)?(?![^\W_])")
_CLOSE: Final = 0.011
_ROUND: Final = 0.01
_MEASURES: Final[tuple[Kind, ...]] = ("speed", "distance", "time")
"""Kinds whose numbers are compared; factors and counts are said in too many ways."""


def unnamed(wish: str, history: Sequence[str], steps: Sequence[DialectStep]) -> Number | None:
    """The first number of a program that neither the wish nor history names as a number of its kind.

    Args:
        wish: The passenger's words.
        history: Remembered trips as the model read them.
        steps: What the program does.
    """
    measures = _measures(steps)
    if not measures:
        return None
    said = _Said.of(wish, history)
    return next((number for kind, number in measures if not said.holds(number, kind)), None)


def named(wish: str, history: Sequence[str]) -> tuple[str, ...]:
    """Every number that a program may take over from the words, in any unit in which it is a round one."""
    found = {number for text in (wish, *history) for number in _DIGITS.findall(split_units(text))}
    for quantity in read_quantities(wish):
        units = [si for kind, si, _ in UNITS.values() if kind == quantity.dimension]
        found |= {plain(round(value, 2)) for si in (1.0, *units) if _round(value := quantity.value / si)}
    return tuple(sorted(found))


def taken_over(wish: str, history: Sequence[str], steps: Sequence[DialectStep]) -> tuple[DialectStep, ...]:
    """The steps, with what was said instead of a wrong number where it is plain which one that is."""
    measures = _measures(steps)
    if not measures:
        return tuple(steps)
    said = _Said.of(wish, history)
    right: dict[Number, Number] = {}
    for kind in _MEASURES:
        wrong = {number for k, number in measures if k == kind and not said.holds(number, kind)}
        taken = [number.si / number.factor for k, number in measures if k == kind]
        left = [q for q in said.quantities if q.dimension == kind and not any(_close(si, q.value) for si in taken)]
        if len(wrong) == len(left) == 1:
            (number,) = wrong
            right[number] = _as_said(left[0], number.unit)
    return tuple(_with(step, right) for step in steps)


@dataclass(frozen=True, slots=True)
class _Said:
    """Numbers of a wish and its history: quantities with units, and numbers that may have any."""

    quantities: tuple[Quantity, ...]
    anything: tuple[float, ...]

    @classmethod
    def of(cls, wish: str, history: Sequence[str]) -> _Said:
        quantities = read_quantities(wish)
        measured = [q for q in quantities if q.dimension in _MEASURES]
        digits = Counter(_DIGITS.findall(split_units(wish))) - Counter(
            d for q in measured for d in _DIGITS.findall(q.said)
        )
        remembered = [float(number) for text in history for number in _DIGITS.findall(text)]
        bare = [q.value for q in quantities if q.dimension == "bare"]
        return cls(quantities, (*map(float, digits), *remembered, *bare))

    def holds(self, number: Number, kind: Kind) -> bool:
        if any(_close(number.value, one) for one in self.anything):
            return True
        measured = number.si / number.factor
        return any(q.dimension == kind and _close(measured, q.value) for q in self.quantities)


def _measures(steps: Sequence[DialectStep]) -> list[tuple[Kind, Number]]:
    found: list[tuple[Kind, Number]] = []
    for step in steps:
        takes, condition = SKILLS[step.skill].takes, step.condition
        if step.number is not None and takes in _MEASURES:
            found.append((takes, step.number))
        if step.wait_s is not None:
            found.append(("time", step.wait_s))
        kind = None if condition is None else CONDITIONS[condition.name][0]
        if condition is not None and condition.number is not None and kind is not None:
            found.append((kind, condition.number))
    return found


def _with(step: DialectStep, right: dict[Number, Number]) -> DialectStep:
    condition = step.condition
    if condition is not None and condition.number is not None:
        condition = replace(condition, number=right.get(condition.number, condition.number))
    number = None if step.number is None else right.get(step.number, step.number)
    wait = None if step.wait_s is None else right.get(step.wait_s, step.wait_s)
    return replace(step, number=number, wait_s=wait, condition=condition)


def _as_said(quantity: Quantity, unit: str) -> Number:
    """A quantity in a unit in which it is round: the one given, if it is; SI, if no other is."""
    units = (unit, "", *(name for name, (kind, _, _) in UNITS.items() if kind == quantity.dimension))
    for name in units:
        value = quantity.value / (UNITS[name][1] if name else 1.0)
        if _round(value):
            return Number(round(value, 2), name)
    return Number(round(quantity.value, 2))


def _close(value: float, other: float) -> bool:
    return abs(value - other) <= _CLOSE * max(1.0, abs(other))


def _round(value: float) -> bool:
    return abs(2 * value - round(2 * value)) < _ROUND
