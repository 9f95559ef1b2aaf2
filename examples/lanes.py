"""A command: `chauffeur lanes cruise` lists the lanes of a scenario's road.

    [project.entry-points."chauffeur.commands"]
    lanes = "lanes:lanes"

Typer makes the command of the function: its parameters are arguments and options, its docstring is the help.
"""

from typing import Annotated

import typer

from chauffeur.driving.episode import make_world
from chauffeur.driving.scenarios import find


def lanes(
    scenario: Annotated[str, typer.Argument(help="A built-in scenario.")] = "cruise",
    kind: Annotated[str, typer.Option(help="Kind of lane.")] = "driving",
) -> None:
    """List the lanes of a scenario's road: name, length, width and speed limit."""
    place = find(scenario)
    for lane in make_world(place).reset(place).road.lanes:
        if lane.kind == kind:
            typer.echo(f"{lane.id:12} {lane.length_m:7.1f} m {lane.width_m:4.1f} m {lane.speed_limit_mps:5.1f} m/s")
