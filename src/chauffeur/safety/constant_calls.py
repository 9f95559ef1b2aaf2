"""Static reading of a program: the driving APIs that it calls, and their constants.

Reading is deliberately modest. It follows names that are bound exactly once, arithmetic of constants, and lanes named
relative to the ego; everything else is unknown here and stays with the limits that hold while the program runs.
"""

from __future__ import annotations

import ast
import math
import operator
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, Final

LANE_STEPS: Final = {"get_left_lane": -1, "get_lane_of": 0, "get_right_lane": 1}
"""Driving APIs that name a lane -> lanes to the right of the ego's own."""
TURNS: Final = {
    "turn_left_at_next_intersection": -1,
    "go_straight_at_next_intersection": 0,
    "turn_right_at_next_intersection": 1,
}
"""Driving APIs that choose a way at the next junction -> quarter turns to the right."""
_MAX_CHARS = 100_000
_MAX_DEPTH = 40
_MAX_VALUES = 16
_MAX_STEPS = 50_000
"""Nodes looked at beyond the first pass: names used twice, level upon level, would otherwise cost 2^levels."""


@dataclass(slots=True)
class _Scope:
    """Names of one function, or of the module: every expression bound to each; None for what cannot be read."""

    parent: _Scope | None
    bound: dict[str, list[ast.expr | None]] = field(default_factory=dict[str, list["ast.expr | None"]])


@dataclass(frozen=True, slots=True)
class ApiUse:
    """One call found in a program.

    Attributes:
        name: Name of the function called.
        line: Program line, 1-based.
        values: Constants the argument can be; empty when it cannot be read.
        lane_offset: Side of the ego's lane that the argument names: -1 left, 0 its own, +1 right; None when it cannot
            be read.
        function: Number of the enclosing function; calls with the same number run in source order.
    """

    name: str
    line: int
    values: tuple[float, ...]
    lane_offset: int | None
    function: int


@dataclass(frozen=True, slots=True)
class ProgramReading:
    """Result of reading a program.

    Attributes:
        uses: Every call of a plain name, in source order.
        sides_tested: Lane offsets whose existence the program tests before it uses them.
    """

    uses: tuple[ApiUse, ...] = ()
    sides_tested: frozenset[int] = frozenset()


@lru_cache(maxsize=512)
def read_program(source: str) -> ProgramReading:
    """Read a program, once a text; nothing of text that is not Python, or far too long (`format-v1` refuses both)."""
    if len(source) > _MAX_CHARS:
        return ProgramReading()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of the text's own oddities, e.g. `5s`; they are not the reader's
            tree = ast.parse(source)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return ProgramReading()
    return _Reader(tree).reading()


