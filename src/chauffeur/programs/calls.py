"""Static checks of driving-API calls: shape, constants' units and ranges, and what may be done with a handle."""

from __future__ import annotations

import ast
from typing import Final

from chauffeur.programs.catalogue import Api, Param, apis_of, argument_problem
from chauffeur.programs.findings import Finding
from chauffeur.programs.nodes import all_nodes

_KMH_PER_MPS: Final = 3.6
_HANDLE_KINDS: Final = frozenset({"vehicle", "lane"})
_LITERALS: Final = (ast.Constant, ast.UnaryOp, ast.BinOp, ast.List, ast.Tuple, ast.Dict, ast.Set, ast.JoinedStr)


def constant_number(node: ast.expr) -> float | None:
    """Value of an expression made of number literals and + - * /, else None."""
    if isinstance(node, ast.Constant):
        value = node.value
        if isinstance(value, bool) or not isinstance(value, int | float):
            return None
        return float(value) if abs(value) < 1e300 else None
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
        inner = constant_number(node.operand)
        return None if inner is None else -inner if isinstance(node.op, ast.USub) else inner
    if isinstance(node, ast.BinOp):
        left, right = constant_number(node.left), constant_number(node.right)
        if left is None or right is None:
            return None
        if isinstance(node.op, ast.Add):
            return left + right
        if isinstance(node.op, ast.Sub):
            return left - right
        if isinstance(node.op, ast.Mult):
            return left * right
        if isinstance(node.op, ast.Div) and right != 0:
            return left / right
    return None


class CallChecks:
    """Checks of one program."""

    def __init__(self, tree: ast.Module, bound: frozenset[str]) -> None:
        self._bound = bound
        self._kinds = _handle_kinds(tree)

    def check(self, call: ast.Call) -> list[Finding]:
        """Findings of one call; none when it is not a driving API's."""
        if not isinstance(call.func, ast.Name) or call.func.id not in apis_of("town") or call.func.id in self._bound:
            return []
        api = apis_of("town")[call.func.id]
        starred = any(isinstance(arg, ast.Starred) for arg in call.args) or any(k.arg is None for k in call.keywords)
        if starred:
            return [
                Finding(call.lineno, "call", f"{api.name} is called with * or **", "write the arguments one by one")
            ]
        problem = argument_problem(api, len(call.args), [k.arg for k in call.keywords if k.arg is not None])
        if problem is not None:
            return [Finding(call.lineno, "call", problem, f"its signature is {api.signature}")]
        by_name = {param.name: param for param in api.params}
        given = list(zip(api.params, call.args, strict=False))
        given += [(by_name[k.arg], k.value) for k in call.keywords if k.arg is not None]
        return [finding for param, value in given for finding in self._argument(api, param, value)]

    def _argument(self, api: Api, param: Param, value: ast.expr) -> list[Finding]:
        where = f"{api.name}({param.name})"
        if param.kind == "number":
            return _number_findings(where, param, value)
        if param.kind not in _HANDLE_KINDS:
            return []
        article = f"a {param.kind}"
        source = "get_lane_of()" if param.kind == "lane" else "get_ego_vehicle()"
        if isinstance(value, ast.Constant) and value.value is None:
            if param.optional:
                return []
            return [Finding(value.lineno, "argument", f"{where} needs {article}, not None", f"see {source}")]
        if isinstance(value, _LITERALS):
            return [
                Finding(value.lineno, "argument", f"{where} needs {article}, not a value written down", f"see {source}")
            ]
        kind = self._kind_of(value)
        if kind is not None and kind != param.kind:
            return [
                Finding(value.lineno, "argument", f"{where} needs {article}, but is given a {kind}", f"see {source}")
            ]
        return []

    def check_comparison(self, node: ast.Compare) -> list[Finding]:
        """`is` between handles would ask about the text behind them, and < about nothing at all."""
        operands = [node.left, *node.comparators]
        findings: list[Finding] = []
        for left, op, right in zip(operands, node.ops, operands[1:], strict=False):
            if isinstance(op, ast.Is | ast.IsNot) and not (_is_singleton(left) or _is_singleton(right)):
                findings.append(
                    Finding(node.lineno, "is", "`is` compares identity, which handles do not have", "use == or !=")
                )
            elif isinstance(op, ast.Lt | ast.LtE | ast.Gt | ast.GtE):
                for side in (left, right):
                    kind = self._kind_of(side)
                    if kind is not None:
                        findings.append(self._misuse(node, kind, "has no order"))
        return findings

    def check_handle_use(self, node: ast.Subscript | ast.BinOp) -> list[Finding]:
        """Handles cannot be indexed or computed with."""
        if isinstance(node, ast.Subscript):
            kind = self._kind_of(node.value)
            return [] if kind is None else [self._misuse(node, kind, "cannot be indexed")]
        for side in (node.left, node.right):
            kind = self._kind_of(side)
            if kind is not None:
                return [self._misuse(node, kind, "cannot be computed with")]
        return []

    def _misuse(self, node: ast.expr, kind: str, what: str) -> Finding:
        remedy = (
            "use get_left_lane(vehicle) and get_right_lane(vehicle)"
            if kind == "lane"
            else "use get_speed_of(vehicle) or get_distance_between_vehicles(veh1, veh2)"
        )
        return Finding(node.lineno, "handle", f"a {kind} {what}", remedy)

    def _kind_of(self, node: ast.expr) -> str | None:
        if isinstance(node, ast.Name):
            return self._kinds.get(node.id)
        return _call_kind(node)


