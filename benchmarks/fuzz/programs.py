"""Programs as inputs: where they begin, and changes that keep most of them programs.

An input is a program's text; behind a line `### library` stands the library it may call.
"""

from __future__ import annotations

import ast
import random
import sys
import warnings
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests" / "programs"))

from benign import BENIGN
from benign_python import BENIGN_PYTHON
from hostile import HOSTILE

from chauffeur.bench.lampilot.expert import expert_program
from chauffeur.programs import APIS
from fuzz.target import bytes_of, text_of

SEPARATOR = "\n### library\n"
MAX_CHARS = 6_000
"""Longer inputs only cost time; what is too long for the gate is refused before anything is read."""

_GOALS: tuple[dict[str, Any], ...] = (
    {"type": "ACCEvalbyDistance", "distance": 15},
    {"type": "ACCEvalbyDistance", "rel_distance": -13},
    {"type": "ACCEvalbySpeed", "speed": 10},
    {"type": "ACCEvalbySpeed", "rel_speed": -6},
    {"type": "LaneChangeEval", "direction": "left"},
    {"type": "OvertakeEval", "direction": "left"},
    {"type": "OvertakeEval", "direction": "right"},
    {"type": "PullOverEval"},
    {"type": "IntersectionEval", "direction": ["il1", "o1", 0]},
)
_LIBRARY = """
def wait(seconds):
    for _ in range(int(seconds / 0.1 + 0.5)):
        yield autopilot()

def clear_left():
    lane = get_left_lane(get_ego_vehicle())
    return lane is not None and is_safe_enter(lane, 2.0)
"""
_CALLER = """
def drive():
    yield from wait(0.3)
    if clear_left():
        set_target_lane(get_left_lane(get_ego_vehicle()))
    yield from wait(seconds=1)
"""
_TOKENS = (
    "yield ", "yield from ", "while True:\n        ", "for x in ", "if ", "else:\n        ", "lambda x: ",
    "try:\n    ", "except ValueError:\n        ", "finally:\n        ", "return", "break", "continue", "pass",
    "global ", "nonlocal ", "(", ")", "[", "]", "{", "}", ":", ",", ".", "=", " := ", "*", "**", "//", "%", "@",
    "->", "...", ";", "\\\n", "#", "None", "True", "'veh:1'", "'lane:a:b:1'", "f'{x!r:>{y}}'", "10 ** 9", "1e308",
    "-1", "0", "nan", "\n    ", "\n", "\t", "__tick__", "__class__", "math.", "import math\n", "async ", "await ",
    "match x:\n", "del ", "class A:\n", "\u2028", *(f"{name}(" for name in APIS),
)  # fmt: skip
_NUMBERS = (
    "0", "-0.0", "1", "0.1", "2.5", "30", "31.29", "99999999999999999999", "1e400", "5e-324", "1_000", "0x1f", "1j",
)  # fmt: skip
_CONSTANTS = (0, 1.5, -3, "a", None)


def split(data: bytes) -> tuple[str, str]:
    """An input as (program, library)."""
    program, _, library = text_of(data).partition(SEPARATOR)
    return program, library


@cache
def seeds() -> tuple[bytes, ...]:
    """The scripted expert's programs, and the tests' programs: benign, hostile and broken."""
    texts = [expert_program(goal) for goal in _GOALS]
    texts += [*BENIGN.values(), *BENIGN_PYTHON.values(), f"{_CALLER}{SEPARATOR}{_LIBRARY}"]
    texts += [hostile.source for hostile in HOSTILE if len(hostile.source) < MAX_CHARS]
    return tuple(dict.fromkeys(map(bytes_of, texts)))


def changed(data: bytes, rng: random.Random) -> bytes:
    """One or two changes of lines, tokens, numbers or whole expressions and statements."""
    text = text_of(data)
    for _ in range(rng.choice((1, 1, 2))):
        text = rng.choice(_CHANGES)(text, rng)
    return bytes_of(text[:MAX_CHARS])


def _spliced(text: str, rng: random.Random) -> str:
    other = text_of(rng.choice(seeds())).split("\n")
    lines = text.split("\n")
    cut, start = rng.randrange(len(lines) + 1), rng.randrange(len(other) + 1)
    if rng.random() < 0.5:
        return "\n".join(lines[:cut] + other[start : start + rng.randint(1, 5)] + lines[cut:])
    return "\n".join(lines[:cut] + other[start:])


