"""`chauffeur bench lampilot`: a planner on every item of a DbLv1 folder."""

from __future__ import annotations

import os
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chauffeur.concept import LAMPILOT_LIMITS

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress, TaskID

bench_app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="markdown",
    help="Run a benchmark of the field. Results are simulated drives.",
)

EXAMPLES = """
Examples:

    chauffeur bench lampilot --data DbLv1 --planner onboard

    chauffeur bench lampilot --data DbLv1 --planner idm --out runs/idm

    chauffeur bench lampilot --data DbLv1 --planner openai/gpt-4o --setting zero-shot --items 98

The data set is LaMPilot's own (`DbLv1` in its public repository). Ctrl-C keeps what is done; the same command goes on.
"""


@bench_app.callback()
def bench() -> None:
    """Benchmarks."""


@bench_app.command(epilog=EXAMPLES)
def lampilot(
    data: Annotated[Path, typer.Option(help="Folder with LaMPilot's DbLv1 task files.")],
    planner: Annotated[
        str,
        typer.Option(help="`onboard`, `keyword`, `openai/<model>`, `replay/<file>`, or the baselines `idm`, `mobil`."),
    ] = "onboard",
    out: Annotated[Path | None, typer.Option(help="Run folder; default runs/lampilot-<planner>.")] = None,
    items: Annotated[int, typer.Option(min=0, help="How many items, drawn with --seed; 0 for all.")] = 0,
    seed: Annotated[int, typer.Option(min=0, help="Seed of that draw.")] = 42,
    workers: Annotated[int | None, typer.Option(min=1, help="Simulation processes; default one per core.")] = None,
    setting: Annotated[str, typer.Option(help="Prompt for language models: `few-shot` or `zero-shot`.")] = "few-shot",
    base_url: Annotated[str | None, typer.Option(help="OpenAI-compatible endpoint.")] = None,
    concurrency: Annotated[int, typer.Option(min=1, help="Planner calls in flight.")] = 8,
) -> None:
    """LaMPilot-Bench (seed Tab. IV): completion, collisions and scores of a planner that follows instructions."""
    import chauffeur
    from chauffeur.bench.lampilot.report import comparison_lines, family_lines
    from chauffeur.bench.lampilot.rollout import BASELINES
    from chauffeur.bench.lampilot.runner import RunConfig
    from chauffeur.cli.console import stdout
    from chauffeur.cli.parts import planner_named, setting_named
    from chauffeur.concept.registry import load_plugin
    from chauffeur.worlds.highway.dblv1 import load_dataset

    console = stdout()
    prompt = setting_named(setting)
    dataset = load_dataset(data)
    maker = None if planner in BASELINES else planner_named(planner, base_url)
    folder = out or Path("runs") / f"lampilot-{planner.replace('/', '-')}"
    config = RunConfig(planner, prompt, dataset.sha256, items, seed, LAMPILOT_LIMITS)
    run = load_plugin("chauffeur.benchmarks", "lampilot").open_run(folder, dataset, config, maker)
    console.print(f"LaMPilot-Bench: {len(run.items)} items, planner {planner}, run folder {folder}")
    with _progress(console) as (bar, tasks):

        def show(stage: str, done: int, total: int) -> None:
            if stage not in tasks:
                tasks[stage] = bar.add_task(stage, total=total)
            bar.update(tasks[stage], completed=done)

        try:
            rows = run.run(workers or os.cpu_count() or 1, show, concurrency)
        except KeyboardInterrupt:
            bar.stop()
            console.print(f"Stopped. What is done is kept in {folder}; run the same command to go on.")
            raise typer.Exit(130) from None
    _table(console, "By task family", *family_lines(rows))
    _table(
        console, "Beside the rows that the paper printed (its own items and machines)", *comparison_lines(planner, rows)
    )
    model = "" if maker is None else f", model {maker.model}"
    console.print(
        f"Chauffeur {chauffeur.__version__}; planner {planner}{model}; data sha256 {dataset.sha256[:12]}; "
        f"draw seed {seed}; limits {config.limits.name}; scores in points, rates in %; simulated drives "
        "(highway-env). Rows marked paper are its authors' own figures."
    )
    console.print(f"Rows: {folder / 'results.jsonl'}")


def _table(console: Console, title: str, header: Sequence[str], lines: Sequence[Sequence[str]]) -> None:
    from rich.table import Table

    table = Table(title=title, title_justify="left", box=None, pad_edge=False, padding=(0, 0, 0, 1))
    for i, name in enumerate(header):
        table.add_column(name.replace(" ", "\n"), justify="right" if i else "left", vertical="bottom", no_wrap=True)
    for line in lines:
        table.add_row(*line)
    console.print(table)
    console.print()


@contextmanager
def _progress(console: Console) -> Generator[tuple[Progress, dict[str, TaskID]]]:
    """Progress bars, one per stage."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description:>9}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console) as bar:
        yield bar, {}
