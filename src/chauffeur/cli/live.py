"""`chauffeur live`: driving in real time, wish after wish."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final

import typer

EXAMPLES = """
Examples:

    chauffeur live

    chauffeur live "Overtake the car in front of you." "Now slow down to 80 km/h." --every 10

    chauffeur live --as ana --audit trips/live.jsonl --duration 120

    chauffeur live --planner openai/qwen2.5 --base-url http://localhost:11434/v1

    chauffeur live "Park near the stadium." --planner talk2drive --scenario parking-stadium

    chauffeur live --speed 4 < wishes.txt

Type a wish and press Enter. `take over` gives you the wheel: `faster`, `slower`, `left`, `right` and `brake` move the
car until `give back`. `stop` or Ctrl-C brings the car to a stand and ends, a second Ctrl-C ends at once.
Exit code 1 says that a wish was not driven, or that the drive ended badly. Every drive is simulated.
"""

STOPPED_WITH_CTRL_C: Final = 130


def live(
    wishes: Annotated[
        list[str] | None, typer.Argument(metavar="WISH", help="What you want, one after the other.")
    ] = None,
    scenario: Annotated[str | None, typer.Option(help="Where to drive; default one that suits the first wish.")] = None,
    planner: Annotated[
        str,
        typer.Option(
            help="`onboard`, `talk2drive`, `keyword`, `openai/<model>`, `replay/<file>`, or an installed one."
        ),
    ] = "onboard",
    person: Annotated[str, typer.Option("--as", help="Whose wishes they are; their history is recalled.")] = "",
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of the traffic; default the scenario's own.")] = None,
    base_url: Annotated[str | None, typer.Option(help="OpenAI-compatible endpoint.")] = None,
    limits: Annotated[str, typer.Option(help="Bounds no plan may cross: `default` or `lampilot`.")] = "default",
    duration: Annotated[float, typer.Option(min=1.0, max=3600.0, help="Seconds to drive, in the car's time.")] = 60.0,
    speed: Annotated[float, typer.Option(min=0.1, max=20.0, help="Seconds of the car's time in a second.")] = 1.0,
    every: Annotated[
        float | None,
        typer.Option(
            min=0.0, help="Seconds from one given wish to the next; default when it is done, or driven for 10 s."
        ),
    ] = None,
    audit: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Audit log to write; see `chauffeur audit`.")
    ] = None,
    realtime: Annotated[
        bool, typer.Option("--realtime/--no-realtime", help="Whether control asks for real-time scheduling.")
    ] = True,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print the outcome only.")] = False,
) -> None:
    """Drive in real time, and say what you want while driving."""
    from contextlib import ExitStack

    from chauffeur.cli.audit import auditor_for, tell_closing
    from chauffeur.cli.console import stdout
    from chauffeur.cli.failures import FAILED
    from chauffeur.cli.lines import Lines, standard_input
    from chauffeur.cli.live_drive import LiveDrive
    from chauffeur.cli.live_screen import LiveScreen, QuietScreen
    from chauffeur.cli.parts import limits_named, not_kept, planner_named
    from chauffeur.concept import PersonId, SandboxError
    from chauffeur.drive.live.books import Books, unanswered
    from chauffeur.drive.live.remembering import Remembering
    from chauffeur.drive.live.settings import Settings
    from chauffeur.drive.live.starts import Start
    from chauffeur.drive.live.supervisor import Runtime
    from chauffeur.drive.scenarios import find, suiting
    from chauffeur.drive.session import make_world, parse_wish
    from chauffeur.drive.surroundings import services_file
    from chauffeur.memory.choice import chosen_memory, open_memory
    from chauffeur.memory.personal_limits import personal_limits

    who = PersonId(person.strip())
    given = [parse_wish(wish, who).text for wish in wishes or ()]
    place = find(scenario) if scenario is not None else suiting(given[0] if given else "")
    bounds = personal_limits(who, limits_named(limits))
    start = Start(place, place.seed if seed is None else seed, bounds, duration)
    settings = Settings(
        starts=(start,),
        planner=planner,
        base_url=base_url,
        memory=chosen_memory() if who else "",
        services=str(services_file() or ""),
        speed=speed,
        realtime=realtime,
    )
    console = stdout()
    dt_s = make_world(place).dt_s
    screen = QuietScreen(console, dt_s) if quiet else LiveScreen(console, dt_s)
    books = None
    with ExitStack() as stack:
        left = () if audit is None else unanswered(audit)
        if audit is not None:  # before anything moves: a log that cannot be had is refused here
            books = stack.enter_context(Books(auditor_for(audit, place, start.seed), dt_s))
        screen.begin(place, start.seed, planner)
        if private := not_kept(who):
            screen.note(private)
        for wish in left:
            screen.note(f"Without an answer since the last session: {wish.wish} “{wish.text}”")
        stack.enter_context(screen)
        screen.refresh(None, stopping=False)
        memory = Remembering(open_memory(), start, dt_s) if who else None
        drive = LiveDrive(screen, books, memory, given, who, every)
        lines = stack.enter_context(Lines(standard_input(), edited=console.is_terminal))
        try:
            runtime = stack.enter_context(Runtime(settings, drive.tell))
        except SandboxError:
            planner_named(planner, base_url)  # says better what is wrong with the planner, if it is that
            raise
        if books is not None:
            books.follow(runtime, settings)
        if memory is not None:
            memory.follow(runtime)
        drive.run(runtime, lines)
    closing = None if books is None else books.close()
    if audit is not None and closing is not None and not quiet:
        tell_closing(console, audit, closing)
    if drive.interrupts.count:
        raise typer.Exit(STOPPED_WITH_CTRL_C)
    if not drive.well or (closing is not None and not closing.complete):
        raise typer.Exit(FAILED)
