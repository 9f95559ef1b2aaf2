"""What the lab adds to `chauffeur`: `evaluate`, `bench`, `view`, `report`, `model`."""

from __future__ import annotations

import typer

from chauffeur.cli.examples import help_text
from chauffeur.cli.lab import (
    adapt_vlm,
    coach,
    coach_town,
    evaluate,
    quantise_vlm,
    report,
    scenes,
    scenes_frames,
    train,
    view,
)
from chauffeur.cli.lab.bench import bench_app
from chauffeur.cli.policies import policies_app

BENCH_EXAMPLES = help_text("main BENCH_EXAMPLES")

MODEL_EXAMPLES = help_text("main MODEL_EXAMPLES")

model_app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="markdown",
    help="Models of our own: train, fine-tune, quantise; and the policies learned from feedback.",
    epilog=MODEL_EXAMPLES,
)


def mount(app: typer.Typer, *, look: str, measure: str, build: str) -> None:
    """Add the lab's commands to `chauffeur`, under the headings of its help."""
    app.command(epilog=view.EXAMPLES, rich_help_panel=look, short_help="Runs and trips on one page, live or a file.")(
        view.view
    )
    app.command(epilog=report.EXAMPLES, rich_help_panel=look)(report.report)
    app.command(
        epilog=evaluate.EXAMPLES, rich_help_panel=measure, short_help="One planner on all benchmarks: a score card."
    )(evaluate.evaluate)
    app.add_typer(bench_app, name="bench", rich_help_panel=measure, epilog=BENCH_EXAMPLES)
    bench_app.command(epilog=coach.EXAMPLES, short_help="Human feedback on LaMPilot-Bench (Tab. IV).")(coach.coach)
    bench_app.command("coach-town", epilog=coach_town.EXAMPLES, short_help="Human feedback in towns (Tab. V).")(
        coach_town.coach_town
    )
    scenes.scenes_app.command(epilog=scenes_frames.FRAMES_EXAMPLES)(scenes_frames.frames)
    scenes.scenes_app.command(epilog=scenes_frames.SFT_EXAMPLES)(scenes_frames.sft)
    bench_app.add_typer(scenes.scenes_app, name="scenes", epilog=scenes.GENERATE_EXAMPLES)
    app.add_typer(model_app, name="model", rich_help_panel=build)
    model_app.add_typer(train.train_app, name="train", epilog=train.ONBOARD_EXAMPLES)
    model_app.command("adapt-vlm", epilog=adapt_vlm.EXAMPLES)(adapt_vlm.adapt_vlm)
    model_app.command("quantise-vlm", epilog=quantise_vlm.EXAMPLES)(quantise_vlm.quantise_vlm)
    model_app.add_typer(policies_app, name="policies")
