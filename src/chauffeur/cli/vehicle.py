"""`chauffeur vehicle`: look at the way to a vehicle, ask it for parameters, and hand it over to its computer."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from chauffeur.cli import egodriver
from chauffeur.cli.examples import WithExamples, help_text
from chauffeur.cli.vehicle_drive import DRIVE_EXAMPLES, drive

if TYPE_CHECKING:
    from collections.abc import Callable

    from chauffeur.worlds.ros import RosVehicleState, VehicleInterface
    from chauffeur.worlds.ros.rosbridge import RosbridgeSettings

vehicle_app = typer.Typer(
    cls=WithExamples,
    no_args_is_help=True,
    rich_markup_mode="markdown",
    help="Vehicles behind ROS: what is asked of them, and how the way to them is.",
)

EXAMPLES = help_text("vehicle")

_NOT_FROM_HERE: Final = "Only a vehicle with Autoware.AI behind rosbridge is engaged and disengaged from here."
_ON_ITS_OWN_SCREEN: Final = "Use the vehicle's own screen."

File = Annotated[Path, typer.Argument(metavar="FILE", help="The vehicle's configuration file; see docs/ros.md.")]
Wait = Annotated[float, typer.Option(min=0.5, max=60.0, help="Seconds to look for the vehicle.")]


@vehicle_app.callback(epilog=EXAMPLES)
def vehicle() -> None:
    """Vehicles behind ROS."""


@vehicle_app.command()
def check(file: File, wait: Wait = 5.0) -> None:
    """Say what the file allows, and whether the vehicle can be reached. Nothing is published."""
    from chauffeur.cli.console import columns, plain, stdout
    from chauffeur.cli.failures import FAILED
    from chauffeur.concept.units import kmh
    from chauffeur.worlds.ros.autoware_ai import AutowareAi, ConstantSpeed
    from chauffeur.worlds.ros.factory import open_vehicle
    from chauffeur.worlds.ros.settings import read_settings

    settings = read_settings(file)
    limits, stack = settings.stack.limits, settings.stack
    rows = [
        ("interface", settings.interface),
        ("speed", f"0 to {kmh(limits.max_speed_mps):.4g} km/h"),
        ("look-ahead", f"{limits.look_ahead_m[0]:g} to {limits.look_ahead_m[1]:g} m"),
        ("ratio", f"{limits.look_ahead_ratio_s[0]:g} to {limits.look_ahead_ratio_s[1]:g} s"),
    ]
    console = stdout()
    console.print(columns(((name, plain(text)) for name, text in rows), indent=0))
    if isinstance(stack, AutowareAi) and isinstance(stack.source, ConstantSpeed):
        words = f"Planned stops are IGNORED: {stack.source.acknowledgement.name} answers for it."
        console.print(plain(words), style="bold red")
    car = open_vehicle(settings)
    try:
        state = _wait_for(car, wait, lambda state: state.link in ("up", "refused", "dry-run"))
        _show(state)
    finally:
        car.close()
    if state.link not in ("up", "dry-run"):
        raise typer.Exit(FAILED)


@vehicle_app.command()
def apply(
    file: File,
    speed: Annotated[float, typer.Option(help="Target speed, m/s: the cap on planned speeds.")],
    look_ahead: Annotated[float, typer.Option(help="Look-ahead, m.")] = 8.0,
    ratio: Annotated[float, typer.Option(help="Look-ahead per speed, s.")] = 2.0,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Print what would be published; publish nothing.")] = False,
    wait: Wait = 5.0,
) -> None:
    """Ask the vehicle for parameters, once. They stay in force when the command ends."""
    from chauffeur.cli.console import echo, plain, stdout
    from chauffeur.cli.failures import FAILED
    from chauffeur.concept import Parameters
    from chauffeur.worlds.ros.dry import DryRun
    from chauffeur.worlds.ros.factory import open_vehicle
    from chauffeur.worlds.ros.settings import read_settings

    car = open_vehicle(read_settings(file), dry_run=dry_run)
    try:
        published = car.apply(Parameters(speed, look_ahead, ratio))
        stdout().print(plain(published.words))
        if isinstance(car, DryRun):
            for line in car.lines:
                echo(line)  # unwrapped, to be copied
            stdout().print("Dry run: nothing was published.")
            return
        state = _wait_for(car, wait, lambda state: state.delivered or state.link == "refused")
        _show(state)
    finally:
        car.close()
    if not state.delivered:
        stdout().print("Not delivered: the vehicle was not asked.", style="bold")
        raise typer.Exit(FAILED)


@vehicle_app.command()
def release(file: File, wait: Wait = 5.0) -> None:
    """Take the speed cap back: the vehicle drives as its own planner plans, which may be faster."""
    from chauffeur.cli.console import plain, stdout
    from chauffeur.cli.failures import FAILED
    from chauffeur.worlds.ros.factory import open_vehicle
    from chauffeur.worlds.ros.settings import read_settings

    car = open_vehicle(read_settings(file))
    try:
        stdout().print(plain(car.release().words))
        state = _wait_for(car, wait, lambda state: state.delivered or state.link == "dry-run")
        _show(state)
    finally:
        car.close()
    if not state.delivered and state.link != "dry-run":
        raise typer.Exit(FAILED)


@vehicle_app.command()
def watch(
    file: File,
    duration: Annotated[float, typer.Option(min=1.0, help="Seconds to watch; default until Ctrl-C.")] = 86400.0,
) -> None:
    """Show the way to the vehicle and its speed, a line when something changes. Nothing is published."""
    import time

    from chauffeur.worlds.ros.factory import open_vehicle
    from chauffeur.worlds.ros.settings import read_settings

    car = open_vehicle(read_settings(file))
    shown = ""
    try:
        end_s = time.monotonic() + duration
        while time.monotonic() < end_s:
            state = car.state()
            if (line := _line(state)) != shown:
                _show(state)
            shown = line
            time.sleep(0.2)
    except KeyboardInterrupt:
        pass
    finally:
        car.close()


vehicle_app.command(epilog=DRIVE_EXAMPLES)(drive)
vehicle_app.command(epilog=egodriver.EXAMPLES)(egodriver.egodriver)


@vehicle_app.command()
def engage(file: File, wait: Wait = 5.0) -> None:
    """Engage drive-by-wire. A word is shown, and a person has to type it."""
    import sys

    from chauffeur.cli.console import plain, stdout
    from chauffeur.concept import ConfigError
    from chauffeur.worlds.ros.engage import engage as engage_vehicle
    from chauffeur.worlds.ros.engage import word_to_type

    bridge = _engaged_over(file)
    if not sys.stdin.isatty():
        raise ConfigError(
            "Engaging needs a person at a terminal.", hint="Run it by hand; it takes no input from a file."
        )
    word = word_to_type()
    stdout().print("The vehicle will be driven by its computer. Hands on the wheel, foot over the brake.", style="bold")
    typed = typer.prompt(f"Type {word} to engage", default="", show_default=False)
    nodes = engage_vehicle(bridge, word, str(typed).strip(), within_s=wait)
    stdout().print(plain(f"Engaged; {nodes} node{'s' if nodes > 1 else ''} listening."))


@vehicle_app.command()
def disengage(file: File, wait: Wait = 5.0) -> None:
    """Give the vehicle back to its driver. Nothing has to be typed for it."""
    from chauffeur.cli.console import plain, stdout
    from chauffeur.worlds.ros.engage import disengage as disengage_vehicle

    bridge = _engaged_over(file)
    nodes = disengage_vehicle(bridge, within_s=wait)
    stdout().print(plain(f"Disengaged; {nodes} node{'s' if nodes > 1 else ''} listening."))


def _engaged_over(file: Path) -> RosbridgeSettings:
    """Where a vehicle is engaged; raises ConfigError for one that is not engaged from here."""
    from chauffeur.concept import ConfigError
    from chauffeur.worlds.ros.autoware_ai import AutowareAi
    from chauffeur.worlds.ros.settings import read_settings

    settings = read_settings(file)
    if settings.interface != "rosbridge" or not isinstance(settings.stack, AutowareAi):
        raise ConfigError(_NOT_FROM_HERE, hint=_ON_ITS_OWN_SCREEN)
    return settings.rosbridge


def _wait_for(car: VehicleInterface, within_s: float, enough: Callable[[RosVehicleState], bool]) -> RosVehicleState:
    """The first state that is enough, or the last one seen."""
    import time

    end_s = time.monotonic() + within_s
    while not enough(state := car.state()) and time.monotonic() < end_s:
        time.sleep(0.02)
    return state


def _line(state: RosVehicleState) -> str:
    from chauffeur.concept.units import kmh

    speed = "" if state.speed_mps is None else f" {kmh(state.speed_mps):.0f} km/h."
    mode = f" Mode: {state.mode}." if state.mode else ""
    return f"{state.words}{speed}{mode}"


def _show(state: RosVehicleState) -> None:
    from chauffeur.cli.console import plain, stdout

    stdout().print(plain(_line(state)))
