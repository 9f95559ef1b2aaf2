"""`chauffeur bench scenes frames` and `sft`: front pictures with motion, our own and nuScenes'."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chauffeur.cli.examples import help_text
from chauffeur.cli.options import Seed

FRAMES_EXAMPLES = help_text("scenes FRAMES_EXAMPLES")
SFT_EXAMPLES = help_text("scenes SFT_EXAMPLES")


def sft(
    data: Annotated[Path, typer.Argument(help="Folder with nuScenes' tables and `samples`.")],
    out: Annotated[Path, typer.Option(help="File to write, one line a frame.")],
    tables: Annotated[str, typer.Option(help="E.g. v1.0-mini; default the only ones there.")] = "",
    scene_list: Annotated[Path | None, typer.Option(help="File with the names of scenes, one a line.")] = None,
    stride: Annotated[int, typer.Option(min=1, help="Only every so many-th frame.")] = 1,
) -> None:
    """Frames as lines for chat fine-tuning, in the words of `bench openloop --setting sft`."""
    from chauffeur.bench.openloop import OpenLoopBenchmark
    from chauffeur.bench.openloop.requests import training_lines
    from chauffeur.cli.console import stdout
    from chauffeur.driving.files import publish

    bench = OpenLoopBenchmark(str(data), tables, "sft", scene_list=str(scene_list or ""), stride=stride)
    lines = [*training_lines((one for one in bench.samples if one.whole), data)]
    publish(out, "".join(lines).encode(), "lines for fine-tuning")
    stdout().print(f"{len(lines):,} lines in {out}; pictures are named below {data}.", soft_wrap=True)


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
    from chauffeur.cli.lab.scenes import progress
    from chauffeur.cli.lab.tables import show_table

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
