"""`chauffeur show scenarios`: where one can drive."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

_SHOWN = 40


def scenarios(
    data: Annotated[Path | None, typer.Option(help="Folder with LaMPilot's DbLv1 task files.")] = None,
    find: Annotated[str, typer.Option(help="Only those whose name or title contains this.")] = "",
    every: Annotated[bool, typer.Option("--all", help="All of them, however many.")] = False,
) -> None:
    """List the scenarios: the built-in ones and, with a data folder, LaMPilot's own samples."""
    from chauffeur.cli.console import plain, stdout, table
    from chauffeur.concept import ScenarioError
    from chauffeur.driving.scenarios import BUILT_IN, DATA_VARIABLE, list_scenarios

    console = stdout()
    wanted = find.casefold()
    found = [s for s in list_scenarios(data) if wanted in s.id.casefold() or wanted in s.title.casefold()]
    if not found:
        raise ScenarioError(f"No scenario matches {find!r}.", hint="Run `chauffeur show scenarios` for the whole list.")
    shown = found if every else found[:_SHOWN]
    lines = [(plain(one.id), plain(one.title), plain(one.wish)) for one in shown]
    console.print(table(("Scenario", "Road", "A wish it shows well"), lines))
    if len(shown) < len(found):
        console.print(f"... and {len(found) - len(shown)} more: add --all, or --find WORD.")
    if data is None and all(scenario in BUILT_IN for scenario in found):
        console.print(
            f"LaMPilot's 490 samples: add --data DIR (its DbLv1 folder), or set {DATA_VARIABLE}.", style="dim"
        )
