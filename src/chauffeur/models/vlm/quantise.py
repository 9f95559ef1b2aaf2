# pyright: reportMissingImports=false
"""A vision-language model of `transformers` in 4 bits (AWQ), calibrated on what it is asked here; paper Sec. VI-B5."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import torch

from chauffeur.concept import ConfigError
from chauffeur.models.export.awq import GroupError, quantise, write_packed
from chauffeur.models.vlm.lora import ChatExamples, encoded
from chauffeur.planners.vlm_processor import load_processor


def quantise_vlm(
    base: str,
    out: Path,
    examples: ChatExamples,
    pairs: int = 64,
    group: int = 128,
    watch: Callable[[int, int], None] | None = None,
) -> list[GroupError]:
    """Write a checkpoint folder whose language layers are in 4 bits; the vision encoder stays as it was.

    Args:
        base: Folder, or name on the hub, of an image-text-to-text model with its processor.
        out: Folder to write: weights as `pack-quantized` of compressed-tensors, configuration, processor.
        examples: Pictures, wishes and answers to calibrate on.
        pairs: So many of them.
        group: Weights of a row that share a scale.
        watch: Called with (groups of matrices done, all of them).

    Returns:
        Errors group by group.

    Raises:
        ConfigError: There is no such checkpoint, or it cannot be quantised.
    """
    from transformers import AutoModelForImageTextToText

    try:
        processor: Any = load_processor(base)
        model: Any = AutoModelForImageTextToText.from_pretrained(base, dtype="auto").eval()
    except (OSError, ValueError) as error:
        raise ConfigError(
            f"transformers has no vision-language model {base!r}: {error}",
            hint="Name a folder or a model on the hub, e.g. runs/qwen/merged of `chauffeur model adapt-vlm`.",
        ) from error
    if torch.cuda.is_available():
        model = model.to("cuda")

    def run(number: int) -> None:
        fed = encoded(processor, [examples[number]])
        model(**{name: value.to(model.device) for name, value in fed.items() if name != "labels"})

    # Every seventh pair: all styles, and pictures of many scenes.
    matrices, errors = quantise(model, [partial(run, 7 * number) for number in range(pairs)], group, watch)
    write_packed(model, matrices, out, group)
    processor.save_pretrained(out)
    return errors
