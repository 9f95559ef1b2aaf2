"""What all benchmark commands do alike: planner and engine, a live line, and why a run stopped."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, Final

import typer

from chauffeur.concept import ConfigError

if TYPE_CHECKING:
    from rich.console import Console

    from chauffeur.bench.kernel.report import ResultTable
    from chauffeur.bench.kernel.run import BenchRun, Effort
    from chauffeur.bench.kernel.store import Row

UNFINISHED: Final = 3
"""Exit code of a run that stopped at its budget: the same command with a larger one goes on."""


def effort(
    workers: int | None,
    concurrency: int = 16,
    max_usd: float | None = None,
    max_requests: int | None = None,
    price: str | None = None,
    ray: str | None = None,
) -> Effort:
    """How hard a run works. Raises ConfigError for options that contradict each other."""
    from functools import partial

    from chauffeur.bench.kernel.budget import Price, SpendingBudget
    from chauffeur.bench.kernel.engine import LocalEngine
    from chauffeur.bench.kernel.run import Effort
    from chauffeur.cli.parts import needs

    if ray is not None and workers is not None:
        raise ConfigError("--workers is for this machine; a Ray cluster knows its own size.", hint="Leave one out.")
    engine: Any = LocalEngine
    if ray is not None:
        needs("cluster", "A Ray cluster", "ray")
        from chauffeur.bench.kernel.cluster import RayEngine

        engine = partial(RayEngine, ray)
    return Effort(
        workers=workers or 0,
        concurrency=concurrency,
        budget=SpendingBudget(max_usd, max_requests),
        price=None if price is None else Price.parse(price),
        engine=engine,
    )


def carry_out(console: Console, run: BenchRun, work: Callable[[Any], list[Row]], title: str) -> list[Row]:
    """Announce a run and do it, with a live line; Ctrl-C leaves with code 130.

    Args:
        console: Where to.
        run: The run.
        work: Does it, given who watches.
        title: What it is called.
    """
    from chauffeur.cli.lab.bench_progress import shown

    shard = run.manifest.shard
    part = f", shard {shard}" if shard.count > 1 else ""
    planner = run.manifest.config.get("planner")
    asked = f", planner {planner}" if planner else ""
    console.print(f"{title}: {len(run.items)} items{part}{asked}, run folder {run.folder}", soft_wrap=True)
    for name, count in run.damaged.items():
        console.print(
            f"{name} has {count} damaged rows; they are set aside in {name}.damaged and their items are done again.",
            soft_wrap=True,
        )
    try:
        with shown(console, time.monotonic) as watch:
            return work(watch)
    except KeyboardInterrupt:
        console.print(f"Stopped. What is done is kept in {run.folder}; run the same command to go on.", soft_wrap=True)
        raise typer.Exit(130) from None


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


def finish(console: Console, run: BenchRun) -> None:
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
