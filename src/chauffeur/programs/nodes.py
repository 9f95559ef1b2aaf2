"""All nodes of a program's tree, listed once: a dozen checks look at each of them."""

from __future__ import annotations

import ast
from typing import Final

_KEPT: Final = "_chauffeur_nodes"


def all_nodes(tree: ast.Module) -> tuple[ast.AST, ...]:
    """The nodes of `ast.walk`, in its order. The tree must not be changed afterwards."""
    kept: tuple[ast.AST, ...] | None = getattr(tree, _KEPT, None)
    if kept is None:
        kept = tuple(ast.walk(tree))
        setattr(tree, _KEPT, kept)
    return kept
