"""`chauffeur bench lampilot`: a planner on every item of a DbLv1 folder; `merge` puts shards of a run together."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from chauffeur.cli.examples import help_text
from chauffeur.cli.lab.bench_plugin import BenchGroup
from chauffeur.cli.lab.bench_run import carry_out, effort, finish, show_tables
from chauffeur.cli.options import (
    BaseUrl,
    Concurrency,
    MaxRequests,
    MaxUsd,
    Price,
    RayCluster,
    ShardPart,
    Workers,
)
from chauffeur.cli.parts import planner_options
from chauffeur.concept import LAMPILOT_LIMITS

if TYPE_CHECKING:
    from rich.console import Console

    from chauffeur.bench.kernel.store import Row
    from chauffeur.bench.lampilot.runner import LampilotRun
    from chauffeur.planners.base import Planner

bench_app = typer.Typer(
    cls=BenchGroup,
    no_args_is_help=True,
    rich_markup_mode="markdown",
    help="Run a benchmark of the field. Results are simulated drives.",
)

EXAMPLES = help_text("bench")

PASSENGER_EXAMPLES = help_text("bench PASSENGER_EXAMPLES")

MERGE_EXAMPLES = help_text("bench MERGE_EXAMPLES")

_NAME: Final = 30
"""Longest planner name that leaves a table its columns; of a longer one the end is shown."""

MetricsOption = Annotated[
    str, typer.Option("--metrics", help="`origin` (LaMPilot's code) or `paper` (its equations as printed).")
]


@bench_app.callback()
def bench() -> None:
    """Benchmarks."""


@bench_app.command(epilog=EXAMPLES, short_help="LaMPilot-Bench: instructions, driven (Tab. IV).")
def lampilot(
    data: Annotated[Path, typer.Option(help="Folder with LaMPilot's DbLv1 task files.")],
    planner: Annotated[
        str,
        typer.Option(
            help="`onboard`, `keyword`, `openai/<model>`, `replay/<file>`, or the baselines `idm`, `mobil`, `expert`."
        ),
    ] = "onboard",
    out: Annotated[Path | None, typer.Option(help="Run folder; default runs/lampilot-PLANNER.")] = None,
    items: Annotated[int, typer.Option(min=0, help="How many items, drawn with --seed; 0 for all.")] = 0,
    seed: Annotated[int, typer.Option(min=0, help="Seed of that draw.")] = 42,
    setting: Annotated[
        str, typer.Option(help="Prompt for language models: `few-shot`, `zero-shot` or `human-feedback`.")
    ] = "few-shot",
    repository: Annotated[Path | None, typer.Option(help="Policy repository, for --setting human-feedback.")] = None,
    rehearse: Annotated[
        int, typer.Option(min=0, help="Try this many variants of each program on copies of the scene first.")
    ] = 0,
    shield: Annotated[
        bool, typer.Option("--shield", help="Let the run-time shield have the last word; LaMPilot has none.")
    ] = False,
    metrics: MetricsOption = "origin",
    base_url: BaseUrl = None,
    concurrency: Concurrency = 16,
    max_usd: MaxUsd = None,
    max_requests: MaxRequests = None,
    price: Price = None,
    workers: Workers = None,
    shard: ShardPart = None,
    ray: RayCluster = None,
) -> None:
    """LaMPilot-Bench (paper Tab. IV): completion, collisions and scores of a planner that follows instructions."""
    from chauffeur.bench.kernel.shards import WHOLE, Shard
    from chauffeur.bench.lampilot.policy_aid import HUMAN_FEEDBACK, aid_for
    from chauffeur.bench.lampilot.runner import LampilotRun, RunConfig
    from chauffeur.bench.lampilot.scenes import annotated
    from chauffeur.cli.console import stdout
    from chauffeur.cli.parts import setting_named
    from chauffeur.worlds.highway.dblv1 import load_dataset

    console = stdout()
    work = effort(workers, concurrency, max_usd, max_requests, price, ray)
    part = WHOLE if shard is None else Shard.parse(shard, os.environ)
    aid = aid_for(setting, repository, LAMPILOT_LIMITS)
    prompt = HUMAN_FEEDBACK if aid is not None else setting_named(setting)
    dataset, _ = annotated(load_dataset(data))
    variant = (f"-rehearsed-{rehearse}" if rehearse else "") + ("-shielded" if shield else "")
    folder = out or Path("runs") / f"lampilot-{planner.replace('/', '-')}{variant}"
    if part != WHOLE:
        folder = folder / part.folder
    asked = "" if aid is None else aid.id
    config = RunConfig(planner, prompt, dataset.sha256, items, seed, LAMPILOT_LIMITS, rehearse, asked, shield)
    run = LampilotRun(folder, dataset, config, _planner(planner, base_url), shard=part, requests=aid)
    rows = carry_out(console, run, lambda watch: run.run(watch, work, ruler=metrics), "LaMPilot-Bench")
    _show(console, run, rows)
    finish(console, run)


@bench_app.command(epilog=PASSENGER_EXAMPLES, short_help="Hand-written wishes: driven, asked, or refused.")
def passengers(
    planner: Annotated[str, typer.Option(help="As for `bench lampilot`.")] = "onboard",
    out: Annotated[Path | None, typer.Option(help="Run folder; default runs/passengers-PLANNER.")] = None,
    setting: Annotated[str, typer.Option(help="Prompt for language models: `few-shot` or `zero-shot`.")] = "few-shot",
    base_url: BaseUrl = None,
    concurrency: Concurrency = 16,
    workers: Workers = None,
) -> None:
    """Hand-written wishes with the right outcome each: driven, asked back about, or refused."""
    from chauffeur.bench.lampilot.runner import LampilotRun
    from chauffeur.bench.passengers import as_dataset, requests_of, run_config
    from chauffeur.cli.console import stdout
    from chauffeur.cli.parts import setting_named

    console = stdout()
    prompt = setting_named(setting)
    config = run_config(planner, prompt)
    folder = out or Path("runs") / f"passengers-{planner.replace('/', '-')}"
    run = LampilotRun(folder, as_dataset(), config, _planner(planner, base_url), requests=requests_of(prompt))
    work = effort(workers, concurrency)
    rows = carry_out(console, run, lambda watch: run.run(watch, work), "Wishes of passengers")
    _show(console, run, rows)
    finish(console, run)


def _planner(spec: str, base_url: str | None) -> Planner | None:
    """Who plans; None for the baselines."""
    from chauffeur.bench.lampilot.rollout import BASELINES
    from chauffeur.planners.registry import make_planner

    return None if spec in BASELINES else make_planner(spec, **planner_options(spec, base_url))


def _show(console: Console, run: LampilotRun, rows: list[Row]) -> None:
    from chauffeur.bench.kernel.report import tables
    from chauffeur.bench.lampilot.report import FAMILY_TABLE, SCORE_TABLE
    from chauffeur.version import __version__

    rated = [row for row, item in zip(rows, run.items, strict=True) if run.stages.asked(item)]
    if not rated:
        return
    if len(rated) < len(rows):
        console.print(f"Partial: the {len(rated)} of {len(rows)} items that were asked.")
    planner = run.config.planner if len(run.config.planner) <= _NAME else f"...{run.config.planner[3 - _NAME :]}"
    show_tables(console, tables((FAMILY_TABLE, SCORE_TABLE), rated, planner))
    model = f", model {run.manifest.model}" if run.manifest.model else ""
    labels = "".join(f"; {label}" for label in run.manifest.labels)
    console.print(
        f"Chauffeur {__version__}; planner {run.config.planner}{model}{labels}; "
        f"metrics {rows[0]['metrics']}; data sha256 {run.config.data_sha256[:12]}; draw seed {run.config.seed}; limits "
        f"{run.config.limits.name}; scores in points, rates in %; simulated drives (highway-env). Rows marked paper "
        "are its authors' own figures."
    )


@bench_app.command(epilog=MERGE_EXAMPLES, short_help="Put shards of a LaMPilot-Bench run together.")
def merge(
    out: Annotated[Path, typer.Argument(help="Folder for the whole run.")],
    shards: Annotated[list[Path], typer.Argument(help="Folders of all its shards.")],
    metrics: MetricsOption = "origin",
) -> None:
    """Put the shards of a LaMPilot-Bench run together, and score it as if it had been one."""
    from chauffeur.bench.kernel.report import tables
    from chauffeur.bench.lampilot.merge import merge_shards
    from chauffeur.bench.lampilot.report import FAMILY_TABLE
    from chauffeur.cli.console import stdout

    console = stdout()
    rows = merge_shards(out, shards, metrics)
    show_tables(console, tables((FAMILY_TABLE,), rows))
    console.print(f"{len(rows)} items of {len(shards)} shards, metrics {rows[0]['metrics']}.")
    console.print(f"Rows: {out / 'results.jsonl'}", soft_wrap=True)
