# pyright: reportMissingImports=false, reportUntypedBaseClass=false, reportUnknownParameterType=false
"""The paper's path for real weights: Qwen2.5-VL, Qwen3-VL or another VLM of `transformers`, fine-tuned by LoRA.

The examples are the compact VLM's: a rendered picture, a wish, and the thoughts and action matrix to answer with, in
the very conversation that `planners.motion` has with a model, so that what is trained is what is asked. The additions
are merged at the end: `motion/transformers/FOLDER` drives with the result, and any server of OpenAI's interface that
takes pictures can serve it (`motion/NAME`).
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from torch import nn

from chauffeur.camera import front_rig, make_renderer
from chauffeur.concept import ActionMatrix, CameraImage, ConfigError, Context, Instruction, PlanRequest, SystemMessage
from chauffeur.describe.road import situation_of
from chauffeur.models.train.trainer import Optimisation, Precision, fit
from chauffeur.models.vlm.gains import GainCase, taught_gains
from chauffeur.models.vlm.scenes import Split, seat_scene
from chauffeur.models.vlm.wishes import training_wish
from chauffeur.planners.prompts.motion import matrix_words, motion_messages
from chauffeur.planners.transformers_vlm import chat_turns
from chauffeur.planners.vlm.template import STYLES
from chauffeur.planners.vlm.thoughts import scene_words, thought_words
from chauffeur.planners.vlm_processor import load_processor

_IGNORED: Final = -100


@dataclass(frozen=True, slots=True)
class LoraRecipe:
    """Settings that decide a fine-tuning. The defaults are the paper's (Sec. VI-B5b) where it prints them.

    Attributes:
        epochs: How often each pair is seen (paper: 5).
        pairs: Picture-instruction pairs (paper: 10,000).
        batch: Pairs of a forward pass (paper: 2 a device).
        accumulate: Forward passes a step (paper: 8).
        rate: Learning rate (paper: 1e-5).
        rank, alpha: Of the additions; the paper does not print them.
        precision: Of the forward pass.
        seed: Of the additions and of the order.
    """

    epochs: int = 5
    pairs: int = 10_000
    batch: int = 2
    accumulate: int = 8
    rate: float = 1e-5
    rank: int = 16
    alpha: int = 32
    precision: Precision = "auto"
    seed: int = 0

    @property
    def steps(self) -> int:
        """Optimiser steps of all epochs."""
        return max(1, self.epochs * self.pairs // (self.batch * self.accumulate))


@dataclass(frozen=True, slots=True)
class ChatExample:
    """A conversation and what the model is to answer."""

    messages: list[Any]
    answer: str


class ChatExamples:
    """Pairs of a split by number: three in a row share a picture, one a style (paper Sec. VI-B5a)."""

    def __init__(self, split: Split = "train", size: tuple[int, int] = (448, 256)) -> None:
        """Args: whose scenes; width and height of the pictures, px."""
        self._split: Split = split
        self._rig = front_rig(*size)
        self._renderer = make_renderer()

    def __getitem__(self, number: int) -> ChatExample:
        """The pair of a number; the same for the same number."""
        place, style = number // len(STYLES), STYLES[number % len(STYLES)]
        scene = seat_scene(self._split, place)
        facts = scene.facts
        rng = np.random.default_rng([43, number])
        taken = self._renderer.render(scene.observation, self._rig, scene.conditions, scene.seed)
        picture: CameraImage = taken.images[0]
        request = PlanRequest(
            Instruction(training_wish(style, rng)),
            Context(f"Manoeuvre: {facts.task.replace('_', ' ')}.", situation_of(scene.observation)),
            SystemMessage(""),
            images=(picture,),
        )
        case = GainCase(style, facts.weather, facts.grade, facts.lead, facts.task)
        values = {**asdict(facts), "style": style, "recall": "none"}
        kp, ki, kd, wl, wh, ws = (float(f"{value:.3g}") for value in taught_gains(case))
        matrix = matrix_words(ActionMatrix((kp, ki, kd), (wl, wh, ws)))
        answer = f"Thoughts: {scene_words(values)} {thought_words(values)}\nP = {matrix}"
        return ChatExample(list(motion_messages(request)), answer)


class _Additions(nn.Module):
    """The weights that are trained, alone: what a stopped run keeps."""

    def __init__(self, tuned: nn.Module) -> None:
        super().__init__()
        self.held = nn.ParameterList([one for one in tuned.parameters() if one.requires_grad])


def encoded(processor: Any, examples: list[ChatExample]) -> dict[str, torch.Tensor]:
    """Examples as a batch for the model: its inputs, and labels of the answers' tokens alone."""
    texts: list[str] = []
    prompts: list[str] = []
    images: list[Any] = []
    for one in examples:
        turns, pictures = chat_turns(one.messages)
        prompt = processor.apply_chat_template(turns, add_generation_prompt=True, tokenize=False)
        prompts.append(prompt)
        texts.append(prompt + one.answer + str(processor.tokenizer.eos_token or ""))
        images += pictures
    batch: dict[str, torch.Tensor] = dict(
        processor(text=texts, images=images, return_tensors="pt", padding=True, padding_side="right")
    )
    labels = batch["input_ids"].clone()
    labels[batch["attention_mask"] == 0] = _IGNORED
    start = 0
    for row, (prompt, one) in enumerate(zip(prompts, examples, strict=True)):
        own = images[start : start + len(chat_turns(one.messages)[1])]
        start += len(own)
        length = processor(text=[prompt], images=own, return_tensors="pt")["input_ids"].shape[1]
        labels[row, :length] = _IGNORED
    return {**batch, "labels": labels}


