"""`chauffeur bench` with the name of any installed benchmark (`chauffeur.benchmarks`) without a command of its own."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Annotated, Any, Final

import typer
from typer.core import TyperGroup

from chauffeur.cli.bench_run import carry_out, effort, finish, planner_options, show_tables
from chauffeur.cli.options import BaseUrl, BenchOptions, ShardPart
from chauffeur.concept import ConfigError
from chauffeur.concept.registry import plugin_names

GROUP = "chauffeur.benchmarks"
_ABOUT: Final = {
    "instructions": "Commands driven closed loop: interactive parking and short drives (paper Tab. XIII).",
    "motion": "Gains for three manoeuvres in five kinds of weather: comfort, safety, alignment (paper Tab. XI).",
    "motion-passengers": "Takeovers of simulated passengers by directness and memory, with gains (paper Fig. 14-15).",
}
"""What our own are, without loading them: a list of commands must not import what they need."""


class BenchGroup(TyperGroup):
    """The commands written here, and one for each further benchmark that is installed."""

    def list_commands(self, ctx: Any) -> list[str]:
        known = super().list_commands(ctx)
        return [*known, *(name for name in plugin_names(GROUP) if name not in known)]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        command = super().get_command(ctx, cmd_name)
        if command is not None or cmd_name not in plugin_names(GROUP):
            return command
        app = typer.Typer(rich_markup_mode="markdown")
        app.command(cmd_name, help=_ABOUT.get(cmd_name) or f"The benchmark {cmd_name!r}, from an installed package.")(
            plugin
        )
        return typer.main.get_command(app)


def plugin(
    ctx: typer.Context,
    planner: Annotated[str, typer.Option(help="Who is asked: a planner, or a model for questions.")] = "onboard",
    option: BenchOptions = None,
    out: Annotated[Path | None, typer.Option(help="Run folder; default runs/NAME-PLANNER.")] = None,
    base_url: BaseUrl = None,
    concurrency: Annotated[int, typer.Option(min=1, help="Calls in flight at most.")] = 16,
    max_usd: Annotated[float | None, typer.Option(min=0.0, help="Budget of the run in USD.")] = None,
    max_requests: Annotated[int | None, typer.Option(min=0, help="Budget of the run in requests.")] = None,
    price: Annotated[str | None, typer.Option(help="USD per million tokens, IN/OUT, where it is not known.")] = None,
    workers: Annotated[int | None, typer.Option(min=1, help="Worker processes; default one per core.")] = None,
    shard: ShardPart = None,
    ray: Annotated[str | None, typer.Option(help="Work on a Ray cluster, as for `bench lampilot`.")] = None,
) -> None:
    """Run a benchmark of an installed package."""
    from chauffeur.bench.kernel.benchmark import make_benchmark
    from chauffeur.bench.kernel.report import tables
    from chauffeur.bench.kernel.run import BenchRun
    from chauffeur.bench.kernel.shards import WHOLE, Shard
    from chauffeur.cli.console import stdout
    from chauffeur.planners.registry import make_answerer, make_planner

    console = stdout()
    name = str(ctx.info_name)
    bench = make_benchmark(name, **options_of(option or []))
    make = {"plans": make_planner, "words": make_answerer}.get(bench.asks)
    who = None if make is None else make(planner, **planner_options(planner, base_url))
    part = WHOLE if shard is None else Shard.parse(shard, os.environ)
    folder = out or Path("runs") / (name if who is None else f"{name}-{planner.replace('/', '-')}")
    run = BenchRun(folder if part == WHOLE else folder / part.folder, bench, who, shard=part)
    work = effort(workers, concurrency, max_usd, max_requests, price, ray)
    rows = carry_out(console, run, lambda watch: run.run(watch, work), bench.id)
    show_tables(console, tables(bench.tables, rows))
    finish(console, run)


def options_of(given: list[str]) -> dict[str, Any]:
    """Options of the benchmark: numbers and truth values as JSON writes them, all else as text."""
    found: dict[str, Any] = {}
    for text in given:
        name, equals, value = text.partition("=")
        if not equals:
            raise ConfigError(f"{text!r} is no option.", hint="Write -o NAME=VALUE.")
        try:
            found[name] = json.loads(value)
        except ValueError:
            found[name] = value
    return found
