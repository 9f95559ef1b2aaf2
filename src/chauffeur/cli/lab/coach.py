"""`chauffeur bench coach`: a critic teaches a model on a few items, and what did well goes into a policy repository."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from chauffeur.cli.options import BaseUrl

if TYPE_CHECKING:
    from rich.console import Console

    from chauffeur.bench.lampilot.coaching import Coached
    from chauffeur.bench.lampilot.critic import Attempt, Critic, CriticJudgement
    from chauffeur.bench.leaderboard.coaching import TownLesson
    from chauffeur.bench.leaderboard.routes import LeaderboardRoute
    from chauffeur.memory.policies import PolicyRepository


_DEMO = "demo12"


def coach(
    repository: Annotated[Path, typer.Option(help="Folder of the policy repository; made if there is none.")],
    data: Annotated[Path | None, typer.Option(help="LaMPilot's DbLv1 folder, to learn on its items.")] = None,
    routes: Annotated[str, typer.Option(help="Route file (XML), or `own`, to learn in towns.")] = "",
    planner: Annotated[
        str, typer.Option(help="The model, e.g. `openai/<model>`; in towns also `apprentice`, the default there.")
    ] = "",
    critic: Annotated[
        str,
        typer.Option(help="`person` at this terminal, or `evaluator`: the benchmark's verdict in words."),
    ] = "",
    ids: Annotated[
        str,
        typer.Option(help="Items by id, with commas; `demo12` for the twelve LaMPilot's own model was coached on."),
    ] = "",
    rounds: Annotated[int, typer.Option(min=1, max=50, help="Attempts at most for each item or lesson.")] = 5,
    lessons: Annotated[int, typer.Option(min=1, help="In towns: programs that the repository shall hold.")] = 50,
    towns: Annotated[str, typer.Option(help="Only these towns, with commas between.")] = "",
    seed: Annotated[int, typer.Option(help="In towns: of traffic, and of the words of instructions.")] = 0,
    out: Annotated[Path | None, typer.Option(help="Folder of the attempts; default `runs/coach-<planner>`.")] = None,
    base_url: BaseUrl = None,
) -> None:
    """Human feedback (paper Tab. IV, V): drive, say what was wrong, drive again; what did well is kept."""
    from chauffeur.cli.console import plain, stdout
    from chauffeur.cli.interrupts import stopped_kindly
    from chauffeur.cli.parts import planner_named
    from chauffeur.concept import LAMPILOT_LIMITS, ConfigError, Limits
    from chauffeur.memory.policies import CRITIC_LABELS, PolicyRepository

    console = stdout()
    if (data is None) == (not routes):
        raise ConfigError("It learns on LaMPilot's items, or in towns.", hint="Give --data DIR, or --routes own.")
    if data is None:
        from chauffeur.bench.leaderboard.coaching import Apprentice, TownCoach

        if critic == "person" or ids or out is not None:
            raise ConfigError("In towns the evaluator judges lessons.", hint="Leave out --critic, --ids and --out.")
        ways = _ways(routes, {town for town in towns.split(",") if town})
        who = Apprentice() if planner in ("", "apprentice") else planner_named(planner, base_url)
        kept_in = PolicyRepository(repository, create=True)
        said = f"Coaching {who.id} on {len(ways)} routes; {CRITIC_LABELS['evaluator']}; simulated drives."
        console.print(plain(said))
        with stopped_kindly(console, repository):
            TownCoach(who, kept_in, Limits(), seed, rounds, partial(_told, console)).coach(ways, lessons)
        console.print(plain(f"{len(kept_in.entries)} programs in {repository}."))
        return
    from chauffeur.bench.lampilot.coaching import DEMO_ITEMS, Coach, items_named
    from chauffeur.worlds.highway.dblv1 import load_dataset

    if not planner:
        raise ConfigError("Nobody is coached.", hint="Name a model with --planner, e.g. openai/gpt-4o.")
    judge = _critic(critic or "person", console)
    wanted = items_named(load_dataset(data), _ids(ids, DEMO_ITEMS))
    folder = out or Path("runs") / f"coach-{planner.replace('/', '-')}"
    kept_in = PolicyRepository(repository, create=True)
    tell = _Teller(console, folder / "drives" if judge.judge_id == "person" else None).tell
    who = planner_named(planner, base_url)
    said = f"Coaching {planner} on {len(wanted)} items; {CRITIC_LABELS[judge.judge_id]}; simulated drives."
    console.print(plain(said))
    with stopped_kindly(console, folder, repository):
        done = Coach(folder, who, kept_in, judge, LAMPILOT_LIMITS, rounds=rounds, tell=tell).coach(wanted)
    _sum_up(console, folder, kept_in, done, len(wanted))


def _ways(routes: str, towns: set[str]) -> list[LeaderboardRoute]:
    from chauffeur.bench.leaderboard.own_routes import own_routes
    from chauffeur.bench.leaderboard.routes import read_routes

    file = own_routes()[0] if routes == "own" else read_routes(Path(routes))
    return [one for one in file.routes if not towns or one.town in towns]


def _told(console: Console, one: TownLesson) -> None:
    from chauffeur.cli.console import plain

    end = f"kept as {one.kept}" if one.kept else f"not kept: {one.words}"
    console.print(plain(f"{one.lesson.id} {one.lesson.said.text} {one.attempts} attempts, {end}"), soft_wrap=True)


def _sum_up(console: Console, folder: Path, kept_in: PolicyRepository, done: tuple[Coached, ...], wanted: int) -> None:
    """What came of the items, and what it cost. Raises Exit: of one no attempt could be made."""
    from chauffeur.bench.kernel.store import RowStore
    from chauffeur.bench.lampilot.coaching import spent
    from chauffeur.cli.console import path_text, plain
    from chauffeur.cli.failures import FAILED
    from chauffeur.cli.lab.tables import show_table

    lines = [(one.item, _ENDINGS[one.ending], plain(one.kept).plain, str(one.rounds)) for one in done]
    console.print()
    show_table(console, "Coached items", ("item", "ending", "program", "rounds"), lines)
    usage = spent(RowStore(folder / "coaching.jsonl", "key").rows.values())
    tokens = usage.prompt_tokens + usage.completion_tokens
    price = "" if usage.cost_usd is None else f", {usage.cost_usd:.4f} USD"
    console.print(plain(f"{usage.requests} requests and {tokens} tokens in this folder so far{price}."))
    labels = "; ".join(kept_in.labels)
    console.print(path_text(kept_in.folder), plain(f"holds {len(kept_in.entries)} programs; {labels}"))
    if len(done) < wanted:
        kept = f"What is done is kept in {folder} and {kept_in.folder}; run the same command to go on."
        console.print(plain(f"Stopped after {len(done)} of {wanted} items. {kept}"))
    if any(one.ending == "failed" for one in done):
        raise typer.Exit(FAILED)


def _ids(listed: str, demo: tuple[str, ...]) -> tuple[str, ...]:
    from chauffeur.concept import ConfigError

    named = [one.strip() for one in listed.split(",") if one.strip()]
    ids = dict.fromkeys(each for one in named for each in (demo if one == _DEMO else (one,)))
    if not ids:
        raise ConfigError("No items to coach on.", hint="Give --ids demo12, or e.g. --ids left_lc_s0_c0.")
    return tuple(ids)


def _critic(name: str, console: Console) -> Critic:
    from rich.text import Text

    from chauffeur.bench.lampilot.critic import EvaluatorCritic, PersonCritic
    from chauffeur.cli.console import plain
    from chauffeur.concept import ConfigError

    if name == "evaluator":
        return EvaluatorCritic()
    if name != "person":
        raise ConfigError(f"Unknown critic {name!r}.", hint="Use person or evaluator.")

    def ask(question: str) -> str | None:
        try:
            return console.input(Text.assemble((plain(question).plain, "bold cyan"), "\n> "))
        except EOFError:
            return None

    return PersonCritic(ask)


class _Teller:
    """Shows a coaching as it goes."""

    def __init__(self, console: Console, pages: Path | None) -> None:
        """`pages` is where a page of each drive goes; without it drives are told in a line."""
        self._console = console
        self._pages = pages

    def tell(self, event: str, value: Any) -> None:
        """One event of the coaching."""
        from rich.text import Text

        from chauffeur.cli.console import plain

        match event:
            case "item":
                self._console.print()
                self._console.print(Text.assemble((f"{value.id}  ", "bold"), "“", plain(value.command), "”"))
            case "asking":
                self._console.print(Text(f"  round {value}: asking the model ...", "dim"))
            case "attempt":
                self._attempt(value)
            case "judged":
                self._judged(value)
            case "ended":
                self._ended(value)
            case _:
                pass

    def _attempt(self, attempt: Attempt) -> None:
        from rich.padding import Padding
        from rich.syntax import Syntax
        from rich.text import Text

        from chauffeur.cli.console import path_text, plain
        from chauffeur.hmi import words
        from chauffeur.hmi.payload import policy_words

        trip = attempt.recorded.trip
        _, label, tone = words.trip_words(trip)
        style = {"good": "bold green", "bad": "bold red", "neutral": "bold"}[tone]
        driven = f" after {trip.duration_s:.1f} s" if attempt.recorded.frames else ""
        line = Text.assemble(f"  round {attempt.number}: ", (label, style), driven, (" (simulated drive)", "dim"))
        if self._pages is None:
            self._console.print(line)
            return
        if attempt.offered:
            self._console.print(plain(f"  offered from the repository: {', '.join(attempt.offered)}"), style="dim")
        if trip.plan.thoughts.text.strip():
            self._console.print(Padding(plain(trip.plan.thoughts.text.strip()), (0, 0, 0, 2)))
        if trip.plan.policy is not None:
            source = plain(policy_words(trip.plan.policy).rstrip("\n")).plain
            code = Syntax(source, "python", theme="ansi_dark", background_color="default", word_wrap=True)
            self._console.print(Padding(code, (0, 0, 0, 2)))
        self._console.print(line)
        for told in (f"“{trip.instruction.text}”{words.account_words(trip)}", *words.cause_words(trip.causes)):
            self._console.print(Padding(plain(told), (0, 0, 0, 4)))
        if attempt.recorded.frames:
            self._drive(attempt)
            page = self._page(attempt, self._pages)
            self._console.print(Text.assemble("    watch it: ", path_text(page)))

    def _drive(self, attempt: Attempt) -> None:
        from chauffeur.bench.lampilot.seen import watch
        from chauffeur.cli.console import columns, plain
        from chauffeur.hmi import words
        from chauffeur.hmi.events import events_of

        recorded = attempt.recorded
        start = recorded.frames[0].observation.time_s
        self._console.print(
            columns(((f"{one.time_s - start:6.1f} s", plain(one.label)) for one in events_of(recorded)), indent=4)
        )
        seen = watch(recorded)
        if seen is None:
            return
        facts = [
            f"speed {words.speed(seen.speeds_mps[0])} at the start, {words.speed(seen.speeds_mps[-1])} at the end",
            f"between {min(seen.speeds_mps):.1f} and {max(seen.speeds_mps):.1f} m/s",
        ]
        if seen.least_gap_m is not None:
            facts.append(f"nearest to the car ahead {seen.least_gap_m:.1f} m")
        self._console.print(plain(f"    {'; '.join(facts)}"))

    def _page(self, attempt: Attempt, folder: Path) -> Path:
        from chauffeur.hmi.page import write_page

        return write_page(folder / f"{attempt.item.id}-{attempt.number}.html", attempt.recorded)

    def _judged(self, judgement: CriticJudgement) -> None:
        from rich.padding import Padding

        from chauffeur.cli.console import plain

        if judgement.words and self._pages is None:
            self._console.print(Padding(plain(judgement.words), (0, 0, 0, 4)), style="dim")

    def _ended(self, ended: Coached) -> None:
        from chauffeur.cli.console import plain

        if ended.before:
            self._console.print(plain(f"{ended.item}: {_ENDINGS[ended.ending]} before this session"), style="dim")
        elif ended.kept:
            self._console.print(plain(f"  kept as {ended.kept}()"), style="green")
        else:
            self._console.print(plain(f"  {_ENDINGS[ended.ending]}. {ended.detail}".rstrip()))


_ENDINGS = {
    "kept": "kept",
    "not_kept": "done, but its program cannot be kept",
    "skipped": "skipped",
    "given_up": "given up after all rounds",
    "failed": "no attempt could be made",
}
