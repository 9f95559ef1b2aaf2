"""Values of a program's expressions, as far as they are known without running it."""

from __future__ import annotations

import ast
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Final

from chauffeur.programs.catalogue import APIS
from chauffeur.safety.faithfulness.frames import MeaningFrame
from chauffeur.safety.faithfulness.notes import ProgramNotes
from chauffeur.safety.faithfulness.values import (
    NOTHING,
    Base,
    LaneValue,
    Term,
    TracedValue,
    bounded,
    combined,
    either,
    negated,
    number,
    of,
    tags_of,
)

_STEPS: Final = {"get_left_lane": -1, "get_right_lane": 1}
_CROSSING: Final = {
    "get_left_to_right_cross_traffic_lanes": "left",
    "get_right_to_left_cross_traffic_lanes": "right",
}


def answer(name: str, asked: Sequence[TracedValue], at: frozenset[int]) -> TracedValue:
    """The answer of an API that only asks.

    Args:
        name: The API.
        asked: Its arguments in order; NOTHING for one that is left out or not known.
        at: Lanes the ego may have moved to the right since the start.
    """
    first = asked[0] if asked else NOTHING
    if name == "get_ego_vehicle":
        return TracedValue(vehicle="ego")
    if name in _STEPS:
        return _lane(_STEPS[name], at) if first.vehicle in ("", "ego") else TracedValue(tags=first.tags)
    if name == "get_lane_of":
        return _lane(0, at) if first.vehicle in ("", "ego") else TracedValue(lanes=first.lanes, tags=first.tags)
    if name in _CROSSING:
        return TracedValue(crossing=_CROSSING[name])
    if name == "is_safe_enter":
        return TracedValue(tags=frozenset(_safe(first)))
    if name in ("detect_front_vehicle_in", "detect_rear_vehicle_in"):
        vehicle = "front" if "front" in name else "rear"
        lanes = first.lanes or (frozenset() if first.crossing else _lane(0, at).lanes)
        return TracedValue(vehicle=vehicle, tags=frozenset({vehicle}), lanes=lanes)
    if name == "get_speed_of":
        return of("ego", "speed") if first.vehicle == "ego" else of("other", "other speed")
    if name == "get_distance_between_vehicles":
        return _distance(first, asked[1])
    if name == "detect_stop_sign_ahead":
        return of("sign", "sign")
    if name == "get_speed_limit":
        return of("limit", "limit")
    if name == "get_target_speed":
        return of("ego", "speed")
    return of("headway", "headway") if name == "get_desired_time_headway" else NOTHING


def _lane(offset: int, at: frozenset[int]) -> TracedValue:
    return TracedValue(lanes=frozenset({LaneValue(offset, at)}))


def _safe(lane: TracedValue) -> set[str]:
    if lane.crossing:
        return {"safe:cross", f"safe:cross:{lane.crossing}"}
    return {f"safe:{one.offset}" for one in lane.lanes} or {"safe:?"}


def _distance(one: TracedValue, other: TracedValue) -> TracedValue:
    match one.vehicle, other.vehicle:
        case "front", "ego":
            return of("gap", "gap")
        case "ego", "front":
            return of("past", "past")
        case "ego", "rear":
            return of("behind", "behind")
        case "", "ego":
            return of("gap", "gap")
        case "ego", "":
            return of("past", "past")
        case _:
            return NOTHING


_MAX_DEPTH: Final = 10
_SPEEDS: Final = frozenset[Base]({"", "ego", "other", "limit"})
_OTHER: Final = Term("other", 1.0, 0.0)

Function = ast.FunctionDef | ast.Lambda