def _number_findings(where: str, param: Param, value: ast.expr) -> list[Finding]:
    unit = f" in {param.unit}" if param.unit else ""
    if isinstance(value, ast.Constant | ast.JoinedStr) and not (
        isinstance(value, ast.Constant) and isinstance(value.value, int | float) and not isinstance(value.value, bool)
    ):
        return [Finding(value.lineno, "argument", f"{where} needs a number{unit}", "pass a number")]
    number = constant_number(value)
    if number is None or param.low is None or param.high is None or param.low <= number <= param.high:
        return []
    reason = f"{where} is {number:g} {param.unit}, outside {param.low:g} to {param.high:g}"
    remedy = f"it is a number of {param.unit}"
    if param.unit == "m/s" and number > param.high:
        reason += f" ({number * _KMH_PER_MPS:.0f} km/h)"
        remedy = f"speeds are in m/s: {number:g} km/h is {number / _KMH_PER_MPS:.1f} m/s"
    elif param.unit == "s" and number > param.high:
        remedy = "a headway is in seconds: divide a gap in metres by the speed in m/s"
    elif number < param.low:
        remedy = "it cannot be negative"
    return [Finding(value.lineno, "range", reason, remedy)]


def _is_singleton(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and (node.value is None or isinstance(node.value, bool))


def _call_kind(node: ast.expr) -> str | None:
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in apis_of("town"):
        kind = apis_of("town")[node.func.id].returns
        return kind if kind in _HANDLE_KINDS else None
    return None


def _handle_kinds(tree: ast.Module) -> dict[str, str]:
    """Names that hold a vehicle, or a lane, wherever they are bound in the program."""
    kinds: dict[str, set[str | None]] = {}

    def bind(target: ast.expr, kind: str | None) -> None:
        for node in ast.walk(target):
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                kinds.setdefault(node.id, set()).add(kind)

    for node in all_nodes(tree):
        if isinstance(node, ast.Assign):
            kind = _call_kind(node.value)
            if isinstance(node.value, ast.Constant) and node.value.value is None:
                continue  # `front = None` says nothing of what it will hold
            for target in node.targets:
                bind(target, kind if isinstance(target, ast.Name) else None)
        elif isinstance(node, ast.AnnAssign | ast.NamedExpr):
            bind(node.target, None if node.value is None else _call_kind(node.value))
        elif isinstance(node, ast.AugAssign | ast.For | ast.comprehension):
            bind(node.target, None)
        elif isinstance(node, ast.arg):
            kinds.setdefault(node.arg, set()).add(None)
        elif isinstance(node, ast.ExceptHandler) and node.name:
            kinds.setdefault(node.name, set()).add(None)
    return {name: kind for name, found in kinds.items() if len(found) == 1 for kind in found if kind is not None}
