"""The `chauffeur` command. Importing this module is cheap: what drives, draws or talks is imported inside commands."""

from __future__ import annotations

import logging
import sys
from typing import Annotated, Any, Final

import typer

from chauffeur.cli import (
    apis,
    camera,
    coach,
    coach_town,
    context,
    doctor,
    drive,
    feedback,
    hear,
    meaning,
    page,
    policies,
    replay,
    report,
    scenarios,
    talk,
    unmasking,
)
from chauffeur.cli.audit import audit_app
from chauffeur.cli.bench import bench_app
from chauffeur.cli.check import check_app
from chauffeur.cli.examples import help_text
from chauffeur.cli.failures import FriendlyGroup, debugging, show_crash
from chauffeur.cli.maps import maps_app
from chauffeur.cli.me import me_app
from chauffeur.cli.printable import PrintableFormatter
from chauffeur.cli.tasks import add_task, scenes_app, train_app
from chauffeur.cli.vehicle import vehicle_app
from chauffeur.concept.registry import load_plugin, plugin_names
from chauffeur.models.tasks import adapt_vlm, quantise_vlm
from chauffeur.version import __version__

EXAMPLES = help_text("main")

SHOW_EXAMPLES = help_text("main SHOW_EXAMPLES")

BENCH_EXAMPLES = help_text("main BENCH_EXAMPLES")

MODEL_EXAMPLES = help_text("main MODEL_EXAMPLES")

DRIVE, LOOK, MEASURE, BUILD = "Drive", "Look", "Measure", "Build"
"""What somebody comes for; the headings of `chauffeur --help`."""

COMMANDS: Final = "chauffeur.commands"
"""Entry points of further commands: functions that Typer makes commands of."""


class ChauffeurGroup(FriendlyGroup):
    """The commands written here, and one for each that an installed package registers."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Names of all of them."""
        known = super().list_commands(ctx)
        return [*known, *(name for name in plugin_names(COMMANDS) if name not in known)]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command of a name; None where there is none."""
        command = super().get_command(ctx, cmd_name)
        if command is not None or cmd_name not in plugin_names(COMMANDS):
            return command
        own = typer.Typer(rich_markup_mode="markdown")
        own.command(cmd_name)(load_plugin(COMMANDS, cmd_name))
        return typer.main.get_command(own)


app = typer.Typer(
    cls=ChauffeurGroup,
    no_args_is_help=True,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=EXAMPLES,
)
show_app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="markdown",
    help="Show scenarios, driving APIs, policies, the context of a place, a trip's page, what is heard, what is seen.",
    epilog=SHOW_EXAMPLES,
)
model_app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="markdown",
    help="Models of our own: train, fine-tune, quantise; and the policies learned from feedback.",
    epilog=MODEL_EXAMPLES,
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


app.command(epilog=drive.EXAMPLES, rich_help_panel=DRIVE)(drive.drive)
app.command(epilog=talk.EXAMPLES, rich_help_panel=DRIVE)(talk.talk)
app.command(epilog=feedback.EXAMPLES, rich_help_panel=DRIVE)(feedback.feedback)
app.add_typer(me_app, name="me", rich_help_panel=DRIVE)

app.command(epilog=replay.EXAMPLES, rich_help_panel=LOOK)(replay.replay)
app.command(epilog=report.EXAMPLES, rich_help_panel=LOOK)(report.report)
app.add_typer(show_app, name="show", rich_help_panel=LOOK)
app.command(epilog=doctor.EXAMPLES, rich_help_panel=LOOK)(doctor.doctor)
show_app.command(epilog=scenarios.EXAMPLES)(scenarios.scenarios)
show_app.command(epilog=apis.EXAMPLES)(apis.apis)
show_app.command("policies", epilog=policies.SHOW_EXAMPLES)(policies.show_policies)
show_app.command(epilog=context.EXAMPLES)(context.context)
show_app.command(epilog=meaning.EXAMPLES)(meaning.meaning)
show_app.command(epilog=page.EXAMPLES)(page.page)
show_app.command(epilog=camera.EXAMPLES)(camera.camera)
show_app.command(epilog=unmasking.EXAMPLES)(unmasking.unmasking)
show_app.command("speech", epilog=hear.EXAMPLES)(hear.hear)

app.add_typer(bench_app, name="bench", rich_help_panel=MEASURE, epilog=BENCH_EXAMPLES)
bench_app.command(epilog=coach.EXAMPLES, short_help="Human feedback on LaMPilot-Bench (Tab. IV).")(coach.coach)
bench_app.command("coach-town", epilog=coach_town.EXAMPLES, short_help="Human feedback in towns (Tab. V).")(
    coach_town.coach_town
)
bench_app.add_typer(scenes_app, name="scenes", epilog=help_text("scenes generate"))

app.add_typer(model_app, name="model", rich_help_panel=BUILD)
app.add_typer(vehicle_app, name="vehicle", rich_help_panel=BUILD)
app.add_typer(maps_app, name="maps", rich_help_panel=BUILD)
app.add_typer(audit_app, name="audit", rich_help_panel=BUILD)
app.add_typer(check_app, name="check", rich_help_panel=BUILD)
model_app.add_typer(train_app, name="train", epilog=help_text("train onboard"))
add_task(model_app, "adapt-vlm", adapt_vlm, "adapt_vlm")
add_task(model_app, "quantise-vlm", quantise_vlm, "quantise_vlm")
model_app.add_typer(policies.policies_app, name="policies")


def run() -> None:
    """Entry point of the `chauffeur` script."""
    if logging.lastResort is not None:
        logging.lastResort.setFormatter(PrintableFormatter())
    if not debugging():
        sys.excepthook = show_crash
    # Calling `app` itself would put Typer's own exception hook in the place of ours.
    typer.main.get_command(app)()
