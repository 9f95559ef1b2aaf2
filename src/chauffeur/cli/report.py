"""`chauffeur report`: what came of benchmark runs, as one page and Markdown."""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from chauffeur.cli.examples import help_text

if TYPE_CHECKING:
    from rich.console import Console

    from chauffeur.bench.report.build import Choices
    from chauffeur.bench.report.model import ReportTable

EXAMPLES = help_text("report")

_TABLES_ONLY: Final = "A page with comparisons and failures is made of runs of LaMPilot-Bench alone; of others, tables."


def report(
    runs: Annotated[
        list[Path],
        typer.Argument(metavar="RUN", help="Run folders of chauffeur bench; of others than lampilot, their tables."),
    ],
    out: Annotated[
        Path | None, typer.Option(help="Folder of the report; default `report` in the run, or beside several runs.")
    ] = None,
    metrics: Annotated[
        str | None, typer.Option(help="Score all runs by `origin` or `paper`; default the ruler they agree on.")
    ] = None,
    gallery: Annotated[
        int | None, typer.Option(min=0, help="Failures shown of each run; default up to 12, fewer of many runs.")
    ] = None,
    data: Annotated[
        Path | None, typer.Option(help="DbLv1 folder, to show the drives of runs that kept no scenes.")
    ] = None,
    inspect: Annotated[
        Path | None, typer.Option(metavar="FILE.eval", help="Also write the run as a log of Inspect AI (one run).")
    ] = None,
    browser: Annotated[bool, typer.Option("--open/--no-open", help="Open the page in the browser.")] = False,
) -> None:
    """Report runs of LaMPilot-Bench: scores with intervals, comparisons, costs, failures; of others, their tables."""
    from rich.padding import Padding
    from rich.text import Text

    from chauffeur.bench.report.build import Choices, build_report
    from chauffeur.bench.report.runs import tables_of_another
    from chauffeur.bench.report.text import render_markdown
    from chauffeur.cli.console import columns, path_text, plain, stdout
    from chauffeur.cli.parts import needs
    from chauffeur.concept import ConfigError
    from chauffeur.drive.files import publish
    from chauffeur.hmi.report_page import write_report_page

    if inspect is not None and len(runs) != 1:
        raise ConfigError("An Inspect log holds one run.", hint="Give --inspect with one RUN, once for each.")
    if inspect is not None:
        needs("inspect", "An Inspect log", "inspect_ai")
    console = stdout()
    others = {run: text for run in runs if (text := tables_of_another(run))}
    if len(others) == len(runs) and inspect is None:
        for run, text in others.items():
            console.print(plain(text), soft_wrap=True)
            console.print(Text.assemble("Figures with intervals: ", path_text(run / "report.json")))
        console.print(plain(_TABLES_ONLY))
        return
    choices = Choices(metrics or "", data, gallery)
    with _progress(console) as show:
        made = build_report(runs, choices, show)
    folder = out or (runs[0] if len(runs) == 1 else runs[0].resolve().parent) / "report"
    page = write_report_page(folder / "report.html", made)
    written = [("page", path_text(page))]
    content = render_markdown(made).encode("utf-8", "replace")
    written.append(("md", path_text(publish(folder / "report.md", content, "report"))))
    if inspect is not None:
        written.append(("inspect", path_text(_write_log(inspect, runs[0], choices))))
    for table in (made.table("scores"), made.table("pairs")):
        if table is not None:
            _show(console, table)
    console.print(plain(made.summary))
    for line in made.headlines:
        words = Text.assemble((plain(line.subject).plain, "bold"), ": ", plain(line.text))
        console.print(Padding(words, (0, 0, 0, 2)))
    for warning in made.warnings:
        console.print(Padding(Text.assemble(("Note: ", "bold yellow"), plain(warning)), (0, 0, 0, 2)))
    console.print(columns(written, indent=0))
    if browser:
        typer.launch(page.resolve().as_uri())


def _show(console: Console, table: ReportTable) -> None:
    """A table's own rows, without the paper's; intervals are in the files."""
    from chauffeur.bench.report.tables import said
    from chauffeur.cli.console import plain
    from chauffeur.cli.tables import show_table

    lines = [
        [plain(said(line.name, line.labels)).plain, *(cell.text for cell in line.cells)]
        for group in table.groups
        for line in group.lines
        if not line.published
    ]
    header = [table.first, *(f"{column.title} {column.unit}".strip() for column in table.columns)]
    show_table(console, plain(table.caption), header, lines)
    console.print()


def _write_log(path: Path, folder: Path, choices: Choices) -> Path:
    from chauffeur.bench.report.inspect_log import write_inspect_log
    from chauffeur.bench.report.rulers import under_one_ruler
    from chauffeur.bench.report.runs import load_runs

    (run,) = under_one_ruler(load_runs([folder]), choices.metrics)
    return write_inspect_log(path, run, choices.how)


@contextmanager
def _progress(console: Console) -> Generator[Callable[[str, int, int], None]]:
    """One bar for the part that takes time: driving failures again."""
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
