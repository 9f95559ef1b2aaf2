"""Bases of a program's set-points: "the lead's speed plus 5 m/s", "the lane on the left".

`programs.verify` says which calls may be reached, with which bounds, and how often loops pass; what a bound throws away
is read here from the text: each name is anything it is ever bound to, whatever the order. That is not sound, and so may
inform and never pass a plan.
"""

from __future__ import annotations

import ast
import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Final

from chauffeur.concept import ChauffeurError
from chauffeur.programs.catalogue import APIS
from chauffeur.programs.extract import parse_quietly
from chauffeur.programs.rewrite import main_function
from chauffeur.programs.verify import CallSite, verify
from chauffeur.safety.constant_calls import LANE_STEPS, TURNS
from chauffeur.safety.faithfulness.facts import PERIOD_S, Base, Deed, DeedKind, Facts, Term

_MAX_CHARS: Final = 100_000
_MAX_STEPS: Final = 60_000
_MAX_DEPTH: Final = 12
_MAX_TERMS: Final = 12
"""Alternatives of a number beyond which it cannot be told."""

_NUMBERS: Final[dict[str, Base]] = {
    "get_speed_limit": "limit", "get_target_speed": "ego", "detect_stop_sign_ahead": "sign",
    "get_desired_time_headway": "headway",
}  # fmt: skip
_VEHICLES: Final = {"get_ego_vehicle": "ego", "detect_front_vehicle_in": "front", "detect_rear_vehicle_in": "rear"}
_SETS: Final[dict[str, DeedKind]] = {
    "set_target_speed": "speed", "set_desired_time_headway": "headway", "set_target_lane": "lane",
    "recover_from_stop": "go", **dict.fromkeys(TURNS, "turn"),
}  # fmt: skip
_SAME: Final = frozenset({"float", "int", "round", "abs", "list", "tuple", "sorted", "reversed"})
_EGO: Final = Term("ego", 1.0, 0.0)
_OTHER: Final = Term("other", 1.0, 0.0)

Function = ast.FunctionDef | ast.Lambda


@dataclass(frozen=True, slots=True)
class NamedThing:
    """A vehicle (`ego`, `front`, `rear`) or a lane (`-1`, `0`, `1` from the ego's own)."""

    name: str


Known = frozenset[Term | NamedThing]
_NONE: Final[Known] = frozenset()
_SPEED_NOW: Final[Known] = frozenset({_EGO})
_GAP_NOW: Final[Known] = frozenset({Term("gap", 1.0, 0.0)})


class _TooMuchError(Exception):
    """The program is larger than is worth reading."""


@dataclass(slots=True)
class _Scope:
    """A function as it is called: its node, what its parameters are given, and the function around it."""

    node: ast.AST
    given: dict[str, Known] = field(default_factory=dict[str, Known])
    outer: _Scope | None = None


@lru_cache(maxsize=64)
def read_facts(source: str, library: str = "") -> Facts:
    """Read the facts of a program; never raises on bad programs. Results are memoised."""
    if len(source) + len(library) > _MAX_CHARS:
        return Facts(readable=False)
    helpers, program = parse_quietly(library), parse_quietly(source)
    main = None if helpers is None or program is None else main_function(program)
    if helpers is None or program is None or main is None:
        return Facts(readable=False)
    try:
        return _Reader(helpers, program, source, library).facts(main)
    except (ChauffeurError, RecursionError, MemoryError, _TooMuchError):
        return Facts(readable=False)


