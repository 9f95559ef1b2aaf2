"""`chauffeur vehicle drive`: wishes for a vehicle behind ROS, in words."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

if TYPE_CHECKING:
    from rich.console import Console

    from chauffeur.drive.onroad import Answer, Event, OnRoad, RoadBooks
    from chauffeur.worlds.ros.settings import VehicleSettings

DRIVE_EXAMPLES: Final = """
Examples:

    chauffeur vehicle drive vehicle.toml "Drive at 20 km/h." "A bit slower, please." --dry-run

    chauffeur vehicle drive vehicle.toml --as ana --context services.toml --audit trips/road.jsonl

    chauffeur vehicle drive vehicle.toml "I'm in a hurry" --planner talk2drive/openai/qwen2.5 --base-url http://localhost:11434/v1

Without a WISH, type one a line; a newer one takes the place of one that is not with the vehicle yet. `stop` asks for a
speed of 0 at once, `evaluate too fast` says how it was, `end` or Ctrl-D ends. What was asked for stays in force.

Exit codes: 0 every wish is with the vehicle (or the dry run), 1 one is not, 2 bad input, 130 ended with Ctrl-C.
"""

_EVALUATE: Final = "evaluate"
_END: Final = ("end", "quit", "exit")
_LISTEN_S: Final = 0.2
_STOPPED_WITH_CTRL_C: Final = 130


def drive(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The vehicle's configuration file; see docs/ros.md.")],
    wishes: Annotated[
        list[str] | None, typer.Argument(metavar="[WISH]...", help="What you want, one after the other.")
    ] = None,
    person: Annotated[str, typer.Option("--as", help="Whose wishes they are; what they said before counts.")] = "",
    planner: Annotated[
        str, typer.Option(help="`talk2drive`, `talk2drive/openai/<model>`, or an installed one that gives parameters.")
    ] = "talk2drive",
    base_url: Annotated[str | None, typer.Option(help="OpenAI-compatible endpoint.")] = None,
    context: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Where the place, map, weather and rules come from; see docs/services.md."),
    ] = None,
    audit: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Audit log to write; see `chauffeur audit`.")
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Print what would be published; publish nothing.")] = False,
    wait: Annotated[float, typer.Option(min=0.5, max=60.0, help="Seconds to look for the vehicle.")] = 5.0,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print what became of each wish only.")] = False,
) -> None:
    """Say what you want of a real vehicle: it is planned, checked, written down, asked of the vehicle, confirmed."""
    import asyncio
    from contextlib import ExitStack

    from chauffeur.cli.audit import tell_closing
    from chauffeur.cli.console import plain, stdout
    from chauffeur.cli.failures import FAILED
    from chauffeur.cli.parts import not_kept, planner_named
    from chauffeur.concept import PersonId
    from chauffeur.describe.services.sources import read_sources
    from chauffeur.drive.onroad import OnRoad
    from chauffeur.drive.surroundings import opened
    from chauffeur.memory.choice import open_memory
    from chauffeur.planners.talk2drive.recent import fitting
    from chauffeur.worlds.ros.opening import open_vehicle
    from chauffeur.worlds.ros.settings import read_settings

    who = PersonId(person.strip())
    settings = read_settings(file)
    sources = None if context is None else read_sources(context)
    console = stdout()
    screen = _Screen(console, settings, dry_run=dry_run or settings.interface == "dry-run", quiet=quiet)
    with ExitStack() as stack:
        mind = planner_named(planner, base_url)
        books = None
        if audit is not None:  # before anything is published: a log that cannot be had is refused here
            books = stack.enter_context(_books(audit, file, settings, dry_run=dry_run))
        if private := not_kept(who):
            console.print(plain(private), style="bold yellow")
        car = open_vehicle(settings, dry_run=dry_run)
        stack.callback(car.close)

        async def session() -> None:
            _end_on_signals()
            async with (
                opened(sources) as place,
                OnRoad(
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
                if wishes:
                    for wish in wishes:
                        await _take(road, screen, wish)
                else:
                    await _listen(road, screen)

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


def _books(path: Path, file: Path, settings: VehicleSettings, *, dry_run: bool) -> RoadBooks:
    """The audit log, as the environment wants it."""
    import os

    from chauffeur.cli.audit import KEY_VARIABLE, PRIVATE_VARIABLE
    from chauffeur.concept import ConfigError
    from chauffeur.drive.onroad import open_books

    private = os.environ.get(PRIVATE_VARIABLE, "")
    if private not in ("", "0", "1"):
        raise ConfigError(f"{PRIVATE_VARIABLE} is {private!r}.", hint="Set it to 1, or to 0.")
    key = os.environ.get(KEY_VARIABLE)
    return open_books(
        path,
        file,
        settings.interface,
        dry_run=dry_run or settings.interface == "dry-run",
        key_file=Path(key) if key else None,
        private=private == "1",
    )


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


async def _take(road: OnRoad, screen: _Screen, line: str) -> None:
    """One line: a wish, or what the person says of the drive."""
    first, _, rest = line.strip().partition(" ")
    if first.lower().rstrip(":,") == _EVALUATE:
        screen.answer(await road.evaluate(rest))
    else:
        screen.answer(await road.ask(line))


async def _listen(road: OnRoad, screen: _Screen) -> None:
    """Lines of standard input: what is typed is meant now, what a file holds is meant in its turn."""
    import asyncio

    from chauffeur.cli.lines import Lines, standard_input

    running: set[asyncio.Task[None]] = set()
    with Lines(standard_input()) as lines:
        if lines.terminal:
            screen.say("Type a wish and press Enter. `stop`, `evaluate ...`, `end`.", style="dim")
        while lines.open:
            for line in await asyncio.to_thread(lines.read, _LISTEN_S):
                if not line.strip():
                    continue
                if line.strip().lower() in _END:
                    await asyncio.gather(*running)
                    return
                task = asyncio.create_task(_take(road, screen, line))
                running.add(task)
                task.add_done_callback(running.discard)
                if not lines.terminal:
                    await task
    await asyncio.gather(*running)


class _Screen:
    """Prints events and answers as they come."""

    def __init__(self, console: Console, settings: VehicleSettings, *, dry_run: bool, quiet: bool) -> None:
        self._console, self._settings, self._dry_run, self._quiet = console, settings, dry_run, quiet
        self.well = True

    def say(self, words: str, style: str = "") -> None:
        """A line."""
        from chauffeur.cli.console import plain

        if not self._quiet:
            self._console.print(plain(words), style=style)

    def tell(self, event: Event) -> None:
        """What the session tells."""
        match event.kind:
            case "link":
                self.say(f"Vehicle: {event.words}", "dim")
            case "plan":
                self.say(f"  thoughts  {event.words}", "dim")
            case "asked":
                self._lines(event.value)
            case "late" | "trouble":
                self.say(event.words, "bold yellow")
            case "over":
                self.say(event.words)
            case _:
                pass

    def answer(self, answer: Answer) -> None:
        """What became of a wish."""
        from rich.text import Text

        from chauffeur.cli.console import plain

        self.well = self.well and (answer.done or answer.status == "superseded")
        style = "bold green" if answer.done else "bold red"
        self._console.print(Text.assemble(plain(f"“{answer.text}” "), (answer.status, style), " ", plain(answer.words)))

    def _lines(self, published: object) -> None:
        """In a dry run: the lines that would publish the same, unwrapped, to be copied."""
        from chauffeur.worlds.ros import Published
        from chauffeur.worlds.ros.autoware_ai import AutowareAi
        from chauffeur.worlds.ros.lines import command_line

        if self._dry_run and not self._quiet and isinstance(published, Published):
            ros = 1 if isinstance(self._settings.stack, AutowareAi) else 2
            for message in published.messages:
                typer.echo(command_line(message, ros))