def fine_tune_vlm(
    base: str,
    out: Path,
    recipe: LoraRecipe,
    examples: ChatExamples,
    watch: Callable[[int, float, float], None] | None = None,
) -> Path:
    """Fine-tune a checkpoint, or go on where a run in this folder stopped; the folder of the merged one.

    Args:
        base: Folder, or name on the hub, of an image-text-to-text model with its processor.
        out: Of the run: `training/` its state, `adapter/` the additions, `merged/` the model with them.
        recipe: What decides it.
        examples: What to learn.
        watch: Called after each step with (step, loss, seconds).

    Raises:
        ConfigError: There is no such checkpoint, or the folder holds a run of another recipe.
    """
    from peft import LoraConfig, get_peft_model
    from transformers import AutoModelForImageTextToText

    try:
        processor: Any = load_processor(base)
        model: Any = AutoModelForImageTextToText.from_pretrained(base)
    except (OSError, ValueError) as error:
        raise ConfigError(
            f"transformers has no vision-language model {base!r}: {error}",
            hint="Name a folder or a model on the hub, e.g. Qwen/Qwen2.5-VL-7B-Instruct.",
        ) from error
    if torch.cuda.is_available():
        model = model.to("cuda")
    torch.manual_seed(recipe.seed)
    adapted = LoraConfig(
        r=recipe.rank, lora_alpha=recipe.alpha, target_modules=r".*language_model.*\.(q|k|v|o|gate|up|down)_proj"
    )
    tuned: Any = get_peft_model(model, adapted).train()

    def batches(first: int) -> Iterator[list[list[int]]]:
        step, together = first, recipe.batch * recipe.accumulate
        while True:
            numbers = [_pair_of(recipe, step * together + i) for i in range(together)]
            yield [numbers[i : i + recipe.batch] for i in range(0, together, recipe.batch)]
            step += 1

    def loss(parts: list[list[int]]) -> torch.Tensor:
        def part_loss(numbers: list[int]) -> torch.Tensor:
            fed = encoded(processor, [examples[number] for number in numbers])
            return tuned(**{name: value.to(model.device) for name, value in fed.items()}).loss / len(parts)

        total = 0.0
        for numbers in parts[:-1]:  # gradients add up, and one part's graph is held at a time
            value = part_loss(numbers)
            value.backward()
            total += float(value.detach())
        last = part_loss(parts[-1])
        return last + total  # the trainer goes back through the last part

    fit(
        _Additions(tuned),
        batches,
        loss,
        lambda _: recipe.rate,
        out / "training",
        {**asdict(recipe), "base": base},
        recipe.steps,
        Optimisation(decay=0.0, betas=(0.9, 0.999), precision=recipe.precision),
        watch=watch,
        every=10,
    )
    tuned.save_pretrained(out / "adapter")
    merged = tuned.merge_and_unload()
    merged.save_pretrained(out / "merged")
    processor.save_pretrained(out / "merged")
    (out / "merged" / "chauffeur.json").write_text(json.dumps(asdict(recipe), indent=1) + "\n", encoding="utf-8")
    return out / "merged"


def _pair_of(recipe: LoraRecipe, number: int) -> int:
    epoch, place = divmod(number, recipe.pairs)
    return int(np.random.default_rng([recipe.seed, 47, epoch]).permutation(recipe.pairs)[place])
