"""`chauffeur model train`: models of our own, from data that is made from a seed."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from chauffeur.cli.examples import help_text
from chauffeur.cli.options import RunFolder, Seed, WeightsSeed

train_app = typer.Typer(no_args_is_help=True, rich_markup_mode="markdown", help="Train models of our own.")

ONBOARD_EXAMPLES = help_text("train ONBOARD_EXAMPLES")


@train_app.callback()
def train() -> None:
    """Models of our own."""


@train_app.command(epilog=ONBOARD_EXAMPLES)
def onboard(
    out: RunFolder,
    seed: Seed = 0,
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
    from chauffeur.cli.lab.stages import stage_lines
    from chauffeur.cli.parts import needs
    from chauffeur.models.onboard.pipeline import PipelinePlan, build_data, train_model

    if not data_only:  # half an hour of data first, and then nothing to train with, helps nobody
        needs("models", "Training", "torch", "transformers", "tokenizers", "onnx", "onnxscript", "safetensors")
        _check_size(size)
    console = stdout()
    plan = PipelinePlan(seed, draws, per_case, size, steps, more, base)
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


SORTERS_EXAMPLES = help_text("train SORTERS_EXAMPLES")


@train_app.command(epilog=SORTERS_EXAMPLES)
def sorters(
    out: Annotated[Path, typer.Option(help="Folder for the sorters and their card.")],
    seed: Seed = 0,
    measured: Annotated[
        bool,
        typer.Option(
            "--measured", help="Also train without a fifth of the writers in turn, and say how it sorts theirs."
        ),
    ] = False,
) -> None:
    """The sorters of what passengers hint at, say of the weather, and remark after a drive."""
    from chauffeur.cli.console import stdout
    from chauffeur.cli.lab.stages import stage_lines
    from chauffeur.models.sorting.pipeline import make_sorters
    from chauffeur.models.sorting.training import SortingRecipe

    console = stdout()
    try:
        card = make_sorters(out, SortingRecipe(seed=seed), stage_lines(console), measured=measured)
    except KeyboardInterrupt:
        console.print(f"Stopped. Whole files are kept in {out}.", soft_wrap=True)
        raise typer.Exit(130) from None
    console.print(f"Sorters: wishes, remarks and weather in {out}; their card: {card}", soft_wrap=True)


VILAD_DRIVE_EXAMPLES = help_text("train VILAD_DRIVE_EXAMPLES")

VILAD_EXAMPLES = help_text("train VILAD_EXAMPLES")


@train_app.command("vilad-parking", epilog=VILAD_EXAMPLES)
def vilad_parking(
    out: RunFolder,
    seed: Seed = 0,
    steps: Annotated[int, typer.Option(min=1, help="Optimiser steps of 32 commands.")] = 1_200,
    size: Annotated[str, typer.Option(help="Network: `lot` ships; `tiny`, `3M`, `10M` and more.")] = "lot",
    mode: Annotated[str, typer.Option(help="`fixed` pattern training, or `plain` without it.")] = "fixed",
) -> None:
    """The parking model of the ViLaD planner: words and free spots to a spot, by masked diffusion."""
    _train_vilad("vilad-parking", out, seed, steps, size, mode, None)


@train_app.command("vilad-drive", epilog=VILAD_DRIVE_EXAMPLES)
def vilad_drive(
    out: RunFolder,
    seed: Seed = 0,
    steps: Annotated[int, typer.Option(min=1, help="Optimiser steps of 32 commands.")] = 3_000,
    size: Annotated[str, typer.Option(help="Network: `lot` ships; `tiny`, `3M`, `10M` and more.")] = "lot",
    mode: Annotated[str, typer.Option(help="`fixed` pattern training, or `plain` without it.")] = "fixed",
    base: Annotated[
        Path | None, typer.Option(help="Run of `vilad-parking` of the same size, whose reading of words is taken over.")
    ] = None,
) -> None:
    """The open-road model of the ViLaD planner: words and the street ahead to waypoints, by masked diffusion."""
    _train_vilad("vilad-drive", out, seed, steps, size, mode, base)


def _train_vilad(name: str, out: Path, seed: int, steps: int, size: str, mode: str, base: Path | None) -> None:
    from chauffeur.cli.console import stdout
    from chauffeur.cli.lab.stages import stage_lines
    from chauffeur.cli.parts import needs

    needs("models", "Training", "torch", "transformers", "onnx", "onnxscript")
    from chauffeur.models.vilad.pipeline import MODELS, make_model, recipe_of

    console = stdout()
    chosen = MODELS[name]()
    recipe = recipe_of(chosen, size, mode, steps, seed, begun=base is not None)
    try:
        model = make_model(chosen, out, recipe, stage_lines(console), base)
    except KeyboardInterrupt:
        console.print(f"Stopped. What is done is kept in {out}; run the same command to go on.", soft_wrap=True)
        raise typer.Exit(130) from None
    console.print(f"Model: {model}; its card: {model / 'MODEL_CARD.md'}", soft_wrap=True)


VILAD_FRAMES_EXAMPLES = help_text("train VILAD_FRAMES_EXAMPLES")


@train_app.command("vilad-frames", epilog=VILAD_FRAMES_EXAMPLES)
def vilad_frames(
    data: Annotated[Path, typer.Option(help="Set that `chauffeur bench scenes frames` has made.")],
    out: RunFolder,
    seed: WeightsSeed = 0,
    encoder_steps: Annotated[int, typer.Option(min=1, help="Optimiser steps of the encoder.")] = 1_000,
    encoder_batch: Annotated[int, typer.Option(min=1, help="Frames of one of its steps.")] = 32,
    steps: Annotated[int, typer.Option(min=1, help="Optimiser steps of the decoders, each.")] = 500,
    also: Annotated[
        list[Path] | None, typer.Option(help="Another set whose training split is trained on too. Repeatable.")
    ] = None,
    device: Annotated[str, typer.Option(help="Where networks are trained: cpu, cuda.")] = "cpu",
) -> None:
    """ViLaD on frames: a front picture, own motion and a command to waypoints, by masked diffusion (paper Sec. VII)."""
    from dataclasses import replace

    from chauffeur.cli.console import stdout
    from chauffeur.cli.lab.stages import stage_lines
    from chauffeur.cli.lab.tables import show_table
    from chauffeur.cli.parts import needs

    needs("models", "Training", "torch", "transformers", "safetensors")
    from chauffeur.models.vilad.frames_pipeline import FIGURES_HEAD, FramesPlan, cells_of, make_frames_model

    console = stdout()
    plan = FramesPlan()
    plan = replace(
        plan,
        vision=replace(plan.vision, steps=encoder_steps, batch=encoder_batch, seed=seed),
        decoder=replace(plan.decoder, steps=steps, seed=seed),
    )
    try:
        model, lines = make_frames_model(data, out, plan, stage_lines(console), also or (), device)
    except KeyboardInterrupt:
        console.print(f"Stopped. What is saved is kept in {out}; run the same command to go on.", soft_wrap=True)
        raise typer.Exit(130) from None
    show_table(console, "Test split: another town, simulated; L2 in m", FIGURES_HEAD, [cells_of(one) for one in lines])
    console.print(f"Model: {model}; its card: {model / 'MODEL_CARD.md'}", soft_wrap=True)


BEV_LLM_EXAMPLES = help_text("train BEV_LLM_EXAMPLES")


@train_app.command("bev-llm", epilog=BEV_LLM_EXAMPLES)
def bev_llm(
    data: Annotated[Path, typer.Option(help="Set that `chauffeur bench scenes qa` has made.")],
    out: RunFolder,
    also: Annotated[
        list[Path] | None, typer.Option(help="Another set whose training split is learned as well; may be repeated.")
    ] = None,
    steps: Annotated[int, typer.Option(min=0, help="Optimiser steps of perception.")] = 3000,
    gather_steps: Annotated[int, typer.Option(min=0, help="The same with the encoder frozen.")] = 1500,
    word_steps: Annotated[int, typer.Option(min=1, help="Optimiser steps of language.")] = 300,
    begin: Annotated[Path | None, typer.Option(help="Folder of a network to begin with.")] = None,
    seed: WeightsSeed = 0,
    ablation: Annotated[str, typer.Option(help="`full`, or what is kept from the network.")] = "full",
) -> None:
    """BEV-LLM, compact: questions about multi-view pictures, with a bird's-eye view that remembers (paper Eq. 9-10)."""
    from typing import get_args

    from chauffeur.bench.nuplanqa.questions import SUBTASKS
    from chauffeur.cli.console import stdout
    from chauffeur.cli.lab.tables import show_table
    from chauffeur.cli.parts import needs
    from chauffeur.concept import ConfigError

    needs("models", "Training", "torch", "transformers", "safetensors")
    from chauffeur.models.bev_llm.network import Keep
    from chauffeur.models.bev_llm.recipe import BevLlmRecipe, joined, load_split, train_compact

    kept = next((one for one in get_args(Keep) if one == ablation), None)
    if kept is None:
        raise ConfigError(f"There is no ablation {ablation!r}.", hint=f"Choose of: {', '.join(get_args(Keep))}.")
    console = stdout()
    recipe = BevLlmRecipe(steps=steps, gather_steps=gather_steps, word_steps=word_steps, seed=seed, ablation=kept)
    lasts = {"perception": steps, "gathering": gather_steps, "language": word_steps}

    def told(stage: str, step: int, loss: float, seconds: float) -> None:
        if step % 50 == 0 or step + 1 == lasts[stage]:
            console.print(f"{stage}, step {step:,}, loss {loss:.3f}, {seconds:.2f} s a step")

    try:
        train, val, test = (load_split(data / split) for split in ("train", "val", "test"))
        train = joined([train, *(load_split(one / "train") for one in also or ())])
        answerer = train_compact(out, recipe, train, val, told, begin=begin)
        tried = get_args(Keep) if kept == "full" else (kept,)
        found = {one: answerer.keeping(one).accuracy(test) for one in tried}
    except KeyboardInterrupt:
        console.print(f"Stopped. What is saved is kept in {out}; run the same command to go on.", soft_wrap=True)
        raise typer.Exit(130) from None
    rows = [
        (name, *(f"{found[one][name]:.1%}" for one in tried)) for name in (*SUBTASKS, "total") if name in found[kept]
    ]
    show_table(console, "Test split: other scenes, places and wordings; simulated", ("subtask", *tried), rows)
    console.print(
        f"Model: {out / 'model'}. Next: chauffeur bench nuplanqa --planner bev-llm/{out / 'model'}", soft_wrap=True
    )