class _Reader:
    def __init__(self, library: ast.Module, program: ast.Module, source: str, library_source: str) -> None:
        verified = verify(source, library_source)
        self._sites = {(site.in_library, site.line, site.column): site for site in verified.calls}
        self._passes = {(one.in_library, one.line): one.passes for one in verified.loops}
        self._foreign = {id(node) for node in ast.walk(library)}
        self._bound: dict[tuple[int, str], list[ast.expr]] = defaultdict(list)
        self._functions: dict[tuple[int, str], Function] = {}
        self._module = _Scope(program)
        self._deeds: list[Deed] = []
        self._marks: set[tuple[Base, float]] = set()
        self._spans: set[float] = set()
        self._asks = False
        self._loops: list[int] = []
        self._arms: list[tuple[int, int]] = []
        self._moves: list[tuple[int, tuple[tuple[int, int], ...]]] = []
        self._inner: set[int] = set()
        self._calls: list[int] = []
        self._steps = 0
        for tree in (library, program):
            self._bind(tree, program)

    def facts(self, main: ast.FunctionDef) -> Facts:
        self._visit(main.body, _Scope(main, outer=self._module))
        return Facts(tuple(self._deeds), frozenset(self._marks), frozenset(self._spans), self._asks)

    # Names ------------------------------------------------------------------------------------------------------------

    def _bind(self, tree: ast.AST, home: ast.AST) -> None:
        """Note what each name of a function is bound to."""
        for node in ast.iter_child_nodes(tree):
            inner = home
            match node:
                case ast.FunctionDef(name=name):
                    self._functions[id(home), name] = node
                    inner = node
                case ast.Lambda():
                    inner = node
                case ast.Assign(targets=targets, value=value):
                    for target in targets:
                        self._assign(target, value, home)
                case (
                    ast.AnnAssign(target=target, value=ast.expr() as value) | ast.NamedExpr(target=target, value=value)
                ):
                    self._assign(target, value, home)
                case ast.AugAssign(target=ast.Name(id=name) as target, op=op, value=value):
                    changed = ast.copy_location(ast.BinOp(ast.Name(name, ast.Load()), op, value), node)
                    self._assign(target, changed, home)
                case ast.For(target=target, iter=iterated) | ast.comprehension(target=target, iter=iterated):
                    self._assign(target, iterated, home)
                case _:
                    pass
            self._bind(node, inner)

    def _assign(self, target: ast.expr, value: ast.expr, home: ast.AST) -> None:
        if isinstance(target, ast.Name):
            self._bound[id(home), target.id].append(value)
            if isinstance(value, ast.Lambda):
                self._functions[id(home), target.id] = value
        elif isinstance(target, ast.Tuple | ast.List) and isinstance(value, ast.Tuple | ast.List):
            for one, part in zip(target.elts, value.elts, strict=False):
                self._assign(one, part, home)

    def _function(self, name: str, scope: _Scope | None) -> tuple[Function, _Scope] | None:
        while scope is not None:
            if (found := self._functions.get((id(scope.node), name))) is not None:
                return found, scope
            scope = scope.outer
        return None

    # Values -----------------------------------------------------------------------------------------------------------

    def _known(self, node: ast.expr, scope: _Scope) -> Known:
        """Everything an expression may be, as far as it can be told."""
        self._steps += 1
        if self._steps > _MAX_STEPS:
            raise _TooMuchError
        if id(node) in self._calls or len(self._calls) > 6 * _MAX_DEPTH:
            return _NONE
        self._calls.append(id(node))
        try:
            found = self._value(node, scope)
        finally:
            self._calls.pop()
        return found if len(found) <= _MAX_TERMS else _NONE

    def _value(self, node: ast.expr, scope: _Scope) -> Known:
        match node:
            case ast.Constant(value=int() | float() as number) if not isinstance(number, bool) and abs(number) < 1e9:
                return frozenset({Term("", 0.0, float(number))})
            case ast.Name(id=name):
                return self._named(name, scope)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                zero: Known = frozenset({Term("", 0.0, 0.0)})
                return _combined(zero, ast.Sub(), self._known(operand, scope))
            case ast.BinOp(left=left, op=op, right=right):
                return _combined(self._known(left, scope), op, self._known(right, scope))
            case ast.IfExp(body=body, orelse=orelse):
                return self._known(body, scope) | self._known(orelse, scope)
            case ast.BoolOp(values=several) | ast.Tuple(elts=several) | ast.List(elts=several):
                return frozenset(one for value in several for one in self._known(value, scope))
            case ast.NamedExpr(value=value) | ast.Subscript(value=value) | ast.Starred(value=value):
                return self._known(value, scope)
            case ast.Call(func=ast.Name(id=name)):
                return self._answer(name, node, scope)
            case _:
                return _NONE

    def _named(self, name: str, scope: _Scope) -> Known:
        home: _Scope | None = scope
        while home is not None:
            bound = self._bound.get((id(home.node), name))
            if bound is not None or name in home.given:
                given = home.given.get(name, _NONE)
                return given.union(*(self._known(one, home) for one in bound or ()))
            home = home.outer
        return _NONE

    def _answer(self, name: str, call: ast.Call, scope: _Scope) -> Known:
        if (own := self._function(name, scope)) is not None:
            inner = self._entered(own, call, scope)
            body = own[0].body
            results = [body] if isinstance(body, ast.expr) else list(_returned(body))
            return frozenset(one for result in results for one in self._known(result, inner))
        args = [self._known(one, scope) for one in (*call.args, *(word.value for word in call.keywords))]
        names = [{one.name for one in arg if isinstance(one, NamedThing)} for arg in args]
        if name in ("min", "max"):
            return _bounded(args)
        if name in _SAME and args:
            return args[0]
        if name in LANE_STEPS:
            return frozenset({NamedThing(str(LANE_STEPS[name]))}) if not names or names[0] <= {"ego"} else _NONE
        if name in _VEHICLES:
            return frozenset({NamedThing(_VEHICLES[name])})
        base = _NUMBERS.get(name, "")
        if name == "get_speed_of":
            base = "ego" if names and names[0] == {"ego"} else "other"
        elif name == "get_distance_between_vehicles" and len(names) == 2:
            front = "front" in names[0] or not names[0]
            base = "gap" if front and "ego" in names[1] else "behind" if "rear" in names[1] else "past"
        return frozenset({Term(base, 1.0, 0.0)}) if base else _NONE

    def _entered(self, own: tuple[Function, _Scope], call: ast.Call, scope: _Scope) -> _Scope:
        function, home = own
        names = [one.arg for one in (*function.args.posonlyargs, *function.args.args)]
        given = dict.fromkeys(names, _NONE)
        given |= {name: self._known(one, scope) for name, one in zip(names, call.args, strict=False)}
        given |= {word.arg: self._known(word.value, scope) for word in call.keywords if word.arg is not None}
        return _Scope(function, given, home)

    # Deeds ------------------------------------------------------------------------------------------------------------

    def _visit(self, nodes: Iterable[ast.AST], scope: _Scope, depth: int = 0) -> None:
        for node in nodes:
            self._steps += 1
            if self._steps > _MAX_STEPS or depth > _MAX_DEPTH:
                raise _TooMuchError
            match node:
                case ast.FunctionDef() | ast.Lambda():
                    continue
                case ast.While() | ast.For():
                    self._loop(node, scope, depth)
                    continue
                case ast.If(test=test, body=body, orelse=orelse):
                    self._visit([test], scope, depth)
                    for arm, part in enumerate((body, orelse)):
                        self._arms.append((id(node), arm))
                        self._visit(part, scope, depth)
                        self._arms.pop()
                    continue
                case ast.BinOp(left=left, op=ast.Sub()):
                    if isinstance(left, ast.BinOp):
                        self._inner.add(id(left))
                    self._difference(node, scope)
                case ast.Compare(left=left, comparators=others):
                    for one, other in zip((left, *others), others, strict=False):
                        self._mark(self._known(one, scope), self._known(other, scope))
                case _:
                    pass
            self._visit(ast.iter_child_nodes(node), scope, depth)
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
                self._call(node, node.func.id, scope, depth)

    def _loop(self, node: ast.While | ast.For, scope: _Scope, depth: int) -> None:
        self._visit([node.test if isinstance(node, ast.While) else node.iter], scope, depth)
        passes = self._passes.get((id(node) in self._foreign, node.lineno))
        if passes is not None:
            self._spans.add(passes * PERIOD_S)
            if isinstance(node, ast.For) and all(_only_yields(one) for one in node.body):
                span = (Term("", 0.0, passes * PERIOD_S),)
                self._deeds.append(Deed("wait", node.lineno, span, times=math.prod(self._loops)))
        self._loops.append(passes or 0)
        self._visit(node.body, scope, depth)
        self._loops.pop()
        self._visit(node.orelse, scope, depth)

    def _call(self, node: ast.Call, name: str, scope: _Scope, depth: int) -> None:
        own = self._function(name, scope)
        if own is not None:
            body = own[0].body
            self._visit([body] if isinstance(body, ast.expr) else body, self._entered(own, node, scope), depth + 1)
            return
        foreign = id(node) in self._foreign
        site = self._sites.get((foreign, node.lineno, node.col_offset))
        if name not in APIS or site is None:
            return
        self._asks = self._asks or name == "is_safe_enter"
        if (kind := _SETS.get(name)) is not None:
            given = [*node.args, *(word.value for word in node.keywords)]
            known = self._known(given[0], scope) if given else _NONE
            self._deeds.append(self._deed(kind, site, known, None if foreign else node.lineno))

    def _deed(self, kind: DeedKind, site: CallSite, known: Known, line: int | None) -> Deed:
        times = math.prod(self._loops)
        terms = tuple(sorted(one for one in known if isinstance(one, Term)))
        bounds = next(((one.value.lo, one.value.hi) for one in site.arguments), (-math.inf, math.inf))
        if kind == "turn":
            return Deed(kind, line, sides=frozenset({TURNS[site.name]}))
        if kind != "lane":
            return Deed(kind, line, terms, times=times, bounds=bounds)
        sides = frozenset(
            int(one.name) for one in known if isinstance(one, NamedThing) and one.name.lstrip("-").isdigit()
        )
        offsets = next((one.value.offsets for one in site.arguments), None)
        sides, back = self._led_back(sides or offsets or frozenset())
        return Deed(kind, line, (), sides, back, times)

    def _led_back(self, sides: frozenset[int]) -> tuple[frozenset[int], bool]:
        """A move's sides, and whether it undoes moves before it: `home` after a move leads back from there."""
        arms = tuple(self._arms)
        before = [side for side, others in self._moves if not _exclude(arms, others)]
        if sides == frozenset({0}):
            out = {side for side, _ in self._moves}
            return (frozenset(-side for side in out), True) if out else (sides, False)
        if len(sides) != 1:
            return sides, False
        (side,) = sides
        back = before.count(-side) > before.count(side)
        self._moves.append((side, arms))
        return sides, back

    def _difference(self, node: ast.BinOp, scope: _Scope) -> None:
        """Note what is steered towards: `wanted - speed`, `gap - wanted`."""
        left, right = self._known(node.left, scope), self._known(node.right, scope)
        self._mark(left, right)
        line = None if id(node) in self._foreign else node.lineno
        if right == _SPEED_NOW and left != _SPEED_NOW:
            speeds = {one for one in left if isinstance(one, Term) and one.base in ("", "ego", "limit", "other")}
            wanted = sorted(one for one in speeds if not one.bound and one != _OTHER)
            if wanted:
                self._deeds.append(Deed("speed", line, tuple(wanted), aimed=True))
        if left == _GAP_NOW and id(node) not in self._inner:
            gaps = [one for one in right if isinstance(one, Term) and one.base in ("", "gap", "ego") and not one.bound]
            if gaps:
                self._deeds.append(Deed("gap", line, tuple(sorted(gaps))))

    def _mark(self, one: Known, other: Known) -> None:
        for left, right in ((one, other), (other, one)):
            plain = [term for term in right if isinstance(term, Term) and not term.factor]
            for term in left:
                if isinstance(term, Term) and term.factor:
                    self._marks |= {(term.base, (value.offset - term.offset) / term.factor) for value in plain}