class _Reader:
    """Walks with a stack of its own: a hostile program nests deeper than Python recurses."""

    def __init__(self, tree: ast.Module) -> None:
        self._steps = 0
        self._shared: set[str] = set()
        self._nodes: list[tuple[ast.AST, _Scope]] = []
        self._walk(tree)

    def reading(self) -> ProgramReading:
        scopes: dict[int, int] = {}
        calls = [(node, scope) for node, scope in self._nodes if isinstance(node, ast.Call)]
        calls.sort(key=lambda item: (item[0].lineno, item[0].col_offset))
        uses: list[ApiUse] = []
        for call, scope in calls:
            name = self._called(call, scope)
            if name is None:
                continue
            argument = _first_argument(call)
            uses.append(
                ApiUse(
                    name=name,
                    line=call.lineno,
                    values=() if argument is None else self._values(argument, scope, 0),
                    lane_offset=None if argument is None else self._lane_offset(argument, scope),
                    function=scopes.setdefault(id(scope), len(scopes)),
                )
            )
        return ProgramReading(tuple(uses), frozenset(self._sides_tested()))

    # Names -----------------------------------------------------------------------------------------------------

    def _walk(self, tree: ast.Module) -> None:
        stack: list[tuple[ast.AST, _Scope]] = [(tree, _Scope(None))]
        while stack:
            node, scope = stack.pop()
            self._nodes.append((node, scope))
            self._bind(node, scope)
            inner = scope
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
                inner = _Scope(scope)
            stack.extend((child, inner) for child in ast.iter_child_nodes(node))

    def _bind(self, node: ast.AST, scope: _Scope) -> None:
        match node:
            case ast.Assign(targets=targets, value=value):
                for target in targets:
                    self._assign(target, value, scope)
            case ast.AnnAssign(target=target, value=ast.expr() as value):
                self._assign(target, value, scope)
            case ast.NamedExpr(target=target, value=value):
                self._assign(target, value, scope)
            case ast.AugAssign(target=target):
                self._assign(target, None, scope)
            case ast.For(target=target) | ast.AsyncFor(target=target) | ast.comprehension(target=target):
                self._assign(target, None, scope)
            case ast.withitem(optional_vars=ast.expr() as target):
                self._assign(target, None, scope)
            case ast.Delete(targets=targets):
                for target in targets:
                    self._assign(target, None, scope)
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name) | ast.ClassDef(name=name):
                _add(scope, name, None)
            case ast.arg(arg=name):
                _add(scope, name, None)
            case ast.alias(name=name, asname=asname):
                _add(scope, asname or name.partition(".")[0], None)
            case ast.ExceptHandler(name=str(name)) | ast.MatchAs(name=str(name)) | ast.MatchStar(name=str(name)):
                _add(scope, name, None)
            case ast.MatchMapping(rest=str(name)):
                _add(scope, name, None)
            case ast.Global(names=names) | ast.Nonlocal(names=names):
                self._shared.update(names)
            case _:
                pass

    def _assign(self, target: ast.expr, value: ast.expr | None, scope: _Scope) -> None:
        if isinstance(target, ast.Name):
            _add(scope, target.id, value)
        elif isinstance(target, ast.Tuple | ast.List):
            parts = value.elts if isinstance(value, ast.Tuple | ast.List) else []
            plain = len(parts) == len(target.elts) and not any(
                isinstance(e, ast.Starred) for e in (*parts, *target.elts)
            )
            for index, element in enumerate(target.elts):
                self._assign(element, parts[index] if plain else None, scope)
        elif isinstance(target, ast.Starred):
            self._assign(target.value, None, scope)

    def _follow(self, node: ast.expr, scope: _Scope) -> tuple[ast.expr, _Scope]:
        """The expression behind a name that is bound exactly once, as far as names lead."""
        for _ in range(_MAX_DEPTH):
            if isinstance(node, ast.NamedExpr):
                node = node.value
                continue
            if not isinstance(node, ast.Name) or node.id in self._shared:
                break
            home: _Scope | None = scope
            while home is not None and node.id not in home.bound:
                home = home.parent
            bound = home.bound[node.id] if home is not None else []
            if home is None or len(bound) != 1 or bound[0] is None:
                break
            node, scope = bound[0], home
        return node, scope

    def _called(self, call: ast.Call, scope: _Scope) -> str | None:
        function, _ = self._follow(call.func, scope)
        return function.id if isinstance(function, ast.Name) else None

    # Numbers ---------------------------------------------------------------------------------------------------

    def _values(self, node: ast.expr, scope: _Scope, depth: int) -> tuple[float, ...]:
        self._steps += 1
        if depth > _MAX_DEPTH or self._steps > _MAX_STEPS:
            return ()
        node, scope = self._follow(node, scope)
        deeper = depth + 1
        match node:
            case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
                return (_as_float(number),)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return tuple(-value for value in self._values(operand, scope, deeper))
            case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                return self._values(operand, scope, deeper)
            case ast.IfExp(body=body, orelse=orelse):
                return (self._values(body, scope, deeper) + self._values(orelse, scope, deeper))[:_MAX_VALUES]
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _ARITHMETIC:
                pairs = [(a, b) for a in self._values(left, scope, deeper) for b in self._values(right, scope, deeper)]
                return tuple(_combine(_ARITHMETIC[type(op)], pairs[:_MAX_VALUES]))
            case ast.Attribute(value=ast.Name(id="math"), attr=attr) if attr in _MATH:
                return (_MATH[attr],)
            case ast.Call(func=ast.Name(id="float"), args=[ast.Constant(value=str(text))]):
                return _parsed(text)
            case ast.Call(func=ast.Name(id=name), args=args, keywords=[]) if name in _FUNCTIONS and args:
                return self._function(_FUNCTIONS[name], args, scope, deeper)
            case _:
                return ()

    def _function(
        self, function: Callable[..., Any], args: list[ast.expr], scope: _Scope, depth: int
    ) -> tuple[float, ...]:
        known = [self._values(argument, scope, depth) for argument in args]
        if any(len(values) != 1 for values in known):
            return ()
        return tuple(_combine(function, [tuple(values[0] for values in known)]))

    # Lanes -----------------------------------------------------------------------------------------------------

    def _lane_offset(self, node: ast.expr, scope: _Scope) -> int | None:
        node, scope = self._follow(node, scope)
        if not isinstance(node, ast.Call):
            return None
        step = LANE_STEPS.get(self._called(node, scope) or "")
        if step is None:
            return None
        vehicle = _first_argument(node)
        if vehicle is not None:
            vehicle, scope = self._follow(vehicle, scope)
        match vehicle:
            case None | ast.Constant(value=None):
                return step
            case ast.Call() if self._called(vehicle, scope) == "get_ego_vehicle":
                return step
            case _:
                return None

    def _sides_tested(self) -> Iterator[int]:
        for node, scope in self._nodes:
            tested = [*_compared_with_none(node), *self._tested_with_a_way_out(node, scope)]
            for offset in (self._lane_offset(expression, scope) for expression in tested):
                if offset is not None:
                    yield offset

    def _tested_with_a_way_out(self, node: ast.AST, scope: _Scope) -> Iterator[ast.expr]:
        """`is_safe_enter` says no to None, so it tells the sides apart where its `else` tries another lane."""
        if not isinstance(node, ast.If) or not node.orelse:
            return
        asked = [call for call in self._calls(node.test) if self._called(call, scope) == "is_safe_enter"]
        if not asked:
            return
        if any(self._called(call, scope) == "set_target_lane" for part in node.orelse for call in self._calls(part)):
            yield from (lane for call in asked if (lane := _first_argument(call)) is not None)

    def _calls(self, tree: ast.AST) -> Iterator[ast.Call]:
        for node in ast.walk(tree):
            self._steps += 1
            if self._steps > _MAX_STEPS:
                return
            if isinstance(node, ast.Call):
                yield node


