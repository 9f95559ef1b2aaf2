"""`chauffeur replay`: drive a recorded trip again and say whether it comes out the same, bit for bit."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from chauffeur.drive.recording import RecordedTrip

EXAMPLES = """
Examples:

    chauffeur replay trips/hurry/trip.mcap
"""


def replay(
    recording: Annotated[Path, typer.Argument(metavar="TRIP.mcap", help="The recorded trip.")],
) -> None:
    """Drive a recorded trip again, from its program and seed, and compare every instant.

    No planner is asked. Exit code 1 says that the drive came out differently.
    """
    from rich.text import Text

    from chauffeur.cli.console import plain, stdout
    from chauffeur.cli.failures import FAILED
    from chauffeur.drive.recording import compare_trips, read_trip

    console = stdout()
    recorded = read_trip(recording)
    trip = recorded.trip
    console.print(Text.assemble("Replaying “", plain(trip.instruction.text), f"” ({trip.scenario}, seed {trip.seed})"))
    again = drive_again(recorded)
    difference = compare_trips(recorded, again)
    if difference is None:
        periods = f"{len(again.frames)} control periods, {trip.duration_s:.1f} s, outcome {trip.outcome}"
        console.print(Text.assemble(("The same, bit for bit: ", "bold green"), f"{periods}."))
        return
    console.print(Text("Not the same. The first difference, recorded against now:", "bold red"))
    console.print(Text("  ") + plain(str(difference)))
    for line in other_versions(recorded):
        console.print(Text("  ") + plain(line))
    raise typer.Exit(FAILED)


def drive_again(recorded: RecordedTrip) -> RecordedTrip:
    """The same program on the same scenario with the same seed. Raises DataError if the recording holds no drive."""
    from dataclasses import replace

    from chauffeur.bench.referees import referee_for
    from chauffeur.concept import DataError, Limits
    from chauffeur.drive.session import drive_policy, make_world, trip_s

    trip, scenario = recorded.trip, recorded.scenario
    policy = trip.plan.policy
    if not recorded.frames or policy is None:
        raise DataError(f"The recording holds no drive: its outcome is {trip.outcome}.", hint="Replay a driven trip.")
    world = make_world(scenario)
    world.reset(scenario, trip.seed)
    referee = referee_for(world, scenario, trip.plan, trip.instruction.text)
    record = dict(trip.record)
    limits = Limits(**record["limits"])
    episode = drive_policy(
        world,
        policy,
        referee,
        trip_s(scenario),
        limits,
        shielded="shield" in record,
        minimum_speed="minimum_speed" in record,
    )
    driven = replace(
        trip,
        outcome=episode.outcome,
        causes=episode.causes,
        metrics=episode.metrics,
        duration_s=episode.duration_s,
        said=episode.said,
    )
    return replace(recorded, trip=driven, frames=episode.frames, final=episode.final)


def other_versions(recorded: RecordedTrip) -> list[str]:
    """What has changed on this machine since the recording, as far as it could matter."""
    import platform

    from chauffeur import __version__
    from chauffeur.drive.session import make_world

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
