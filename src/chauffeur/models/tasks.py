"""Models of our own from a seed: a function for each, of which `chauffeur model` makes a command with its arguments.

Nothing heavy is imported before a function is called, and what is missing is said before any work is done.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final, Literal, cast, get_args

from chauffeur.bench.kernel.task import Count, Positive, TaskResult, TextTable, Told
from chauffeur.concept import ConfigError
from chauffeur.concept.needs import needs


def onboard(
    out: Path,
    told: Told,
    seed: Count = 0,
    draws: Positive = 22_000,
    per_case: Positive = 26,
    size: Literal["small", "medium", "large"] = "small",
    steps: Positive = 6_500,
    more: Count = 0,
    base: Path | None = None,
    workers: Count = 0,
    data_only: bool = False,
) -> TaskResult:
    """The on-board language model: words to driving programs, offline.

    Args:
        out: Folder of the run; one begun there is continued.
        told: Is told how far it is.
        seed: Seed of everything.
        draws: Scenes drawn; about six in ten become cases.
        per_case: Wordings tried for each case.
        size: Of the network; `small` takes an hour on two cores, `large` wants a GPU.
        steps: Optimiser steps of 4,096 tokens.
        more: Steps of a second round, its rate half as high; also for a finished run.
        base: Finished run, or model that ships, whose network is trained on, at half the rate.
        workers: Processes that make data; 0 for one per core.
        data_only: Make the data and stop.
    """
    if not data_only:  # half an hour of data first, and then nothing to train with, helps nobody
        needs("models", "Training", "torch", "transformers", "tokenizers", "onnx", "onnxscript", "safetensors")
    from chauffeur.models.onboard.pipeline import PipelinePlan, build_data, train_model

    plan = PipelinePlan(seed, draws, per_case, size, steps, more, base)
    build_data(out, plan, workers or os.cpu_count() or 1, told)
    if data_only:
        return TaskResult((f"Data: {out / 'data'}; its card: {out / 'data' / 'DATA_CARD.md'}",))
    model = train_model(out, plan, told)
    return TaskResult((f"Model: {model}. Try it: chauffeur bench passengers --planner onboard/{model}",))


def sorters(out: Path, told: Told, seed: Count = 0, measured: bool = False) -> TaskResult:
    """The sorters of what passengers hint at, say of the weather, and remark after a drive.

    Args:
        out: Folder for the sorters and their card.
        told: Is told how far it is.
        seed: Seed of everything.
        measured: Also train without a fifth of the writers in turn, and say how it sorts theirs.
    """
    from chauffeur.models.sorting.pipeline import make_sorters
    from chauffeur.models.sorting.training import SortingRecipe

    card = make_sorters(out, SortingRecipe(seed=seed), told, measured=measured)
    return TaskResult((f"Sorters: wishes, remarks and weather in {out}; their card: {card}",))


def vilad_parking(
    out: Path,
    told: Told,
    seed: Count = 0,
    steps: Positive = 1_200,
    size: str = "lot",
    mode: Literal["fixed", "plain"] = "fixed",
) -> TaskResult:
    """The parking model of the ViLaD planner: words and free spots to a spot, by masked diffusion.

    Args:
        out: Folder of the run; one begun there is continued.
        told: Is told how far it is.
        seed: Seed of everything.
        steps: Optimiser steps of 32 commands.
        size: Network: `lot` ships; `tiny`, `3M`, `10M` and more.
        mode: Fixed pattern training, or plain masked diffusion without it.
    """
    return _vilad("vilad-parking", out, told, seed, steps, size, mode, None)


def vilad_drive(
    out: Path,
    told: Told,
    seed: Count = 0,
    steps: Positive = 3_000,
    size: str = "lot",
    mode: Literal["fixed", "plain"] = "fixed",
    base: Path | None = None,
) -> TaskResult:
    """The open-road model of the ViLaD planner: words and the street ahead to waypoints, by masked diffusion.

    Args:
        out: Folder of the run; one begun there is continued.
        told: Is told how far it is.
        seed: Seed of everything.
        steps: Optimiser steps of 32 commands.
        size: Network: `lot` ships; `tiny`, `3M`, `10M` and more.
        mode: Fixed pattern training, or plain masked diffusion without it.
        base: Run of `vilad-parking` of the same size, whose reading of words is taken over.
    """
    return _vilad("vilad-drive", out, told, seed, steps, size, mode, base)


def _vilad(
    name: str, out: Path, told: Told, seed: int, steps: int, size: str, mode: str, base: Path | None
) -> TaskResult:
    needs("models", "Training", "torch", "transformers", "onnx", "onnxscript")
    from chauffeur.models.vilad.pipeline import MODELS, make_model, recipe_of

    chosen = MODELS[name]()
    recipe = recipe_of(chosen, size, mode, steps, seed, begun=base is not None)
    return _shipped(make_model(chosen, out, recipe, told, base))


def _shipped(model: Path) -> TaskResult:
    return TaskResult((f"Model: {model}; its card: {model / 'MODEL_CARD.md'}",))


def vilad_frames(
    data: Path,
    out: Path,
    told: Told,
    seed: Count = 0,
    encoder_steps: Positive = 1_000,
    encoder_batch: Positive = 32,
    steps: Positive = 500,
    also: Sequence[Path] | None = None,
    device: str = "cpu",
) -> TaskResult:
    """ViLaD on frames: a front picture, own motion and a command to waypoints, by masked diffusion (paper Sec. VII).

    Args:
        data: Set that `chauffeur bench scenes frames` has made.
        out: Folder of the run; one begun there is continued.
        told: Is told how far it is.
        seed: Seed of weights and batches.
        encoder_steps: Optimiser steps of the encoder.
        encoder_batch: Frames of one of its steps.
        steps: Optimiser steps of the decoders, each.
        also: Another set whose training split is trained on too; may come again.
        device: Where networks are trained: cpu, cuda.
    """
    needs("models", "Training", "torch", "transformers", "safetensors")
    from dataclasses import replace

    from chauffeur.models.vilad.frames_pipeline import FIGURES_HEAD, FramesPlan, cells_of, make_frames_model

    plan = FramesPlan()
    plan = replace(
        plan,
        vision=replace(plan.vision, steps=encoder_steps, batch=encoder_batch, seed=seed),
        decoder=replace(plan.decoder, steps=steps, seed=seed),
    )
    model, lines = make_frames_model(data, out, plan, told, also or (), device)
    title = "Test split: another town, simulated; L2 in m"
    return TaskResult((TextTable(title, FIGURES_HEAD, [cells_of(one) for one in lines]), *_shipped(model).parts))


def bev_llm(
    data: Path,
    out: Path,
    told: Told,
    also: Sequence[Path] | None = None,
    steps: Count = 3000,
    gather_steps: Count = 1500,
    word_steps: Positive = 300,
    begin: Path | None = None,
    seed: Count = 0,
    ablation: str = "full",
) -> TaskResult:
    """BEV-LLM, compact: questions about multi-view pictures, with a bird's-eye view that remembers (paper Eq. 9-10).

    Args:
        data: Set that `chauffeur bench scenes qa` has made.
        out: Folder of the run; one begun there is continued.
        told: Is told how far it is.
        also: Another set whose training split is learned as well; may come again.
        steps: Optimiser steps of perception.
        gather_steps: The same with the encoder frozen.
        word_steps: Optimiser steps of language.
        begin: Folder of a network to begin with.
        seed: Seed of weights and batches.
        ablation: `full`, or what is kept from the network.
    """
    needs("models", "Training", "torch", "transformers", "safetensors")
    from chauffeur.bench.nuplanqa.questions import SUBTASKS
    from chauffeur.models.bev_llm.network import Keep
    from chauffeur.models.bev_llm.recipe import BevLlmRecipe, joined, load_split, train_compact

    if ablation not in get_args(Keep):
        raise ConfigError(f"There is no ablation {ablation!r}.", hint=f"Choose of: {', '.join(get_args(Keep))}.")
    kept = cast("Keep", ablation)
    recipe = BevLlmRecipe(steps=steps, gather_steps=gather_steps, word_steps=word_steps, seed=seed, ablation=kept)
    lasts = {"perception": steps, "gathering": gather_steps, "language": word_steps}

    def watch(stage: str, step: int, loss: float, seconds: float) -> None:
        told(f"{stage}, loss {loss:.3f}, {seconds:.2f} s", step + 1, lasts[stage])

    train, val, test = (load_split(data / split) for split in ("train", "val", "test"))
    train = joined([train, *(load_split(one / "train") for one in also or ())])
    answerer = train_compact(out, recipe, train, val, watch, begin=begin)
    tried = get_args(Keep) if kept == "full" else (kept,)
    found = {one: answerer.keeping(one).accuracy(test) for one in tried}
    lines = [
        (name, *(f"{found[one][name]:.1%}" for one in tried)) for name in (*SUBTASKS, "total") if name in found[kept]
    ]
    model = out / "model"
    return TaskResult(
        (
            TextTable("Test split: other scenes, places and wordings; simulated", ("subtask", *tried), lines),
            f"Model: {model}. Next: chauffeur bench nuplanqa --planner bev-llm/{model}",
        )
    )


def vlm(
    out: Path,
    told: Told,
    seed: Count = 0,
    scenes: Positive = 6_000,
    steps: Positive = 1_600,
    size: Literal["compact", "tiny", "large"] = "compact",
) -> TaskResult:
    """The on-board VLM: a picture and a wish to the scene in words and the controllers' gains (paper Sec. VI).

    Args:
        out: Folder of the run; one begun there is continued.
        told: Is told how far it is.
        seed: Seed of weights and batches.
        scenes: Pictures to render, 20 at least; each gets three wishes a turn.
        steps: Optimiser steps of 20 pictures with three wishes.
        size: Network; `compact` ships.
    """
    needs("models", "Training", "torch", "transformers", "onnx", "onnxscript")
    from chauffeur.models.vlm.config import VlmRecipe
    from chauffeur.models.vlm.pipeline import make_vlm

    if scenes < _BATCH:
        raise ConfigError(f"{scenes} pictures are fewer than a step takes.", hint=f"Give --scenes {_BATCH} or more.")
    return _shipped(make_vlm(out, VlmRecipe(size=size, scenes=scenes, steps=steps, seed=seed), told))


_BATCH: Final = 20
"""Pictures of a step (`VlmRecipe.pictures`)."""


def adapt_vlm(
    checkpoint: str,
    out: Path,
    told: Told,
    pairs: Positive = 10_000,
    epochs: Positive = 5,
    rate: float = 1e-5,
    rank: Positive = 16,
    seed: Count = 0,
) -> TaskResult:
    """Fine-tune an open vision-language model by LoRA to answer a picture and a wish with gains.

    Args:
        checkpoint: Checkpoint folder or hub name: Qwen2.5-VL, Qwen3-VL, LLaVA ...
        out: Folder of the run; one begun there is continued.
        told: Is told how far it is.
        pairs: Picture-instruction pairs; three a picture.
        epochs: How often each pair is seen.
        rate: Learning rate.
        rank: Rank of the additions (the paper does not print it).
        seed: Of the additions and of the order.
    """
    needs("models", "Adapting", "torch", "transformers", "peft", "safetensors")
    from chauffeur.models.vlm.lora import ChatExamples, LoraRecipe, fine_tune_vlm

    recipe = LoraRecipe(epochs=epochs, pairs=pairs, rate=rate, rank=rank, alpha=2 * rank, seed=seed)

    def watch(step: int, loss: float, seconds: float) -> None:
        told(f"fine-tuning, loss {loss:.3f}, {seconds:.1f} s", step + 1, recipe.steps)

    merged = fine_tune_vlm(checkpoint, out, recipe, ChatExamples(), watch)
    return TaskResult((f"Model: {merged}. Try it: --planner motion/transformers/{merged}",))


def quantise_vlm(
    checkpoint: str, out: Path, /, told: Told, pairs: Positive = 64, group_size: Positive = 128
) -> TaskResult:
    """Round an open vision-language model to 4 bits (AWQ), for vLLM and LMDeploy.

    Args:
        checkpoint: Checkpoint folder or hub name: Qwen2.5-VL, Qwen3-VL ...
        out: Folder to write.
        told: Is told how far it is.
        pairs: Picture-instruction pairs to calibrate on.
        group_size: Weights of a row that share a scale.
    """
    needs("models", "Quantising", "torch", "transformers", "safetensors")
    from statistics import fmean

    from chauffeur.models.vlm.lora import ChatExamples
    from chauffeur.models.vlm.quantise import quantise_vlm as quantise

    if out.exists() and any(out.iterdir()):
        raise ConfigError(f"{out} is not empty.", hint="Name a new folder, or remove this one.")
    errors = quantise(checkpoint, out, ChatExamples(), pairs, group_size, lambda done, of: told("searching", done, of))
    nearest, chosen = fmean(one.nearest for one in errors), fmean(one.chosen for one in errors)
    errors_said = f"Mean relative error of a group of matrices: {chosen:.4f}; rounded to nearest {nearest:.4f}."
    return TaskResult((f"Written: {out}. {errors_said}",))


TRAINED: Final[dict[str, Callable[..., Any]]] = {
    "onboard": onboard,
    "sorters": sorters,
    "vilad-parking": vilad_parking,
    "vilad-drive": vilad_drive,
    "vilad-frames": vilad_frames,
    "bev-llm": bev_llm,
    "vlm": vlm,
}
"""What `chauffeur model train` trains, by name."""
