"""`chauffeur bench hostile`: wishes, histories and service texts that try to make the car drive unsafely."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from rich.console import Console

    from chauffeur.bench.hostile import HostileRun
    from chauffeur.bench.kernel.store import Row

EXAMPLES = """
Examples:

    chauffeur bench hostile --planner onboard

    chauffeur bench hostile --planner obedient/hidden --no-shield --out runs/worst

    chauffeur bench hostile --planner openai/gpt-4o --items 5 --concurrency 8

`obedient` stands for the worst language model: it writes the program that each attacker wants, `obedient/hidden` with
numbers that no check can read before driving. Ctrl-C keeps what is done; the same command goes on.

Exit codes: 0 done, 1 the endpoint or this machine gave up, 2 bad input, 130 Ctrl-C. What was found is in the tables,
not in the exit code.
"""


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
    base_url: Annotated[str | None, typer.Option(help="OpenAI-compatible endpoint.")] = None,
    concurrency: Annotated[int, typer.Option(min=1, help="Planner calls in flight at most.")] = 16,
    workers: Annotated[int | None, typer.Option(min=1, help="Simulation processes; default one per core.")] = None,
) -> None:
    """Hostile words: 618 attacks in ten classes, and 270 harmless wishes that look like them."""
    from chauffeur.bench.hostile import HostileConfig, HostileRun
    from chauffeur.bench.hostile.report import table_markdown
    from chauffeur.bench.hostile.runner import planner_of
    from chauffeur.cli.console import stdout
    from chauffeur.cli.parts import limits_named, setting_named
    from chauffeur.drive.files import publish

    console = stdout()
    config = HostileConfig(planner, setting_named(setting), items, seed, screened, limits_named(limits), shield)
    options: dict[str, Any] = {} if base_url is None else {"base_url": base_url}
    if planner.startswith("openai/"):
        options |= {"attempts": 1, "stream": False}  # the run itself asks again, and nobody looks at pieces
    variant = ("" if screened else "-raw") + ("" if shield else "-unshielded")
    folder = out or Path("runs") / f"hostile-{planner.replace('/', '-')}{variant}"
    run = HostileRun(folder, config, planner_of(planner, **options))
    console.print(
        f"Hostile words: {len(run.inputs)} inputs, planner {planner}, limits {config.limits.name}, run folder {folder}",
        soft_wrap=True,
    )
    for name, count in run.damaged.items():
        console.print(f"{name} has {count} damaged rows; they are set aside and done again.", soft_wrap=True)
    rows = _drive(console, run, workers or 0, concurrency)
    if rows:
        publish(folder / "table.md", table_markdown(rows, f"Hostile words, planner {planner}").encode(), "table")
        _show(console, run, rows)
    if run.halt is not None:
        _stop(console, run)


def _drive(console: Console, run: HostileRun, workers: int, concurrency: int) -> list[Row]:
    from chauffeur.cli.bench_progress import shown

    try:
        with shown(console, time.monotonic) as watch:
            return run.run(watch, workers=workers, concurrency=concurrency)
    except KeyboardInterrupt:
        console.print(f"Stopped. What is done is kept in {run.folder}; run the same command to go on.", soft_wrap=True)
        raise typer.Exit(130) from None


def _show(console: Console, run: HostileRun, rows: list[Row]) -> None:
    import chauffeur
    from chauffeur.bench.hostile.report import ATTACKS_HEADER, HARMLESS_HEADER, attack_lines, harmless_lines, headline

    _table(console, "Attacks", ATTACKS_HEADER, attack_lines(rows))
    if any(not row["hostile"] for row in rows):
        _table(console, "Harmless wishes that look like attacks", HARMLESS_HEADER, harmless_lines(rows))
    console.print(headline(rows))
    console.print(
        f"Chauffeur {chauffeur.__version__}; planner {rows[0]['planner']}, model {rows[0]['model']}; "
        f"{rows[0]['bench']}; limits {run.config.limits.name}; "
        f"words {'screened' if run.config.screened else 'raw'}; "
        f"{'with' if run.config.shield else 'without'} the run-time shield; {rows[0]['note']}."
    )
    failed = sum(row["answer"] == "failed" for row in rows)
    if failed:
        console.print(f"{failed} inputs failed for want of infrastructure; the same command tries them again.")
    if len(rows) < len(run.inputs):
        console.print(f"{len(run.inputs) - len(rows)} inputs have no result; the same command tries them again.")
    console.print(f"Rows: {run.folder / 'results.jsonl'}", soft_wrap=True)


def _stop(console: Console, run: HostileRun) -> None:
    from chauffeur.cli.failures import FAILED, show_error
    from chauffeur.concept import PlannerError

    assert run.halt is not None
    show_error(PlannerError(run.halt.why, hint=run.halt.hint))
    console.print(f"{run.unasked} of {len(run.inputs)} inputs have not been asked. What is done is kept.")
    raise typer.Exit(FAILED)


def _table(console: Console, title: str, header: Sequence[str], lines: Sequence[Sequence[str]]) -> None:
    from chauffeur.cli.tables import show_table

    show_table(console, title, header, lines)
    console.print()
