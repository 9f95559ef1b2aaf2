"""Consoles and the small pieces every command prints with. What people and models wrote is printed as `Text`: never
as markup, and without control characters that could move the cursor or hide something."""

from __future__ import annotations

import sys
import unicodedata
from collections.abc import Iterable
from pathlib import Path

from rich.console import Console, RenderableType
from rich.table import Table
from rich.text import Text

_PIPED_WIDTH = 100


def stdout() -> Console:
    """Console of results: colour on a terminal only; piped, lines keep one width whatever the window."""
    return Console(highlight=False, width=None if sys.stdout.isatty() else _PIPED_WIDTH)


def stderr() -> Console:
    """Console of errors."""
    return Console(stderr=True, highlight=False, soft_wrap=True)


def plain(text: str) -> Text:
    """Foreign text as it may be shown on a terminal."""
    kept = (c for c in text if c in "\n\t" or unicodedata.category(c) not in ("Cc", "Cf"))
    return Text("".join(kept))


def columns(rows: Iterable[tuple[Text | str, RenderableType]], *, indent: int = 2) -> Table:
    """Two aligned columns without lines: a dim name and a value."""
    grid = Table.grid(padding=(0, 2, 0, 0))
    grid.add_column(style="dim", no_wrap=True)
    grid.add_column(overflow="fold")
    for name, value in rows:
        grid.add_row(Text(" " * indent) + (name if isinstance(name, Text) else Text(name)), value)
    return grid


def path_text(path: Path) -> Text:
    """A path that a terminal may make clickable."""
    return Text(str(path), style="cyan", overflow="fold")
