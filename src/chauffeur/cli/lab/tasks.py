"""`chauffeur model train`, `adapt-vlm`, `quantise-vlm` and `chauffeur bench scenes`: commands made of functions.

See `bench.kernel.task`: what a function takes are the options of its command, what it gives is shown here.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

import typer

from chauffeur.bench.tasks import SCENES
from chauffeur.cli.interrupts import stopped_kindly
from chauffeur.cli.lab.generated import options_of, taking
from chauffeur.models.tasks import TRAINED

train_app = typer.Typer(no_args_is_help=True, rich_markup_mode="markdown", help="Train models of our own.")
scenes_app = typer.Typer(
    no_args_is_help=True, rich_markup_mode="markdown", help="Make, check and count scenes with instructions."
)


def add_task(app: typer.Typer, name: str, make: Callable[..., Any]) -> None:
    """Add the command of a function that does long work and gives a TaskResult."""
    parameters = inspect.signature(make).parameters.values()
    first = [one.name for one in parameters if one.kind is inspect.Parameter.POSITIONAL_ONLY]

    def run(**given: Any) -> None:
        from chauffeur.bench.kernel.task import TextTable
        from chauffeur.cli.console import plain, stdout
        from chauffeur.cli.failures import FAILED
        from chauffeur.cli.lab.stages import stages_shown
        from chauffeur.cli.lab.tables import show_table

        console = stdout()
        with stopped_kindly(console, given.get("out")), stages_shown(console) as told:
            hears = {"told": told} if any(one.name == "told" for one in parameters) else {}
            arguments = [given.pop(name) for name in first]
            result = make(*arguments, **given, **hears)
        for part in result.parts:
            if isinstance(part, TextTable):
                show_table(
                    console, plain(part.title), part.header, [[plain(c).plain for c in row] for row in part.lines]
                )
                console.print()
            else:
                console.print(plain(part), soft_wrap=True)
        if result.faulty:
            raise typer.Exit(FAILED)

    about = (inspect.getdoc(make) or "").partition("\n\n")[0]
    options = [one for one in options_of(make) if one.name != "told"]
    app.command(name, help=about)(taking(options, run))


for _name, _make in TRAINED.items():
    add_task(train_app, _name, _make)
for _name, _make in SCENES.items():
    add_task(scenes_app, _name, _make)
