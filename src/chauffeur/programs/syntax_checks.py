"""What Python's compiler refuses although its parser does not: statements, names and stars in the wrong place.

`ast.parse` alone takes `break` outside a loop, two parameters of one name, or `[a] = *b` for Python; the sandbox does
not, or takes them for something else. Formats in texts, which it reads beforehand, are looked at as well.
"""

from __future__ import annotations

import ast
import re
import symtable
import warnings
from collections.abc import Iterator
from typing import Final

from chauffeur.programs.findings import Finding
from chauffeur.programs.nodes import children

_HOLD_STARS: Final = (ast.Call, ast.List, ast.Tuple, ast.Set)
_FORMAT: Final = re.compile(r"(?:.?[<>=^])?[-+ ]?z?#?0?\d*[,_]?(?:\.\d*)?.?", re.DOTALL)
"""A format specification as the sandbox reads it, before it knows what is to be formatted."""


def misplaced(source: str, tree: ast.Module) -> Iterator[Finding]:
    """Findings in a text of which `tree` is the syntax tree."""
    yield from _names(source)
    # (node, whether it stands in a function, whether it stands in a loop of that function)
    stack: list[tuple[ast.AST, bool, bool]] = [(tree, False, False)]
    while stack:
        node, in_function, in_loop = stack.pop()
        yield from _at(node, in_function=in_function, in_loop=in_loop)
        inside: list[ast.AST] = []
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            inside = [*node.body] if isinstance(node.body, list) else [node.body]
            stack += [(child, True, False) for child in inside]
        elif isinstance(node, ast.For | ast.AsyncFor | ast.While):
            inside = [*node.body]
            stack += [(child, in_function, True) for child in inside]
        known = set(map(id, inside))
        stack += [(child, in_function, in_loop) for child in children(node) if id(child) not in known]


def _names(source: str) -> Iterator[Finding]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            symtable.symtable(source, "program", "exec")
    except SyntaxError as error:
        yield Finding(error.lineno, "syntax", f"this is not valid Python: {error.msg}", "")


def _at(node: ast.AST, *, in_function: bool, in_loop: bool) -> Iterator[Finding]:
    match node:
        case ast.Break() | ast.Continue() if not in_loop:
            word = "break" if isinstance(node, ast.Break) else "continue"
            yield Finding(node.lineno, "syntax", f"`{word}` stands outside a loop", "leave it out")
        case ast.Return() | ast.Yield() | ast.YieldFrom() if not in_function:
            word = "return" if isinstance(node, ast.Return) else "yield"
            yield Finding(
                node.lineno, "syntax", f"`{word}` stands outside a function", "move it into the main function"
            )
        case ast.Call(keywords=keywords):
            given = [keyword.arg for keyword in keywords if keyword.arg is not None]
            for name in sorted({name for name in given if given.count(name) > 1}):
                yield Finding(node.lineno, "syntax", f"{name[:40]} is given twice", "give it once")
        case ast.Try(handlers=handlers):
            for handler in handlers[:-1]:
                if handler.type is None:
                    yield Finding(handler.lineno, "syntax", "`except:` stands before another `except`", "put it last")
        case ast.FormattedValue(format_spec=ast.JoinedStr(values=parts)):
            texts = [str(part.value) for part in parts if isinstance(part, ast.Constant)]
            form = "".join(texts)
            if len(texts) == len(parts) and _FORMAT.fullmatch(form) is None:
                yield Finding(node.lineno, "syntax", f"{form[:40]!r} is no format", "write e.g. f'{speed:.1f}'")
        case _:
            pass
    yield from _stars(node)


def _stars(node: ast.AST) -> Iterator[Finding]:
    stars = [child for child in children(node) if isinstance(child, ast.Starred)]
    wrong = stars if not isinstance(node, _HOLD_STARS) else []
    if isinstance(node, ast.List | ast.Tuple) and isinstance(node.ctx, ast.Store):
        wrong = stars[1:]
    for star in wrong:
        yield Finding(star.lineno, "syntax", "a starred expression cannot stand here", "leave the star out")
