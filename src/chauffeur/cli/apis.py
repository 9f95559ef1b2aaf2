"""`chauffeur show apis`: what a program may ask of the car."""

from __future__ import annotations

from typing import Annotated

import typer


def apis(
    name: Annotated[str, typer.Argument(help="One of them, in full; all in short without it.")] = "",
    town: Annotated[bool, typer.Option("--town", help="Only those that there are in towns alone.")] = False,
) -> None:
    """List the driving APIs: the whole language in which a program may speak to the car."""
    from rich.padding import Padding
    from rich.syntax import Syntax
    from rich.text import Text

    from chauffeur.cli.console import columns, stdout
    from chauffeur.concept import ConfigError
    from chauffeur.programs.catalogue import CATALOGUE, TOWN_CALLS, apis_of, plugged_apis

    console = stdout()
    if not name:
        effects = {"read": "Ask", "wish": "Wish", "say": "Say"}
        offered = (*(TOWN_CALLS if town else CATALOGUE), *plugged_apis().values())
        for effect, heading in effects.items():
            shown = [api for api in offered if api.effect == effect]
            if shown:
                console.print(heading, style="bold")
            for api in shown:
                console.print(Padding(Text(api.signature, "cyan"), (0, 0, 0, 2)))
                console.print(Padding(Text(api.meaning), (0, 0, 0, 6)))
        waits = "`yield proceed(speed)` lets 0.05 s pass" if town else "`yield autopilot()` lets 0.1 s pass"
        console.print(f"\nA program is a generator function; {waits}.", style="dim")
        return
    known = apis_of("town")
    if name not in known:
        import difflib

        near = difflib.get_close_matches(name, list(known), n=1)
        raise ConfigError(
            f"There is no driving API {name!r}.",
            hint=f"Did you mean {near[0]}?" if near else "Run: chauffeur show apis",
        )
    api = known[name]
    console.print(Syntax(api.signature, "python", theme="ansi_dark", background_color="default"))
    console.print(api.meaning)
    rows = [(p.name, f"{p.meaning}{f', in {p.unit}' if p.unit else ''}") for p in api.params]
    if api.result:
        rows.append(("gives", api.result))
    rows.append(("example", api.example))
    console.print(columns(rows))
