"""`chauffeur study`: the takeover study with people: plan, next trip, record, export, unblind."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chauffeur.cli.examples import WithExamples

if TYPE_CHECKING:
    from rich.console import Console

    from chauffeur.bench.personalization.people import PeopleStudy
    from chauffeur.bench.personalization.protocol import PeopleArm, PlannedTrip

study_app = typer.Typer(
    cls=WithExamples,
    no_args_is_help=True,
    rich_markup_mode="markdown",
    help="A study with people: who takes over how often, blind, randomised and counterbalanced (paper Tab. IX and X).",
)

Folder = Annotated[Path, typer.Argument(metavar="FOLDER", help="The study.")]
Participant = Annotated[str, typer.Option("--participant", help="Pseudonym, e.g. P001.")]

EXAMPLES = """
Examples:

    chauffeur study new lab --participants 30

    chauffeur study consent lab --participant P001

    chauffeur study next lab --participant P001 --words "Could you go a bit faster?"

    chauffeur study record lab --participant P001 --number 1 --takeover --rating 3 --comment "Too slow for me."

    chauffeur study export lab --out trips.csv

    chauffeur study withdraw lab --participant P001

    chauffeur study unblind lab

Participants have pseudonyms only. `study withdraw` erases a person. For simulated passengers: `bench personalization`.
"""


@study_app.callback(epilog=EXAMPLES)
def study() -> None:
    """A study with people."""


@study_app.command()
def new(
    folder: Folder,
    participants: Annotated[int, typer.Option(min=1, help="How many people.")] = 30,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Draws the plan again as it was; default one that nobody knows.")
    ] = None,
    learning: Annotated[int, typer.Option(min=0, help="Trips in each scenario from which the memory learns.")] = 5,
) -> None:
    """Plan a study: schedule, sealed key, and a consent text to edit."""
    from chauffeur.bench.personalization.people import PeopleStudy
    from chauffeur.cli.console import stdout

    console = stdout()
    made = PeopleStudy.create(folder, participants, seed, learning)
    each = made.standing().planned // participants
    console.print(f"Planned {participants} participants with {each} trips each in {folder}.", soft_wrap=True)
    console.print(f"Edit {folder / 'consent.md'} before anybody signs it.", soft_wrap=True)
    console.print("key.sealed says which letter is which system: do not look, and keep a copy elsewhere.")
    if seed is not None:
        console.print("Whoever knows the seed can draw the key again: keep it from those who meet participants.")


@study_app.command()
def consent(folder: Folder, participant: Participant) -> None:
    """Note that a participant has signed the consent text."""
    from chauffeur.cli.console import stdout

    _open(folder).consent(participant)
    stdout().print(f"{participant} has consented.")


@study_app.command("next")
def next_trip(
    folder: Folder,
    participant: Annotated[str, typer.Option(help="Pseudonym; default whoever has trips left.")] = "",
    words: Annotated[
        str | None, typer.Option(help="What the participant says to the car: the trip is driven, in simulation.")
    ] = None,
    planner: Annotated[str, typer.Option(help="Who plans behind the letters of Talk2Drive.")] = "talk2drive",
    operator: Annotated[
        bool, typer.Option("--operator", help="Say which system it is: for whoever runs a real vehicle, alone.")
    ] = False,
) -> None:
    """The next trip: what the participant is told, and the letter of the system; with --words, drive it."""
    from chauffeur.cli.console import stdout

    console = stdout()
    made = _open(folder)
    trip = made.next_trip(participant)
    if trip is None:
        console.print("All trips are recorded.")
        return
    if trip.participant not in made.standing().consented:
        console.print(f"{trip.participant} has not consented yet; nothing is recorded before.")
    _show_trip(console, made, trip)
    if operator:
        console.print(f"System (keep it from participant and interviewer): {_system_words(made.system(trip), planner)}")
    if words is not None:
        _drive(console, made, trip, words, planner)
    console.print(
        f"Then: chauffeur study record {folder} --participant {trip.participant} --number {trip.number} "
        "--takeover | --no-takeover --rating 1..7",
        soft_wrap=True,
        markup=False,
    )


@study_app.command()
def record(
    folder: Folder,
    participant: Participant,
    trip: Annotated[int, typer.Option("--number", min=1, help="Number of the trip, as `study next` says it.")],
    takeover: Annotated[bool, typer.Option("--takeover/--no-takeover", help="Whether the participant took over.")],
    rating: Annotated[int | None, typer.Option(help="1 (bad) to 7 (good).")] = None,
    at: Annotated[float | None, typer.Option("--takeover-s", help="When they took over, s into the trip.")] = None,
    said: Annotated[str, typer.Option(help="What they had asked the car for.")] = "",
    comment: Annotated[str, typer.Option(help="What they said afterwards; while learning, the memory hears it.")] = "",
) -> None:
    """Keep what came of a trip. Doing it again corrects it; the journal keeps both."""
    from chauffeur.cli.console import stdout

    made = _open(folder)
    row = made.record(participant, trip, takeover=takeover, rating=rating, at_s=at, said=said, comment=comment)
    heard = bool(comment.strip()) and row["phase"] == "learning" and _tell_memory(made, participant, trip, comment)
    standing = made.standing()
    stdout().print(
        f"Recorded trip {trip} of {participant}; {standing.recorded} of {standing.planned} trips of the study."
        + (" The memory heard the comment." if heard else "")
    )


@study_app.command()
def withdraw(
    folder: Folder,
    participant: Participant,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask.")] = False,
) -> None:
    """Erase a participant who withdraws: records, trips and profile."""
    from chauffeur.cli.console import stdout

    made = _open(folder)
    made.trips_of(participant)
    if not yes and not typer.confirm(f"Erase everything of {participant}?"):
        raise typer.Exit(1)
    erased = made.withdraw(participant)
    stdout().print(f"{erased} records of {participant} are erased, with their trips and profile. Copies are yours.")


@study_app.command()
def export(
    folder: Folder,
    out: Annotated[Path, typer.Option(metavar="FILE", help="File to write: `.csv`, or `.parquet` (extra `tables`).")],
) -> None:
    """Write the recorded trips, in code letters."""
    from chauffeur.bench.personalization.people import csv_text, write_parquet
    from chauffeur.cli.console import stdout
    from chauffeur.cli.parts import needs
    from chauffeur.concept import ConfigError
    from chauffeur.drive.files import publish

    if out.suffix not in (".csv", ".parquet"):
        raise ConfigError(f"{out.name} is no name for an export.", hint="It ends in .csv or .parquet.")
    if out.suffix == ".parquet":
        needs("tables", "Parquet", "pyarrow")
    rows = _open(folder).rows()
    if out.suffix == ".parquet":
        write_parquet(out, rows)
    else:
        publish(out, csv_text(rows).encode(), "export")
    stdout().print(f"{len(rows)} trips, in code letters.")


@study_app.command()
def unblind(
    folder: Folder,
    early: Annotated[bool, typer.Option("--early", help="Although trips are missing; this is written down.")] = False,
) -> None:
    """Open the key and analyse: takeover rates, reductions and intervals, as for simulated passengers."""
    import json

    from chauffeur.bench.personalization.report import people_tables
    from chauffeur.cli.console import stdout
    from chauffeur.cli.tables import show_table
    from chauffeur.drive.files import publish

    console = stdout()
    made: PeopleStudy = _open(folder)
    rows = made.unblinded(early=early)
    lines = "".join(json.dumps(row, ensure_ascii=True) + "\n" for row in rows)
    publish(folder / "results.jsonl", lines.encode(), "results")
    for title, header, table in people_tables(rows):
        show_table(console, title, header, table)
        console.print()
    people = len({row["passenger"] for row in rows})
    console.print(
        f"{people} participants, {len(rows)} trips. 95 % intervals in brackets, resampled by person; none below ten "
        f"persons. Rows: {folder / 'results.jsonl'}",
        soft_wrap=True,
    )


def _open(folder: Path) -> PeopleStudy:
    from chauffeur.bench.personalization.people import PeopleStudy

    return PeopleStudy(folder)


def _show_trip(console: Console, made: PeopleStudy, trip: PlannedTrip) -> None:
    from chauffeur.bench.personalization.protocol import INSTRUCTIONS, LEVEL_INSTRUCTIONS

    standing = made.standing()
    total = len(made.trips_of(trip.participant))
    console.print(
        f"{trip.participant}, trip {trip.number} of {total}, system {trip.letter}, scene {trip.scene} "
        f"({standing.recorded} of {standing.planned} trips of the study are recorded)",
        soft_wrap=True,
    )
    console.print(f'Tell them: "{INSTRUCTIONS[trip.task]} {LEVEL_INSTRUCTIONS[trip.level]}"', soft_wrap=True)


def _system_words(arm: PeopleArm, planner: str) -> str:
    return {
        "keyword": "the keyword rules",
        "without": f"--planner {planner}, without a profile",
        "with": f"--planner {planner}, with the participant's profile",
    }[arm]


def _drive(console: Console, made: PeopleStudy, trip: PlannedTrip, words: str, planner: str) -> None:
    """Drive in simulation, saying nothing that would give the system away."""
    from chauffeur.bench.personalization.people_drive import drive_trip

    driven = drive_trip(made, trip, words, planner)
    console.print(f"Driven, in simulation: {driven.words}", soft_wrap=True)
    if driven.file is not None:
        console.print(f"Kept in {driven.file}; it names the system, so leave it closed until the end.", soft_wrap=True)


def _tell_memory(made: PeopleStudy, participant: str, number: int, comment: str) -> bool:
    from chauffeur.bench.personalization.people_drive import tell_memory

    return tell_memory(made, made.trip(participant, number), comment)
