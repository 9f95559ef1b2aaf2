"""What calls come to: driving APIs, built-in functions, methods, and whatever else may be called."""

from __future__ import annotations

import ast
import math
from abc import ABC, abstractmethod
from typing import Final

from chauffeur.programs.catalogue import apis_of
from chauffeur.programs.verify import arithmetic
from chauffeur.programs.verify.circumstances import answer
from chauffeur.programs.verify.expressions import MATH_MODULE, DeadEndError, Expressions
from chauffeur.programs.verify.frames import CallFrame
from chauffeur.programs.verify.state import QUIET, WISHES, State
from chauffeur.programs.verify.values import (
    ANY_TEXT,
    FALSE,
    FLAG,
    FUNCTION,
    INT,
    LANE,
    NONE,
    NOTHING,
    NUMERIC,
    OBJECT,
    TEXT,
    TOP,
    TRUE,
    TUPLE,
    UNKNOWN,
    Callee,
    Value,
    fresh,
    join,
    may_be_false,
    may_be_true,
    number,
)

_GROWING: Final = frozenset({"add", "append", "extend", "insert", "setdefault", "update"})
_COUNT: Final = number(-1.0, math.inf, INT)
"""A length, or a place in a text."""
_TO_TEXT: Final = frozenset({"format", "join", "lower", "replace", "strip", "title", "upper"})
_TO_COUNT: Final = frozenset({"count", "find", "index"})
_TO_FLAG: Final = frozenset({"endswith", "is_integer", "startswith"})
_TO_NONE: Final = frozenset({"add", "append", "clear", "discard", "extend", "insert", "remove", "reverse", "update"})
_VIEWS: Final = frozenset({"items", "keys", "values"})
_MAKERS: Final = frozenset({"dict", "frozenset", "list", "set", "sorted", "tuple"})
_CALLING: Final = frozenset({"filter", "map"})
_KEYED: Final = frozenset({"max", "min", "sorted"})
_WALKERS: Final = frozenset({"enumerate", "iter", "reversed", "zip"})


