"""Worlds say what they can do; nobody else knows them by their names."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

SOURCES = Path(__file__).parents[2] / "src" / "chauffeur"
NAMES = {"highway", "intersection", "parking", "ros", "track", "town", "carla"}

_OTHERS = ("situation", "lane", "plan", "self", "surface")
"""Whose `world` or `kind` is none of a world: a situation's words, what a lane is for, how a street is drawn."""


def _compared(tree: ast.AST) -> Iterator[ast.Compare]:
    """Comparisons of somebody's `world` or `kind` with a world's name; not of a lane's kind, or a situation's word."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.Compare):
            continue
        sides = [node.left, *node.comparators]
        names = {c.value for side in sides for c in ast.walk(side) if isinstance(c, ast.Constant)}
        asked = [side for side in sides if isinstance(side, ast.Attribute) and side.attr in ("world", "kind")]
        described = all(any(word in ast.unparse(side.value) for word in _OTHERS) for side in asked)
        if asked and not described and any(isinstance(name, str) and name in NAMES for name in names):
            yield node


def test_nothing_outside_the_worlds_compares_a_worlds_name() -> None:
    found = [
        f"{path.relative_to(SOURCES)}:{node.lineno}: {ast.unparse(node)}"
        for path in SOURCES.rglob("*.py")
        if not path.is_relative_to(SOURCES / "worlds")
        for node in _compared(ast.parse(path.read_text(encoding="utf-8")))
    ]
    assert found == [], "ask the world's capabilities or the road graph"


@pytest.mark.parametrize("source", ["scenario.world == 'parking'", "shot.kind in ('highway', 'town')"])
def test_such_a_comparison_is_found(source: str) -> None:
    assert len(list(_compared(ast.parse(source)))) == 1


LAMPILOTS_OWN = ("bench/lampilot/", "bench/report/redrive.py", "models/onboard/")
"""What is LaMPilot's: its goals are read on its roads, its rows driven again."""


def test_worlds_are_made_by_their_registered_names() -> None:
    made = {
        str(path.relative_to(SOURCES))
        for path in SOURCES.rglob("*.py")
        if not path.is_relative_to(SOURCES / "worlds") and "HighwayWorld()" in path.read_text(encoding="utf-8")
    }
    assert {path for path in made if not path.startswith(LAMPILOTS_OWN)} == set()
