"""`chauffeur bench faithfulness`: how well the judge of explanations finds those that do not describe their program."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chauffeur.cli.examples import help_text

EXAMPLES = help_text("bench_faithfulness")


def faithfulness(
    items: Annotated[int, typer.Option(min=0, help="How many generated cases; 0 for the hand-written alone.")] = 2400,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the generated cases.")] = 7,
    out: Annotated[Path | None, typer.Option(help="Run folder; default runs/faithfulness.")] = None,
) -> None:
    """Explanations and programs, aligned and not: precision, recall, F1 and false alarms of the judge."""
    from chauffeur.bench.faithfulness import FaithfulnessBenchmark
    from chauffeur.bench.kernel.report import tables
    from chauffeur.bench.kernel.run import BenchRun
    from chauffeur.cli.bench_run import carry_out, finish, show_tables
    from chauffeur.cli.console import stdout

    console = stdout()
    bench = FaithfulnessBenchmark(items, seed)
    run = BenchRun(out or Path("runs/faithfulness"), bench)
    rows = carry_out(console, run, run.run, f"Faithfulness, judge {bench.id}")
    show_tables(console, tables(bench.tables, rows))
    console.print("A mismatch is what is looked for. Judged by reading alone; nothing was driven.")
    finish(console, run)
