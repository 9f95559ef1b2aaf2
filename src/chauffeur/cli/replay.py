"""`chauffeur replay`: drive a recorded trip again and say whether it comes out the same, bit for bit."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rich.console import Console

    from chauffeur.driving.recording import Difference

EXAMPLES = """
Examples:

    chauffeur replay trips/hurry/trip.mcap
"""


def replay(
    recording: Annotated[Path, typer.Argument(metavar="TRIP.mcap", help="The recorded trip.")],
    limits: Annotated[str, typer.Option(help="Bounds it may not cross, as of `chauffeur drive`.")] = "default",
) -> None:
    """Drive a recorded trip again, from its program and seed, and compare every instant.

    No planner is asked. The program passes today's checks, and is driven with today's safety filter and within today's
    limits. Exit code 1 says that it was refused, or that the drive came out differently.
    """
    from rich.text import Text

    from chauffeur.cli.console import plain, stdout
    from chauffeur.cli.failures import FAILED
    from chauffeur.cli.parts import limits_named
    from chauffeur.driving.again import drive_again
    from chauffeur.driving.divergence import probable_reasons
    from chauffeur.driving.judge.choice import referee_for
    from chauffeur.driving.recording import compare_trips, read_trip
    from chauffeur.memory.personal_limits import personal_limits

    console = stdout()
    recorded = read_trip(recording)
    trip = recorded.trip
    console.print(Text.assemble("Replaying “", plain(trip.instruction.text), f"” ({trip.scenario}, seed {trip.seed})"))
    if recorded.note:
        console.print(recorded.note, style="yellow")
    done = drive_again(recorded, personal_limits(trip.instruction.person, limits_named(limits)), referee_for)
    for note in done.notes:
        console.print(plain(note), style="yellow")
    if done.trip is None:
        console.print(Text.assemble(("Not driven: ", "bold red"), plain(done.refusal)))
        raise typer.Exit(FAILED)
    difference = compare_trips(recorded, done.trip)
    if difference is None:
        again = done.trip
        seconds, held = again.trip.duration_s, len(recorded.frames)
        periods = f"{held} control periods, {seconds:.1f} s, outcome {again.trip.outcome}"
        if recorded.cut_off:
            periods = f"the {held} control periods that can be read; the drive took {seconds:.1f} s"
        console.print(Text.assemble(("The same, bit for bit: ", "bold green"), f"{periods}."))
        return
    _tell(console, difference, probable_reasons(recorded, difference, done.verdicts))
    raise typer.Exit(FAILED)


def _tell(console: Console, difference: Difference, reasons: tuple[str, ...]) -> None:
    from rich.text import Text

    from chauffeur.cli.console import columns, plain

    when = "after the last control period"
    if difference.tick is not None:
        when = f"in control period {difference.tick} (at {difference.time_s:.1f} s)"
    console.print(Text(f"Not the same. The first difference is {when}:", "bold red"))
    console.print(
        columns(
            [
                ("Quantity", plain(difference.field)),
                ("Recorded", plain(difference.first)),
                ("Now", plain(difference.second)),
                *(("Probably" if not place else "", plain(reason)) for place, reason in enumerate(reasons)),
            ]
        )
    )
