"""`chauffeur what-if`: the situation of a recorded trip, driven by another planner, beside the recording."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from textwrap import shorten
from typing import TYPE_CHECKING, Annotated, Final

import typer

from chauffeur.cli.options import BaseUrl

if TYPE_CHECKING:
    from rich.text import Text

    from chauffeur.concept.units import SpeedUnit
    from chauffeur.driving.recording import RecordedTrip

_TOLD: Final = 400
"""Characters of the reasoning that are shown; language models write pages, which the recordings hold."""


def what_if(
    recording: Annotated[Path, typer.Argument(metavar="TRIP.mcap", help="The recorded trip.")],
    planner: Annotated[str, typer.Option(help="Who plans now: as for `chauffeur drive`, or MODULE:NAME.")],
    base_url: BaseUrl = None,
    limits: Annotated[str, typer.Option(help="Bounds it may not cross, as of `chauffeur drive`.")] = "default",
    save: Annotated[Path | None, typer.Option(help="Folder for the new recording, page and filmstrip.")] = None,
) -> None:
    """Drive a recorded situation with another planner, and show both drives side by side.

    Wish, scenario, seed and history are the recording's; of its limits and today's the stricter hold. Checks, safety
    filter and judge are today's.
    """
    from rich.table import Table
    from rich.text import Text

    from chauffeur.cli.compilation import CompilationNotice
    from chauffeur.cli.console import plain, stdout
    from chauffeur.cli.drive import save_trip
    from chauffeur.cli.parts import limits_named, planner_named
    from chauffeur.cli.show import Teller
    from chauffeur.driving.again import drive_otherwise
    from chauffeur.driving.judge.choice import referee_for
    from chauffeur.driving.recording import read_trip
    from chauffeur.hmi.words import pace_of, seed_words
    from chauffeur.memory.personal_limits import personal_limits

    console = stdout()
    then = read_trip(recording)
    trip = then.trip
    asked = planner_named(planner, base_url)
    bounds = personal_limits(trip.instruction.person, limits_named(limits))
    where = f"” ({trip.scenario}, seed {seed_words(trip.seed)})"
    console.print(Text.assemble("What if: “", plain(trip.instruction.said or trip.instruction.text), plain(where)))
    with Teller(console) as teller, CompilationNotice(teller.compiling):
        done = drive_otherwise(then, asked, bounds, referee_for, teller.tell)
    for note in (then.note, *done.notes):
        if note:
            console.print(plain(note), style="yellow")
    now = done.trip
    assert now is not None
    table = Table.grid(padding=(0, 2, 0, 0))
    table.add_column(style="dim")
    for _ in range(2):
        table.add_column(overflow="fold", ratio=1)
    for name, *sides in _rows(then, now, pace_of(trip.instruction.text)):
        table.add_row(name, *(side if isinstance(side, Text) else plain(side) for side in sides))
    console.print(table)
    if save is not None:
        Teller(console).wrote(save_trip(save, now))


def _rows(then: RecordedTrip, now: RecordedTrip, unit: SpeedUnit) -> Iterator[tuple[str, *tuple[str | Text, ...]]]:
    """Lines of the comparison: a name, the recording's and the new drive's."""
    from rich.text import Text

    from chauffeur.driving.divergence import motion_parts, setpoints_part
    from chauffeur.hmi import words
    from chauffeur.hmi.payload import policy_words

    pair = then.trip, now.trip
    yield "", Text("recorded", "bold"), Text("now", "bold")
    yield "Planner", *(" ".join(dict.fromkeys((one.plan.planner, one.plan.model))) for one in pair)
    told = [one.plan.thoughts.text.strip() or one.plan.refusal or "(nothing said)" for one in pair]
    yield "Understood", *(words.passenger_units(shorten(text, _TOLD, placeholder=" …"), unit) for text in told)
    yield "Intent", *(one.plan.intent or "not told" for one in pair)
    kinds = [one.plan.policy.kind.replace("_", " ") if one.plan.policy else "none" for one in pair]
    sizes = [f", {len(policy_words(one.plan.policy).splitlines())} lines" if one.plan.policy else "" for one in pair]
    yield "Policy", *(kind + (size if kind == "program" else "") for kind, size in zip(kinds, sizes, strict=True))
    stopped = [[words.check_name(verdict.check) for verdict in one.verdicts if not verdict.passed] for one in pair]
    yield "Checks", *(f"not passed: {', '.join(names)}" if names else "passed" for names in stopped)
    marks = [words.trip_words(one, timed=True) for one in pair]
    yield "Outcome", *(Text(f"{sign} {label}", f"bold {_TONES[tone]}") for sign, label, tone in marks)
    yield "", *(words.passenger_units(one.causes.detail, unit) or words.end_words(one) for one in pair)
    metrics = [{metric.id: words.metric_value(metric, unit) for metric in one.metrics} for one in pair]
    for name in dict.fromkeys((*metrics[0], *metrics[1])):
        yield words.metric_name(name), *(found.get(name, "–") for found in metrics)
    if then.frames and now.frames:
        yield "Set-points part", *words.parting_words(setpoints_part(then, now), unit)
        yield "Motion parts", *words.parting_words(motion_parts(then, now), unit)


_TONES = {"good": "green", "bad": "red", "neutral": "default"}