class Calls(Expressions, ABC):
    """Expressions with their calls; calls of the program's own functions are the subclass's."""

    @abstractmethod
    def call_own(
        self, node: ast.Call, callee: Callee, arguments: list[Value], keywords: dict[str, Value] | None
    ) -> Value:
        """A call of one of the program's own functions; no `keywords` where the arguments are not known one by one."""

    @abstractmethod
    def forget_returns(self) -> None:
        """The call just made was one of several."""

    def call(self, node: ast.Call) -> Value:
        """As declared."""
        callee: Value | None = None
        method: ast.Attribute | None = None
        if isinstance(node.func, ast.Name):
            callee = self._callee(node.func)
        elif isinstance(node.func, ast.Attribute):
            owner = self.eval(node.func.value)
            if owner == MATH_MODULE:
                callee = self.of_math(node.func.attr)
            else:
                method, callee = node.func, owner
        else:
            callee = self.eval(node.func)
        arguments = [self.eval(argument) for argument in node.args]
        given = [(keyword.arg, self.eval(keyword.value)) for keyword in node.keywords]
        plain = not any(isinstance(argument, ast.Starred) for argument in node.args)
        keywords = {name: value for name, value in given if name is not None}
        one_by_one = plain and len(keywords) == len(given)
        if method is not None:
            return self._method(node, method.attr, callee)
        return self._call_value(node, callee, arguments, keywords if one_by_one else None)

    def _callee(self, node: ast.Name) -> Value:
        place = self.frame.place(node.id)
        if place is None:
            kind = "api" if node.id in apis_of("town") else "builtin"
            return Value(FUNCTION, callees=frozenset({(kind, node.id)}))
        if isinstance(place, CallFrame):
            functions = place.scope.functions.get(node.id, ())
            found = Value(FUNCTION, callees=frozenset(("own", function, place) for function in functions))
            return join(found, TOP) if not functions or node.id in place.scope.plain else found
        return self.state.variables.get(place, TOP)

    def _call_value(
        self, node: ast.Call, callee: Value, arguments: list[Value], keywords: dict[str, Value] | None
    ) -> Value:
        known = sorted(callee.callees - {UNKNOWN}, key=lambda one: (one[0], getattr(one[1], "lineno", 0), str(one[1])))
        opaque = not known or UNKNOWN in callee.callees or bool(callee.bits & ~FUNCTION)
        if opaque:
            self.call_unknown()
            if not known:
                return TOP
        elif len(known) == 1:
            return self._call_one(node, known[0], arguments, keywords)
        start = self.state
        results = [TOP] if opaque else []
        states: list[State | None] = [start.copy()] if opaque else []
        for one in known:
            self.state = start.copy()
            try:
                results.append(self._call_one(node, one, arguments, keywords))
            except DeadEndError:
                continue
            states.append(self.state)
        self.forget_returns()
        return self._meet(results, states)

    def _call_one(
        self, node: ast.Call, callee: Callee, arguments: list[Value], keywords: dict[str, Value] | None
    ) -> Value:
        if callee[0] == "own":
            return self.call_own(node, callee, arguments, keywords)
        if callee[0] == "api":
            return self._call_api(node, callee[1], arguments, keywords)
        if callee[0] == "builtin" and (
            callee[1] in _CALLING or (callee[1] in _KEYED and (keywords is None or "key" in keywords))
        ):
            self.call_unknown()
        if callee[0] == "math":
            return arithmetic.math_function(callee[1], arguments) if keywords == {} else TOP
        return self._call_builtin(node, callee[1] if callee[0] == "builtin" else "", arguments, keywords)

    def call_unknown(self) -> None:
        """A call that is not followed: functions that were let loose may run, yield, wish and rebind shared names."""
        state = self.state
        if self.recording:
            self.record.took_effect(state.pending)
        state.pending = QUIET
        state.first = False
        state.forget_lanes()
        state.forget(self.scopes.shared)
        for loop in self.loops:
            loop.grown = None
            loop.exits += 1
        self.note_error()

    def _call_api(self, node: ast.Call, name: str, arguments: list[Value], keywords: dict[str, Value] | None) -> Value:
        params = apis_of("town")[name].params
        if keywords is None:
            by_name = dict.fromkeys((param.name for param in params), TOP)
        else:
            by_name = {param.name: value for param, value in zip(params, arguments, strict=False)} | keywords
        if self.recording:
            self.record.call(node, name, by_name, guarded=self.guards > 0)
        state = self.state
        if name in WISHES:
            self._wish(node, name, by_name)
        elif name == "get_target_speed":
            self._asked(0)
        elif name in {"is_safe_enter", "get_desired_time_headway"}:
            self._asked(1)
        elif name == "autopilot":
            self._asked(2)
            self._asked(3)
        return answer(name, by_name, self.where, first=state.first, site=id(node))

    def _asked(self, kind: int) -> None:
        if self.recording:
            self.record.took_effect(self.state.pending[kind : kind + 1])

    def _wish(self, node: ast.Call, name: str, arguments: dict[str, Value]) -> None:
        state, kind = self.state, WISHES[name]
        if self.recording:
            lane = arguments.get("target_lane", NOTHING)
            side = 0
            if lane.bits & ~NONE == LANE and lane.offsets:  # wishing None fails
                side = -1 if max(lane.offsets) < 0 else 1 if min(lane.offsets) > 0 else 0
            certain = not self.is_open and isinstance(node.func, ast.Name) and node.func.id == name
            self.record.wish(node, name, side, state.pending[kind], certain=certain)
        state.pending = (*state.pending[:kind], frozenset({id(node)}), *state.pending[kind + 1 :])
        self.note_error()

    def _method(self, node: ast.Call, name: str, owner: Value) -> Value:
        if name == "sort" and node.keywords:
            self.call_unknown()
        if name in _GROWING:
            self.grow(owner)
        if owner.callees or not owner.bits & (OBJECT | TEXT | TUPLE):
            return TOP
        if name in _TO_NONE:
            return NOTHING
        if name in _TO_TEXT:
            return ANY_TEXT
        if name in _TO_COUNT:
            return _COUNT
        if name in _TO_FLAG:
            return FLAG
        if name in _VIEWS:
            return Value(OBJECT, refs=owner.refs)
        return fresh(id(node)) if name == "split" else TOP

    def _call_builtin(
        self, node: ast.Call, name: str, arguments: list[Value], keywords: dict[str, Value] | None
    ) -> Value:
        if keywords is None:
            arguments = [TOP]
        if name in {"min", "max"} and keywords == {} and len(arguments) > 1:
            return arithmetic.least(arguments) if name == "min" else arithmetic.greatest(arguments)
        if name in _MAKERS:
            return fresh(id(node), TUPLE if name == "tuple" else OBJECT)._replace(items=None)
        if name in _WALKERS or name == "range":
            refs: frozenset[int] | None = frozenset()
            for value in arguments if name != "range" else ():
                refs = None if refs is None or value.refs is None else refs | value.refs
            return Value(OBJECT, refs=refs)
        if name == "str":
            return ANY_TEXT
        if name == "len":
            return _COUNT
        if name in {"all", "any", "isinstance"}:
            return FLAG
        if name == "print":
            return NOTHING
        if keywords == {} and arguments and arguments[0].bits & NUMERIC:
            return self._of_number(name, arguments)
        return FLAG if name == "bool" else TOP

    def _of_number(self, name: str, arguments: list[Value]) -> Value:
        value = arguments[0]
        if name == "bool":
            return Value((TRUE if may_be_true(value) else 0) | (FALSE if may_be_false(value) else 0))
        if name == "pow" and len(arguments) == 2:
            return arithmetic.binary(ast.Pow(), value, arguments[1])
        if name == "round" and len(arguments) <= 2:
            return arithmetic.rounded(value, arguments[1] if len(arguments) == 2 else None)
        if not value.only_numeric or len(arguments) > 1:
            return TOP
        if name == "abs":
            return arithmetic.absolute(value)
        if name == "float":
            return arithmetic.to_float(value)
        return arithmetic.truncated(value) if name == "int" else TOP
