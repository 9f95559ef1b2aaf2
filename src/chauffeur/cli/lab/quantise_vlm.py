"""`chauffeur model quantise-vlm`: a fine-tuned vision-language model in 4 bits (paper Sec. VI-B5)."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chauffeur.cli.examples import help_text

EXAMPLES = help_text("quantise_vlm")


def quantise_vlm(
    checkpoint: Annotated[str, typer.Argument(help="Checkpoint folder or hub name: Qwen2.5-VL, Qwen3-VL ...")],
    out: Annotated[Path, typer.Argument(help="Folder to write.")],
    pairs: Annotated[int, typer.Option(min=1, help="Picture-instruction pairs to calibrate on.")] = 64,
    group_size: Annotated[int, typer.Option(min=8, help="Weights of a row that share a scale.")] = 128,
) -> None:
    """Round an open vision-language model to 4 bits (AWQ), for vLLM and LMDeploy."""
    from statistics import fmean

    from chauffeur.cli.console import stdout
    from chauffeur.cli.lab.stages import stage_lines
    from chauffeur.cli.parts import needs
    from chauffeur.concept import ConfigError

    needs("models", "Quantising", "torch", "transformers", "safetensors")
    from chauffeur.models.vlm.lora import ChatExamples
    from chauffeur.models.vlm.quantise import quantise_vlm as quantise

    if out.exists() and any(out.iterdir()):
        raise ConfigError(f"{out} is not empty.", hint="Name a new folder, or remove this one.")
    console = stdout()
    told = stage_lines(console)
    errors = quantise(checkpoint, out, ChatExamples(), pairs, group_size, lambda done, of: told("searching", done, of))
    nearest, chosen = fmean(one.nearest for one in errors), fmean(one.chosen for one in errors)
    console.print(
        f"Written: {out}. Mean relative error of a group of matrices: {chosen:.4f}; rounded to nearest {nearest:.4f}.",
        soft_wrap=True,
    )
