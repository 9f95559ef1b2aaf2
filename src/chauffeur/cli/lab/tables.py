"""Tables of results on the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text


def show_table(console: Console, title: str | Text, header: Sequence[str], lines: Sequence[Sequence[str]]) -> None:
    """Print a table: names at the left, numbers at the right, words of the head below one another.

    What is wider than the terminal goes on below, with the names again: no name and no number is lost.
    """
    from rich.table import Table

    for number, columns in enumerate(_bands(console.width, header, lines)):
        table = Table(
            title=None if number else title, title_justify="left", box=None, pad_edge=False, padding=(0, 0, 0, 1)
        )
        for i in columns:
            table.add_column(
                header[i].replace(" ", "\n"),
                justify="right" if i else "left",
                vertical="bottom",
                no_wrap=i > 0,
                overflow="fold",
                max_width=None if i else _names_width(console.width, header, lines),
            )
        for line in lines:
            table.add_row(*(line[i] if i < len(line) else "" for i in columns))
        if number:
            console.print()
        console.print(table)


def _width(column: int, header: Sequence[str], lines: Sequence[Sequence[str]]) -> int:
    """Terminal cells that a column takes."""
    from rich.cells import cell_len

    texts = [*header[column].split(" "), *(line[column] for line in lines if column < len(line))]
    return max((cell_len(part) for text in texts for part in text.split("\n")), default=0)


def _names_width(terminal: int, header: Sequence[str], lines: Sequence[Sequence[str]]) -> int:
    """Of the first column: long names are folded before they take more than half of the terminal."""
    return min(_width(0, header, lines), max(1, terminal // 2))


def _bands(terminal: int, header: Sequence[str], lines: Sequence[Sequence[str]]) -> list[list[int]]:
    """Columns that fit beside one another, the first, which names the rows, in each band."""
    names = _names_width(terminal, header, lines)
    bands, used = [[0]], names
    for column in range(1, len(header)):
        wide = 1 + _width(column, header, lines)
        if used + wide > terminal and len(bands[-1]) > 1:
            bands.append([0])
            used = names
        bands[-1].append(column)
        used += wide
    return bands
