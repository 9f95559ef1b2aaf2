"""`chauffeur replay`: drive a recorded trip again and say whether it comes out the same, bit for bit."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from chauffeur.driving.recording import RecordedTrip


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
    console.print(Text("Not the same. The first difference, recorded against now:", "bold red"))
    console.print(Text("  ") + plain(str(difference)))
    for line in other_versions(recorded):
        console.print(Text("  ") + plain(line))
    raise typer.Exit(FAILED)


def other_versions(recorded: RecordedTrip) -> list[str]:
    """What has changed on this machine since the recording, as far as it could matter."""
    import platform

    from chauffeur.driving.episode import make_world
    from chauffeur.version import __version__

    changed: list[str] = []
    for name, then in recorded.trip.record:
        if name == "python":
            now = platform.python_version()
        elif name == "chauffeur":
            now = __version__
        elif name == "engine":
            now = make_world(recorded.scenario).engine
        else:
            continue
        if now != then:
            changed.append(f"recorded with {name} {then}, now {now}")
    return changed
