"""The vocabulary a program may use besides the driving APIs, and what to say about the rest."""

from __future__ import annotations

import ast
import difflib
import math
from collections.abc import Iterable
from typing import Final

BUILTINS: Final = frozenset(
    {
        "abs", "all", "any", "bool", "dict", "divmod", "enumerate", "filter", "float", "frozenset", "int",
        "isinstance", "iter", "len", "list", "map", "max", "min", "next", "pow", "print", "range", "reversed",
        "round", "set", "sorted", "str", "sum", "tuple", "zip",
        "ArithmeticError", "AssertionError", "AttributeError", "Exception", "IndexError", "KeyError", "NameError",
        "OverflowError", "RuntimeError", "StopIteration", "TypeError", "ValueError", "ZeroDivisionError",
    }
)  # fmt: skip

MATH_NAMES: Final = frozenset(name for name in dir(math) if not name.startswith("_"))

METHODS: Final = frozenset(
    {
        "add", "append", "clear", "copy", "count", "difference", "discard", "endswith", "extend", "find", "format",
        "get", "index", "insert", "intersection", "is_integer", "items", "join", "keys", "lower", "pop", "popitem",
        "remove", "replace", "reverse", "setdefault", "sort", "split", "startswith", "strip", "title", "union",
        "update", "upper", "values",
    }
)  # fmt: skip
"""Methods of lists, dicts, sets, texts and numbers."""

MUTATING: Final = frozenset(
    {"add", "append", "clear", "discard", "extend", "insert", "pop", "popitem", "remove", "update", "setdefault"}
)

ATTRIBUTE_REMEDIES: Final = {
    "speed": "use get_speed_of(vehicle)",
    "velocity": "use get_speed_of(vehicle)",
    "lane": "use get_lane_of(vehicle)",
    "lane_index": "use get_lane_of(vehicle)",
    "lane_id": "use get_lane_of(vehicle), get_left_lane(vehicle) and get_right_lane(vehicle)",
    "target_lane_index": "use set_target_lane(lane)",
    "target_speed": "use get_target_speed() and set_target_speed(speed)",
    "position": "use get_distance_between_vehicles(veh1, veh2)",
    "x": "use get_distance_between_vehicles(veh1, veh2)",
    "y": "use get_lane_of(vehicle)",
    "speed_limit": "use get_speed_limit()",
    "front_vehicle": "use detect_front_vehicle_in(lane)",
    "rear_vehicle": "use detect_rear_vehicle_in(lane)",
}
"""What models reach for on a vehicle or lane, and the API that answers it."""

NODE_REASONS: Final[dict[type[ast.AST], tuple[str, str]]] = {
    ast.ClassDef: ("classes are not part of the language", "use functions and plain variables"),
    ast.AsyncFunctionDef: ("async functions are not part of the language", "use a plain generator function"),
    ast.AsyncFor: ("async loops are not part of the language", "use a plain for loop"),
    ast.AsyncWith: ("async with is not part of the language", "leave it out"),
    ast.Await: ("await is not part of the language", "wait with `yield autopilot()`"),
    ast.With: ("`with` is not part of the language", "there is nothing to open; leave it out"),
    ast.Delete: ("`del` is not part of the language", "assign None instead"),
    ast.Match: ("`match` is not part of the language", "use if and elif"),
    ast.TryStar: ("`except*` is not part of the language", "use except"),
}
"""Statements that are refused, with reason and remedy."""

ALLOWED_NODES: Final[tuple[type[ast.AST], ...]] = (
    ast.Module, ast.FunctionDef, ast.Lambda, ast.arguments, ast.arg, ast.Return, ast.Global, ast.Nonlocal, ast.Pass,
    ast.Expr, ast.Assign, ast.AugAssign, ast.AnnAssign, ast.NamedExpr, ast.If, ast.For, ast.While, ast.Break,
    ast.Continue, ast.Try, ast.ExceptHandler, ast.Raise, ast.Assert, ast.Import, ast.ImportFrom, ast.alias,
    ast.Yield, ast.YieldFrom, ast.Call, ast.keyword, ast.Name, ast.Attribute, ast.Subscript, ast.Slice, ast.Starred,
    ast.Constant, ast.JoinedStr, ast.FormattedValue, ast.Tuple, ast.List, ast.Set, ast.Dict, ast.ListComp,
    ast.SetComp, ast.DictComp, ast.GeneratorExp, ast.comprehension, ast.IfExp, ast.BoolOp, ast.BinOp, ast.UnaryOp,
    ast.Compare, ast.boolop, ast.operator, ast.unaryop, ast.cmpop, ast.expr_context,
)  # fmt: skip


_INVENTED: Final = (
    (("change_lane", "lane_change", "switch_lane"), "ask is_safe_enter(lane), then set_target_lane(lane)"),
    (("accelerat", "decelerat", "brake", "slow", "speed_up"), "use set_target_speed(speed in m/s)"),
    (("sleep", "wait"), "wait with `yield autopilot()`; each one lasts 0.1 s"),
    (("stop", "pull_over", "halt"), "use set_target_speed(0) and yield autopilot()"),
)
"""Parts of names that models invent, and what there is instead."""


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """A remedy for an unknown name: the nearest known one, or nothing to offer."""
    for parts, remedy in _INVENTED:
        if any(part in name.lower() for part in parts):
            return remedy
    near = difflib.get_close_matches(name[:60], list(known), n=1, cutoff=0.7)
    return f"did you mean {near[0]}?" if near else "use only the driving APIs, your own functions and Python's basics"
