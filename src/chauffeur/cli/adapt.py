"""`chauffeur model adapt`: models of our own, made to fit a person or a fleet."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final

import typer

EXAMPLES = """
Examples:

    chauffeur model adapt --base runs/onboard/transformers --out runs/ana --as ana

    chauffeur model adapt --base runs/onboard/transformers --out runs/fleet --interactions a.jsonl --interactions b.jsonl

    chauffeur drive "Step on it, love." --as ana --planner onboard/runs/ana/current

Learns from trips that were accepted: they ended well, and nobody asked for a change. The adapted model is taken into
use only if it forgot nothing and does no worse on interactions that were held back; otherwise, and after Ctrl-C, the
old one stays. It needs PyTorch and peft: pip install 'chauffeur[models]'.
"""  # noqa: E501 - a command stands on one line, to be copied


_HOW: Final = "How it learns"


def adapt(
    base: Annotated[Path, typer.Option(help="`transformers` folder of a trained model.")],
    out: Annotated[Path, typer.Option(help="Folder of the adapted models; `current` in it names the one in use.")],
    interactions: Annotated[
        list[Path] | None, typer.Option(help="JSON lines: wish, situation, history, program, accepted. Repeatable.")
    ] = None,
    person: Annotated[str | None, typer.Option("--as", help="Learn from this person's remembered trips.")] = None,
    validation: Annotated[
        Path | None, typer.Option(help="Examples that guard against forgetting; default data/seen.jsonl of the base.")
    ] = None,
    replay: Annotated[
        Path | None, typer.Option(help="Training examples mixed in; default data/train.jsonl of the base, if there.")
    ] = None,
    rank: Annotated[int, typer.Option(min=1, help="Rank of the additions to each matrix.", rich_help_panel=_HOW)] = 8,
    passes: Annotated[int, typer.Option(min=1, help="How often each interaction is seen.", rich_help_panel=_HOW)] = 30,
    rate: Annotated[float, typer.Option(help="Highest learning rate.", rich_help_panel=_HOW)] = 3e-3,
    tolerance: Annotated[float, typer.Option(min=0.0, help="Points of validation that may be lost.")] = 0.5,
    seed: Annotated[int, typer.Option(min=0, help="Seed of everything.")] = 0,
) -> None:
    """Fit the on-board language model to interactions that people accepted. Exit code 1: the old model stays."""
    from rich.text import Text

    from chauffeur.cli.console import stdout
    from chauffeur.cli.parts import needs
    from chauffeur.cli.stages import stage_lines
    from chauffeur.concept import ConfigError, PersonId
    from chauffeur.memory.choice import open_memory
    from chauffeur.models.onboard.adaptation import AdaptRecipe
    from chauffeur.models.onboard.adaptation import adapt as adapt_model
    from chauffeur.models.onboard.interactions import (
        AcceptedInteraction,
        exported_items,
        interactions_of,
        load_interactions,
    )

    needs("models", "Adapting", "torch", "transformers", "tokenizers", "onnx", "onnxscript", "peft", "safetensors")
    if not interactions and not person:
        raise ConfigError("There is nothing to learn from.", hint="Give --as NAME, --interactions FILE, or both.")
    console = stdout()
    data = base.parent / "data"
    if replay is None and (data / "train.jsonl").exists():
        replay = data / "train.jsonl"
    if replay is None:
        console.print("Nothing to replay: without examples of its training the model forgets more easily.")
    found: list[AcceptedInteraction] = []
    for path in interactions or ():
        found += load_interactions(path)
    if person:
        found += interactions_of(exported_items(open_memory().export(PersonId(person))))
    recipe = AdaptRecipe(
        validation=validation or data / "seen.jsonl",
        replay=replay,
        rank=rank,
        passes=passes,
        rate=rate,
        tolerance=tolerance,
        seed=seed,
    )
    try:
        verdict = adapt_model(base, found, out, recipe, stage_lines(console))
    except KeyboardInterrupt:
        console.print("Stopped. The old model stays in use.")
        raise typer.Exit(130) from None
    console.print(Text(verdict.why), soft_wrap=True)
    if not verdict.taken:
        console.print("Not taken into use: the old model stays.")
        raise typer.Exit(1)
    current = out / "current"
    console.print(Text(f"In use: {current}. Try it: --planner onboard/{current}"), soft_wrap=True)
