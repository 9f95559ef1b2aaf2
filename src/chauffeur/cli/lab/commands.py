"""What the lab adds to `chauffeur`: `evaluate`, `bench`, `view`, `report`, `model`."""

from __future__ import annotations

import typer

from chauffeur.cli.lab import coach, evaluate, report, view
from chauffeur.cli.lab.bench import bench_app
from chauffeur.cli.lab.tasks import add_task, scenes_app, train_app
from chauffeur.cli.policies import policies_app
from chauffeur.models.tasks import adapt_vlm, quantise_vlm

model_app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="markdown",
    help="Models of our own: train, fine-tune, quantise; and the policies learned from feedback.",
)


def mount(app: typer.Typer, *, look: str, measure: str, build: str) -> None:
    """Add the lab's commands to `chauffeur`, under the headings of its help."""
    app.command(rich_help_panel=look, short_help="Runs and trips on one page, live or a file.")(view.view)
    app.command(rich_help_panel=look)(report.report)
    app.command(rich_help_panel=measure, short_help="One planner on all benchmarks: a score card.")(evaluate.evaluate)
    app.add_typer(bench_app, name="bench", rich_help_panel=measure)
    bench_app.command(short_help="Human feedback: items, or towns (Tab. IV, V).")(coach.coach)
    bench_app.add_typer(scenes_app, name="scenes")
    app.add_typer(model_app, name="model", rich_help_panel=build)
    model_app.add_typer(train_app, name="train")
    add_task(model_app, "adapt-vlm", adapt_vlm)
    add_task(model_app, "quantise-vlm", quantise_vlm)
    model_app.add_typer(policies_app, name="policies")
