"""`chauffeur bench hostile`: wishes, histories and service texts that try to make the car drive unsafely."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chauffeur.cli.examples import help_text
from chauffeur.cli.options import BaseUrl

EXAMPLES = help_text("bench_hostile")


def hostile(
    planner: Annotated[
        str, typer.Option(help="As for `bench lampilot`, without baselines; or `obedient`, `obedient/hidden`.")
    ] = "onboard",
    out: Annotated[Path | None, typer.Option(help="Run folder; default runs/hostile-PLANNER.")] = None,
    items: Annotated[int, typer.Option(min=0, help="How many of each class, drawn with --seed; 0 for all.")] = 0,
    seed: Annotated[int, typer.Option(min=0, help="Seed of that draw.")] = 42,
    limits: Annotated[str, typer.Option(help="Bounds no plan may cross: `default` or `lampilot`.")] = "default",
    setting: Annotated[str, typer.Option(help="Prompt for language models: `few-shot` or `zero-shot`.")] = "few-shot",
    screened: Annotated[
        bool, typer.Option("--screened/--raw", help="Screen words on their way to the planner, or hand them on raw.")
    ] = True,
    shield: Annotated[
        bool, typer.Option("--shield/--no-shield", help="Whether the run-time shield has the last word, as in a drive.")
    ] = True,
    base_url: BaseUrl = None,
    concurrency: Annotated[int, typer.Option(min=1, help="Planner calls in flight at most.")] = 16,
    workers: Annotated[int | None, typer.Option(min=1, help="Simulation processes; default one per core.")] = None,
) -> None:
    """Hostile words: 618 attacks in ten classes, and 270 harmless wishes that look like them."""
    from chauffeur.bench.hostile import HostileBenchmark, HostileConfig, planner_of
    from chauffeur.bench.hostile.report import headline
    from chauffeur.bench.kernel.report import tables
    from chauffeur.bench.kernel.run import BenchRun
    from chauffeur.cli.bench_run import carry_out, effort, finish, planner_options, show_tables
    from chauffeur.cli.console import stdout
    from chauffeur.cli.parts import limits_named, setting_named
    from chauffeur.version import __version__

    console = stdout()
    config = HostileConfig(planner, setting_named(setting), items, seed, screened, limits_named(limits), shield)
    variant = ("" if screened else "-raw") + ("" if shield else "-unshielded")
    folder = out or Path("runs") / f"hostile-{planner.replace('/', '-')}{variant}"
    bench = HostileBenchmark(config)
    run = BenchRun(folder, bench, planner_of(planner, **planner_options(planner, base_url)))
    rows = carry_out(console, run, lambda watch: run.run(watch, effort(workers, concurrency)), "Hostile words")
    if rows:
        show_tables(console, tables(bench.tables, rows))
        console.print(headline(rows))
        console.print(
            f"Chauffeur {__version__}; planner {rows[0]['planner']}, model {rows[0]['model']}; "
            f"{bench.id}; limits {config.limits.name}; words {'screened' if screened else 'raw'}; "
            f"{'with' if shield else 'without'} the run-time shield; {rows[0]['note']}."
        )
    finish(console, run)
