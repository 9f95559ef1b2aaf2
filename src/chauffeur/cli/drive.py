"""`chauffeur drive`: one wish, from the words to the last metre."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from chauffeur.cli.examples import help_text
from chauffeur.cli.options import AuditFile

if TYPE_CHECKING:
    from chauffeur.driving.recording import RecordedTrip

EXAMPLES = help_text("drive")

SEEN: Final = (
    "The planner is told what BEV-LLM sees in rendered pictures; checks and safety filter use the world's own state."
)
_RESEARCH: Final = "Models and benchmarks"


def drive(
    wish: Annotated[str, typer.Argument(help="What you want, in your own words.")],
    scenario: Annotated[
        str | None,
        typer.Option(help="Where to drive; default one that suits the wish. See `chauffeur show scenarios`."),
    ] = None,
    planner: Annotated[
        str,
        typer.Option(
            help="`onboard`, `talk2drive`, `vilad` (parking, open road), `keyword`, `openai/<model>`, `replay/<file>`, "
            "or an installed one; default `onboard`, in a parking lot `talk2drive`.",
            show_default=False,
        ),
    ] = "",
    person: Annotated[str, typer.Option("--as", help="Whose wish it is; their history is recalled and kept.")] = "",
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of the traffic; default the scenario's own.")] = None,
    save: Annotated[Path | None, typer.Option(help="Folder for recording, page and filmstrip.")] = None,
    base_url: Annotated[str | None, typer.Option(help="OpenAI-compatible endpoint.", rich_help_panel=_RESEARCH)] = None,
    setting: Annotated[
        str, typer.Option(help="Prompt: `few-shot` or `zero-shot`.", rich_help_panel=_RESEARCH)
    ] = "few-shot",
    seeing: Annotated[
        str,
        typer.Option(
            help="Where the situation is read from: the world's own `state`, or rendered `cameras` (BEV-LLM; "
            "`cameras/FOLDER` for a trained one).",
            rich_help_panel=_RESEARCH,
        ),
    ] = "state",
    limits: Annotated[
        str, typer.Option(help="Bounds no plan may cross: `default` or `lampilot`.", rich_help_panel=_RESEARCH)
    ] = "default",
    data: Annotated[
        Path | None, typer.Option(help="LaMPilot's DbLv1 folder, for its own samples.", rich_help_panel=_RESEARCH)
    ] = None,
    audit: AuditFile = None,
    print_prompt: Annotated[
        bool,
        typer.Option(
            "--print-prompt",
            help="Print what the planner's model would be sent, and stop there.",
            rich_help_panel=_RESEARCH,
        ),
    ] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print the outcome only.")] = False,
    full: Annotated[
        bool, typer.Option("--full", help="Print everything as it comes, in SI units: helpers, scores, provenance.")
    ] = False,
    browser: Annotated[
        bool, typer.Option("--open/--no-open", help="Open the page of the drive; without --save in ./trips.")
    ] = False,
) -> None:
    """Drive a wish: plan it, check it, drive it, score it."""
    import asyncio
    from contextlib import ExitStack
    from dataclasses import replace

    from chauffeur.cli.audit import auditor_for, tell_closing
    from chauffeur.cli.compilation import CompilationNotice
    from chauffeur.cli.console import stdout
    from chauffeur.cli.failures import FAILED
    from chauffeur.cli.parts import (
        limits_named,
        not_kept,
        planner_named,
        seeing_named,
        setting_named,
        standing_sources,
    )
    from chauffeur.cli.show import FullTeller, Quiet, Teller
    from chauffeur.concept import PersonId, Result, result_of
    from chauffeur.driving.events import told_to
    from chauffeur.driving.judge.choice import referee_for
    from chauffeur.driving.recorder import with_head
    from chauffeur.driving.scenarios import find, planner_for, suiting
    from chauffeur.driving.session import Forgetful, Session, parse_wish
    from chauffeur.memory.choice import open_memory
    from chauffeur.memory.personal_limits import personal_limits
    from chauffeur.planners.talk2drive.recent import fitting

    instruction = parse_wish(wish, PersonId(person.strip()))
    bounds = personal_limits(instruction.person, limits_named(limits))
    place = suiting(instruction.text) if scenario is None else find(scenario, data)
    planner = planner_for(planner, place)
    console = stdout()
    teller = Quiet(console) if quiet else FullTeller(console) if full else Teller(console)
    session = Session(
        planner=planner_named(planner, base_url, teller.writing),
        memory=fitting(open_memory(), planner) if instruction.person else Forgetful(),
        sources=standing_sources(),
        referee=referee_for,
        tell=teller.tell,
        setting=setting_named(setting),
    )
    start_seed = place.seed if seed is None else seed
    session.seeing = seeing_named(seeing, start_seed)
    if session.seeing is not None:
        console.print(SEEN, style="dim", markup=False)
    if print_prompt:
        from chauffeur.cli.prompts import show_prompt

        session.tell = Quiet(console).tell
        show_prompt(console, session.planner, asyncio.run(session.request(instruction, place, start_seed, bounds)))
        return
    with ExitStack() as stack:
        auditor = None
        if audit is not None:  # before anything moves: a log that cannot be had is refused here
            auditor = stack.enter_context(auditor_for(audit, place, start_seed))
            session.tell = told_to(auditor.tell, teller.tell)
        teller.begin(place, start_seed)
        if private := not_kept(instruction.person):
            console.print(private, style="bold yellow", markup=False)
        stack.enter_context(teller)
        stack.enter_context(CompilationNotice(teller.compiling))
        recorded = asyncio.run(session.drive(instruction, place, start_seed, bounds))
        plan = recorded.trip.plan
        if plan.offer and auditor is None and asking() and typer.confirm(plan.refusal):
            meant = replace(instruction, text=plan.offer, confirmed=plan.refusal)
            recorded = asyncio.run(session.drive(meant, place, start_seed, bounds))
    closing = None if auditor is None else auditor.close()
    if closing is not None:
        recorded = with_head(recorded, closing)
    teller.end(recorded)
    if audit is not None and closing is not None:
        tell_closing(console, audit, closing)
    if browser and save is None:
        save = Path("trips") / recorded.trip.id
    if save is not None:
        teller.wrote(save_trip(save, recorded))
        if browser:
            typer.launch((save / "trip.html").resolve().as_uri())
    if result_of(recorded.trip) is not Result.DONE or (closing is not None and not closing.complete):
        raise typer.Exit(FAILED)


def asking() -> bool:
    """Whether somebody is there to answer a question."""
    import sys

    return sys.stdin.isatty() and sys.stdout.isatty()


def save_trip(folder: Path, recorded: RecordedTrip) -> list[Path]:
    """Write recording, page, the view from the seat where the planner looked, and the filmstrip of what was driven."""
    from chauffeur.driving.recording import write_trip
    from chauffeur.hmi.page import write_page

    written = [
        write_trip(
            folder / "trip.mcap",
            recorded.trip,
            recorded.frames,
            recorded.scenario,
            system=recorded.system,
            final=recorded.final,
        ),
        write_page(folder / "trip.html", recorded),
    ]
    if recorded.view is not None:
        from chauffeur.driving.files import publish

        written.append(publish(folder / "view.png", recorded.view.png(), "view from the seat"))
    if recorded.frames:
        from chauffeur.hmi.filmstrip import write_filmstrip

        written.append(write_filmstrip(folder / "filmstrip.png", recorded))
    return written
