"""The `chauffeur` command. Importing this module is cheap: what drives, draws or talks is imported inside commands."""

from __future__ import annotations

import logging
import sys
from typing import Annotated, Any, Final

import typer

from chauffeur.cli import (
    apis,
    camera,
    context,
    doctor,
    drive,
    feedback,
    hear,
    meaning,
    page,
    plugins,
    policies,
    replay,
    scenarios,
    talk,
    unmasking,
    what_if,
)
from chauffeur.cli.audit import audit_app
from chauffeur.cli.check import check_app
from chauffeur.cli.examples import help_text
from chauffeur.cli.failures import FriendlyGroup, debugging, show_crash
from chauffeur.cli.maps import maps_app
from chauffeur.cli.me import me_app
from chauffeur.cli.printable import PrintableFormatter
from chauffeur.cli.vehicle import vehicle_app
from chauffeur.concept.lab import LAB_COMMANDS, has_lab, needs_lab
from chauffeur.concept.registry import load_plugin, plugin_names
from chauffeur.version import __version__

EXAMPLES = help_text("main")

SHOW_EXAMPLES = help_text("main SHOW_EXAMPLES")

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

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Find the command; of the lab's it is said how to get them. Raises MissingExtraError."""
        if args and args[0] in LAB_COMMANDS:
            needs_lab(f"`chauffeur {args[0]}`")
        return super().resolve_command(ctx, args)

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

app.command(epilog=replay.EXAMPLES, rich_help_panel=LOOK, short_help="A recorded trip again, bit for bit.")(
    replay.replay
)
app.command(
    "what-if",
    epilog=what_if.EXAMPLES,
    rich_help_panel=LOOK,
    short_help="A recorded trip with another planner, side by side.",
)(what_if.what_if)
app.add_typer(show_app, name="show", rich_help_panel=LOOK)
app.command(epilog=doctor.EXAMPLES, rich_help_panel=LOOK, short_help="Check this installation.")(doctor.doctor)
app.command(epilog=plugins.EXAMPLES, rich_help_panel=LOOK, short_help="What is installed, and of whom.")(
    plugins.plugins
)
show_app.command(epilog=scenarios.EXAMPLES)(scenarios.scenarios)
show_app.command(epilog=apis.EXAMPLES)(apis.apis)
show_app.command("policies", epilog=policies.SHOW_EXAMPLES)(policies.show_policies)
show_app.command(epilog=context.EXAMPLES)(context.context)
show_app.command(epilog=meaning.EXAMPLES)(meaning.meaning)
show_app.command(epilog=page.EXAMPLES)(page.page)
show_app.command(epilog=camera.EXAMPLES)(camera.camera)
show_app.command(epilog=unmasking.EXAMPLES)(unmasking.unmasking)
show_app.command("speech", epilog=hear.EXAMPLES)(hear.hear)

if has_lab():
    from chauffeur.cli.lab import commands as lab

    lab.mount(app, look=LOOK, measure=MEASURE, build=BUILD)

app.add_typer(vehicle_app, name="vehicle", rich_help_panel=BUILD)
app.add_typer(maps_app, name="maps", rich_help_panel=BUILD)
app.add_typer(audit_app, name="audit", rich_help_panel=BUILD)
app.add_typer(check_app, name="check", rich_help_panel=BUILD)


def run() -> None:
    """Entry point of the `chauffeur` script."""
    if logging.lastResort is not None:
        logging.lastResort.setFormatter(PrintableFormatter())
    if not debugging():
        sys.excepthook = show_crash
    # Calling `app` itself would put Typer's own exception hook in the place of ours.
    typer.main.get_command(app)()