def _compared_with_none(node: ast.AST) -> Iterator[ast.expr]:
    """Expressions that a node compares with None, or takes as true or false."""
    match node:
        case ast.Compare(left=left, comparators=[ast.Constant(value=None)]):
            yield left
        case ast.Compare(left=ast.Constant(value=None), comparators=[right]):
            yield right
        case ast.If(test=test) | ast.While(test=test) | ast.IfExp(test=test) | ast.Assert(test=test):
            yield test
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            yield operand
        case ast.BoolOp(values=values):
            yield from values
        case _:
            pass


def _first_argument(call: ast.Call) -> ast.expr | None:
    """The only argument of the APIs read here, by position or by name."""
    if call.args:
        return call.args[0]
    return call.keywords[0].value if call.keywords else None


def _add(scope: _Scope, name: str, value: ast.expr | None) -> None:
    scope.bound.setdefault(name, []).append(value)


def _as_float(number: float) -> float:
    try:
        return float(number)
    except OverflowError:
        return math.inf


def _parsed(text: str) -> tuple[float, ...]:
    try:
        return (float(text),)
    except ValueError:
        return ()


def _combine(function: Callable[..., Any], arguments: list[tuple[float, ...]]) -> Iterator[float]:
    for values in arguments:
        try:
            result = function(*values)
        except OverflowError:
            result = math.inf
        except (ArithmeticError, ValueError, TypeError):
            continue
        if isinstance(result, int | float):  # a negative number to a broken power is complex
            yield _as_float(result)


_ARITHMETIC: dict[type[ast.operator], Callable[[float, float], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.Pow: operator.pow,
}
"""All on floats, so that no power of integers can grow without bound while it is being read."""

_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "abs": abs, "float": float, "int": math.trunc, "max": max, "min": min, "round": round,
}  # fmt: skip
_MATH = {"inf": math.inf, "nan": math.nan, "pi": math.pi, "e": math.e, "tau": math.tau}
