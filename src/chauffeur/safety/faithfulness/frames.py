"""Names and loops of a program that is followed: what a statement depends on, and how often a loop may turn."""

from __future__ import annotations

import ast
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

from chauffeur.safety.faithfulness.values import TracedValue, either

Constants = Callable[[ast.expr], tuple[float, ...]]
"""Plain numbers that an expression can be."""


@dataclass(slots=True)
class MeaningFrame:
    """Names of a function while it is followed, and what its statements depend on.

    Attributes:
        names: Values by name.
        outer: The function around it.
        active: What the tests around the statement depend on.
        gates: What was waited for before it.
        returned: What it may return.
    """

    names: dict[str, TracedValue]
    outer: MeaningFrame | None = None
    active: frozenset[str] = frozenset()
    gates: frozenset[str] = frozenset()
    returned: list[TracedValue] = field(default_factory=list[TracedValue])

    def find(self, name: str) -> TracedValue | None:
        """What a name stands for; None where it stands for nothing here."""
        frame: MeaningFrame | None = self
        while frame is not None:
            if name in frame.names:
                return frame.names[name]
            frame = frame.outer
        return None

    @property
    def depends(self) -> frozenset[str]:
        """What a statement here depends on."""
        return self.active | self.gates


@contextmanager
def under(frame: MeaningFrame, tags: frozenset[str]) -> Generator[None]:
    """Statements that depend on more."""
    before = frame.active
    frame.active = before | tags
    try:
        yield
    finally:
        frame.active = before


def joined(several: Sequence[dict[str, TracedValue]]) -> dict[str, TracedValue]:
    """Names as they may be after one of several ways."""
    if len(several) == 1:
        return several[0]
    first, second = several
    joined = dict(second)
    for name, value in first.items():
        other = second.get(name)
        joined[name] = value if other is None or other == value else either([value, other])
    return joined


def settled(test: ast.expr) -> tuple[bool, bool]:
    """Whether a test never holds, and whether it always does, by a constant written in it."""
    match test:
        case ast.Constant(value=value):
            return not value, bool(value)
        case ast.BoolOp(op=ast.And(), values=values):
            return any(isinstance(one, ast.Constant) and not one.value for one in values), False
        case _:
            return False, False


def count_of(test: ast.expr, constants: Constants) -> int | None:
    """Turns of a loop that counts from one plain number to another; None for other loops."""
    for node in ast.walk(test):
        if isinstance(node, ast.Compare) and len(node.ops) == 1 and isinstance(node.ops[0], ast.Lt | ast.Gt):
            left = constants(node.left)
            right = constants(node.comparators[0])
            if len(left) == 1 and len(right) == 1:
                return round(abs(right[0] - left[0]))
    return None


def turns_of(iterated: ast.expr, constants: Constants) -> float | None:
    """Turns of a loop over `range`; None for other loops, and where its ends are not known."""
    match iterated:
        case ast.Call(func=ast.Name(id="range"), args=[last]):
            first = None
        case ast.Call(func=ast.Name(id="range"), args=[first, last, *_]):
            pass
        case _:
            return None
    ends = constants(last)
    begins = (0.0,) if first is None else constants(first)
    return ends[0] - begins[0] if len(ends) == 1 and len(begins) == 1 else None


def only_waits(statement: ast.stmt) -> bool:
    """Whether a statement only lets a control period pass."""
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Yield)
