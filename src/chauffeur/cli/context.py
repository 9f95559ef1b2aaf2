"""`chauffeur show context`: what the driving context would say of a place on the earth."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from chauffeur.describe.services import Position, Surroundings
    from chauffeur.describe.services.surroundings import Row


def context(
    at: Annotated[str, typer.Option(metavar="LAT,LON", help="The place, in degrees (WGS 84).")],
    heading: Annotated[float | None, typer.Option(help="Compass heading of the car: 0 north, 90 east.")] = None,
    accuracy: Annotated[float, typer.Option(help="Standard deviation of the position, in metres.")] = 5.0,
    map_file: Annotated[Path | None, typer.Option("--map", metavar="FILE", help="An OpenStreetMap file.")] = None,
    region: Annotated[str, typer.Option(help="Whose traffic rules hold: a name, or a rule file (.toml).")] = "",
    online: Annotated[
        list[str] | None,
        typer.Option(help="A service to ask: `weather`, `map` or `traffic`, or `map=URL` for a server of your own."),
    ] = None,
    budget: Annotated[float, typer.Option(help="Seconds that all services together may take.")] = 0.3,
    as_json: Annotated[bool, typer.Option("--json", help="Print the numbers as JSON.")] = False,
) -> None:
    """Tell what a driving context would say of a place: weather, road, limit, traffic, rules; with ages and sources."""
    import asyncio

    from chauffeur.describe.services import Sources, SourceSettings, load_road_map, load_rules

    urls: dict[Any, str] = {name: url for name, _, url in (one.partition("=") for one in online or [])}
    here = position(at, heading, accuracy)
    settings = SourceSettings(
        here,
        tuple(urls),
        {name: url for name, url in urls.items() if url},
        rules=load_rules(region) if region else None,
        road_map=load_road_map(map_file) if map_file is not None else None,
        budget_s=budget,
    )

    async def tell() -> None:
        async with Sources(settings) as sources:
            found = await sources.around(here, budget_s=budget)
            # Told before the services are closed: a resolver of names that hangs would hold up the closing.
            if as_json:
                _print_json(found)
            else:
                _print_words(found)

    asyncio.run(tell())


def position(at: str, heading: float | None, accuracy: float) -> Position:
    """The place that was given.

    Raises:
        ConfigError: It is none.
    """
    from chauffeur.concept import ConfigError
    from chauffeur.describe.services import Position

    try:
        latitude, longitude = (float(one) for one in at.split(","))
    except ValueError as error:
        raise ConfigError(
            f"{at!r} is not a place.", hint="Give latitude and longitude in degrees, e.g. --at 48.137,11.575"
        ) from error
    return Position(latitude, longitude, heading, accuracy)


def _print_words(found: Surroundings) -> None:
    from chauffeur.cli.console import plain, stdout, table
    from chauffeur.describe.services.units import age_words

    console = stdout()
    console.print("What the driving context would say", style="bold")
    for words in found.words():
        console.print(plain(words))
    rows = found.rows()
    if any(row.note.startswith("the service did not answer within") for row in rows):
        console.print("Some services did not answer in time; they may with more of it: --budget 3", style="dim")
    known = [row for row in rows if row.source]
    if not known:
        return
    console.print()
    lines = [
        (row.name, plain(_value(row)), plain(row.source), "" if row.age_s is None else age_words(row.age_s),
         f"{row.confidence:.2f}")
        for row in known
    ]  # fmt: skip
    console.print(table(("Reading", "Value", "Source", "Age", "Confidence"), lines))
    if any(row.source.startswith("OpenStreetMap") for row in known):
        console.print("Map data: OpenStreetMap contributors, ODbL.", style="dim")


def _value(row: Row) -> str:
    if row.value is None:
        return "none"
    return row.value if isinstance(row.value, str) else f"{row.value:.1f} {row.unit}".strip()


def _print_json(found: Surroundings) -> None:
    import json
    from dataclasses import asdict

    from chauffeur.cli.console import echo

    at = found.at
    told = {
        "at": {"latitude_deg": at.latitude_deg, "longitude_deg": at.longitude_deg, "heading_deg": at.heading_deg},
        "when_s": found.when_s,
        "words": found.words(),
        "readings": [asdict(row) for row in found.rows()],
    }
    echo(json.dumps(told, ensure_ascii=False, indent=2))
