"""Programs like a given one: the same text with other numbers in it."""

from __future__ import annotations

import ast
from typing import Final

import numpy as np

from chauffeur.programs.errors import ProgramSyntaxError
from chauffeur.programs.rewrite import parse, unix_lines

_SHARE: Final = 0.5
"""Chance of each number to be changed in a variant."""
_TRIES: Final = 8
"""Draws for one variant: a draw may bring a text that is there already."""


def perturbed(source: str, count: int, seed: int, *, spread: float = 0.15) -> list[str]:
    """Variants of a program: speeds, gaps, headways, waits and thresholds changed by some `spread` of themselves.

    What is changed are the numbers of the text. Counts stay counts; 0, 1, -1 and numbers that are no quantity (indices,
    exponents, moduli, keywords of a slice) stay as they are. The gate is the business of whoever drives one.

    Args:
        source: Program text.
        count: How many texts, the program itself included, which comes first.
        seed: The same seed gives the same texts, and a smaller count the first of them.
        spread: Standard deviation of the change, as a share.

    Returns:
        Different texts, at most `count`: fewer where the program has not enough numbers.
    """
    text = unix_lines(source)
    try:
        numbers = _quantities(parse(text))
    except ProgramSyntaxError:
        return [source]
    out = [source]
    rng = np.random.default_rng([seed, len(text)])
    while len(out) < count and numbers:
        for _ in range(_TRIES):
            variant = _changed(text, numbers, rng, spread)
            if variant not in out and variant != text:
                out.append(variant)
                break
        else:
            break
    return out


def _quantities(tree: ast.Module) -> list[ast.Constant]:
    """Numbers of the text that may be changed, in its order."""
    fixed: set[int] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Subscript):
            fixed |= {id(inner) for inner in ast.walk(node.slice)}
        elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow | ast.Mod | ast.FloorDiv):
            fixed |= {id(inner) for inner in ast.walk(node.right)}
        elif isinstance(node, ast.JoinedStr):
            fixed |= {id(inner) for inner in ast.walk(node)}
    found = [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant)
        and type(node.value) in (int, float)
        and node.value not in (0, 1)
        and id(node) not in fixed
    ]
    return sorted(found, key=lambda node: (node.lineno, node.col_offset))


def _changed(text: str, numbers: list[ast.Constant], rng: np.random.Generator, spread: float) -> str:
    lines = [line.encode() for line in text.split("\n")]
    chances, factors = rng.random(len(numbers)), np.exp(rng.normal(0.0, spread, len(numbers)))
    for node, chance, factor in reversed(list(zip(numbers, chances, factors, strict=True))):
        if chance >= _SHARE or node.end_col_offset is None:
            continue
        value = node.value
        assert isinstance(value, int | float)
        new = max(1, round(value * factor)) if isinstance(value, int) else float(f"{value * factor:.4g}")
        line = lines[node.lineno - 1]
        lines[node.lineno - 1] = line[: node.col_offset] + repr(new).encode() + line[node.end_col_offset :]
    return b"\n".join(lines).decode()
