"""`chauffeur bench openloop` and `bench scenes frames`: three seconds ahead from one picture (paper Tab. XII), or six
with and without an instruction (doScenes)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from chauffeur.cli.examples import help_text
from chauffeur.cli.options import ASKING, MaxRequests, MaxUsd, Price, Seed

if TYPE_CHECKING:
    from rich.console import Console

    from chauffeur.bench.openloop.instructed import InstructedBenchmark

FRAMES = "Which frames"
EXAMPLES = help_text("bench_openloop")
FRAMES_EXAMPLES = help_text("bench_openloop FRAMES_EXAMPLES")


def openloop(
    data: Annotated[Path, typer.Option(help="Folder with nuScenes' tables and `samples`.")],
    planner: Annotated[
        str, typer.Option(help="The model: openai/NAME, transformers/FOLDER, vilad-frames or vilad-frames/FOLDER.")
    ] = "",
    tables_of: Annotated[str, typer.Option("--tables", help="E.g. v1.0-mini; default the only one.")] = "",
    instructions: Annotated[
        Path | None,
        typer.Option(help="doScenes' annotations (folder or file): 6 s ahead, with each instruction and without."),
    ] = None,
    setting: Annotated[str, typer.Option(help="`zero-shot`, `chain-of-thought` or `sft`.")] = "zero-shot",
    shown: Annotated[str, typer.Option(help="`pictures`, or `blank` (grey ones).")] = "pictures",
    scene_list: Annotated[
        Path | None, typer.Option(help="File with the names of scenes, one a line.", rich_help_panel=FRAMES)
    ] = None,
    side: Annotated[int, typer.Option(min=0, help="Longer side of the pictures in px; 0 as they are.")] = 448,
    stride: Annotated[int, typer.Option(min=1, help="Only every so many-th frame.", rich_help_panel=FRAMES)] = 1,
    limit: Annotated[
        int, typer.Option(min=0, help="Only the first so many frames; 0 for all.", rich_help_panel=FRAMES)
    ] = 0,
    write_sft: Annotated[
        Path | None, typer.Option(help="Write the frames as lines for chat fine-tuning, and stop.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Run folder; default runs/openloop-PLANNER.")] = None,
    base_url: Annotated[str | None, typer.Option(help="OpenAI-compatible endpoint.", rich_help_panel=ASKING)] = None,
    concurrency: Annotated[int, typer.Option(min=1, help="Calls in flight at most.", rich_help_panel=ASKING)] = 8,
    max_usd: MaxUsd = None,
    max_requests: MaxRequests = None,
    price: Price = None,
) -> None:
    """Waypoints over three seconds from a front picture and own motion, under five averagings (paper Tab. XII).

    With --instructions over six seconds, with what people would tell the car and without (doScenes).
    """
    from chauffeur.bench.kernel.report import tables
    from chauffeur.bench.kernel.run import BenchRun
    from chauffeur.bench.openloop import OpenLoopBenchmark
    from chauffeur.bench.openloop.frames import SIMULATED
    from chauffeur.bench.openloop.instructed import InstructedBenchmark
    from chauffeur.bench.openloop.requests import training_lines
    from chauffeur.cli.bench_run import carry_out, effort, finish, planner_options, show_tables
    from chauffeur.cli.console import stdout
    from chauffeur.concept import ConfigError
    from chauffeur.drive.files import publish
    from chauffeur.planners.registry import make_answerer

    console = stdout()
    if instructions is not None and write_sft is not None:
        raise ConfigError("--instructions is measured over 6 s.", hint="Leave out --write-sft.")
    options: dict[str, Any] = {
        "version": tables_of,
        "setting": "sft" if write_sft else setting,
        "shown": shown,
        "scenes": str(scene_list or ""),
        "side": side,
        "limit": limit,
        "every": stride,
    }
    bench = (
        OpenLoopBenchmark(str(data), **options)
        if instructions is None
        else InstructedBenchmark(str(data), str(instructions), **options)
    )
    if write_sft is not None:
        lines = [*training_lines((one for one in bench.samples if one.whole), data)]
        publish(write_sft, "".join(lines).encode(), "lines for fine-tuning")
        console.print(f"{len(lines):,} lines in {write_sft}; pictures are named below {data}.", soft_wrap=True)
        return
    if not planner:
        raise ConfigError("Nobody is asked.", hint="Name a model with --planner, e.g. openai/gpt-4o.")
    who = make_answerer(planner, **planner_options(planner, base_url))
    name = "openloop" if instructions is None else "openloop-instructed"
    parts = [name, planner.replace("/", "-"), *(one for one in (setting, shown) if one not in _USUAL)]
    run = BenchRun(out or Path("runs") / "-".join(parts), bench, who)
    work = effort(1, concurrency, max_usd, max_requests, price)
    rows = carry_out(console, run, lambda watch: run.run(watch, work), f"Open-loop planning ({bench.id})")
    show_tables(console, tables(bench.tables, rows))
    if isinstance(bench, InstructedBenchmark):
        _tell_instructed(console, bench, run.folder)
    elif bench.own:
        console.print(SIMULATED, soft_wrap=True)
    else:
        console.print("Commands are read off the true future, as ST-P3 and UniAD do: no input a car would have.")
    finish(console, run)


_USUAL = ("zero-shot", "pictures")
_SHOWN = 20
"""Lines of what was left out on the console; all are in the run folder."""


def _tell_instructed(console: Console, bench: InstructedBenchmark, folder: Path) -> None:
    """What was asked about, what of the annotations was not, and what the figures are of."""
    from chauffeur.bench.kernel.run import write_results
    from chauffeur.bench.openloop.frames import SIMULATED

    left_out = bench.left_out
    for line in left_out[:_SHOWN]:
        console.print(line, soft_wrap=True, markup=False)
    if len(left_out) > _SHOWN:
        console.print(f"... and {len(left_out) - _SHOWN} more, in {folder / 'left_out.txt'}.", soft_wrap=True)
    if left_out:
        write_results(folder, {"left_out.txt": "".join(f"{line}\n" for line in left_out)})
    console.print(
        "Gain: error without the instruction minus error with it, same model and scene. Annotators had seen the whole "
        "scene: an instruction is privileged, and may be about what comes after the 6 s. No navigation is shown.",
        soft_wrap=True,
    )
    if bench.own:
        console.print(SIMULATED, soft_wrap=True)


def frames(
    out: Annotated[Path, typer.Option(help="Folder to write; a set begun there is continued.")],
    trips: Annotated[
        int, typer.Option(min=8, help="Trips for training; validation has an eighth, the test split a quarter.")
    ] = 160,
    seed: Seed = 0,
    width: Annotated[int, typer.Option(min=32, help="Pictures' width, px.")] = 160,
    height: Annotated[int, typer.Option(min=32, help="Pictures' height, px.")] = 96,
    seconds: Annotated[float, typer.Option(min=10.0, help="Of a trip in town, at most.")] = 80.0,
    most: Annotated[int, typer.Option(min=6, help="Frames kept of a trip, at most.")] = 60,
    towns: Annotated[
        str,
        typer.Option(help="Towns of training and validation, by their packs' names with commas between; four of ours."),
    ] = "",
) -> None:
    """Front pictures of our own traffic with 2 s of motion before and 3 s after them, in nuScenes' format."""
    from chauffeur.bench.openloop.driving import TOWNS
    from chauffeur.bench.openloop.extrapolation import FUTURE_KINDS
    from chauffeur.bench.openloop.frames import SIMULATED, FramesConfig, make_frames
    from chauffeur.cli.console import stdout
    from chauffeur.cli.scenes import progress
    from chauffeur.cli.tables import show_table

    console = stdout()
    config = FramesConfig(
        trips,
        seed,
        width,
        height,
        seconds,
        most,
        tuple(one.strip() for one in towns.split(",") if one.strip()) or TOWNS,
    )
    try:
        with progress(console, "trips") as show:
            counts = make_frames(out, config, show)
    except KeyboardInterrupt:
        console.print(f"Stopped. Whole trips are kept in {out}; run the same command to go on.")
        raise typer.Exit(130) from None
    lines = [(kind, *(f"{counts[split].get(kind, 0):,}" for split in counts)) for kind in FUTURE_KINDS]
    show_table(console, "Frames by what happens next", ("next", *counts), lines)
    console.print(SIMULATED, soft_wrap=True)
    console.print(f"Next: chauffeur model train vilad-frames --data {out} --out runs/frames", soft_wrap=True)
