"""The one way to the terminal: consoles and the small pieces every command prints with.

Much of what is shown comes from elsewhere: models, programs, planners of third parties, servers, recordings, memory. On
its way out no text is markup, and nothing in it can move the cursor, hide something or make a link: whatever a console
from here prints has gone through `printable`, whichever command prints it.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import typer
from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.table import Table
from rich.text import Text

from chauffeur.cli.printable import printable

_PIPED_WIDTH = 100


class Screen(Console):
    """A console that prints text as text: no markup, no emoji codes, nothing but what is `printable`.

    Colours, links and cursor moves are added behind `render`, from styles and controls that are this program's own.
    """

    def __init__(self, **options: Any) -> None:
        chosen: dict[str, Any] = {"markup": False, "emoji": False, "highlight": False, **options}
        super().__init__(**chosen)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """As rich renders it, made printable."""
        for segment in super().render(renderable, options):
            if segment.control or segment.text.isprintable():
                yield segment
            else:
                yield Segment(printable(segment.text), segment.style)


def stdout() -> Console:
    """Console of results: colour on a terminal only; piped, lines keep one width whatever the window."""
    return Screen(width=None if sys.stdout.isatty() else _PIPED_WIDTH)


def stderr() -> Console:
    """Console of errors."""
    return Screen(stderr=True, soft_wrap=True)


def echo(text: str) -> None:
    """Print a line to standard output as it is, unwrapped, to be copied or read by a program."""
    typer.echo(printable(text))


def plain(text: str) -> Text:
    """Foreign text, printable before it is laid out, so that columns fit."""
    return Text(printable(text))


def columns(rows: Iterable[tuple[Text | str, RenderableType]], *, indent: int = 2) -> Table:
    """Two aligned columns without lines: a dim name and a value."""
    grid = Table.grid(padding=(0, 2, 0, 0))
    grid.add_column(style="dim", no_wrap=True)
    grid.add_column(overflow="fold")
    for name, value in rows:
        grid.add_row(Text(" " * indent) + (name if isinstance(name, Text) else Text(name)), value)
    return grid


def table(headings: Sequence[str], rows: Iterable[Sequence[RenderableType]], *, right: Sequence[str] = ()) -> Table:
    """A table without lines below bold headings; the columns called so in `right` hold numbers."""
    shown = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="bold")
    for heading in headings:
        shown.add_column(heading, justify="right" if heading in right else "left", overflow="fold")
    for row in rows:
        shown.add_row(*row)
    return shown


def path_text(path: Path) -> Text:
    """A path that a terminal may make clickable."""
    return Text(str(path), style="cyan", overflow="fold")
