"""`chauffeur bench human`: a person drives the benchmark's scenarios from the keyboard."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chauffeur.cli.bench import MetricsOption
from chauffeur.concept import ConfigError

if TYPE_CHECKING:
    from rich.console import Console

    from chauffeur.bench.lampilot.human_run import HumanRun

EXAMPLES = """
Examples:

    chauffeur bench human --data DbLv1 --as ana

    chauffeur bench human --data DbLv1 --as ana --items 98

Each drive counts from the moment it is started and cannot be repeated. Ctrl-C, or closing the page, stops between
drives without loss; the same command goes on. The page is served on this machine only.
"""


_LONGEST_NAME = 60


def human(
    data: Annotated[Path, typer.Option(help="Folder with LaMPilot's DbLv1 task files.")],
    driver: Annotated[str, typer.Option("--as", help="Name of the person, shown with every result.")] = "anonymous",
    out: Annotated[
        Path | None, typer.Option(help="Run folder; default runs/lampilot-human, with the driver's name if given.")
    ] = None,
    items: Annotated[int, typer.Option(min=0, help="How many items, drawn with --seed; 0 for all.")] = 12,
    seed: Annotated[int, typer.Option(min=0, help="Seed of that draw.")] = 42,
    assist: Annotated[
        bool, typer.Option("--assist/--no-assist", help="Keep the lane while nobody steers; results are labelled so.")
    ] = False,
    metrics: MetricsOption = "origin",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port of the page; 0 takes a free one.")] = 0,
    browser: Annotated[bool, typer.Option("--open/--no-open", help="Open the page in the browser.")] = True,
) -> None:
    """LaMPilot-Bench driven by a person with the arrow keys (paper Tab. IV, row Human Driver), scored like the rest."""
    import asyncio

    from chauffeur.bench.kernel.store import sole_writer
    from chauffeur.bench.lampilot.human_run import HumanConfig, HumanRun
    from chauffeur.bench.lampilot.metrics import ruler_named
    from chauffeur.cli.console import stdout
    from chauffeur.worlds.highway.dblv1 import load_dataset

    console = stdout()
    name = " ".join(driver.split()) or "anonymous"
    if len(name) > _LONGEST_NAME:
        raise ConfigError(f"A driver's name has at most {_LONGEST_NAME} characters.", hint="Give a shorter --driver.")
    dataset = load_dataset(data)
    folder = out or Path("runs") / ("lampilot-human" if name == "anonymous" else f"lampilot-human-{_file_name(name)}")
    config = HumanConfig(name, assist, dataset.sha256, items, seed)
    with sole_writer(folder), closing(HumanRun(folder, dataset, config, ruler_named(metrics).id)) as run:
        try:
            if run.next_item() is not None:
                asyncio.run(_drive(run, port, browser, console))
        except KeyboardInterrupt:
            if run.next_item() is not None:
                run.score()
                here = f" With --items {run.done} it ends the run here." if run.done else ""
                console.print(
                    f"Stopped after {run.done} of {len(run.items)} drives; they are kept in {folder}. "
                    f"The same command goes on.{here}",
                    markup=False,
                )
                raise typer.Exit(130) from None
        _report(run, run.score(), console)


async def _drive(run: HumanRun, port: int, browser: bool, console: Console) -> None:
    import asyncio
    from datetime import UTC, datetime

    from chauffeur.hmi.wheel.pace import WallClock
    from chauffeur.hmi.wheel.server import serving
    from chauffeur.hmi.wheel.session import WheelSession

    session = WheelSession(run, WallClock(), lambda: datetime.now(UTC).isoformat(timespec="seconds"))
    async with serving(session, port) as server:
        console.print(
            f"{len(run.items) - run.done} drives to go, run folder {run.folder}. Drive in the browser:", markup=False
        )
        console.print(server.url, soft_wrap=True)
        if browser:
            typer.launch(server.url)
        await session.drive_all()
        await asyncio.sleep(1.0)  # the page hears that the run is done


def _report(run: HumanRun, rows: list[dict[str, object]], console: Console) -> None:
    from chauffeur.bench.lampilot.report import family_lines
    from chauffeur.cli.console import plain
    from chauffeur.cli.tables import show_table

    show_table(console, plain(", ".join(run.config.labels)), *family_lines(rows))
    rows_at = run.folder / "results.jsonl"
    console.print(f"Simulated drives (highway-env); ruler {run.ruler_id}. Rows: {rows_at}", markup=False)


def _file_name(name: str) -> str:
    return "".join(c if c.isalnum() else "-" for c in name.lower())
