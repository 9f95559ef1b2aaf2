"""Static check that a program gives control back: every loop must reach a yield or visibly end."""

from __future__ import annotations

import ast
from collections.abc import Iterable
from typing import Final

from chauffeur.programs.calls import constant_number
from chauffeur.programs.catalogue import apis_of
from chauffeur.programs.findings import Finding
from chauffeur.programs.nodes import all_nodes
from chauffeur.programs.rewrite import own_nodes
from chauffeur.programs.words import BUILTINS, MUTATING

MAX_BARE_RANGE: Final = 100_000
"""Passes of a counted loop without a yield that surely fit into one control period."""

_REMEDY: Final = "put `yield autopilot()` into the loop; nothing on the road changes until a yield"


def loop_findings(tree: ast.Module) -> list[Finding]:
    """Findings about the loops of a program."""
    findings: list[Finding] = []
    for node in all_nodes(tree):
        if isinstance(node, ast.While):
            findings += _while_findings(node)
        elif isinstance(node, ast.For):
            findings += _for_findings(node)
    return findings


def has_end(tree: ast.Module) -> bool:
    """Whether a program may end by itself: one with `while True` that nothing leaves goes on until another wish."""
    return not any(
        isinstance(node, ast.While) and isinstance(node.test, ast.Constant) and node.test.value and not _may_leave(node)
        for node in all_nodes(tree)
    )


def _may_leave(loop: ast.While) -> bool:
    return any(isinstance(node, ast.Break | ast.Return | ast.Raise) for node in _loop_nodes(loop))


def _while_findings(loop: ast.While) -> list[Finding]:
    if isinstance(loop.test, ast.Constant) and not loop.test.value:
        return []
    if _reaches_yield(loop.body) or _expression_yields(loop.test):
        if not _expression_yields(loop.test) and _may_spin(loop.body):
            return [
                Finding(
                    loop.lineno,
                    "may-spin",
                    "a pass through this loop can go by without a yield and then repeats for ever",
                    "add `else: yield autopilot()`, or yield at the end of the loop's body",
                    "warning",
                )
            ]
        return []
    if any(isinstance(node, ast.Yield | ast.YieldFrom) for node in _loop_nodes(loop)):
        return [Finding(loop.lineno, "no-yield", "the yield in this loop can never be reached", _REMEDY)]
    if _visibly_ends(loop):
        return []
    return [Finding(loop.lineno, "no-yield", "this loop never yields and may never end", _REMEDY)]


def _for_findings(loop: ast.For) -> list[Finding]:
    call = loop.iter
    if not (isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "range" and call.args):
        return []
    numbers = [constant_number(arg) for arg in call.args]
    last = numbers[0] if len(numbers) == 1 else numbers[1]
    if last is None or abs(last) <= MAX_BARE_RANGE or _reaches_yield(loop.body):
        return []
    return [Finding(loop.lineno, "no-yield", f"this loop makes {abs(last):.0f} passes without a yield", _REMEDY)]


def _loop_nodes(loop: ast.While) -> Iterable[ast.AST]:
    return own_nodes(ast.Module(body=[*loop.body, ast.Expr(loop.test)], type_ignores=[]))


def _expression_yields(node: ast.AST) -> bool:
    holder = ast.Module(body=[node], type_ignores=[])  # pyright: ignore[reportArgumentType]
    return any(isinstance(inner, ast.Yield | ast.YieldFrom) for inner in own_nodes(holder))


def _reaches_yield(body: list[ast.stmt]) -> bool:
    """Whether some path through a block meets a yield."""
    for statement in body:
        if isinstance(statement, ast.If | ast.For | ast.While | ast.Try):
            blocks = _blocks(statement)
            head = getattr(statement, "test", None) or getattr(statement, "iter", None)
            if (head is not None and _expression_yields(head)) or any(_reaches_yield(block) for block in blocks):
                return True
        elif isinstance(statement, ast.FunctionDef):
            continue
        elif _expression_yields(statement):
            return True
        if isinstance(statement, ast.Return | ast.Break | ast.Continue | ast.Raise):
            return False
    return False