class ExpressionEvaluator(ProgramNotes, ABC):
    """Follows expressions; what a call does is noted on the way."""

    def __init__(self) -> None:
        super().__init__()
        self._depth = 0
        self._way_out: list[set[str]] = []
        self._homes: dict[int, MeaningFrame] = {}

    @abstractmethod
    def _block(self, body: Sequence[ast.stmt], frame: MeaningFrame) -> bool:
        """Follow statements; True when what comes after them is not reached from here."""

    def _store(self, target: ast.expr, value: TracedValue, frame: MeaningFrame) -> None:
        if isinstance(target, ast.Name):
            self._bind(target.id, value, frame)
        elif isinstance(target, ast.Tuple | ast.List):
            for index, element in enumerate(target.elts):
                part = value.items[index] if len(value.items) == len(target.elts) else TracedValue(tags=value.tags)
                self._store(element, part, frame)

    def _bind(self, name: str, value: TracedValue, frame: MeaningFrame) -> None:
        # What is bound only under a test tells how the test came out.
        frame.names[name] = replace(value, tags=value.tags | frame.active)

    def _value(self, node: ast.expr, frame: MeaningFrame) -> TracedValue:
        self._count()
        match node:
            case ast.Constant(value=bool() | str() | None):
                return NOTHING
            case ast.Constant(value=int() | float() as plain):
                if abs(plain) >= 1e9:
                    return NOTHING
                self._literals.add(float(plain))
                return number(float(plain))
            case ast.Name(id=name):
                return frame.find(name) or NOTHING
            case ast.NamedExpr(target=target, value=value):
                found = self._value(value, frame)
                self._store(target, found, frame)
                return found
            case ast.UnaryOp(op=op, operand=operand):
                found = self._value(operand, frame)
                return negated(found) if isinstance(op, ast.USub) else found
            case ast.BinOp(left=left, op=op, right=right):
                return self._sum(self._value(left, frame), op, self._value(right, frame), frame)
            case ast.BoolOp(values=values):
                return self._all(values, frame)
            case ast.Compare(left=left, comparators=others):
                found = [self._value(one, frame) for one in (left, *others)]
                for a, b in pairwise(found):
                    self._compare(a, b)
                return TracedValue(tags=tags_of(found))
            case ast.IfExp(test=test, body=body, orelse=orelse):
                tested = self._value(test, frame)
                found = either([self._value(body, frame), self._value(orelse, frame)])
                return replace(found, tags=found.tags | tested.tags)
            case ast.Call():
                return self._called(node, frame)
            case ast.YieldFrom(value=ast.Call() as call):
                return self._called(call, frame, waits=True)
            case ast.Yield(value=ast.expr() as value) | ast.YieldFrom(value=value) | ast.Starred(value=value):
                return self._value(value, frame)
            case ast.Tuple(elts=elements) | ast.List(elts=elements) | ast.Set(elts=elements):
                items = tuple(self._value(one, frame) for one in elements)
                return TracedValue(
                    tags=tags_of(items), items=items, crossing=next((i.crossing for i in items if i.crossing), "")
                )
            case ast.Subscript(value=value, slice=index):
                return self._member(self._value(value, frame), index)
            case ast.GeneratorExp() | ast.ListComp() | ast.SetComp():
                return self._comprehension(node, frame)
            case ast.Lambda():
                self._homes[id(node)] = frame
                return TracedValue(functions=(node,))
            case ast.Attribute(value=value):
                return TracedValue(tags=self._value(value, frame).tags)
            case ast.JoinedStr(values=values):
                return TracedValue(tags=tags_of([self._value(one, frame) for one in values]))
            case ast.FormattedValue(value=value):
                return self._value(value, frame)
            case _:
                return NOTHING

    def _all(self, nodes: Sequence[ast.expr], frame: MeaningFrame) -> TracedValue:
        """`and` and `or`; what cannot come after a plain 0 or False is not looked at."""
        found: list[TracedValue] = []
        for node in nodes:
            found.append(self._value(node, frame))
            if isinstance(node, ast.Constant) and not node.value:
                break
        return either(found)

    def _member(self, value: TracedValue, index: ast.expr) -> TracedValue:
        match index:
            case ast.Constant(value=int() as place) if place < len(value.items):
                return value.items[place]
            case _ if value.items:
                return either(value.items)
            case _:
                return value

    def _comprehension(self, node: ast.GeneratorExp | ast.ListComp | ast.SetComp, frame: MeaningFrame) -> TracedValue:
        tags: frozenset[str] = frozenset()
        inner = MeaningFrame({}, frame, frame.active, frame.gates)
        for part in node.generators:
            iterated = self._value(part.iter, inner)
            self._store(part.target, either(iterated.items) if iterated.items else iterated, inner)
            tags |= iterated.tags | tags_of([self._value(test, inner) for test in part.ifs])
        found = self._value(node.elt, inner)
        return replace(found, tags=found.tags | tags)

    def _sum(self, left: TracedValue, op: ast.operator, right: TracedValue, frame: MeaningFrame) -> TracedValue:
        found = combined(left, op, right)
        if isinstance(op, ast.Sub):
            if _is_speed_now(right) and not _is_speed_now(left):
                wanted = frozenset(t for t in left.terms if t.base in _SPEEDS and not t.bound and t != _OTHER)
                if wanted:
                    self._do("speed", frame, TracedValue(wanted, left.tags), reference=True)
            self._compare(left, right, compared=False)
            self._steered_gap(left, right, frame)
        return found

    def _called(self, node: ast.Call, frame: MeaningFrame, *, waits: bool = False) -> TracedValue:
        args = tuple(self._value(one, frame) for one in node.args)
        named = {word.arg: self._value(word.value, frame) for word in node.keywords if word.arg is not None}
        everything = [*args, *named.values()]
        if not isinstance(node.func, ast.Name):
            return TracedValue(tags=tags_of([self._value(node.func, frame), *everything]))
        name = node.func.id
        known = frame.find(name)
        if known is not None:
            results = [self._call(one, args, named, frame, waits=waits) for one in known.functions[:4]]
            return either(results) if results else TracedValue(tags=tags_of(everything))
        api = APIS.get(name)
        if api is None:
            return _builtin(name, args, everything)
        asked = [named.get(param.name, NOTHING) for param in api.params]
        asked[: len(args)] = args[: len(asked)]
        if api.effect == "read":
            return answer(name, asked, self._at)
        self._wish(name, asked, frame)
        return NOTHING

    def _call(
        self,
        function: ast.AST,
        args: Sequence[TracedValue],
        named: dict[str, TracedValue],
        frame: MeaningFrame,
        *,
        waits: bool,
    ) -> TracedValue:
        if not isinstance(function, ast.FunctionDef | ast.Lambda) or self._depth >= _MAX_DEPTH:
            return NOTHING
        inner = MeaningFrame(
            _arguments(function, args, named), self._homes.get(id(function)), frame.active, frame.gates
        )
        entry = inner.depends
        self._depth += 1
        ways, self._way_out = self._way_out, []
        line = self._line
        try:
            if isinstance(function, ast.Lambda):
                inner.returned.append(self._value(function.body, inner))
            else:
                self._block(function.body, inner)
        finally:
            self._depth -= 1
            self._way_out = ways
        self._line = line
        if waits:
            frame.gates = inner.gates  # they began with those of the frame
        result = either(inner.returned)
        return replace(result, tags=(result.tags | inner.gates) - (entry - tags_of(args)))

    def _constants(self, node: ast.expr, frame: MeaningFrame) -> tuple[float, ...]:
        """Plain numbers that an expression can be."""
        return self._value(node, frame).constants


def _arguments(
    function: Function, args: Sequence[TracedValue], named: dict[str, TracedValue]
) -> dict[str, TracedValue]:
    names = [one.arg for one in (*function.args.posonlyargs, *function.args.args)]
    return dict.fromkeys(names, NOTHING) | dict(zip(names, args, strict=False)) | named


def _is_speed_now(value: TracedValue) -> bool:
    return value.terms == frozenset({Term("ego", 1.0, 0.0)})


def _builtin(name: str, args: Sequence[TracedValue], everything: Sequence[TracedValue]) -> TracedValue:
    tags = tags_of(everything)
    if name in ("min", "max"):
        members = args[0].items if len(args) == 1 and args[0].items else args
        return replace(bounded(members), tags=tags)
    if name in ("float", "int", "round", "abs", "list", "tuple", "sorted", "reversed", "enumerate"):
        return replace(args[0], tags=tags) if args else NOTHING
    return TracedValue(tags=tags)
