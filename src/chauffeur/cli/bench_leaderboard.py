"""`chauffeur bench leaderboard`: CARLA Leaderboard 1.0's routes, scenarios and scoring in a town."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chauffeur.cli.examples import help_text

EXAMPLES = help_text("bench_leaderboard")

_LANGUAGE = "Language planners"
_WHERE = "Where it runs"


def leaderboard(
    planner: Annotated[str, typer.Option(help="`expert`, `reckless`, `standing`, or a planner: `onboard`.")] = "expert",
    routes: Annotated[str, typer.Option(help="Route file (XML), or `own`.")] = "own",
    scenarios: Annotated[str, typer.Option(help="`public`, `ten` or `none`.")] = "public",
    triggers: Annotated[str, typer.Option(help="Trigger file or folder, where it is elsewhere.")] = "",
    seeds: Annotated[str, typer.Option(help="How many a route, from 0 on; or which: `11,12`.")] = "3",
    density: Annotated[float, typer.Option(min=0.0, help="Factor of the background traffic.")] = 1.0,
    people: Annotated[int, typer.Option(min=0, help="People on foot; the rules know none.")] = 0,
    scoring: Annotated[str, typer.Option(help="`lb1.0` or `lb2.1`.")] = "lb1.0",
    towns: Annotated[str, typer.Option(help="Only these towns, with commas between.")] = "",
    limit: Annotated[int, typer.Option(min=0, help="Only so many routes; 0 for all.")] = 0,
    shield: Annotated[
        bool, typer.Option("--shield/--no-shield", help="Whether the safety filter drives along.")
    ] = False,
    setting: Annotated[
        str,
        typer.Option(help="`zero-shot`, `few-shot` or `human-feedback`.", rich_help_panel=_LANGUAGE),
    ] = "few-shot",
    repository: Annotated[
        Path | None, typer.Option(help="For `human-feedback`; else what ships.", rich_help_panel=_LANGUAGE)
    ] = None,
    latency: Annotated[
        float | None,
        typer.Option(min=0.0, help="Seconds a plan takes; default what it took.", rich_help_panel=_LANGUAGE),
    ] = None,
    base_url: Annotated[str, typer.Option(help="OpenAI-compatible endpoint.", rich_help_panel=_LANGUAGE)] = "",
    out: Annotated[Path | None, typer.Option(help="Run folder; default runs/leaderboard-PLANNER.")] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Worker processes; default one per core.", rich_help_panel=_WHERE)
    ] = None,
    shard: Annotated[
        str | None,
        typer.Option(help="Only part i of n; without it, what shards have done is taken over.", rich_help_panel=_WHERE),
    ] = None,
    ray: Annotated[
        str | None, typer.Option(help="Work on a Ray cluster, as for `bench lampilot`.", rich_help_panel=_WHERE)
    ] = None,
) -> None:
    """CARLA Leaderboard 1.0 anywhere: RC, IP and DS over routes with traffic, lights and scenarios."""
    import os
    from collections import Counter

    from chauffeur.bench.kernel.report import tables
    from chauffeur.bench.kernel.run import BenchRun
    from chauffeur.bench.kernel.shards import WHOLE, Shard
    from chauffeur.bench.leaderboard.artefacts import write_artefacts
    from chauffeur.bench.leaderboard.benchmark import LeaderboardBenchmark
    from chauffeur.bench.leaderboard.results import NOT_DRIVEN, NOTE
    from chauffeur.bench.leaderboard.scoring import scoring_named
    from chauffeur.cli.bench_run import carry_out, effort, finish, show_tables
    from chauffeur.cli.console import stdout

    console = stdout()
    bench = LeaderboardBenchmark(
        routes,
        scenarios,
        triggers,
        planner,
        seeds,
        density,
        people,
        scoring_named(scoring),
        towns,
        limit,
        shield,
        setting,
        str(repository or ""),
        latency,
        base_url,
    )
    part = WHOLE if shard is None else Shard.parse(shard, os.environ)
    folder = out or Path("runs") / f"leaderboard-{planner.replace('/', '-')}"
    run = BenchRun(folder if part == WHOLE else folder / part.folder, bench, None, shard=part)
    work = effort(workers, ray=ray)
    rows = carry_out(console, run, lambda watch: run.run(watch, work), f"Leaderboard 1.0, {planner}")
    show_tables(console, tables(bench.tables, rows))
    undriven = Counter((row["infra_failed"], row["detail"]) for row in rows if row["engine"] == NOT_DRIVEN)
    for (infra, why), times in undriven.most_common():
        counted = "not counted" if infra else "counted as 0"
        console.print(f"Not driven, {counted}: {times} of {len(rows)}. {why}", style="yellow", soft_wrap=True)
    if rows:
        results = {item.id: run.stages.outcome(item).result for item in run.items}
        written = write_artefacts(run.folder, bench, rows, results)
        drawn = len(written) - 1
        maps = "1 route map" if drawn == 1 else f"{drawn} route maps"
        console.print(f"Official results: {written[0]}; {maps} beside it.", soft_wrap=True)
        console.print(NOTE)
    finish(console, run)
