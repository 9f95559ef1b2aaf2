"""Which names belong to which function, as Python decides it before anything runs."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Final

from chauffeur.programs.nodes import children

FunctionNode = ast.FunctionDef | ast.Lambda
_COMPREHENSIONS: Final = (ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)


@dataclass(slots=True, eq=False)
class Scope:
    """Names of a module, a function, a lambda or a comprehension.

    Attributes:
        parent: The scope around it.
        names: What is bound in it.
        shared: What it declares `global` or `nonlocal`.
        comprehension: Whether it is a comprehension's.
        plain: What is bound in it otherwise than by `def`.
        functions: Functions defined in it, by name.
    """

    parent: Scope | None
    names: set[str] = field(default_factory=set[str])
    shared: dict[str, bool] = field(default_factory=dict[str, bool])
    comprehension: bool = False
    plain: set[str] = field(default_factory=set[str])
    functions: dict[str, list[ast.FunctionDef]] = field(default_factory=dict[str, list[ast.FunctionDef]])

    def bind(self, name: str) -> None:
        """A name is bound here, and not by `def`."""
        self.names.add(name)
        self.plain.add(name)


class Scopes:
    """The scopes of some texts that share one module."""

    def __init__(self, trees: Iterable[ast.Module]) -> None:
        self.module = Scope(None)
        self.shared: set[str] = set()
        """Names that some function may rebind outside itself."""
        self._of: dict[int, Scope] = {}
        self._stored: dict[int, frozenset[str]] = {}
        for tree in trees:
            for statement in tree.body:
                self._walk(statement, self.module)

    def of(self, node: ast.AST) -> Scope:
        """The scope a function, lambda or comprehension opens."""
        return self._of[id(node)]

    def stored_in(self, node: ast.For | ast.While | FunctionNode) -> frozenset[str]:
        """Names that a loop, or a function's body, binds in its own scope."""
        kept = self._stored.get(id(node))
        if kept is None:
            parts = (
                node.body
                if isinstance(node, ast.FunctionDef)
                else [node.body if isinstance(node, ast.Lambda) else node]
            )
            kept = self._stored[id(node)] = frozenset(name for part in parts for name in _stores(part))
        return kept

    def _walk(self, node: ast.AST, scope: Scope) -> None:
        self._bind(node, scope)
        if isinstance(node, ast.FunctionDef | ast.Lambda):
            self._function(node, scope)
        elif isinstance(node, _COMPREHENSIONS):
            inner = self._of[id(node)] = Scope(scope, comprehension=True)
            for index, clause in enumerate(node.generators):
                for name in _names(clause.target):
                    inner.bind(name)
                self._walk(clause.iter, inner if index else scope)
                for test in clause.ifs:
                    self._walk(test, inner)
            for element in (node.key, node.value) if isinstance(node, ast.DictComp) else (node.elt,):
                self._walk(element, inner)
        elif isinstance(node, ast.NamedExpr):
            self._walk(node.value, scope)
        else:
            for child in children(node):
                self._walk(child, scope)

    def _function(self, node: FunctionNode, scope: Scope) -> None:
        inner = self._of[id(node)] = Scope(scope)
        for default in (*node.args.defaults, *node.args.kw_defaults):
            if default is not None:
                self._walk(default, scope)
        for argument in _arguments(node.args):
            inner.bind(argument.arg)
        for child in node.body if isinstance(node, ast.FunctionDef) else [node.body]:
            self._walk(child, inner)
        inner.names -= inner.shared.keys()

    def _bind(self, node: ast.AST, scope: Scope) -> None:
        match node:
            case ast.NamedExpr(target=ast.Name(id=name)):
                while scope.comprehension and scope.parent is not None:
                    scope = scope.parent
                scope.bind(name)
            case ast.Name(id=name, ctx=ast.Store()):
                scope.bind(name)
            case ast.FunctionDef(name=name):
                scope.names.add(name)
                scope.functions.setdefault(name, []).append(node)
            case ast.ExceptHandler(name=str(name)):
                scope.bind(name)
            case ast.alias(name=name, asname=asname):
                scope.bind(asname or name.partition(".")[0])
            case ast.Global(names=names) | ast.Nonlocal(names=names):
                scope.shared.update(dict.fromkeys(names, isinstance(node, ast.Global)))
                self.shared.update(names)
                if isinstance(node, ast.Global):
                    self.module.names.update(names)
            case _:
                pass


def _arguments(arguments: ast.arguments) -> Iterator[ast.arg]:
    yield from (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs)
    yield from (argument for argument in (arguments.vararg, arguments.kwarg) if argument is not None)


def _names(target: ast.expr) -> Iterator[str]:
    return (node.id for node in ast.walk(target) if isinstance(node, ast.Name))


def _stores(loop: ast.AST) -> Iterator[str]:
    """Names stored below a node outside functions; those of comprehensions do no harm among them."""
    stack = [loop]
    while stack:
        node = stack.pop()
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id
        if not isinstance(node, ast.FunctionDef | ast.Lambda):
            stack += children(node)
