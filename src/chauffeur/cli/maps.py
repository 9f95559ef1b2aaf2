"""`chauffeur maps`: towns to drive in: see what there is, build, fetch, export and draw them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

maps_app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="markdown",
    help="Towns to drive in: list, build, fetch, export and draw them.",
)

Out = Annotated[Path | None, typer.Option("--out", help="Folder of the pack; by default the user's maps folder.")]


@maps_app.callback()
def maps() -> None:
    """Towns to drive in."""


@maps_app.command("list")
def list_maps() -> None:
    """List the towns that are here."""
    from rich.table import Table
    from rich.text import Text

    from chauffeur.cli.console import plain, stdout
    from chauffeur.concept import ChauffeurError
    from chauffeur.worlds.town.library import load, packs
    from chauffeur.worlds.town.pack import maps_folder

    table = Table("town", "lanes, km", "junctions", "lights", "signs", "places", "notes", box=None, pad_edge=False)
    for name, folder in packs().items():
        try:
            pack = load(folder)
        except ChauffeurError as error:
            table.add_row(plain(name), "", "", "", "", "", plain(str(error)))
            continue
        length_km = sum(lane.length_m for lane in pack.road.lanes if lane.kind == "driving") / 1000.0
        heads = sum(len(group.heads) for group in pack.signals)
        table.add_row(
            plain(pack.name), f"{length_km:.1f}", str(len(pack.road.junctions)), str(heads), str(len(pack.signs)),
            str(len(pack.places)), plain(" ".join(pack.notes)),
        )  # fmt: skip
    stdout().print(table)
    stdout().print(Text(f"Built towns lie in {maps_folder()}.", "dim"))


@maps_app.command()
def build(
    source: Annotated[str, typer.Argument(help="An OpenDRIVE file, or the name of one of our own towns.")],
    seed: Annotated[int | None, typer.Option(help="Draw another town by the recipe of one of ours.")] = None,
    out: Out = None,
) -> None:
    """Build a town: road graph, lights and signs, and the SUMO network that goes with them.

    Tables of stop lines and light cycles (`carla_NAME_stoplines.json`, `carla_NAME_traffic_light_controller.json`) are
    taken from beside an OpenDRIVE file, or from a folder `signals` beside its own.
    """
    from chauffeur.cli.console import stdout
    from chauffeur.concept import ConfigError
    from chauffeur.worlds.town import build as building

    path = Path(source)
    with stdout().status(f"Building {path.stem} ..."):
        if path.suffix == ".xodr":
            if seed is not None:
                raise ConfigError("A file has no seed.", hint="--seed goes with the name of one of our own towns.")
            pack = building.build(building.sources_of(path), folder=out)
        else:
            pack = building.build_own(source, seed, out)
    _said(pack.xodr.parent, pack.name, pack.notes)


@maps_app.command()
def pull(
    towns: Annotated[list[str] | None, typer.Argument(help="Towns; all that are public by default.")] = None,
    host: Annotated[str, typer.Option(help="Where from, for a mirror.")] = "",
) -> None:
    """Fetch CARLA's public towns and build them. What is fetched already is not fetched again."""
    from chauffeur.cli.console import stderr
    from chauffeur.worlds.town import build as building
    from chauffeur.worlds.town import pull as pulling
    from chauffeur.worlds.town.pack import maps_folder

    console = stderr()
    for town in towns or list(pulling.PUBLIC):
        with console.status(f"{town} ..."):
            xodr = pulling.pull(
                town, maps_folder() / "sources", host=host or pulling.HOST, told=lambda name: console.print(f"  {name}")
            )
            pack = building.build(building.sources_of(xodr))
        _said(pack.xodr.parent, pack.name, pack.notes)


@maps_app.command()
def export(
    host: Annotated[str, typer.Option(help="Where the CARLA server runs.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=1, max=65535)] = 2000,
    out: Out = None,
) -> None:
    """Build a pack of the town that a running CARLA server has loaded: its lights, stop signs and cycles included."""
    from chauffeur.cli.console import stderr
    from chauffeur.worlds.town import build as building
    from chauffeur.worlds.town.export import connect
    from chauffeur.worlds.town.export import export as exported
    from chauffeur.worlds.town.pack import maps_folder

    with stderr().status("Asking the server ..."):
        sources = exported(connect(host, port), maps_folder() / "sources" / "exported")
        pack = building.build(sources, folder=out)
    _said(pack.xodr.parent, pack.name, pack.notes)


@maps_app.command()
def show(
    town: Annotated[str, typer.Argument(help="Name of a town, or folder of a pack.")],
    out: Annotated[Path | None, typer.Option("--out", help="PNG or SVG file; by default NAME.png here.")] = None,
    pixels: Annotated[int, typer.Option(min=200, max=8000, help="Longer side of a PNG.")] = 1600,
) -> None:
    """Draw a town from above: lanes, crossings, stop lines (red), signs, streets and landmarks."""
    from chauffeur.cli.console import path_text, stdout
    from chauffeur.concept import ConfigError
    from chauffeur.hmi.town_map import map_picture, map_svg
    from chauffeur.worlds.town.library import load

    pack = load(town)
    path = out if out is not None else Path(f"{pack.name}.png")
    if path.suffix == ".svg":
        path.write_text(map_svg(pack))
    elif path.suffix == ".png":
        map_picture(pack, pixels).save(path)
    else:
        raise ConfigError(f"A map is drawn as .png or .svg, not as {path.suffix or 'a file without an ending'}.")
    stdout().print(path_text(path))


def _said(folder: Path, name: str, notes: tuple[str, ...]) -> None:
    from rich.text import Text

    from chauffeur.cli.console import path_text, plain, stdout
    from chauffeur.worlds.town.library import packs

    stdout().print(Text.assemble(plain(name), " is in ", path_text(folder), "."))
    for note in notes:
        stdout().print(plain(note))
    known = name if packs().get(name) == folder else str(folder)
    stdout().print(Text(f'Drive there: chauffeur drive "Turn left." --scenario {known}'))
