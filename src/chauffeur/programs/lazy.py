"""Static check of what Python evaluates lazily and the sandbox at once: only uses that come to the same are allowed."""

from __future__ import annotations

import ast
from typing import Final

from chauffeur.programs.findings import Finding
from chauffeur.programs.lower import SEARCHES, can_lower, search_of
from chauffeur.programs.nodes import all_nodes, children
from chauffeur.programs.words import BUILTINS

_CONSUMERS: Final = frozenset({"list", "tuple", "set", "frozenset", "dict", "sum", "min", "max", "sorted", "len"})
_CONSUMING_METHODS: Final = frozenset({"join", "extend", "update"})
_LAZY_CALLS: Final = frozenset({"map", "filter"})
_LAZY_VIEWS: Final = frozenset({"zip", "enumerate", "reversed"})


def lazy_findings(tree: ast.Module) -> list[Finding]:
    """Findings about generator expressions and lazy built-ins."""
    nodes = all_nodes(tree)
    parents = {id(child): node for node in nodes for child in children(node)}
    in_text = {id(inner) for node in nodes if isinstance(node, ast.JoinedStr) for inner in ast.walk(node)}
    findings: list[Finding] = []
    for node in nodes:
        parent = parents.get(id(node))
        if isinstance(node, ast.GeneratorExp):
            findings += _generator_findings(node, parent, in_text)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            findings += _call_findings(node, node.func.id, parent)
    return findings


def _generator_findings(node: ast.GeneratorExp, parent: ast.AST | None, in_text: set[int]) -> list[Finding]:
    if parent is not None:
        search = search_of(parent)
        if search is not None and search.generator is node:
            if id(node) in in_text:
                return [
                    _finding(
                        node, f"{search.name}(... for ...) cannot stand inside an f-string", "assign it to a name first"
                    )
                ]
            if not can_lower(search):
                return [_finding(node, f"this {search.name}(... for ...) is too intricate", "use a for loop")]
            return []
        if _consumes(parent, node):
            return []
    return [_finding(node, "a generator expression can only stand inside any, all, next, sum, list and the like",
                     "write a list: [... for ...]")]  # fmt: skip


def _call_findings(call: ast.Call, name: str, parent: ast.AST | None) -> list[Finding]:
    if name == "iter" and len(call.args) != 1:
        return [_finding(call, "iter takes one argument here", "use a while loop")]
    if name in _LAZY_CALLS and call.args:
        function = call.args[0]
        pure = isinstance(function, ast.Name) and function.id in BUILTINS
        iterated = isinstance(parent, ast.For | ast.comprehension) or _is_search(parent)
        if not (parent is not None and _consumes(parent, call)) and not (pure and iterated):
            return [_finding(call, f"{name} can only stand inside list, sum, sorted and the like",
                             f"write list({name}(...)) or a list: [... for ...]")]  # fmt: skip
    if name in _LAZY_VIEWS and (
        (isinstance(parent, ast.Assign | ast.NamedExpr | ast.Return) and not _unpacks(parent))
        or (isinstance(parent, ast.Call) and isinstance(parent.func, ast.Name) and parent.func.id in {"next", "iter"})
    ):
        return [_finding(call, f"{name} cannot be kept for later", f"write list({name}(...))")]
    return []


def _consumes(parent: ast.AST, node: ast.expr) -> bool:
    if isinstance(parent, ast.Starred):
        return True
    if not isinstance(parent, ast.Call) or node not in parent.args:
        return False
    if isinstance(parent.func, ast.Name):
        return parent.func.id in _CONSUMERS
    return isinstance(parent.func, ast.Attribute) and parent.func.attr in _CONSUMING_METHODS


def _is_search(parent: ast.AST | None) -> bool:
    return isinstance(parent, ast.Call) and isinstance(parent.func, ast.Name) and parent.func.id in SEARCHES - {"next"}


def _unpacks(parent: ast.AST) -> bool:
    return isinstance(parent, ast.Assign) and all(isinstance(target, ast.Tuple | ast.List) for target in parent.targets)


def _finding(node: ast.expr, reason: str, remedy: str) -> Finding:
    return Finding(node.lineno, "lazy", reason, remedy)
