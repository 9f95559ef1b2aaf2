"""Programs as helper functions of other programs: which of them a program calls, and one that stands by itself.

A program that did well is kept as one top-level function without parameters, so that another can call it with
`yield from`. Whatever else its text held (imports, functions, helpers it called) moves inside that function: two such
functions side by side never share a name, and either can be taken away without breaking the other.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Sequence

from chauffeur.programs.errors import ProgramSyntaxError
from chauffeur.programs.lower import apply_edits
from chauffeur.programs.rewrite import main_function, parse, top_level_names, unix_lines

_INDENT = "    "


def main_name(source: str) -> str:
    """Name of a program's main function.

    Raises:
        ProgramSyntaxError: The text is no program, or has no main function.
    """
    main = main_function(parse(unix_lines(source)))
    if main is None:
        raise ProgramSyntaxError("The program has no main function.")
    return main.name


def function_names(library: str) -> tuple[str, ...]:
    """Names of the functions a library offers, in order; none for text that is no Python."""
    try:
        tree = parse(unix_lines(library), "library")
    except ProgramSyntaxError:
        return ()
    return tuple(node.name for node in tree.body if isinstance(node, ast.FunctionDef))


def needed(source: str, library: str) -> str:
    """The part of a library that a program can come to use; empty when it uses none, or one of the texts is no Python.

    A name that the program defines itself is its own, whatever the library offers under it.
    """
    try:
        program, helpers = parse(unix_lines(source)), parse(unix_lines(library), "library")
    except ProgramSyntaxError:
        return ""
    lines = unix_lines(library).split("\n")
    wanted = _loaded(program) - top_level_names(program)
    kept: set[int] = set()
    growing = True
    while growing:  # helpers may call each other
        growing = False
        for index, node in enumerate(helpers.body):
            if index not in kept and wanted & top_level_names(ast.Module([node], [])):
                kept.add(index)
                wanted |= _loaded(node)
                growing = True
    texts = ("\n".join(lines[node.lineno - 1 : node.end_lineno]) for node in (helpers.body[i] for i in sorted(kept)))
    return join(texts)


def join(programs: Iterable[str]) -> str:
    """Programs that stand by themselves as one library text."""
    texts = [text.strip("\n") for text in programs]
    return "\n\n\n".join(texts) + "\n" if texts else ""


def standalone(source: str, name: str, library: str = "") -> str:
    """A program as one top-level function that needs nothing beside it.

    Args:
        source: Program text.
        name: What the function is to be called.
        library: Helper functions that the program may call; those it needs move inside.

    Raises:
        ProgramSyntaxError: One of the texts is no Python, or there is no main function.
    """
    source = unix_lines(source).strip("\n") + "\n"
    tree = parse(source)
    main = main_function(tree)
    if main is None:
        raise ProgramSyntaxError("The program has no main function.")
    helpers = needed(source, library)
    if not helpers and len(tree.body) == 1 and (main.name == name or main.name not in _loaded(main)):
        return _renamed(source, main, name)
    return _wrapped([text for text in (helpers, source) if text], main.name, name)


def _loaded(tree: ast.AST) -> set[str]:
    return {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)}


def _renamed(source: str, main: ast.FunctionDef, name: str) -> str:
    text = source.encode()
    start = sum(len(line) + 1 for line in text.split(b"\n")[: main.lineno - 1]) + main.col_offset
    found = re.compile(rb"def[\s\\]+" + re.escape(main.name.encode())).match(text, start)
    if found is None:  # decorated, or written in a way nobody writes
        raise ProgramSyntaxError(f"The beginning of {main.name} cannot be read.", line=main.lineno)
    edited = apply_edits(text, [(found.end() - len(main.name.encode()), found.end(), name.encode())])
    return edited.decode()


def _wrapped(texts: Sequence[str], main: str, name: str) -> str:
    """Everything inside one function; what was global there is the function's own."""
    body: list[str] = []
    shared: set[str] = set()
    bound: set[str] = set()
    for text in texts:
        tree = parse(text)
        shared |= {name for node in ast.walk(tree) if isinstance(node, ast.Global) for name in node.names}
        bound |= _bound_outside_functions(tree)
        body.append(_indented(_nonlocal(text, tree), tree))
    missing = [f"{_INDENT}{one} = None" for one in sorted(shared - bound)]
    return "\n".join([f"def {name}():", *missing, *body, f"{_INDENT}return (yield from {main}())"]) + "\n"


def _bound_outside_functions(tree: ast.Module) -> set[str]:
    found: set[str] = set()
    stack: list[ast.AST] = list(tree.body)
    while stack:
        node = stack.pop()
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            found.add(node.name)
        elif isinstance(node, ast.alias):
            found.add(node.asname or node.name)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            found.add(node.id)
        elif not isinstance(node, ast.Lambda):
            stack.extend(ast.iter_child_nodes(node))
    return found


def _nonlocal(text: str, tree: ast.Module) -> str:
    """`global` of a module is `nonlocal` of the function the module becomes."""
    content = text.encode()
    starts = [0]
    for line in content.split(b"\n"):
        starts.append(starts[-1] + len(line) + 1)
    places = [starts[n.lineno - 1] + n.col_offset for n in ast.walk(tree) if isinstance(n, ast.Global)]
    return apply_edits(content, [(place, place + len(b"global"), b"nonlocal") for place in places]).decode()


def _indented(text: str, tree: ast.Module) -> str:
    """Text one level deeper; lines inside texts that run over several lines stay as they are."""
    inside = {
        line
        for node in ast.walk(tree)
        if isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Constant) and isinstance(node.value, str))
        for line in range(node.lineno + 1, (node.end_lineno or node.lineno) + 1)
    }
    lines = text.strip("\n").split("\n")
    return "\n".join(
        line if number in inside or not line.strip() else _INDENT + line for number, line in enumerate(lines, start=1)
    )
