"""`chauffeur view`: runs of benchmarks and recorded trips on one page, live or as one file."""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from chauffeur.cli.options import DrivesOf, Gallery

if TYPE_CHECKING:
    from rich.console import Console

    from chauffeur.bench.viewer.content import Content

_USUAL: Final = (Path("runs"), Path("trips"))


def view(
    folders: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[FOLDER]...", help="Where runs and trips lie; default ./runs and ./trips."),
    ] = None,
    export: Annotated[
        Path | None, typer.Option(metavar="FILE.html", help="Write all of it as one self-contained page instead.")
    ] = None,
    gallery: Gallery = None,
    data: DrivesOf = None,
    port: Annotated[int, typer.Option(min=0, max=65_535, help="Port of the page; 0 takes a free one.")] = 0,
    browser: Annotated[
        bool | None, typer.Option("--open/--no-open", help="Open the page in the browser.", show_default=False)
    ] = None,
) -> None:
    """Show runs of benchmarks and recorded trips on one page, while they run and afterwards."""
    import sys

    from chauffeur.bench.viewer.content import Content
    from chauffeur.bench.viewer.shelf import Shelf
    from chauffeur.cli.console import columns, path_text, stdout
    from chauffeur.concept import ConfigError, DataError

    given = folders or [folder for folder in _USUAL if folder.is_dir()]
    if not given:
        raise ConfigError(
            "There is no folder runs or trips here.", hint="Name the folders where your runs and trips lie."
        )
    for folder in given:
        if not folder.exists():
            raise DataError(f"No such folder: {folder}.", hint="Name folders with runs of chauffeur bench, or trips.")
    content = Content(Shelf([folder.resolve() for folder in given]), data)
    console = stdout()
    if export is None:
        _serve(console, content, port, sys.stdout.isatty() if browser is None else browser)
        return
    page = write_page_of(console, content, export, gallery)
    console.print(columns([("page", path_text(page))], indent=0))
    if browser:
        typer.launch(page.resolve().as_uri())


def write_page_of(console: Console, content: Content, path: Path, gallery: int | None) -> Path:
    """Write all that there is as one page.

    Raises:
        ConfigError: There is nothing to show.
        DataError: See `write_view`.
    """
    from chauffeur.bench.viewer.page import write_view
    from chauffeur.concept import ConfigError

    index = content.index()
    whole = {line["id"] for kind in ("runs", "trips") for line in index[kind] if "trouble" not in line}
    runs = [name for name in index["order"] if name in whole]
    trips = [line["id"] for line in index["trips"] if line["id"] in whole]
    if not runs and not trips:
        raise ConfigError("There is no run and no trip to show.", hint="Name folders with runs, or trips.")
    with progress(console) as show:
        return write_view(path, content, runs, trips, gallery, show)


def _serve(console: Console, content: Content, port: int, browser: bool) -> None:
    """Serve until Ctrl-C."""
    import asyncio
    import signal

    from chauffeur.bench.viewer.server import Viewer

    async def serve() -> None:
        viewer = Viewer(content)
        ended = asyncio.Event()
        loop = asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(number) != signal.SIG_IGN:
                loop.add_signal_handler(number, ended.set)
        async with viewer.serving(port):
            console.print(viewer.url, soft_wrap=True, markup=False, highlight=False)
            console.print("Ctrl-C ends it.", style="dim")
            if browser:
                typer.launch(viewer.url)
            await ended.wait()

    asyncio.run(serve())


@contextmanager
def progress(console: Console) -> Generator[Callable[[str, int, int], None]]:
    """One bar for the parts that take time: reading runs, and driving items again."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    with Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        console=console,
        transient=True,
    ) as bar:
        task = bar.add_task("reading runs", total=None)

        def show(what: str, done: int, total: int) -> None:
            bar.update(task, description=what, completed=done, total=total)

        yield show
