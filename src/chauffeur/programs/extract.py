"""From a model's answer to the program text in it. Reads text only; nothing is executed, and no text makes it raise."""

from __future__ import annotations

import ast
import re
import textwrap
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from chauffeur.foreign.fences import Block, fenced_blocks, marks_on_own_lines, without_blocks
from chauffeur.foreign.model_text import MAX_REPLY_CHARS
from chauffeur.foreign.numbers import plain_signs

_PYTHON_LABELS: Final = frozenset({"python", "py", "python3", "py3", "ipython", "python2"})
_PROGRAM_START: Final = re.compile(r"^(?:def |import math\b|from math import )", re.MULTILINE)
_DEFINITION: Final = re.compile(r"^[ \t]*def ", re.MULTILINE)
_MAX_TRIES: Final = 60
_MAX_BLOCKS: Final = 24
"""Blocks that are looked at; an honest answer has one or two."""


@dataclass(frozen=True, slots=True)
class Extracted:
    """An answer taken apart.

    Attributes:
        source: Program text, dedented; None when the answer holds none, or several.
        thoughts: What stands before and around it, without the program.
        several: Whether it holds different programs, of which nothing says which one is meant.
    """

    source: str | None
    thoughts: str
    several: bool = False


@dataclass(frozen=True, slots=True)
class _Piece:
    """A block that may be the program, or a part of it.

    Attributes:
        source: Its text, dedented.
        tree: Its syntax tree; None where it has none.
        defines: Functions that it defines.
        names: Every name in it.
        drives: Whether one of its functions is a generator.
    """

    source: str
    tree: ast.Module | None
    defines: frozenset[str]
    names: frozenset[str]
    drives: bool


def extract_program(answer: str) -> Extracted:
    """Take the program out of an answer, reasoning and later turns gone (`foreign.model_text`).

    The program is the block that defines the generator function: a block that only uses it is an example, one that
    defines a function which the program calls is joined in front of it, and the same program twice is one. Two
    different programs are none: the last is not better for being last. Without blocks the text itself may be the
    program, or the part of it that begins with `def` or `import math`.
    """
    text = marks_on_own_lines(answer[:MAX_REPLY_CHARS].replace("\r\n", "\n").replace("\r", "\n"))
    blocks = fenced_blocks(text)[:_MAX_BLOCKS]
    found = [(block, _piece(textwrap.dedent(block.body))) for block in blocks]
    candidates = [
        (block, piece)
        for block, piece in found
        if piece.defines or (block.label in _PYTHON_LABELS and piece.tree is None and _DEFINITION.search(piece.source))
    ]
    if any(block.label in _PYTHON_LABELS for block, _ in candidates):
        candidates = [(block, piece) for block, piece in candidates if block.label in (*_PYTHON_LABELS, "")]
    if not candidates:  # an answer of one block that is no definition: for the gate to explain
        candidates = [(block, piece) for block, piece in found if block.label in _PYTHON_LABELS][-1:]
    if candidates:
        return _of_blocks(text, candidates)
    whole = _piece(textwrap.dedent(text))
    return Extracted(whole.source, "") if whole.defines else _from_prose(text)


def _of_blocks(text: str, candidates: Sequence[tuple[Block, _Piece]]) -> Extracted:
    pieces = [piece for _, piece in candidates]
    used = frozenset(name for piece in pieces for name in piece.names - piece.defines)
    drivers = [piece for piece in pieces if piece.drives]
    mains = [piece for piece in drivers if not piece.defines & used] or drivers or pieces[-1:]
    if len({_same(piece) for piece in mains}) > 1:
        return Extracted(None, without_blocks(text, [block for block, _ in candidates]), several=True)
    main = mains[0]
    needed, helpers = set(main.names - main.defines), list[_Piece]()
    for piece in reversed(pieces):
        if piece is not main and piece.tree is not None and piece.defines & needed - main.defines:
            helpers.insert(0, piece)
            needed |= piece.names
    taken = [block for block, piece in candidates if piece in (main, *helpers) or _same(piece) == _same(main)]
    return Extracted("\n\n".join(piece.source for piece in (*helpers, main)), without_blocks(text, taken))


def _piece(source: str) -> _Piece:
    source = source.strip("\n") + "\n"
    tree = parse_quietly(source)
    if tree is None and not source.isascii():  # `−2`, `２２`, “left”, blanks that are none
        plain = plain_signs(source)
        tree = parse_quietly(plain)
        source = source if tree is None else plain
    if tree is None:
        return _Piece(source, None, frozenset(), frozenset(), drives="yield" in source)
    functions = [node for node in tree.body if isinstance(node, ast.FunctionDef)]
    names = frozenset(node.id for node in ast.walk(tree) if isinstance(node, ast.Name))
    drives = any(isinstance(node, ast.Yield | ast.YieldFrom) for function in functions for node in ast.walk(function))
    return _Piece(source, tree, frozenset(function.name for function in functions), names, drives)


def _same(piece: _Piece) -> str:
    """What two writings of one program have in common."""
    return piece.source if piece.tree is None else ast.dump(piece.tree)


def _from_prose(text: str) -> Extracted:
    start = _PROGRAM_START.search(text)
    if start is None:
        return Extracted(None, text.strip())
    lines = text[start.start() :].split("\n")
    for end in range(len(lines), max(0, len(lines) - _MAX_TRIES), -1):
        piece = _piece("\n".join(lines[:end]))
        if piece.defines:
            rest = "\n".join(lines[end:])
            thoughts = f"{text[: start.start()]}\n{rest}".strip()
            several = _PROGRAM_START.search(rest) is not None
            return Extracted(None if several else piece.source, thoughts, several)
    # It does not parse, but it is plainly meant as the program: hand it on, so that the gate can say what is wrong.
    return Extracted("\n".join(lines).rstrip("\n") + "\n", text[: start.start()].strip())


def parse_quietly(source: str) -> ast.Module | None:
    """Syntax tree of a text, or None when it has none. Never raises, never warns, never runs anything."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return ast.parse(source)
    except (SyntaxError, ValueError, RecursionError, MemoryError, OverflowError):
        return None
