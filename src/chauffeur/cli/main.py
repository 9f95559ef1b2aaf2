"""The `chauffeur` command. Importing this module is cheap: what drives, draws or talks is imported inside commands."""

from __future__ import annotations

import logging
import sys
from typing import Annotated

import typer

from chauffeur import __version__
from chauffeur.cli import (
    apis,
    bench_alignment,
    bench_hostile,
    bench_personalization,
    chaos,
    coach,
    context,
    doctor,
    drive,
    feedback,
    hear,
    live,
    page,
    replay,
    report,
    scenarios,
    talk,
    wheel,
)
from chauffeur.cli.adapt import adapt_app
from chauffeur.cli.audit import audit_app
from chauffeur.cli.bench import bench_app
from chauffeur.cli.failures import FriendlyGroup, debugging, show_crash
from chauffeur.cli.me import me_app
from chauffeur.cli.policies import policies_app
from chauffeur.cli.printable import PrintableFormatter
from chauffeur.cli.scenes import scenes_app
from chauffeur.cli.serve import serve_app
from chauffeur.cli.study import study_app
from chauffeur.cli.train import train_app
from chauffeur.cli.vehicle import vehicle_app

EXAMPLES = """
Examples:

    chauffeur drive "Overtake the car in front of you."

    chauffeur drive "I'm in a hurry" --as ana --save trips/hurry --open

    chauffeur live "Overtake the car in front of you."

    chauffeur talk --as ana

    chauffeur feedback "A bit too close for me." --as ana

    chauffeur replay trips/hurry/trip.mcap

Every drive is simulated. Exit codes: 0 done, 1 refused or failed, 2 bad input, 130 stopped with Ctrl-C.
"""

app = typer.Typer(
    cls=FriendlyGroup,
    no_args_is_help=True,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=EXAMPLES,
)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"chauffeur {__version__}")
        raise typer.Exit


@app.callback()
def chauffeur(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and leave.")
    ] = False,
) -> None:
    """A passenger says what they want; the car does it, safely, says why, and remembers how they liked it."""
    del version


app.command(epilog=drive.EXAMPLES)(drive.drive)
app.command(epilog=live.EXAMPLES)(live.live)
app.command(epilog=talk.EXAMPLES)(talk.talk)
app.command(epilog=chaos.EXAMPLES)(chaos.chaos)
app.command(epilog=feedback.EXAMPLES)(feedback.feedback)
app.command(epilog=hear.EXAMPLES)(hear.hear)
app.command(epilog=context.EXAMPLES)(context.context)
app.command(epilog=scenarios.EXAMPLES)(scenarios.scenarios)
app.command(epilog=apis.EXAMPLES)(apis.apis)
app.command(epilog=replay.EXAMPLES)(replay.replay)
app.command(epilog=page.EXAMPLES)(page.page)
app.command(epilog=report.EXAMPLES)(report.report)
app.command(epilog=doctor.EXAMPLES)(doctor.doctor)
bench_app.command(epilog=wheel.EXAMPLES)(wheel.human)
bench_app.command(epilog=coach.EXAMPLES)(coach.coach)
bench_app.command(epilog=bench_alignment.EXAMPLES)(bench_alignment.alignment)
bench_app.command(epilog=bench_hostile.EXAMPLES)(bench_hostile.hostile)
bench_app.command(epilog=bench_personalization.EXAMPLES)(bench_personalization.personalization)
app.add_typer(bench_app, name="bench")
app.add_typer(me_app, name="me")
app.add_typer(policies_app, name="policies")
app.add_typer(scenes_app, name="scenes")
app.add_typer(study_app, name="study")
app.add_typer(train_app, name="train")
app.add_typer(serve_app, name="serve")
app.add_typer(adapt_app, name="adapt")
app.add_typer(audit_app, name="audit")
app.add_typer(vehicle_app, name="vehicle")


def run() -> None:
    """Entry point of the `chauffeur` script."""
    if logging.lastResort is not None:
        logging.lastResort.setFormatter(PrintableFormatter())
    if not debugging():
        sys.excepthook = show_crash
    # Calling `app` itself would put Typer's own exception hook in the place of ours.
    typer.main.get_command(app)()
