"""`chauffeur model adapt-vlm`: an open vision-language model fine-tuned to set gains (paper Sec. VI-B5)."""

from __future__ import annotations

from typing import Annotated

import typer

from chauffeur.cli.examples import help_text
from chauffeur.cli.options import RunFolder

EXAMPLES = help_text("adapt_vlm")


def adapt_vlm(
    checkpoint: Annotated[str, typer.Option(help="Checkpoint folder or hub name: Qwen2.5-VL, Qwen3-VL, LLaVA ...")],
    out: RunFolder,
    pairs: Annotated[int, typer.Option(min=1, help="Picture-instruction pairs; three a picture.")] = 10_000,
    epochs: Annotated[int, typer.Option(min=1, help="How often each pair is seen.")] = 5,
    rate: Annotated[float, typer.Option(min=0.0, help="Learning rate.")] = 1e-5,
    rank: Annotated[int, typer.Option(min=1, help="Rank of the additions (the paper does not print it).")] = 16,
    seed: Annotated[int, typer.Option(min=0, help="Of the additions and of the order.")] = 0,
) -> None:
    """Fine-tune an open vision-language model by LoRA to answer a picture and a wish with gains."""
    from chauffeur.cli.console import stdout
    from chauffeur.cli.lab.stages import stage_lines
    from chauffeur.cli.parts import needs

    needs("models", "Adapting", "torch", "transformers", "peft", "safetensors")
    from chauffeur.models.vlm.lora import ChatExamples, LoraRecipe, fine_tune_vlm

    console = stdout()
    told = stage_lines(console)
    recipe = LoraRecipe(epochs=epochs, pairs=pairs, rate=rate, rank=rank, alpha=2 * rank, seed=seed)

    def watch(step: int, loss: float, seconds: float) -> None:
        told(f"fine-tuning, loss {loss:.3f}, {seconds:.1f} s", step + 1, recipe.steps)

    try:
        merged = fine_tune_vlm(checkpoint, out, recipe, ChatExamples(), watch)
    except KeyboardInterrupt:
        console.print(f"Stopped. What is saved is kept in {out}; run the same command to go on.", soft_wrap=True)
        raise typer.Exit(130) from None
    console.print(f"Model: {merged}. Try it: --planner motion/transformers/{merged}", soft_wrap=True)
