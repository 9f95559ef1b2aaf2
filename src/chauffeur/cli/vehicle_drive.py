"""`chauffeur vehicle drive`: wishes for a vehicle behind ROS, in words."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from chauffeur.cli.options import (
    AuditFile,
    BaseUrl,
    DryRun,
    Microphone,
    MicrophoneDevice,
    Quiet,
    Speak,
    SpeechEngine,
    VehicleFile,
    VehicleWait,
    Wishes,
)

if TYPE_CHECKING:
    pass

_STOPPED_WITH_CTRL_C: Final = 130


def drive(
    file: VehicleFile,
    wishes: Wishes = None,
    person: Annotated[str, typer.Option("--as", help="Whose wishes they are; what they said before counts.")] = "",
    planner: Annotated[
        str, typer.Option(help="`talk2drive`, `talk2drive/openai/<model>`, or an installed one that gives parameters.")
    ] = "talk2drive",
    base_url: BaseUrl = None,
    context: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Where the place, map, weather and rules come from; see docs/services.md."),
    ] = None,
    audit: AuditFile = None,
    engine: SpeechEngine = "grammar",
    microphone: Microphone = False,
    device: MicrophoneDevice = "",
    speak: Speak = False,
    dry_run: DryRun = False,
    wait: VehicleWait = 5.0,
    quiet: Quiet = False,
) -> None:
    """Say what you want of a real vehicle: it is planned, checked, written down, asked of the vehicle, confirmed."""
    import asyncio
    from contextlib import ExitStack

    from chauffeur.cli.audit import audit_options, tell_closing
    from chauffeur.cli.console import plain, stdout
    from chauffeur.cli.failures import FAILED
    from chauffeur.cli.parts import engine_named, not_kept, planner_named
    from chauffeur.cli.vehicle_desk import Desk
    from chauffeur.cli.vehicle_screen import VehicleScreen
    from chauffeur.concept import PersonId
    from chauffeur.describe.services.sources import read_sources
    from chauffeur.driving.onroad.session import VehicleSession
    from chauffeur.driving.recorder import open_vehicle_audit
    from chauffeur.driving.surroundings import opened
    from chauffeur.driving.talk.sound import Sound
    from chauffeur.driving.talk.voice import Voice
    from chauffeur.memory.choice import open_memory
    from chauffeur.planners.talk2drive.recent import fitting
    from chauffeur.worlds.ros.factory import open_vehicle
    from chauffeur.worlds.ros.settings import read_settings

    who = PersonId(person.strip())
    settings = read_settings(file)
    sources = None if context is None else read_sources(context)
    named = engine_named(engine)  # an unknown one is refused also where nobody listens
    ear = named if microphone else None
    console = stdout()
    dry = dry_run or settings.interface == "dry-run"
    with ExitStack() as stack:
        mind = planner_named(planner, base_url)
        books = None
        if audit is not None:  # before anything is published: a log that cannot be had is refused here
            key, private_log = audit_options()
            books = stack.enter_context(
                open_vehicle_audit(audit, file, settings.interface, dry_run=dry, key_file=key, private=private_log)
            )
        if private := not_kept(who):
            console.print(plain(private), style="bold yellow")
        voice = Voice() if speak else None
        sound = stack.enter_context(Sound(device)) if ear is not None else None
        screen = VehicleScreen(console, settings, dry_run=dry, quiet=quiet, voice=voice)
        car = open_vehicle(settings, dry_run=dry_run)
        stack.callback(car.close)

        async def session() -> None:
            _end_on_signals()
            async with (
                opened(sources) as place,
                VehicleSession(
                    car,
                    settings,
                    mind,
                    person=who,
                    memory=fitting(open_memory(), planner) if who else None,
                    sources=place,
                    books=books,
                    tell=screen.tell,
                ) as road,
            ):
                await road.reached(wait)
                async with Desk(road, screen).open(ear, sound, voice) as desk:
                    for wish in wishes or ():
                        if not desk.left:
                            await desk.take(wish)
                    if not desk.left and (ear is not None or not wishes):
                        await desk.read()

        interrupted = False
        try:
            asyncio.run(session())
        except (KeyboardInterrupt, asyncio.CancelledError):
            interrupted = True
    if books is not None and audit is not None:
        tell_closing(console, audit, books.close())
    if interrupted:
        raise typer.Exit(_STOPPED_WITH_CTRL_C)
    if not screen.well or (books is not None and not books.close().complete):
        raise typer.Exit(FAILED)


def _end_on_signals() -> None:
    """A plain kill or a hang-up ends the session in good order, as Ctrl-C does; under nohup a hang-up does nothing."""
    import asyncio
    import signal

    task = asyncio.current_task()
    assert task is not None
    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) != signal.SIG_IGN:
            with contextlib.suppress(ValueError, RuntimeError, NotImplementedError):  # not in the main thread
                asyncio.get_running_loop().add_signal_handler(number, task.cancel)
