"""What all benchmark commands do alike: planner and engine, a live line, tables, and why a run stopped."""

from __future__ import annotations

import os
import time
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import typer

from chauffeur.cli.interrupts import stopped_kindly
from chauffeur.cli.parts import planner_options
from chauffeur.concept import ConfigError

if TYPE_CHECKING:
    from rich.console import Console

    from chauffeur.bench.kernel.report import ResultTable
    from chauffeur.bench.kernel.run import BenchRun, Effort
    from chauffeur.bench.kernel.stages import StageStore
    from chauffeur.bench.kernel.store import Row

_NAME: Final = 30
"""Longest planner name that leaves a table its columns; of a longer one the end is shown."""
UNFINISHED: Final = 3
"""Exit code of a run that stopped at its budget: the same command with a larger one goes on."""


def effort(given: Mapping[str, Any]) -> Effort:
    """How hard a run works. Raises ConfigError for options that contradict each other."""
    from functools import partial

    from chauffeur.bench.kernel.budget import Price, SpendingBudget
    from chauffeur.bench.kernel.engine import LocalEngine
    from chauffeur.bench.kernel.run import Effort
    from chauffeur.concept.needs import needs

    ray, price = given["ray"], given.get("price")
    if ray is not None and given["workers"] is not None:
        raise ConfigError("--workers is for this machine; a Ray cluster knows its own size.", hint="Leave one out.")
    engine: Any = LocalEngine
    if ray is not None:
        needs("cluster", "A Ray cluster", "ray")
        from chauffeur.bench.kernel.cluster import RayEngine

        engine = partial(RayEngine, ray)
    return Effort(
        workers=given["workers"] or 0,
        concurrency=given.get("concurrency", 16),
        budget=SpendingBudget(given.get("max_usd"), given.get("max_requests")),
        price=None if price is None else Price.parse(price),
        engine=engine,
    )


def run_named(name: str, make: Any, options: Mapping[str, Any], given: Mapping[str, Any]) -> None:
    """Run a benchmark, or go on with its run, and show what came of it.

    Args:
        name: Its own.
        make: Its class or function.
        options: The arguments of that.
        given: Options of its command, by which it is run.

    Raises:
        ConfigError: Options make no sense.
        Exit: The run stopped asking, or items failed for want of infrastructure; Ctrl-C leaves with code 130.
    """
    from chauffeur.bench.kernel.benchmark import asked_by, benchmark_from
    from chauffeur.bench.kernel.run import BenchRun
    from chauffeur.bench.kernel.shards import WHOLE, Shard
    from chauffeur.bench.kernel.stages import made_by
    from chauffeur.cli.console import stdout
    from chauffeur.cli.lab.bench_progress import shown

    console, work = stdout(), effort(given)
    part = WHOLE if given["shard"] is None else Shard.parse(given["shard"], os.environ)
    bench = benchmark_from(make, name, **options)
    planner = given.get("planner") or ("onboard" if bench.asks == "plans" else None)
    who = asked_by(bench, planner, **planner_options(planner or "", given.get("base_url")))
    variant = str(getattr(bench, "variant", ""))
    parts = [name, *([str(planner).replace("/", "-")] if planner else []), *([variant] if variant else [])]
    folder = given["out"] or Path("runs") / "-".join(parts)
    run = BenchRun(
        folder if part == WHOLE else folder / part.folder, bench, who, shard=part, made=made_by(name, options)
    )
    said = f", shard {part}" if part != WHOLE else ""
    said += f", planner {planner}" if planner else ""
    console.print(f"{bench.id}: {len(run.items)} items{said}, run folder {run.folder}", soft_wrap=True)
    for file, count in run.damaged.items():
        console.print(
            f"{file} has {count} damaged rows; they are set aside in {file}.damaged and their items are done again.",
            soft_wrap=True,
        )
    with stopped_kindly(console, run.folder), shown(console, time.monotonic) as watch:
        rows = run.run(watch, work)
    _show(console, run.stages, run.folder, rows, planner or "")
    _finish(console, run)


def merge_folders(out: Path, shards: Sequence[Path], name: str, make: Any, options: Mapping[str, Any]) -> None:
    """Merge the shards of a run of a benchmark, and show what comes of it.

    Raises:
        ConfigError, DataError: See merge_shards.
    """
    from chauffeur.bench.kernel.benchmark import benchmark_from
    from chauffeur.bench.kernel.merge import merge_shards
    from chauffeur.bench.kernel.stages import made_by
    from chauffeur.cli.console import stdout

    bench = benchmark_from(make, name, **options)
    stages, rows = merge_shards(out, shards, bench, made_by(name, options))
    console = stdout()
    _show(console, stages, out, rows, str(stages.manifest.config.get("planner", "")))
    console.print(f"{len(stages.manifest.items)} items of {len(shards)} shards.")
    console.print(f"Rows: {out / 'results.jsonl'}", soft_wrap=True)


def _show(console: Console, stages: StageStore[Any], folder: Path, rows: list[Row], planner: str) -> None:
    """The tables of a run, and what its benchmark says below them."""
    from chauffeur.bench.kernel.benchmark import Concludes
    from chauffeur.bench.kernel.report import ALL, tables
    from chauffeur.cli.console import plain

    if not rows:
        return
    asked = [item for item in stages.manifest.items if stages.asked(item)]
    if len(asked) < len(stages.manifest.items):
        console.print(f"Partial: the {len(asked)} of {len(stages.manifest.items)} items that were asked.")
    name = planner if len(planner) <= _NAME else f"...{planner[3 - _NAME :]}"
    show_tables(console, tables(stages.benchmark.tables, rows, name or ALL))
    if isinstance(stages.benchmark, Concludes):
        results = {item.id: stages.outcome(item).result for item in stages.manifest.items}
        for line in stages.benchmark.conclude(folder, rows, results):
            console.print(plain(line), soft_wrap=True)


def show_tables(console: Console, found: Iterable[ResultTable]) -> None:
    """The kernel's tables."""
    from chauffeur.cli.console import plain
    from chauffeur.cli.lab.tables import show_table

    for table in found:
        show_table(
            console, plain(table.spec.title), table.header, [[plain(c).plain for c in row] for row in table.cells]
        )
        for note in table.notes:
            console.print(plain(note), soft_wrap=True)
        console.print()


def _finish(console: Console, run: BenchRun) -> None:
    """What is left, and why; leaves with a code of its own where the run stopped asking."""
    from chauffeur.cli.failures import FAILED, show_error
    from chauffeur.concept import PlannerError
    from chauffeur.planners.llm_errors import TIMEOUT_VARIABLE

    if run.spoiled:
        console.print(f"{run.spoiled} items failed for want of infrastructure; the same command tries them again.")
    if run.repeated:
        console.print(
            f"{run.repeated} requests were sent again, word for word, after a time-out. A slow server wants a longer "
            f"{TIMEOUT_VARIABLE} or a smaller --concurrency."
        )
    console.print(f"Rows: {run.folder / 'results.jsonl'}", soft_wrap=True)
    if run.halt is None:
        return
    show_error(PlannerError(run.halt.why, hint=run.halt.hint))
    console.print(f"{run.unasked} of {len(run.items)} items have not been asked. What is done is kept in {run.folder}.")
    raise typer.Exit(UNFINISHED if run.halt.budget else FAILED)
