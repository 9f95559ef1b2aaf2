"""From a model's reply to the program text in it. Reads text only; nothing is executed, and no text makes it raise."""

from __future__ import annotations

import ast
import re
import textwrap
import warnings
from dataclasses import dataclass
from typing import Final

MAX_REPLY_CHARS: Final = 200_000
"""A longer reply is cut: no honest plan is that long, and a model that babbles must not cost seconds."""

_FENCE: Final = re.compile(r"^[ \t]*(?P<marks>`{3,}|~{3,})[ \t]*(?P<label>[\w+.-]*)[^\n`]*$")
_PYTHON_LABELS: Final = frozenset({"python", "py", "python3"})
_PROGRAM_START: Final = re.compile(r"^(?:def |import math\b|from math import )", re.MULTILINE)
_MAX_TRIES: Final = 60


@dataclass(frozen=True, slots=True)
class Extracted:
    """A reply taken apart.

    Attributes:
        source: Program text, dedented; None when the reply holds none.
        thoughts: What stands before and around it, without the program: the model's reasoning.
    """

    source: str | None
    thoughts: str


@dataclass(frozen=True, slots=True)
class _Block:
    label: str
    body: str
    start: int
    end: int


def extract_program(reply: str) -> Extracted:
    """Take the program out of a model's reply.

    The last block fenced as Python wins, then the last other fenced block that defines a function, then the whole
    text if it is a program, then the part of the prose that begins with `def` or `import math`.
    """
    text = reply[:MAX_REPLY_CHARS].replace("\r\n", "\n").replace("\r", "\n")
    blocks = _fenced_blocks(text)
    candidates = [block for block in blocks if block.label in _PYTHON_LABELS]
    if not candidates:
        candidates = [block for block in blocks if _defines_function(textwrap.dedent(block.body))]
    if candidates:
        block = candidates[-1]
        return Extracted(textwrap.dedent(block.body).strip("\n") + "\n", _without(text, block.start, block.end))
    whole = textwrap.dedent(text).strip("\n") + "\n"
    if _defines_function(whole):
        return Extracted(whole, "")
    return _from_prose(text)


def _fenced_blocks(text: str) -> list[_Block]:
    blocks: list[_Block] = []
    opened: tuple[str, str, int, int] | None = None
    position = 0
    for line in text.split("\n"):
        end = position + len(line)
        match = _FENCE.match(line)
        if match is not None:
            marks, label = match["marks"], match["label"].lower()
            if opened is None:
                opened = (marks, label, position, end + 1)
            elif marks.startswith(opened[0]) and not label:
                blocks.append(_Block(opened[1], text[opened[3] : position], opened[2], end))
                opened = None
        position = end + 1
    if opened is not None:  # a reply cut off by its token limit, or a fence the model forgot to close
        blocks.append(_Block(opened[1], text[opened[3] :], opened[2], len(text)))
    return blocks


def _from_prose(text: str) -> Extracted:
    start = _PROGRAM_START.search(text)
    if start is None:
        return Extracted(None, text.strip())
    lines = text[start.start() :].split("\n")
    end = len(lines)
    for _ in range(_MAX_TRIES):
        source = "\n".join(lines[:end]).rstrip("\n") + "\n"
        if _defines_function(source):
            rest = "\n".join(lines[end:])
            return Extracted(source, f"{text[: start.start()]}\n{rest}".strip())
        end -= 1
        if end == 0:
            break
    # It does not parse, but it is plainly meant as the program: hand it on, so that the gate can say what is wrong.
    return Extracted("\n".join(lines).rstrip("\n") + "\n", text[: start.start()].strip())


def _without(text: str, start: int, end: int) -> str:
    return f"{text[:start].rstrip()}\n{text[end:].lstrip()}".strip()


def _defines_function(source: str) -> bool:
    tree = parse_quietly(source)
    return tree is not None and any(isinstance(node, ast.FunctionDef) for node in tree.body)


def parse_quietly(source: str) -> ast.Module | None:
    """Syntax tree of a text, or None when it has none. Never raises, never warns, never runs anything."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return ast.parse(source)
    except (SyntaxError, ValueError, RecursionError, MemoryError, OverflowError):
        return None
