"""Makes a generator program runnable where there are no generators, and tells the host where it stands.

`yield E` becomes `__tick__(line, (E))`, a call that the host answers one control period later; `yield autopilot()`, the
commonest, becomes `__drive__(line)`, which is both calls in one; `yield from f(...)` becomes `f(...)`, since the
helper's own yields reach the host by themselves, with lines that count on from the program's as in `Program.text`. Only
those few characters change, and what `lower` does: every statement keeps its line, so the sandbox's tracebacks name the
lines the model wrote.
"""

from __future__ import annotations

import ast
import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import count
from typing import Final

from chauffeur.concept import lines_before_library
from chauffeur.programs.errors import ProgramSyntaxError
from chauffeur.programs.lower import PRELUDE, Lowering, apply_edits, needs_prelude
from chauffeur.programs.nodes import all_nodes, children, levels
from chauffeur.programs.prefetch import DRIVE, TICK, apis_named, closing, stand_ins

MAX_SOURCE_CHARS: Final = 20_000
MAX_NODES: Final = 5_000
MAX_DEPTH: Final = 40

_BINDINGS: Final = "_chauffeur_bindings"
_GENERATOR: Final = "_chauffeur_generator"
_BINDING: Final = (
    ast.Name,
    ast.FunctionDef,
    ast.AsyncFunctionDef,
    ast.ClassDef,
    ast.arg,
    ast.ExceptHandler,
    ast.alias,
    ast.Global,
    ast.Nonlocal,
)
_NUMBER: Final = re.compile(r"(?<![\w.])(?:\d{1,15}\.\d{1,17}|[1-9]\d{0,14}|0)(?![\w.])")
"""A plainly written number; in a comment or a text it does no harm either."""
_MARK: Final = "90817263"
_MARKED: Final = re.compile(rf"{_MARK}(\d{{4}})(?:\.5)?")
_MOST_MARKS: Final = 9_999
_YIELD_FROM: Final = re.compile(rb"yield(?:\s|\\\n|#[^\n]*\n)+from")


@dataclass(frozen=True, slots=True)
class Prepared:
    """A program ready for the sandbox.

    Attributes:
        helpers: What is read before it: stand-ins for the driving APIs (prefetch.py), Python bodies of built-ins,
            rewritten library functions.
        program: Rewritten program, ending in the call of its main function.
        main: Name of the main function.
        main_line: Line it begins at.
        stood_in: Driving APIs that have a stand-in.
    """

    helpers: str
    program: str
    main: str
    main_line: int
    stood_in: frozenset[str]


def parse(source: str, what: str = "program") -> ast.Module:
    """Syntax tree of a program text within the size limits.

    Args:
        source: Program text.
        what: How to call it in messages.

    Raises:
        ProgramSyntaxError: It is too long, too deeply nested, or not Python.
    """
    if len(source) > MAX_SOURCE_CHARS:
        raise ProgramSyntaxError(
            f"The {what} has {len(source)} characters; {MAX_SOURCE_CHARS} are allowed.", hint="Write a shorter one."
        )
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # e.g. an invalid escape in a string: harmless, and not the reader's text
            tree = ast.parse(source)
    except SyntaxError as error:
        raise ProgramSyntaxError(f"The {what} is not valid Python: {error.msg}.", line=error.lineno) from None
    except (RecursionError, MemoryError, OverflowError):
        raise ProgramSyntaxError(f"The {what} is nested too deeply.", hint="Use simpler expressions.") from None
    except ValueError as error:
        raise ProgramSyntaxError(f"The {what} is not valid Python: {error}.") from None
    _measure(tree, what)
    return tree


def unix_lines(text: str) -> str:
    """Text with the line ends that byte offsets are counted by."""
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _measure(tree: ast.Module, what: str) -> None:
    nodes = 0
    for depth, level in enumerate(levels(tree)):
        nodes += len(level)
        if depth > MAX_DEPTH or nodes > MAX_NODES:
            too = "nested too deeply" if depth > MAX_DEPTH else "too long"
            line = next((line for node in level if (line := getattr(node, "lineno", None)) is not None), None)
            raise ProgramSyntaxError(f"The {what} is {too}.", line=line, hint="Write a simpler one.")


def own_nodes(function: ast.FunctionDef | ast.Lambda | ast.Module) -> Iterator[ast.AST]:
    """Nodes of a function's own body, in no particular order, without those of functions defined inside it."""
    stack: list[ast.AST] = list(function.body) if isinstance(function.body, list) else [function.body]
    while stack:
        node = stack.pop()
        yield node
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda | ast.ClassDef):
            stack += children(node)


def is_generator(function: ast.FunctionDef) -> bool:
    """Whether a function has a yield of its own; found out once."""
    kept: bool | None = getattr(function, _GENERATOR, None)
    if kept is None:
        kept = any(isinstance(node, ast.Yield | ast.YieldFrom) for node in own_nodes(function))
        setattr(function, _GENERATOR, kept)
    return kept


def takes_nothing(function: ast.FunctionDef) -> bool:
    """Whether a function can be called without arguments."""
    args = function.args
    required = len(args.posonlyargs) + len(args.args) - len(args.defaults)
    return required == 0 and all(default is not None for default in args.kw_defaults)


def main_function(tree: ast.Module) -> ast.FunctionDef | None:
    """The main function: the last top-level generator function that can be called without arguments."""
    for node in reversed(tree.body):
        if isinstance(node, ast.FunctionDef) and is_generator(node) and takes_nothing(node):
            return node
    return None


