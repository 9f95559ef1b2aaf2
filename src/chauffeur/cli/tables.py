"""Tables of results on the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text


def show_table(console: Console, title: str | Text, header: Sequence[str], lines: Sequence[Sequence[str]]) -> None:
    """Print a table: names at the left, numbers at the right, words of the head below one another."""
    from rich.table import Table

    table = Table(title=title, title_justify="left", box=None, pad_edge=False, padding=(0, 0, 0, 1))
    for i, name in enumerate(header):
        table.add_column(name.replace(" ", "\n"), justify="right" if i else "left", vertical="bottom", no_wrap=True)
    for line in lines:
        table.add_row(*line)
    console.print(table)
