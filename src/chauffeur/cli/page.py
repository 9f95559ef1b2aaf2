"""`chauffeur show page`: a recorded trip as a page, and as a strip of pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chauffeur.cli.examples import help_text

EXAMPLES = help_text("page")


def page(
    recording: Annotated[Path, typer.Argument(metavar="TRIP.mcap", help="The recorded trip.")],
    out: Annotated[Path | None, typer.Option(help="The page; default beside the recording.")] = None,
    filmstrip: Annotated[Path | None, typer.Option(help="Also write a PNG strip of the drive here.")] = None,
    pictures: Annotated[int, typer.Option(min=1, max=24, help="Pictures in that strip.")] = 6,
    foxglove: Annotated[Path | None, typer.Option(help="Also write a layout for Foxglove here (JSON).")] = None,
    browser: Annotated[bool, typer.Option("--open/--no-open", help="Open the page in the browser.")] = False,
) -> None:
    """Render a recorded trip as one self-contained HTML page."""
    from chauffeur.cli.console import columns, path_text, stdout
    from chauffeur.driving.recording import read_trip
    from chauffeur.hmi.page import write_page

    trip = read_trip(recording)
    if trip.note:
        stdout().print(trip.note, style="yellow")
    written = [("page", path_text(write_page(out or recording.with_suffix(".html"), trip)))]
    if filmstrip is not None:
        from chauffeur.hmi.filmstrip import write_filmstrip

        written.append(("filmstrip", path_text(write_filmstrip(filmstrip, trip, pictures))))
    if foxglove is not None:
        from chauffeur.hmi.document import asset

        foxglove.write_text(asset("foxglove-layout.json"), encoding="utf-8")
        written.append(("Foxglove layout", path_text(foxglove)))
    stdout().print(columns(written, indent=0))
    if browser:
        typer.launch((out or recording.with_suffix(".html")).resolve().as_uri())
