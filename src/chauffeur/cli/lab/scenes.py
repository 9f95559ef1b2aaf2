"""`chauffeur bench scenes`: scenes and instructions of our own, in LaMPilot's format."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Generator, Iterable
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from chauffeur.cli.examples import help_text
from chauffeur.cli.options import Processes, Seed

if TYPE_CHECKING:
    from rich.console import Console

scenes_app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="markdown",
    help="Make, check and count scenes with instructions.",
)

GENERATE_EXAMPLES = help_text("scenes GENERATE_EXAMPLES")

CHECK_EXAMPLES = help_text("scenes CHECK_EXAMPLES")

STATS_EXAMPLES = help_text("scenes STATS_EXAMPLES")

_LINE_EVERY_S: Final = 10.0
_SHOWN: Final = 20


@scenes_app.command(epilog=GENERATE_EXAMPLES)
def generate(
    out: Annotated[Path, typer.Option(help="Folder to write; a suite begun there is continued.")],
    items: Annotated[int, typer.Option(min=1, help="Items of the main suite.")] = 4900,
    seed: Seed = 0,
    extras: Annotated[
        int | None,
        typer.Option(
            min=0, help="Items beyond the original: hints, several steps, refusals, units. Default a fifth of --items."
        ),
    ] = None,
    avoid: Annotated[
        Path | None, typer.Option(help="DbLv1 folder whose instructions must not come up, e.g. LaMPilot's own.")
    ] = None,
    workers: Processes = None,
) -> None:
    """A suite of our own with the statistics of LaMPilot-Bench (paper Tab. III), split for training and testing."""
    from chauffeur.bench.lampilot.scenes.suite import Suite, SuiteConfig
    from chauffeur.cli.console import stdout
    from chauffeur.worlds.highway.dblv1 import load_dataset

    console = stdout()
    avoided = None if avoid is None else load_dataset(avoid)
    config = SuiteConfig(
        items, seed, items // 5 if extras is None else extras, "" if avoided is None else avoided.sha256
    )
    suite = Suite(out, config, avoided)
    try:
        with progress(console, "made") as show:
            manifest = suite.generate(workers or os.cpu_count() or 1, show)
    except KeyboardInterrupt:
        console.print(f"Stopped. {suite.made:,} items are kept in {out}; run the same command to go on.")
        raise typer.Exit(130) from None
    _summary(console, out, manifest)


QA_EXAMPLES = help_text("scenes QA_EXAMPLES")


@scenes_app.command(epilog=QA_EXAMPLES)
def qa(
    out: Annotated[Path, typer.Option(help="Folder to write; a set begun there is continued.")],
    scenes: Annotated[
        int, typer.Option(min=5, help="Scenes for training; validation and test have a fifth each.")
    ] = 1000,
    seed: Seed = 0,
    width: Annotated[int, typer.Option(min=48, help="Pictures' width, px.")] = 448,
    height: Annotated[int, typer.Option(min=32, help="Pictures' height, px.")] = 256,
    frames: Annotated[int, typer.Option(min=1, max=5, help="Instants of a scene that are rendered.")] = 4,
    pairs: Annotated[
        int, typer.Option(min=0, help="Free question-answer pairs for each fact of a training scene.")
    ] = 0,
    render: Annotated[bool, typer.Option("--render/--no-render", help="Render, or write words alone.")] = True,
    look: Annotated[
        str, typer.Option(help="Palette and lens of the test split: `default`, `held_out_a`...")
    ] = "default",
    sources: Annotated[
        str,
        typer.Option(help="`all`, `staged` streets, our `worlds`, or one: `highway`, `crossing`, `town`, `lot`."),
    ] = "all",
    front: Annotated[int, typer.Option(min=1, max=4, help="Times as wide and high as others: front pictures.")] = 1,
    workers: Processes = None,
) -> None:
    """Questions about pictures in NuPlanQA's format, from scenes of our own, that no trick can answer."""
    from chauffeur.bench.nuplanqa.scenes.gate import BOUND
    from chauffeur.bench.nuplanqa.scenes.making import SIMULATED, QaConfig, make_set
    from chauffeur.cli.console import stdout

    console = stdout()
    config = QaConfig(scenes, seed, width, height, frames, pairs, render, look, sources, front)
    try:
        with progress(console, "scenes") as show:
            made = make_set(out, config, workers or os.cpu_count() or 1, show)
    except KeyboardInterrupt:
        console.print(f"Stopped. What is rendered is kept in {out}; run the same command to go on.")
        raise typer.Exit(130) from None
    _table(console, ("Split", "Questions"), [(name, f"{count:,}") for name, count in made.questions.items()])
    console.print()
    lines = [(one.trick, f"{one.accuracy:.1%}", one.worst_told) for one in made.gate]
    _table(console, ("Test split answered from", "Right", "Worst subtask"), lines, right=(1,))
    console.print()
    console.print(SIMULATED)
    if not all(one.passes() for one in made.gate):
        console.print(f"The questions give themselves away: above {BOUND:.0%}. Make more scenes.")
        raise typer.Exit(1)
    console.print(f"Next: chauffeur bench nuplanqa --data {out / 'test'} --planner openai/MODEL", soft_wrap=True)