def _line_moved(text: str, rng: random.Random) -> str:
    lines = text.split("\n")
    line = lines.pop(rng.randrange(len(lines)))
    kind = rng.random()
    if kind < 0.3 and lines:
        lines.insert(rng.randrange(len(lines)), line)
    elif kind < 0.6:
        lines.insert(rng.randrange(len(lines) + 1), " " * rng.choice((0, 4, 8, 12)) + line.lstrip())
        lines.insert(rng.randrange(len(lines) + 1), line)
    return "\n".join(lines)


def _token(text: str, rng: random.Random) -> str:
    at = rng.randrange(len(text) + 1)
    return text[:at] + rng.choice(_TOKENS) + text[at + rng.choice((0, 0, 1, 4)) :]


def _characters(text: str, rng: random.Random) -> str:
    at = rng.randrange(len(text) + 1)
    return text[:at] + text[at + rng.randint(1, 9) :]


def _grown(text: str, rng: random.Random) -> str:
    """Something nested deep or repeated often."""
    part = rng.choice(("(", "[", "-", "not ", "x = ", "1 + ", "yield autopilot()\n    ", "if 1:\n" + " " * 8))
    at = rng.randrange(len(text) + 1)
    return text[:at] + part * rng.randint(2, 120) + text[at:]


def _tree_changed(text: str, rng: random.Random) -> str:
    """An expression or statement exchanged for one of any seed, doubled, or taken out."""
    program, mark, library = text.partition(SEPARATOR)
    tree = _parsed(program)
    if tree is None:
        return _token(text, rng)
    nodes = list(ast.walk(tree))
    if rng.random() < 0.6:
        places = [
            (node, name, index)
            for node in nodes
            for name, value in ast.iter_fields(node)
            for index, item in enumerate(value if isinstance(value, list) else [value])
            if isinstance(item, ast.expr)
        ]
        if places:
            node, name, index = rng.choice(places)
            new = rng.choice(_pieces()[0]) if rng.random() < 0.8 else ast.Constant(rng.choice(_CONSTANTS))
            old = getattr(node, name)
            if isinstance(old, list):
                old[index] = new
            else:
                setattr(node, name, new)
    else:
        blocks = [
            block
            for node in nodes
            for _, block in ast.iter_fields(node)
            if isinstance(block, list) and block and isinstance(block[0], ast.stmt)
        ]
        if blocks:
            block = rng.choice(blocks)
            kind = rng.random()
            if kind < 0.5:
                block.insert(rng.randrange(len(block) + 1), rng.choice(_pieces()[1]))
            elif kind < 0.7:
                block.append(rng.choice(block))
            elif kind < 0.85 or len(block) > 1:
                block.pop(rng.randrange(len(block)))
                block or block.append(ast.Pass())
    try:
        return ast.unparse(tree) + mark + library
    except (ValueError, AttributeError, TypeError, RecursionError):
        return _token(text, rng)  # an expression cannot stand in the place of any other


def _number(text: str, rng: random.Random) -> str:
    places = [at for at, char in enumerate(text) if char.isascii() and char.isdigit()]
    if not places:
        return _token(text, rng)
    at = rng.choice(places)
    return text[:at] + rng.choice(_NUMBERS) + text[at + 1 :]


def _name(text: str, rng: random.Random) -> str:
    """One name put in the place of another."""
    tree = _parsed(text.partition(SEPARATOR)[0])
    names = sorted({node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}) if tree is not None else []
    if not names:
        return _token(text, rng)
    return text.replace(rng.choice(names), rng.choice([*names, *APIS]), rng.choice((1, 1, -1)))


_CHANGES = (_spliced, _line_moved, _token, _characters, _grown, _number, _name, *(5 * (_tree_changed,)))


def _parsed(program: str) -> ast.Module | None:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return ast.parse(program)
    except (SyntaxError, ValueError, RecursionError, MemoryError, OverflowError):
        return None


@cache
def _pieces() -> tuple[tuple[ast.expr, ...], tuple[ast.stmt, ...]]:
    """Every expression and every statement of the seeds, each once."""
    expressions: dict[str, ast.expr] = {}
    statements: dict[str, ast.stmt] = {}
    for node in _all_nodes():
        if isinstance(node, ast.expr):
            expressions.setdefault(ast.dump(node), node)
        elif isinstance(node, ast.stmt) and sum(1 for _ in ast.walk(node)) < 60:
            statements.setdefault(ast.dump(node), node)
    return tuple(expressions.values()), tuple(statements.values())


def _all_nodes() -> Iterator[ast.AST]:
    for seed in seeds():
        tree = _parsed(split(seed)[0])
        if tree is not None and len(seed) < 4_000:
            yield from ast.walk(tree)