def _exclude(one: Sequence[tuple[int, int]], other: Sequence[tuple[int, int]]) -> bool:
    """True if two places stand in different arms of one `if`."""
    arms = dict(other)
    return any(arms.get(test, arm) != arm for test, arm in one)


def _returned(body: Iterable[ast.stmt]) -> Iterator[ast.expr]:
    for statement in body:
        for node in ast.walk(statement):
            if isinstance(node, ast.Return) and node.value is not None:
                yield node.value


def _only_yields(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Yield)


def _bounded(args: Sequence[Known]) -> Known:
    """Of min or max: any argument; a plain number beside another kind is a bound only."""
    found = frozenset(one for arg in args for one in arg)
    if len(args) < 2 or all(arg and all(isinstance(t, Term) and not t.factor for t in arg) for arg in args):
        return found
    return frozenset(replace(t, bound=True) if isinstance(t, Term) and not t.factor else t for t in found)


def _combined(left: Known, op: ast.operator, right: Known) -> Known:
    terms = [one for a in left for b in right if isinstance(a, Term) and isinstance(b, Term) for one in _sum(a, op, b)]
    return frozenset(one for one in terms if math.isfinite(one.offset) and math.isfinite(one.factor))


def _sum(a: Term, op: ast.operator, b: Term) -> Iterator[Term]:
    bound = a.bound or b.bound
    match op:
        case ast.Add() if not a.factor or not b.factor:
            yield Term(a.base or b.base, a.factor + b.factor, a.offset + b.offset, bound)
        case ast.Sub() if not a.factor or not b.factor:
            yield Term(a.base or b.base, a.factor - b.factor, a.offset - b.offset, bound)
        case ast.Mult() if not a.factor or not b.factor:
            one, other = (a, b.offset) if not b.factor else (b, a.offset)
            yield Term(one.base if other else "", one.factor * other, one.offset * other, bound)
        case ast.Div() if not b.factor and b.offset:
            yield Term(a.base, a.factor / b.offset, a.offset / b.offset, bound)
        case ast.Div() if not a.factor and b == _EGO:
            yield Term("per speed", 1.0, a.offset, bound)
        case _:
            pass
