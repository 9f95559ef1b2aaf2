"""`chauffeur plugins`: everything that is installed behind an entry point, where it comes from, and if it loads."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text

    from chauffeur.concept.registry import Plugin


def plugins(
    load: Annotated[
        bool, typer.Option("--load", help="Import each one; without it their modules are looked for, and not run.")
    ] = False,
) -> None:
    """List every kind of plug-in, from worlds to commands, and the packages they come from.

    Exit code 1 where one of them cannot be loaded.
    """
    from chauffeur.cli.console import stdout
    from chauffeur.cli.failures import FAILED
    from chauffeur.concept.registry import GROUPS, plugins

    console = stdout()
    found = plugins()
    faults = {one: one.fault(load=load) for one in found}
    for group, members in groupby(found, key=lambda one: one.group):
        console.print(group, style="bold")
        _list(console, [(one, faults[one]) for one in members])
    within = _without_entry_points()
    for group in GROUPS:
        if all(one.group != group for one in found):
            said = f"built in: {', '.join(within[group])}; " if group in within else ""
            console.print(f"{group}: {said}none from other packages", style="dim")
    broken = sum(bool(fault) for fault in faults.values())
    foreign = sum(not one.built_in for one in found)
    how = "loaded" if load else "found, not loaded (--load does)"
    console.print(f"\n{len(found) - broken} of {len(found)} {how}; {foreign} from other packages.")
    if broken:
        raise typer.Exit(FAILED)


def _list(console: Console, members: list[tuple[Plugin, str]]) -> None:
    from rich.table import Table

    table = Table.grid(padding=(0, 2, 0, 0))
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    table.add_column(overflow="fold", style="dim")
    for one, fault in members:
        table.add_row(f"  {one.name}", _state(one, fault), one.where)
    console.print(table)


def _state(one: Plugin, fault: str) -> Text:
    """Where it comes from, and what is wrong with it."""
    from rich.text import Text

    from chauffeur.cli.console import plain

    version = "" if one.built_in else one.version  # of ours `chauffeur --version` tells it
    said = plain(f"{one.package or 'a package without a name'} {version}".strip())
    said.append(", built in" if one.built_in else ", third party", "" if one.built_in else "cyan")
    if one.shadowed:
        said.append("; not used: its name is taken", "yellow")
    if fault:
        said.append_text(Text.assemble(("; does not load: ", "bold red"), plain(fault)))
    return said


def _without_entry_points() -> dict[str, tuple[str, ...]]:
    """Built-in parts of the groups that are for other packages alone."""
    from chauffeur.executors.registry import BUILT_IN
    from chauffeur.safety.checks import DRIVE_CHECKS

    names = (getattr(check, "__name__", "").removeprefix("check_") for check in DRIVE_CHECKS)
    calls = ("chauffeur show apis",)
    return {"chauffeur.executors": tuple(BUILT_IN), "chauffeur.apis": calls, "chauffeur.checks": tuple(names)}
