"""`chauffeur bench chaos`: drives in real time, with faults injected from the outside."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rich.console import Console

    from chauffeur.bench.chaos.runner import ChaosConfig
    from chauffeur.bench.kernel.store import Row

EXAMPLES = """
Examples:

    chauffeur bench chaos --items 1010 --out runs/chaos

    chauffeur bench chaos --kind policy-killed --kind planner-hangs --items 20 --out runs/kills

    chauffeur bench chaos --case 17

Every drive is simulated; processes, network, memory, disk and clock are real. Ctrl-C keeps the cases that were played;
the same command goes on.

Exit codes: 0 all safe and every wish answered, 1 something failed, 2 bad input, 130 Ctrl-C.
"""


def chaos(
    items: Annotated[int, typer.Option(min=1, help="How many cases.")] = 1010,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the suite.")] = 0,
    kind: Annotated[list[str] | None, typer.Option(help="A kind of fault, may be repeated; default all.")] = None,
    out: Annotated[Path | None, typer.Option(help="Run folder; default runs/chaos.")] = None,
    time_scale: Annotated[
        float, typer.Option(min=0.1, max=5.0, help="Seconds of the car's time in a second; 5 has periods of 20 ms.")
    ] = 5.0,
    realtime: Annotated[
        bool, typer.Option("--realtime/--no-realtime", help="Whether control asks for real-time scheduling.")
    ] = True,
    case: Annotated[int | None, typer.Option(min=0, help="Play this case alone, and show what happens.")] = None,
) -> None:
    """Break processes, models, memory, disk and clock while driving, and judge what the car did."""
    from chauffeur.bench.chaos.runner import ChaosConfig
    from chauffeur.cli.console import stdout

    console = stdout()
    config = ChaosConfig(items, seed, tuple(kind or ()), time_scale, realtime)
    if case is not None:
        _replay(console, config, case)
        return
    _run(console, config, out or Path("runs") / "chaos")


def _replay(console: Console, config: ChaosConfig, number: int) -> None:
    from chauffeur.bench.chaos.runner import replay
    from chauffeur.bench.chaos.table import failures
    from chauffeur.cli.console import plain
    from chauffeur.cli.failures import FAILED

    row = replay(config, number, lambda words: console.print(plain(words), soft_wrap=True))
    if row is None:
        console.print("The fault could not strike this time; try again.")
        raise typer.Exit(FAILED)
    console.print_json(json.dumps(row))
    if failures([row]):
        raise typer.Exit(FAILED)


def _run(console: Console, config: ChaosConfig, folder: Path) -> None:
    from chauffeur.bench.chaos.runner import ChaosRun
    from chauffeur.cli.bench_progress import shown

    run = ChaosRun(folder, config)
    console.print(
        f"Faults in real time: {config.cases:,} cases, seed {config.first}, run folder {folder}", soft_wrap=True
    )
    try:
        with shown(console, time.monotonic) as watch:
            rows = run.run(watch)
    except KeyboardInterrupt:
        console.print(f"Stopped. What is done is kept in {folder}; run the same command to go on.", soft_wrap=True)
        raise typer.Exit(130) from None
    _show(console, config, folder, rows)


def _show(console: Console, config: ChaosConfig, folder: Path, rows: list[Row]) -> None:
    import chauffeur
    from chauffeur.bench.chaos.results import write_results
    from chauffeur.bench.chaos.table import HEADER, failures, headline, lines
    from chauffeur.cli.console import plain
    from chauffeur.cli.failures import FAILED
    from chauffeur.cli.tables import show_table

    if not rows:
        console.print("No case could be played.")
        raise typer.Exit(FAILED)
    write_results(folder, config, rows)
    show_table(console, "Faults", HEADER, lines(rows))
    console.print()
    console.print(headline(rows))
    console.print(
        f"Chauffeur {chauffeur.__version__}; {rows[0]['suite']}; seed {config.first}; periods of "
        f"{100.0 / config.speed:g} ms; simulated drives, real processes. Table: {folder / 'table.md'}",
        soft_wrap=True,
    )
    if len(rows) < config.cases:
        console.print(f"{config.cases - len(rows)} cases could not be played: their fault found nothing to befall.")
    wrong = failures(rows)
    for line in wrong:
        console.print(plain(line), soft_wrap=True)
    if wrong:
        raise typer.Exit(FAILED)