def _summary(console: Console, out: Path, manifest: dict[str, Any] | Any) -> None:
    scenes, words = manifest["scenes"]["main"], manifest["words"]
    console.print()
    _table(console, ("Folder", "Items", "SHA-256"), _folders(manifest))
    console.print()
    console.print(f"Scenes: {scenes['drawn']:,} drawn, {scenes['kept']:,} kept. Left out:")
    _table(console, ("", ""), [(why, f"{times:,}") for why, times in scenes["rejected"].items()])
    console.print()
    console.print("Wordings drawn, and thrown away because they were not read as what they say:")
    rows = [(name, f"{held['drawn']:,}", f"{held['rejected_share']:.1%}") for name, held in words.items()]
    _table(console, ("Family", "Drawn", "Thrown away"), rows)
    console.print()
    console.print(f"Next: chauffeur bench lampilot --data {out / 'test'} --planner onboard", soft_wrap=True)


def _folders(manifest: Any) -> list[tuple[str, str, str]]:
    hashes = manifest["sha256"]
    return [(name, f"{count:,}", hashes[name]["tasks"][:12]) for name, count in manifest["items"].items()]


@scenes_app.command(epilog=CHECK_EXAMPLES)
def check(
    data: Annotated[Path, typer.Argument(help="Suite, or any DbLv1 folder.")],
    workers: Processes = None,
    out: Annotated[Path | None, typer.Option(help="Write every fault as a JSON line.")] = None,
) -> None:
    """Drive every scene with the scripted expert, and read every instruction back."""
    from chauffeur.bench.lampilot.scenes.scene_check import check as look_over
    from chauffeur.bench.lampilot.scenes.scene_check import counts
    from chauffeur.cli.console import plain, stdout
    from chauffeur.driving.files import publish

    console = stdout()
    with progress(console, "checked") as show:
        items, faults = look_over(data, workers or os.cpu_count() or 1, show)
    if out is not None:
        lines = "".join(json.dumps(asdict(fault), ensure_ascii=False) + "\n" for fault in faults)
        publish(out, lines.encode(), "list of faults")
    if not faults:
        console.print(f"{items:,} items: every scene is solved by the expert, every instruction says its goal.")
        return
    console.print(f"{items:,} items, {len(faults):,} faults:")
    _table(console, ("What", "Why", "Times"), [(what, plain(why), f"{n:,}") for what, why, n in counts(faults)])
    console.print()
    for fault in faults[:_SHOWN]:
        said = f'  "{fault.text}"' if fault.text else ""
        console.print(plain(f"{fault.where}: {fault.why}{said}"), soft_wrap=True)
    if len(faults) > _SHOWN:
        console.print(f"... and {len(faults) - _SHOWN:,} more: add --out FILE.")
    raise typer.Exit(1)


@scenes_app.command(epilog=STATS_EXAMPLES)
def stats(data: Annotated[Path, typer.Argument(help="Suite, or any DbLv1 folder.")]) -> None:
    """The columns of Tab. III for any DbLv1 folder, next to the paper's. Extras of a suite are counted apart."""
    from chauffeur.bench.lampilot.scenes.scene_check import folders_of, statistics_of, table
    from chauffeur.cli.console import stdout
    from chauffeur.worlds.highway.dblv1 import load_dataset

    console = stdout()
    folders = folders_of(data)
    main = {name: folder for name, folder in folders.items() if not name.startswith("extras/")}
    loaded = [load_dataset(folder) for folder in main.values()]
    _table(console, ("Statistic", "Here", "Paper"), table(statistics_of(loaded)), right=(1, 2))
    if len(folders) > 1:
        console.print()
        counts = [(name, f"{len(load_dataset(folder).items()):,}") for name, folder in folders.items()]
        _table(console, ("Folder", "Items"), counts)


def _table(
    console: Console, headings: tuple[str, ...], rows: Iterable[tuple[Any, ...]], right: tuple[int, ...] = ()
) -> None:
    from rich.table import Table

    shown = Table(box=None, padding=(0, 2, 0, 0), header_style="bold", show_header=any(headings))
    for place, heading in enumerate(headings):
        last = place == len(headings) - 1 and place > 0
        justify = "right" if place in right or (last and not right) else "left"
        shown.add_column(heading, justify=justify, overflow="fold")
    for row in rows:
        shown.add_row(*row)
    console.print(shown)


@contextmanager
def progress(console: Console, what: str) -> Generator[Callable[[int, int], None]]:
    """A bar on a terminal, a line now and then elsewhere."""
    if not console.is_terminal:
        yield _lines(console, what)
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console) as bar:
        task = bar.add_task(what)

        def show(done: int, total: int) -> None:
            bar.update(task, completed=done, total=total)

        yield show


def _lines(console: Console, what: str) -> Callable[[int, int], None]:
    last_s = time.monotonic()

    def show(done: int, total: int) -> None:
        nonlocal last_s
        if done == total or time.monotonic() - last_s >= _LINE_EVERY_S:
            console.print(f"{done:,}/{total:,} {what}")
            last_s = time.monotonic()

    return show
