"""`chauffeur me`: what the car remembers of a person, in that person's hands."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from chauffeur.memory.privacy import Privacy

me_app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="markdown",
    help="What is remembered of you: see it, take it with you, erase it.",
)

Person = Annotated[str, typer.Option("--as", help="Whose profile.")]


@me_app.callback()
def me() -> None:
    """What is remembered of you."""


@me_app.command()
def show(person: Person, most: Annotated[int, typer.Option(min=1, help="Trips at most, newest first.")] = 20) -> None:
    """Show what is remembered, the settings, and your limits."""
    import json

    from rich.table import Table
    from rich.text import Text

    from chauffeur.cli.console import path_text, plain, stdout
    from chauffeur.concept import Limits, PersonId
    from chauffeur.concept.data import data_home
    from chauffeur.concept.units import people_speed
    from chauffeur.memory.choice import open_memory
    from chauffeur.memory.personal_limits import LIMITS_FILE, personal_limits
    from chauffeur.memory.privacy import read_privacy
    from chauffeur.memory.records import result_of_kept

    console, privacy = stdout(), read_privacy()
    trips = json.loads(open_memory().export(PersonId(person)))["trips"]
    if trips:
        table = Table("when", "wish", "what came of it", "what you said", box=None, pad_edge=False)
        for trip in trips[::-1][:most]:
            said = "; ".join(each["text"] for each in trip["feedback"])
            when, result = trip["when"][:16].replace("T", " "), str(result_of_kept(trip))
            table.add_row(when, plain(trip["instruction"]), result, plain(said))
        console.print(table)
        console.print(Text(f"{len(trips)} trips in all.", "dim"))
    else:
        console.print(Text.assemble("Nothing is remembered of ", plain(person), "."))
    kept = "until they are erased" if privacy.retention_days is None else f"for {privacy.retention_days} days"
    console.print(Text(f"Trips are kept {kept}.", "dim"))
    if not privacy.keeps:
        console.print(Text("Privacy mode is on: nothing new is kept.", "bold yellow"))
    limits = personal_limits(PersonId(person), Limits())
    if limits != Limits():
        cap = (
            "" if limits.max_speed_mps is None else f"never above {people_speed(limits.max_speed_mps, at_most=True)}, "
        )
        over = f"{people_speed(limits.max_over_limit_mps, at_most=True)} above the sign at most"
        words = f"Your limits: {cap}{over}, {limits.min_time_headway_s:g} s headway or more "
        console.print(Text.assemble(words, "(", path_text(data_home() / LIMITS_FILE), ")"))


@me_app.command()
def export(person: Person, out: Annotated[Path | None, typer.Option(help="File; default the screen.")] = None) -> None:
    """Take everything that is kept with you, as JSON."""
    from chauffeur.cli.console import path_text, stdout
    from chauffeur.concept import PersonId
    from chauffeur.memory.choice import open_memory
    from chauffeur.memory.files import publish

    document = open_memory().export(PersonId(person))
    if out is None:
        stdout().print(document, markup=False, highlight=False, soft_wrap=True)
        return
    publish(out, (document + "\n").encode())
    stdout().print("Written:", path_text(out))


@me_app.command("forget-last")
def forget_last(person: Person) -> None:
    """Forget the last trip."""
    from rich.text import Text

    from chauffeur.cli.console import plain, stdout
    from chauffeur.concept import PersonId
    from chauffeur.memory.choice import open_memory

    item = open_memory().forget_last(PersonId(person))
    if item is None:
        stdout().print(Text.assemble("Nothing is remembered of ", plain(person), "."))
        return
    stdout().print(Text.assemble("Forgotten: “", plain(item.instruction), f"” ({item.when[:16].replace('T', ' ')})"))


@me_app.command()
def erase(person: Person, yes: Annotated[bool, typer.Option("--yes", help="Do not ask.")] = False) -> None:
    """Erase the whole profile: its key first, so that no copy of the file can be read again."""
    from rich.text import Text

    from chauffeur.cli.console import plain, stdout
    from chauffeur.concept import PersonId
    from chauffeur.memory.choice import open_memory

    if not yes:
        typer.confirm(f"Erase everything that is remembered of {person}? It cannot be undone", abort=True)
    gone = open_memory().erase(PersonId(person))
    words = (
        ("Erased: the profile of ", plain(person), ".") if gone else ("There was no profile of ", plain(person), ".")
    )
    stdout().print(Text.assemble(*words))


@me_app.command()
def retention(
    days: Annotated[str, typer.Argument(help="Days trips are kept, or `forever`.")],
) -> None:
    """Set how long trips are kept, of everybody; what is older goes now."""
    from dataclasses import replace

    from chauffeur.cli.console import stdout
    from chauffeur.concept import ConfigError
    from chauffeur.memory.choice import open_memory
    from chauffeur.memory.privacy import write_privacy

    if days != "forever" and not days.isdecimal():
        raise ConfigError(f"{days!r} is no number of days.", hint="Write for example: chauffeur me retention 90")
    write_privacy(replace(_settings(), retention_days=None if days == "forever" else int(days)))
    swept = open_memory().sweep()
    kept = "until they are erased" if days == "forever" else f"for {int(days)} days"
    stdout().print(f"Trips are kept {kept}. {swept} older ones were deleted.")


@me_app.command()
def privacy(
    mode: Annotated[str, typer.Argument(help="`on`: nothing new is kept; `off`: trips are kept.")],
) -> None:
    """Turn privacy mode on or off, for everybody."""
    from dataclasses import replace

    from chauffeur.cli.console import stdout
    from chauffeur.concept import ConfigError
    from chauffeur.memory.privacy import write_privacy

    if mode not in ("on", "off"):
        raise ConfigError(f"Privacy mode {mode!r} is unknown.", hint="Write on or off.")
    write_privacy(replace(_settings(), keeps=mode == "off"))
    stdout().print(
        "Privacy mode is on: nothing new is kept." if mode == "on" else "Privacy mode is off: trips are kept."
    )


def _settings() -> Privacy:
    """The settings as they are; the default ones where the file is broken, for they are about to be set."""
    from chauffeur.concept import ConfigError
    from chauffeur.memory.privacy import Privacy, read_privacy

    try:
        return read_privacy()
    except ConfigError:
        return Privacy(keeps=False)  # what somebody may have wished is not given up by mending the file
