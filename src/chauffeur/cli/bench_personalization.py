"""`chauffeur bench personalization`: Talk2Drive's evaluation with simulated passengers."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chauffeur.cli.examples import help_text
from chauffeur.cli.options import BaseUrl, ShardPart

if TYPE_CHECKING:
    from rich.console import Console

    from chauffeur.bench.kernel.store import Row
    from chauffeur.bench.personalization.benchmark import StudyBenchmark

EXAMPLES = help_text("bench_personalization")


def personalization(
    planner: Annotated[
        str, typer.Option(help="Who plans without and with memory, e.g. `talk2drive` or `talk2drive/openai/MODEL`.")
    ] = "talk2drive",
    passengers: Annotated[int, typer.Option(min=1, help="How many simulated passengers.")] = 100,
    seed: Annotated[int, typer.Option(min=0, help="Seed of passengers, moods, words and order.")] = 1,
    trips: Annotated[int, typer.Option(min=0, help="Trips the memory learns from, for each task.")] = 5,
    half: Annotated[str, typer.Option(help="Wordings: `test`, or `tuning` to improve a planner.")] = "test",
    out: Annotated[Path | None, typer.Option(help="Run folder; default runs/personalization-PLANNER.")] = None,
    workers: Annotated[int, typer.Option(min=1, help="Simulation processes.")] = 1,
    shard: ShardPart = None,
    base_url: BaseUrl = None,
) -> None:
    """Takeover rates of simulated passengers (paper Tab. VIII, IX, X): keywords, Talk2Drive, and with memory."""
    from chauffeur.bench.kernel.run import BenchRun
    from chauffeur.bench.kernel.shards import WHOLE, Shard
    from chauffeur.bench.personalization.benchmark import StudyBenchmark, StudyConfig
    from chauffeur.cli.bench_run import carry_out, effort, finish
    from chauffeur.cli.console import stdout
    from chauffeur.cli.failures import FAILED
    from chauffeur.concept import ConfigError

    console = stdout()
    if half not in ("test", "tuning"):
        raise ConfigError(f"There are no wordings {half!r}.", hint="Write --half test or --half tuning.")
    part = WHOLE if shard is None else Shard.parse(shard, os.environ)
    folder = out or Path("runs") / f"personalization-{planner.replace('/', '-')}"
    config = StudyConfig(passengers, seed, planner, "test" if half == "test" else "tuning", trips)
    bench = StudyBenchmark(config, {} if base_url is None else {"base_url": base_url})
    run = BenchRun(folder if part == WHOLE else folder / part.folder, bench, shard=part)
    rows = carry_out(
        console, run, lambda watch: run.run(watch, effort(workers)), "Personalization, simulated passengers"
    )
    if rows:
        _show(console, bench, rows)
    finish(console, run)
    if run.spoiled:
        raise typer.Exit(FAILED)


def _show(console: Console, bench: StudyBenchmark, rows: list[Row]) -> None:
    from chauffeur.bench.kernel.report import tables
    from chauffeur.bench.personalization.figures import headline, latencies
    from chauffeur.cli.bench_run import show_tables
    from chauffeur.version import __version__

    show_tables(console, tables(bench.tables, rows))
    console.print(headline(rows), soft_wrap=True)
    p50, p95 = latencies(rows, "with")
    console.print(
        f"Chauffeur {__version__}; planner {bench.options.planner}, model {bench.model}; {bench.id}; "
        f"{bench.options.half} wordings; seed {bench.options.seed}; from words to policy {1000 * p50:.0f} ms (median), "
        f"{1000 * p95:.0f} ms (95 %). {bench.judge}",
        soft_wrap=True,
    )