def _blocks(statement: ast.If | ast.For | ast.While | ast.Try) -> list[list[ast.stmt]]:
    if isinstance(statement, ast.Try):
        return [
            statement.body,
            *(handler.body for handler in statement.handlers),
            statement.orelse,
            statement.finalbody,
        ]
    if isinstance(statement, ast.If | ast.While) and isinstance(statement.test, ast.Constant):
        return [statement.body] if statement.test.value else [statement.orelse]
    return [statement.body, statement.orelse]


def _may_spin(body: list[ast.stmt]) -> bool:
    falls, continues = _idle_paths(body)
    return falls or continues


def _idle_paths(body: list[ast.stmt]) -> tuple[bool, bool]:
    """Whether a block can be passed, and whether a `continue` can be reached, with nothing changed and no yield."""
    continues = False
    for statement in body:
        if isinstance(statement, ast.Continue):
            return False, True
        if isinstance(statement, ast.If) and not _expression_yields(statement.test):
            paths = [_idle_paths(block) for block in (statement.body, statement.orelse)]
            continues = continues or any(path[1] for path in paths)
            if not any(path[0] for path in paths):
                return False, continues
        elif _changes_something(statement):
            return False, continues
    return True, continues


def _changes_something(statement: ast.stmt) -> bool:
    if isinstance(statement, ast.Return | ast.Break | ast.Raise | ast.AugAssign | ast.For | ast.While | ast.Try):
        return True
    if isinstance(statement, ast.FunctionDef | ast.Pass):
        return False
    if _expression_yields(statement):
        return True
    assigned = {n.id for n in ast.walk(statement) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
    for node in ast.walk(statement):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load) and node.id in assigned:
            return True
        if isinstance(node, ast.Call) and not _is_constant_call(node):
            return True
    # A flag may be raised: the next pass may take another way.
    return isinstance(statement, ast.Assign) and isinstance(statement.value, ast.Constant)


def _is_constant_call(call: ast.Call) -> bool:
    """A call that gives the same result until the next yield and changes nothing."""
    if not isinstance(call.func, ast.Name):
        return False
    api = apis_of("town").get(call.func.id)
    if api is not None:
        return api.effect != "wish"
    return call.func.id in BUILTINS and call.func.id != "next"


def _visibly_ends(loop: ast.While) -> bool:
    """Whether the loop's own variables move on: a counter, a list that is emptied, a walked structure."""
    tests: list[ast.AST] = [loop.test]
    tests += [node.test for node in _loop_nodes(loop) if isinstance(node, ast.If) and _leaves(node)]
    asked = {inner.id for test in tests for inner in ast.walk(test) if isinstance(inner, ast.Name)}
    leaves = _may_leave(loop)
    endless = isinstance(loop.test, ast.Constant)
    if endless and not leaves:
        return False
    return bool(asked & _moving_names(loop)) or (leaves and _first_pass_leaves(loop.body))


def _leaves(node: ast.If) -> bool:
    return any(isinstance(inner, ast.Break | ast.Return | ast.Raise) for inner in ast.walk(node))


def _first_pass_leaves(body: list[ast.stmt]) -> bool:
    return any(isinstance(statement, ast.Break | ast.Return | ast.Raise) for statement in body)


def _moving_names(loop: ast.While) -> set[str]:
    moving: set[str] = set()
    for node in _loop_nodes(loop):
        if isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name):
            moving.add(node.target.id)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in MUTATING:
            moving |= {inner.id for inner in ast.walk(node.func.value) if isinstance(inner, ast.Name)}
        elif isinstance(node, ast.Assign | ast.NamedExpr):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            read = {n.id for n in ast.walk(node.value) if isinstance(n, ast.Name)}
            written = {n.id for t in targets for n in ast.walk(t) if isinstance(n, ast.Name)}
            calls_api = any(
                isinstance(n, ast.Call) and isinstance(n.func, ast.Name) and n.func.id in apis_of("town")
                for n in ast.walk(node.value)
            )
            # `i = i + 1` or `lane = get_left_lane_of_my_own(lane)` move; `safe = is_safe_enter(lane)` stands still.
            if read & written or (read and not calls_api):
                moving |= written
    return moving