def binds(node: ast.AST) -> list[str]:
    """Names that a node itself binds."""
    if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store | ast.Del):
        return [node.id]
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        return [node.name]
    if isinstance(node, ast.arg):
        return [node.arg]
    if isinstance(node, ast.ExceptHandler) and node.name:
        return [node.name]
    if isinstance(node, ast.alias):
        return [node.asname or node.name.partition(".")[0]]
    if isinstance(node, ast.Global | ast.Nonlocal):
        return list(node.names)
    return []


def bindings(tree: ast.Module) -> tuple[tuple[ast.AST, str], ...]:
    """Every name that a text binds, at any depth, with the node that does; listed once, as `all_nodes`."""
    kept: tuple[tuple[ast.AST, str], ...] | None = getattr(tree, _BINDINGS, None)
    if kept is None:
        kept = tuple((node, name) for node in all_nodes(tree) if isinstance(node, _BINDING) for name in binds(node))
        setattr(tree, _BINDINGS, kept)
    return kept


def bound_names(tree: ast.Module) -> frozenset[str]:
    """Names that a text binds, at any depth."""
    return frozenset(name for _, name in bindings(tree))


def generator_names(tree: ast.Module) -> frozenset[str]:
    """Names of all generator functions a text defines, at any depth."""
    return frozenset(n.name for n in all_nodes(tree) if isinstance(n, ast.FunctionDef) and is_generator(n))


def top_level_names(tree: ast.Module) -> frozenset[str]:
    """Names that a library offers: its functions, and what it imports."""
    functions = [node for node in tree.body if isinstance(node, ast.FunctionDef)]
    imports = [alias for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom) for alias in node.names]
    return frozenset(name for node in (*functions, *imports) for name in binds(node))


def top_level_generators(tree: ast.Module) -> frozenset[str]:
    """Names of the generator functions that a library offers; those inside its functions are its own business."""
    return frozenset(node.name for node in tree.body if isinstance(node, ast.FunctionDef) and is_generator(node))


def prepare(source: str, library: str = "") -> Prepared:
    """Rewrite a program, and the library it may call, for the sandbox; a text rewritten before is remembered.

    So is one that differs from it in its numbers only: variants of one program cost next to nothing.

    Args:
        source: Program text.
        library: Helper functions the program may call with `yield from`.

    Raises:
        ProgramSyntaxError: The text is no program, or has no main function.
    """
    numbers = _NUMBER.findall(source)
    if _MARK in source or len(numbers) > _MOST_MARKS:
        return _prepared(source, library)
    places = count()
    masked = _NUMBER.sub(lambda match: f"{_MARK}{next(places):04d}{'.5' if '.' in match[0] else ''}", source)
    try:
        prepared = _prepared(masked, library)
    except ProgramSyntaxError:
        return _prepared(source, library)  # raises for the text itself, unless only the marks made it too long
    return replace(prepared, program=_MARKED.sub(lambda match: numbers[int(match[1])], prepared.program))


@lru_cache(maxsize=512)
def _prepared(source: str, library: str) -> Prepared:
    source, library = unix_lines(source), unix_lines(library)
    tree = parse(source)
    main = main_function(tree)
    if main is None:
        raise ProgramSyntaxError(
            "The program has no main function.",
            hint="Write a function without parameters that yields autopilot() once per control period.",
        )
    library_tree = parse(library, "library")
    stood_in = apis_named((tree, library_tree))
    helpers = stand_ins(stood_in)
    if needs_prelude(tree) or needs_prelude(library_tree):
        helpers += PRELUDE
    if library_tree.body:
        helpers += f"{_rewrite(library, library_tree, lines_before_library(source))}\n"
    program = _rewrite(source, tree)
    # The first tick stands before the main call: a started program has run its top level and waits like a generator.
    program = f"{program}\n{TICK}(0, None)\n{closing(main.name)}"
    return Prepared(helpers, program, main.name, main.lineno, stood_in)


def _rewrite(source: str, tree: ast.Module, lines_before: int = 0) -> str:
    text = source.encode()
    lowering = Lowering(text, tree)
    edits = lowering.edits()
    redefined = "autopilot" in bound_names(tree)
    for node in all_nodes(tree):
        if isinstance(node, ast.JoinedStr) and any(isinstance(n, ast.Yield | ast.YieldFrom) for n in ast.walk(node)):
            raise ProgramSyntaxError("A yield cannot stand inside an f-string.", line=node.lineno)
        if isinstance(node, ast.Yield):
            start, end = lowering.span(node)
            line = f"{lines_before + node.lineno}"
            if node.value is not None and not redefined and _is_autopilot(node.value):
                breaks = "\n" * text.count(b"\n", start, end)
                edits.append((start, end, f"{DRIVE}({line}{breaks})".encode()))
            else:
                value = "" if node.value is not None else "None"
                edits += [(start, start + len(b"yield"), f"{TICK}({line}, ({value}".encode()), (end, end, b"))")]
        elif isinstance(node, ast.YieldFrom):
            start, end = lowering.span(node)
            keyword = _YIELD_FROM.match(text, start)
            assert keyword is not None  # the node starts with these two words
            edits += [(start, keyword.end(), b"("), (end, end, b")")]
    return apply_edits(text, edits).decode()


def _is_autopilot(node: ast.expr) -> bool:
    return called_name(node) == "autopilot" and isinstance(node, ast.Call) and not node.args and not node.keywords


def called_name(node: ast.expr) -> str | None:
    """The plain name that a call calls; None for anything else."""
    return node.func.id if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) else None
