"""Makes Python's lazy searches lazy where generator expressions are lists, and lets key functions call the host.

The sandbox evaluates a generator expression at once, and its built-in functions cannot call back to the host. So
`any(...)`, `all(...)` and `next(...)` over a generator expression become calls of `__find__` with a lambda,
`X.sort(key=K)` becomes `__sort__(X, key=K)`, and `sorted`, `min`, `max`, `map` and `filter` get a Python body
(`PRELUDE`).
"""

from __future__ import annotations

import ast
from dataclasses import dataclass
from typing import Final

from chauffeur.programs.nodes import all_nodes

SEARCHES: Final = frozenset({"any", "all", "next"})
"""Built-ins that may stop before the end of what they are given."""

PRELUDE: Final = """
__sorted__, __min__, __max__ = sorted, min, max

def __find__(test, items):
    for item in items:
        found = test(item)
        if found is not None:
            return found
    return None

def __take__(found, *default):
    if found is not None:
        return found[0]
    if default:
        return default[0]
    raise StopIteration

def __pick__(best, name, args, key, options):
    if key is None:
        return best(*args, **options)
    items = list(args[0]) if len(args) == 1 else list(args)
    if not items:
        if "default" in options:
            return options["default"]
        raise ValueError(f"{name}() iterable argument is empty")
    return best([(key(item), item) for item in items], key=lambda row: row[0])[1]

def sorted(items, *, key=None, reverse=False):
    if key is None:
        return __sorted__(items, reverse=reverse)
    rows = [(key(item), item) for item in items]
    return [row[1] for row in __sorted__(rows, key=lambda row: row[0], reverse=reverse)]

def min(*args, key=None, **options):
    return __pick__(__min__, "min", args, key, options)

def max(*args, key=None, **options):
    return __pick__(__max__, "max", args, key, options)

def map(function, *items):
    return [function(*row) for row in zip(*items)]

def filter(function, items):
    return [item for item in items if (item if function is None else function(item))]

def __sort__(items, **options):
    items[:] = sorted(items, **options)
"""
"""Fed to the sandbox before a program that needs it."""

_NEEDS_PRELUDE: Final = frozenset({"map", "filter", *SEARCHES})
_KEYED: Final = frozenset({"sorted", "min", "max"})

Edit = tuple[int, int, bytes]
"""(start, end, replacement) in bytes of the source."""


@dataclass(frozen=True, slots=True)
class Search:
    """A call of any, all or next over a generator expression."""

    call: ast.Call
    name: str
    generator: ast.GeneratorExp


def search_of(node: ast.AST) -> Search | None:
    """The search a node is, if it is one that can be lowered in form."""
    if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in SEARCHES):
        return None
    if node.keywords or not node.args or not isinstance(node.args[0], ast.GeneratorExp):
        return None
    if len(node.args) > (2 if node.func.id == "next" else 1):
        return None
    return Search(node, node.func.id, node.args[0])


def can_lower(search: Search) -> bool:
    """Whether its targets are plain names, and it binds nothing outside itself."""
    plain = all(_target_names(clause.target) is not None for clause in search.generator.generators)
    return plain and not any(isinstance(node, ast.NamedExpr) for node in ast.walk(search.generator))


def needs_prelude(tree: ast.Module) -> bool:
    """Whether a program uses a function that `PRELUDE` gives a body."""
    for node in all_nodes(tree):
        if isinstance(node, ast.Name) and node.id in _NEEDS_PRELUDE:
            return True
        if isinstance(node, ast.Call) and any(keyword.arg in {"key", None} for keyword in node.keywords):
            if isinstance(node.func, ast.Name) and node.func.id in _KEYED:
                return True
            if isinstance(node.func, ast.Attribute) and node.func.attr == "sort":
                return True
    return False


