"""`chauffeur talk`: a drive in real time that one talks with."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Final

import typer

from chauffeur.cli.options import (
    VOICE,
    AuditFile,
    BaseUrl,
    LimitsName,
    Microphone,
    MicrophoneDevice,
    Quiet,
    Speak,
    SpeechEngine,
    TrafficSeed,
    Wishes,
)

if TYPE_CHECKING:
    from chauffeur.hmi.cabin import Cabin

STOPPED_WITH_CTRL_C: Final = 130
_QUIET_ROAD: Final = "overtake"
"""Where one drives until something is wished."""
_TRIP_S: Final = 75.0
"""A road takes about so long; then another begins."""


def talk(
    wishes: Wishes = None,
    person: Annotated[str, typer.Option("--as", help="Whose wishes they are; their memory is used.")] = "",
    planner: Annotated[
        str,
        typer.Option(
            help="`onboard`, `talk2drive`, `keyword`, `openai/<model>`, or an installed one; "
            "default `onboard`, in a parking lot `talk2drive`.",
            show_default=False,
        ),
    ] = "",
    base_url: BaseUrl = None,
    scenario: Annotated[str | None, typer.Option(help="Where to drive; default one that suits the first wish.")] = None,
    seed: TrafficSeed = None,
    limits: LimitsName = "default",
    duration: Annotated[
        float, typer.Option(min=1.0, max=7200.0, help="Seconds to drive at most, in the car's time.")
    ] = 900.0,
    every: Annotated[
        float | None,
        typer.Option(
            min=0.0, help="Seconds from one given wish to the next; default when it is done; 10 s if it has no end."
        ),
    ] = None,
    time_scale: Annotated[float, typer.Option(min=0.1, max=20.0, help="Seconds of the car's time in a second.")] = 1.0,
    realtime: Annotated[
        bool, typer.Option("--realtime/--no-realtime", help="Whether control asks for real-time scheduling.")
    ] = True,
    quiet: Quiet = False,
    engine: SpeechEngine = "grammar",
    microphone: Microphone = False,
    device: MicrophoneDevice = "",
    page: Annotated[
        bool, typer.Option("--page/--no-page", help="Open the cabin page in the browser.", rich_help_panel=VOICE)
    ] = False,
    speak: Speak = False,
    audit: AuditFile = None,
) -> None:
    """Drive in real time and talk: it says what it thinks and what was checked, and remembers how you liked it."""
    from contextlib import ExitStack

    from chauffeur.cli.audit import auditor_for, tell_closing
    from chauffeur.cli.console import Screen, columns, plain, stdout
    from chauffeur.cli.control_figures import control_figures
    from chauffeur.cli.failures import FAILED
    from chauffeur.cli.interrupts import Interrupts
    from chauffeur.cli.lines import Lines, standard_input
    from chauffeur.cli.parts import engine_named, limits_named, not_kept, planner_named
    from chauffeur.cli.talk_drive import TalkDrive
    from chauffeur.cli.talk_screen import TalkScreen
    from chauffeur.concept import PersonId, SandboxError
    from chauffeur.driving.live.settings import Settings
    from chauffeur.driving.live.starts import Start
    from chauffeur.driving.recorder import unanswered
    from chauffeur.driving.scenarios import find, lasting, planner_for, seeds_with_lead, suiting
    from chauffeur.driving.session import parse_wish
    from chauffeur.driving.surroundings import services_file
    from chauffeur.driving.talk.session import WELL, Talk
    from chauffeur.driving.talk.sound import Sound
    from chauffeur.driving.talk.voice import Voice
    from chauffeur.memory.choice import chosen_memory, open_memory
    from chauffeur.memory.personal_limits import personal_limits

    who = PersonId(person.strip())
    given = [parse_wish(wish, who).text for wish in wishes or ()]
    place = find(scenario or _QUIET_ROAD) if scenario or not given else suiting(given[0])
    planner = planner_for(planner, place)
    bounds = personal_limits(who, limits_named(limits))
    trips = math.ceil(duration / _TRIP_S)
    place = lasting(place, duration)
    seeds = seeds_with_lead(place, place.seed if seed is None else seed, trips)
    first = seeds[0] if seed is None else seed  # a seed that was asked for is driven, whoever is on the road
    settings = Settings(
        starts=tuple(Start(place, number, bounds, duration) for number in (first, *seeds[1:])),
        planner=planner,
        base_url=base_url,
        memory=chosen_memory() if who else "",
        services=str(services_file() or ""),
        speed=time_scale,
        realtime=realtime,
    )
    if who:
        open_memory()  # one that cannot be had is refused here
    named = engine_named(engine)  # an unknown one is refused also where nobody listens
    ear = named if microphone or page else None
    console = stdout()
    screen = TalkScreen(Screen(quiet=True) if quiet else console)
    books = None
    with ExitStack() as stack:
        left = () if audit is None else unanswered(audit)
        if audit is not None:
            books = stack.enter_context(auditor_for(audit, place, first))
        sound = stack.enter_context(Sound(device)) if microphone else None
        voice = Voice() if speak else None
        drive = TalkDrive(screen, stack.enter_context(_cabin()) if page else None, given, every)
        if private := not_kept(who):
            screen.note(private)
        for wish in left:
            screen.note(f"Without an answer since the last session: {wish.wish} “{wish.text}”")
        stack.enter_context(screen)
        interrupts = stack.enter_context(Interrupts())
        lines = stack.enter_context(Lines(standard_input(), edited=console.is_terminal))
        session = Talk(
            settings, drive.tell, person=who, books=books, engine=ear, sound=sound, voice=voice, most_s=duration
        )
        screen.refresh(None)
        try:
            stack.enter_context(session)
        except SandboxError:
            planner_named(planner, base_url)  # says better what is wrong with the planner, if it is that
            raise
        drive.run(session, lines, interrupts)
    closing = None if books is None else books.close()
    if quiet:
        console.print(plain(f"{screen.ended} ({screen.time_s:.1f} s, simulated drive)"))
    else:
        console.print(columns((name, plain(said)) for name, said in control_figures(session.tally)))
    if audit is not None and closing is not None and not quiet:
        tell_closing(console, audit, closing)
    if interrupts.count:
        raise typer.Exit(STOPPED_WITH_CTRL_C)
    if session.outcome not in WELL or not drive.well or (closing is not None and not closing.complete):
        raise typer.Exit(FAILED)


def _cabin() -> Cabin:
    import os

    from chauffeur.hmi.cabin import Cabin
    from chauffeur.hmi.cabin.address import address_of

    at = address_of(os.environ)
    return Cabin(host=at.host, port=at.port, certificate=at.certificate)
