"""`chauffeur bench coach-town`: the evaluator teaches a planner to follow instructions through towns."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chauffeur.cli.examples import help_text
from chauffeur.cli.options import BaseUrl

EXAMPLES = help_text("coach_town")


def coach_town(
    repository: Annotated[Path, typer.Option(help="Folder of the policy repository; made if there is none.")],
    planner: Annotated[str, typer.Option(help="`apprentice`, or a planner, e.g. `openai/<model>`.")] = "apprentice",
    routes: Annotated[str, typer.Option(help="Route file (XML) to learn on, or `own`.")] = "own",
    lessons: Annotated[int, typer.Option(min=1, help="Programs that the repository shall hold.")] = 50,
    towns: Annotated[str, typer.Option(help="Only these towns, with commas between.")] = "",
    seed: Annotated[int, typer.Option(help="Of traffic, and of the words of instructions.")] = 0,
    base_url: BaseUrl = None,
) -> None:
    """Human feedback in towns (paper Tab. V): drive an instruction, say what was wrong, drive again."""
    from chauffeur.bench.leaderboard.coaching import Apprentice, TownCoach, TownLesson
    from chauffeur.bench.leaderboard.own_routes import own_routes
    from chauffeur.bench.leaderboard.routes import read_routes
    from chauffeur.cli.console import plain, stdout
    from chauffeur.cli.parts import planner_named
    from chauffeur.concept import Limits
    from chauffeur.memory.policies import CRITIC_LABELS, PolicyRepository

    console = stdout()
    file = own_routes()[0] if routes == "own" else read_routes(Path(routes))
    wanted = {town for town in towns.split(",") if town}
    chosen = [one for one in file.routes if not wanted or one.town in wanted]
    kept_in = PolicyRepository(repository, create=True)
    who = Apprentice() if planner == "apprentice" else planner_named(planner, base_url)
    console.print(plain(f"Coaching {who.id} on {len(chosen)} routes; {CRITIC_LABELS['evaluator']}; simulated drives."))

    def told(one: TownLesson) -> None:
        end = f"kept as {one.kept}" if one.kept else f"not kept: {one.words}"
        console.print(plain(f"{one.lesson.id} {one.lesson.said.text} {one.attempts} attempts, {end}"), soft_wrap=True)

    try:
        TownCoach(who, kept_in, Limits(), seed, told).coach(chosen, lessons)
    except KeyboardInterrupt:
        console.print(plain(f"\nStopped. What was kept is in {repository}; run the same command to go on."))
        raise typer.Exit(130) from None
    console.print(plain(f"{len(kept_in.entries)} programs in {repository}."))
