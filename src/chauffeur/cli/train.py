"""`chauffeur model train`, and `model gguf`: models of our own, from data that is made from a seed."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

train_app = typer.Typer(no_args_is_help=True, rich_markup_mode="markdown", help="Train models of our own.")

ONBOARD_EXAMPLES = """
Examples:

    chauffeur model train onboard --out runs/onboard

    chauffeur model train onboard --out runs/large --size large --steps 20000 --draws 60000

    chauffeur model train onboard --out runs/onboard --more 4000

    chauffeur model train onboard --out runs/wider --base runs/onboard --steps 8000

    chauffeur model train onboard --out runs/onboard --data-only

    chauffeur bench passengers --planner onboard/runs/onboard/model

Makes its own data first: scenes, programs that were driven in them, and words. The same seed gives the same data.
Ctrl-C keeps what is done; the same command goes on. It needs PyTorch and tokenizers: pip install 'chauffeur[models]'.
"""


@train_app.callback()
def train() -> None:
    """Models of our own."""


@train_app.command(epilog=ONBOARD_EXAMPLES)
def onboard(
    out: Annotated[Path, typer.Option(help="Folder of the run; one begun there is continued.")],
    seed: Annotated[int, typer.Option(min=0, help="Seed of everything.")] = 0,
    draws: Annotated[int, typer.Option(min=100, help="Scenes drawn; about six in ten become cases.")] = 22_000,
    per_case: Annotated[int, typer.Option(min=1, help="Wordings tried for each case.")] = 26,
    size: Annotated[str, typer.Option(help="`small` (an hour on two cores), `medium`, or `large` (GPU).")] = "small",
    steps: Annotated[int, typer.Option(min=1, help="Optimiser steps of 4,096 tokens.")] = 6_500,
    more: Annotated[
        int, typer.Option(min=0, help="Steps of a second round, its rate half as high; also for a finished run.")
    ] = 0,
    base: Annotated[
        Path | None,
        typer.Option(help="Finished run, or model that ships, whose network is trained on, at half the rate."),
    ] = None,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes that make data; default one per core.")] = None,
    data_only: Annotated[bool, typer.Option("--data-only", help="Make the data and stop.")] = False,
) -> None:
    """The on-board language model: words to driving programs, offline."""
    from chauffeur.cli.console import stdout
    from chauffeur.cli.parts import needs
    from chauffeur.cli.stages import stage_lines
    from chauffeur.models.onboard.pipeline import Plan, build_data, train_model

    if not data_only:  # half an hour of data first, and then nothing to train with, helps nobody
        needs("models", "Training", "torch", "transformers", "tokenizers", "onnx", "onnxscript", "safetensors")
        _check_size(size)
    console = stdout()
    plan = Plan(seed, draws, per_case, size, steps, more, base)
    told = stage_lines(console)
    try:
        build_data(out, plan, workers or os.cpu_count() or 1, told)
        if data_only:
            console.print(f"Data: {out / 'data'}; its card: {out / 'data' / 'DATA_CARD.md'}", soft_wrap=True)
            return
        model = train_model(out, plan, told)
    except KeyboardInterrupt:
        console.print(f"Stopped. What is done is kept in {out}; run the same command to go on.", soft_wrap=True)
        raise typer.Exit(130) from None
    console.print(f"Model: {model}. Try it: chauffeur bench passengers --planner onboard/{model}", soft_wrap=True)


def _check_size(size: str) -> None:
    from chauffeur.concept import ConfigError
    from chauffeur.models.onboard.training import SIZES

    if size not in SIZES:
        raise ConfigError(f"There is no size {size!r}.", hint=f"Sizes: {', '.join(SIZES)}.")


SORTERS_EXAMPLES = """
Examples:

    chauffeur model train sorters --out runs/sorters

    chauffeur model train sorters --out runs/sorters --measured

Two minutes, without PyTorch; with `--measured`, which leaves out a fifth of the writers in turn, about eight. The same
seed gives the same files; those that ship are of seed 0.
"""


@train_app.command(epilog=SORTERS_EXAMPLES)
def sorters(
    out: Annotated[Path, typer.Option(help="Folder for the two sorters and their card.")],
    seed: Annotated[int, typer.Option(min=0, help="Seed of everything.")] = 0,
    measured: Annotated[
        bool,
        typer.Option(
            "--measured", help="Also train without a fifth of the writers in turn, and say how it sorts theirs."
        ),
    ] = False,
) -> None:
    """The sorters of what passengers hint at, and of their remarks after a drive."""
    from chauffeur.cli.console import stdout
    from chauffeur.cli.stages import stage_lines
    from chauffeur.models.sorting.pipeline import make_sorters
    from chauffeur.models.sorting.training import Recipe

    console = stdout()
    try:
        card = make_sorters(out, Recipe(seed=seed), stage_lines(console), measured=measured)
    except KeyboardInterrupt:
        console.print(f"Stopped. Whole files are kept in {out}.", soft_wrap=True)
        raise typer.Exit(130) from None
    console.print(f"Sorters: {out / 'wishes.npz'}, {out / 'remarks.npz'}; their card: {card}", soft_wrap=True)


GGUF_EXAMPLES = """
Examples:

    chauffeur model gguf runs/onboard/transformers onboard.gguf

    chauffeur model gguf runs/onboard/transformers onboard-q8.gguf --eight-bit

    llama-server --model onboard.gguf --jinja --port 8080

    chauffeur drive "Take the left lane." --planner openai/onboard --base-url http://localhost:8080/v1
"""


def gguf(
    checkpoint: Annotated[Path, typer.Argument(help="Folder `transformers` of a run.")],
    file: Annotated[Path, typer.Argument(help="GGUF file to write.")],
    eight_bit: Annotated[bool, typer.Option("--eight-bit", help="Half the size: matrices in 8 bits (Q8_0).")] = False,
) -> None:
    """A trained model as one file for llama.cpp and what is built on it."""
    from chauffeur.cli.console import stdout
    from chauffeur.models.onboard.to_gguf import to_gguf

    written = to_gguf(checkpoint, file, eight_bit=eight_bit)
    stdout().print(f"Written: {written}, {written.stat().st_size / 1e6:.1f} MB", soft_wrap=True)