VLM_EXAMPLES = help_text("train VLM_EXAMPLES")


@train_app.command("vlm", epilog=VLM_EXAMPLES)
def vlm(
    out: RunFolder,
    seed: WeightsSeed = 0,
    scenes: Annotated[int, typer.Option(min=20, help="Pictures to render; each gets three wishes a turn.")] = 6_000,
    steps: Annotated[int, typer.Option(min=1, help="Optimiser steps of 20 pictures with three wishes.")] = 1_600,
    size: Annotated[str, typer.Option(help="Network: `compact` ships; `tiny`, `large`.")] = "compact",
) -> None:
    """The on-board VLM: a picture and a wish to the scene in words and the controllers' gains (paper Sec. VI)."""
    from chauffeur.cli.console import stdout
    from chauffeur.cli.lab.stages import stage_lines
    from chauffeur.cli.parts import needs
    from chauffeur.concept import ConfigError

    needs("models", "Training", "torch", "transformers", "onnx", "onnxscript")
    from chauffeur.models.vlm.config import VlmRecipe
    from chauffeur.models.vlm.network import SIZES
    from chauffeur.models.vlm.pipeline import make_vlm

    if size not in SIZES:
        raise ConfigError(f"There is no size {size!r}.", hint=f"Sizes: {', '.join(SIZES)}.")
    console = stdout()
    try:
        recipe = VlmRecipe(size=size, scenes=scenes, steps=steps, seed=seed)
        model = make_vlm(out, recipe, stage_lines(console))
    except KeyboardInterrupt:
        console.print(f"Stopped. What is done is kept in {out}; run the same command to go on.", soft_wrap=True)
        raise typer.Exit(130) from None
    console.print(f"Model: {model}; its card: {model / 'MODEL_CARD.md'}", soft_wrap=True)