class Lowering:
    """Computes the edits of one source text."""

    def __init__(self, text: bytes, tree: ast.Module) -> None:
        self._text = text
        self._tree = tree
        self._starts = [0]
        for line in text.split(b"\n"):
            self._starts.append(self._starts[-1] + len(line) + 1)
        self._edits: list[Edit] = []

    def span(self, node: ast.expr) -> tuple[int, int]:
        """Byte offsets of an expression."""
        assert node.end_lineno is not None and node.end_col_offset is not None  # ast.parse always sets them
        start = self._starts[node.lineno - 1] + node.col_offset
        return start, self._starts[node.end_lineno - 1] + node.end_col_offset

    def edits(self) -> list[Edit]:
        """Replacements that do not overlap. Line breaks are kept, so that later lines keep their numbers."""
        in_text = {
            id(inner) for node in all_nodes(self._tree) if isinstance(node, ast.JoinedStr) for inner in ast.walk(node)
        }
        nodes = [node for node in all_nodes(self._tree) if id(node) not in in_text]  # there, positions are not exact
        searches = [search for node in nodes if (search := search_of(node)) is not None and can_lower(search)]
        searches.sort(key=lambda search: self.span(search.call)[1] - self.span(search.call)[0])
        for search in searches:  # inner ones first: an outer one takes them over
            start, end = self.span(search.call)
            replacement = self._lowered(search)
            missing = self._text.count(b"\n", start, end) - replacement.count(b"\n")
            self._edits = [edit for edit in self._edits if not start <= edit[0] < end]
            self._edits.append((start, end, replacement[:-1] + b"\n" * missing + b")"))
        for node in nodes:
            self._lower_sort(node)
        return self._edits

    def _lower_sort(self, node: ast.AST) -> None:
        if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "sort"):
            return
        if node.args or not node.keywords:
            return
        (start, end), (_, name_end) = self.span(node), self.span(node.func)
        if any(edit[0] < end and start < edit[1] for edit in self._edits):
            return
        owner_end = self.span(node.func.value)[1]
        opening = self._text.index(b"(", name_end)
        between = b"\n" * self._text.count(b"\n", owner_end, opening)
        closing = self._text[owner_end : self._text.index(b".", owner_end)]  # parentheses around the owner
        self._edits += [(start, start, b"__sort__("), (owner_end, opening + 1, closing + b", " + between)]

    def _lowered(self, search: Search) -> bytes:
        generator = search.generator
        value = b"(" + self._source(generator.elt) + b")"
        if search.name == "any":
            leaf, test = b"True", value
        elif search.name == "all":
            leaf, test = b"True", b"not " + value
        else:
            leaf, test = b"(" + value + b",)", b""
        body = leaf
        for depth, clause in enumerate(reversed(generator.generators)):
            tests = [b"(" + self._source(condition) + b")" for condition in clause.ifs]
            if depth == 0 and test:
                tests.append(test)
            if tests:
                body = body + b" if " + b" and ".join(tests) + b" else None"
            names = _target_names(clause.target)
            assert names is not None  # can_lower asked
            listed = ", ".join(names).encode()
            if isinstance(clause.target, ast.Name):
                function = b"lambda " + listed + b": " + body
            else:
                function = b"lambda __row__: (lambda " + listed + b": " + body + b")(*__row__)"
            body = b"__find__(" + function + b", (" + self._source(clause.iter) + b"))"
        if search.name == "any":
            return b"(" + body + b" is not None)"
        if search.name == "all":
            return b"(" + body + b" is None)"
        default = b"".join(b", (" + self._source(argument) + b")" for argument in search.call.args[1:])
        return b"__take__(" + body + default + b")"

    def _source(self, node: ast.expr) -> bytes:
        start, end = self.span(node)
        inside = [(a - start, b - start, new) for a, b, new in self._edits if start <= a and b <= end]
        return apply_edits(self._text[start:end], inside)


def apply_edits(text: bytes, edits: list[Edit]) -> bytes:
    """Text with replacements made; they must not overlap."""
    for start, end, replacement in sorted(edits, key=lambda edit: edit[:2], reverse=True):  # offsets before stay true
        text = text[:start] + replacement + text[end:]
    return text


def _target_names(target: ast.expr) -> list[str] | None:
    if isinstance(target, ast.Name):
        return [target.id]
    if isinstance(target, ast.Tuple):
        names = [element.id for element in target.elts if isinstance(element, ast.Name)]
        return names if len(names) == len(target.elts) else None
    return None
