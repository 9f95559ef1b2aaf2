"""`chauffeur evaluate`: one planner on every benchmark that it can take, as one score card; and two cards compared."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from chauffeur.cli.lab.bench_run import UNFINISHED, effort
from chauffeur.cli.options import BaseUrl, BenchOptions, Concurrency, MaxRequests, MaxUsd, Price, Workers
from chauffeur.cli.parts import planner_options

if TYPE_CHECKING:
    from rich.console import Console

    from chauffeur.bench.evaluation.parts import PlannedPart, Profile
    from chauffeur.bench.kernel.pipeline import Watch
    from chauffeur.bench.kernel.run import BenchRun


def evaluate(
    benchmarks: Annotated[
        list[str] | None, typer.Argument(metavar="[BENCHMARK]...", help="Only these; default all that it can take.")
    ] = None,
    planner: Annotated[str, typer.Option(help="Who is evaluated: a planner or model, or MODULE:NAME.")] = "onboard",
    profile: Annotated[str, typer.Option(help="`quick`: a sample of each benchmark; `full`: all items.")] = "quick",
    compare: Annotated[
        tuple[Path, Path] | None, typer.Option(metavar="OLD NEW", help="Compare two score cards; nothing is run.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder of the card; default runs/evaluate-PLANNER-PROFILE.")] = None,
    option: BenchOptions = None,
    base_url: BaseUrl = None,
    concurrency: Concurrency = 16,
    max_usd: MaxUsd = None,
    max_requests: MaxRequests = None,
    price: Price = None,
    workers: Workers = None,
) -> None:
    """Run a planner on every benchmark that it can take, into one score card."""
    from chauffeur.bench.evaluation.parts import Evaluated
    from chauffeur.bench.evaluation.run import Evaluation
    from chauffeur.cli.console import stdout
    from chauffeur.cli.failures import FAILED
    from chauffeur.cli.lab.score_card import show_card, show_comparison

    console = stdout()
    if compare is not None:
        show_comparison(console, *compare)
        return
    asking = {"concurrency": concurrency, "max_usd": max_usd, "max_requests": max_requests, "price": price}
    work = effort({"workers": workers, "ray": None, **asking})
    who = Evaluated.of(planner, base_url or "", **planner_options(planner, None))
    name = planner.replace("/", "-").replace(":", "-")
    folder = out or Path("runs") / f"evaluate-{name}-{profile}"
    evaluation = Evaluation(who, folder, cast("Profile", profile), _options(option or []), benchmarks or ())
    runs = sum(one.benchmark is not None for one in evaluation.parts)
    console.print(f"{who.made.id}, profile {profile}, benchmarks to run: {runs}; folder {folder}", soft_wrap=True)
    try:
        card = evaluation.run(lambda part, run: _shown(console, part, run), work)
    except KeyboardInterrupt:
        console.print(f"Stopped. What is done is kept in {folder}; run the same command to go on.", soft_wrap=True)
        raise typer.Exit(130) from None
    show_card(console, card)
    console.print(f"Card: {folder / 'card.json'}, {folder / 'card.md'}", soft_wrap=True)
    if any(one.state == "partial" for one in card.entries):
        raise typer.Exit(UNFINISHED)
    named = [one for one in card.entries if one.name in (benchmarks or ())]
    if any(one.state == "failed" for one in card.entries) or any(one.state == "not run" for one in named):
        raise typer.Exit(FAILED)


@contextmanager
def _shown(console: Console, part: PlannedPart, run: BenchRun) -> Generator[Watch]:
    """A live line of a benchmark's run, beneath its name."""
    import time

    from chauffeur.cli.lab.bench_progress import shown

    console.print(f"{part.name}: {len(run.items)} items", style="bold")
    with shown(console, time.monotonic) as watch:
        yield watch


def _options(given: list[str]) -> dict[str, dict[str, Any]]:
    """Options of benchmarks, `NAME.OPTION=VALUE`, by benchmark. Raises ConfigError."""
    from chauffeur.cli.parts import named_values
    from chauffeur.concept import ConfigError

    found: dict[str, dict[str, Any]] = {}
    for name, value in named_values(given).items():
        bench, dot, own = name.partition(".")
        if not dot or not own:
            raise ConfigError(f"{name!r} names no benchmark.", hint="Write -o BENCHMARK.NAME=VALUE.")
        found.setdefault(bench, {})[own] = value
    return found
