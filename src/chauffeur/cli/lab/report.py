"""`chauffeur report`: what came of benchmark runs, as one page, Markdown and CSV."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chauffeur.cli.options import DrivesOf, Gallery


def report(
    runs: Annotated[
        list[Path], typer.Argument(metavar="RUN", help="Run folders of chauffeur bench, of one benchmark.")
    ],
    out: Annotated[
        Path | None, typer.Option(help="Folder of the report; default `report` in the run, or beside several runs.")
    ] = None,
    metrics: Annotated[
        str | None, typer.Option(help="Score runs of lampilot by `origin` or `paper`; default the ruler they agree on.")
    ] = None,
    gallery: Gallery = None,
    data: DrivesOf = None,
    inspect: Annotated[
        Path | None, typer.Option(metavar="FILE.eval", help="Also write the run as a log of Inspect AI (one run).")
    ] = None,
    browser: Annotated[bool, typer.Option("--open/--no-open", help="Open the page in the browser.")] = False,
) -> None:
    """Report runs of a benchmark: tables with intervals, comparisons, and the items that went wrong."""
    from rich.padding import Padding
    from rich.text import Text

    from chauffeur.bench.kernel.report import report_csv
    from chauffeur.bench.report.build import Choices, build_report, read_runs
    from chauffeur.bench.report.inspect_log import write_inspect_log
    from chauffeur.bench.report.text import render_markdown
    from chauffeur.bench.viewer.content import Content
    from chauffeur.bench.viewer.shelf import Shelf
    from chauffeur.cli.console import columns, path_text, plain, stdout
    from chauffeur.cli.lab.bench_run import show_tables
    from chauffeur.cli.lab.view import progress, write_page_of
    from chauffeur.concept import ConfigError
    from chauffeur.concept.needs import needs
    from chauffeur.driving.files import publish

    if inspect is not None and len(runs) != 1:
        raise ConfigError("An Inspect log holds one run.", hint="Give --inspect with one RUN, once for each.")
    if inspect is not None:
        needs("inspect", "An Inspect log", "inspect_ai")
    console = stdout()
    with progress(console) as show:
        made = build_report(runs, Choices(metrics or "", data, gallery), show)
    folder = out or (runs[0] if len(runs) == 1 else runs[0].resolve().parent) / "report"
    content = Content(Shelf([run.resolve() for run in runs]), data, metrics or "")
    page = write_page_of(console, content, folder / "report.html", gallery)
    written = [("page", path_text(page))]
    figures = report_csv((*made.tables, *made.pairs))
    for kind, text in (("md", render_markdown(made)), ("csv", figures)):
        path = publish(folder / f"report.{kind}", text.encode("utf-8", "replace"), "report")
        written.append((kind, path_text(path)))
    if inspect is not None:
        ((run,), cls) = read_runs(runs, metrics or "")
        written.append(("inspect", path_text(write_inspect_log(inspect, run, cls))))
    show_tables(console, (*made.tables[:1], *made.pairs, *made.tables[1:]))
    if made.judge:
        console.print(plain(f"Judge: {made.judge}"))
    for notice in made.notices:
        console.print(Padding(Text.assemble(("Note: ", "bold yellow"), plain(notice)), (0, 0, 0, 2)))
    console.print(columns(written, indent=0))
    if browser:
        typer.launch(page.resolve().as_uri())
