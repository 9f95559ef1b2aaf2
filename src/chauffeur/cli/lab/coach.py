"""`chauffeur bench coach`: a critic teaches a model on a few items, and what did well goes into a policy repository."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from chauffeur.cli.examples import help_text
from chauffeur.cli.options import BaseUrl

if TYPE_CHECKING:
    from rich.console import Console

    from chauffeur.bench.lampilot.coaching import Coached
    from chauffeur.bench.lampilot.critic import Attempt, Critic, CriticJudgement

EXAMPLES = help_text("coach")


_DEMO = "demo12"


def coach(
    data: Annotated[Path, typer.Option(help="Folder with LaMPilot's DbLv1 task files.")],
    planner: Annotated[str, typer.Option(help="The model, e.g. `openai/<model>`.")],
    repository: Annotated[Path, typer.Option(help="Folder of the policy repository; made if there is none.")],
    critic: Annotated[
        str, typer.Option(help="`person` at this terminal, or `evaluator`: the benchmark's verdict in words.")
    ] = "person",
    ids: Annotated[
        str,
        typer.Option(help="Items by id, with commas; `demo12` for the twelve LaMPilot's own model was coached on."),
    ] = "",
    rounds: Annotated[int, typer.Option(min=1, max=50, help="Attempts at most for each item.")] = 5,
    out: Annotated[Path | None, typer.Option(help="Folder of the attempts; default `runs/coach-<planner>`.")] = None,
    base_url: BaseUrl = None,
) -> None:
    """Human feedback (paper Tab. IV): drive, say what was wrong, drive again; what did well is kept for more wishes."""
    from chauffeur.bench.kernel.store import RowStore
    from chauffeur.bench.lampilot.coaching import DEMO_ITEMS, Coach, items_named, spent
    from chauffeur.cli.console import path_text, plain, stdout
    from chauffeur.cli.failures import FAILED
    from chauffeur.cli.parts import planner_named
    from chauffeur.concept import LAMPILOT_LIMITS
    from chauffeur.memory.policies import CRITIC_LABELS, PolicyRepository
    from chauffeur.worlds.highway.dblv1 import load_dataset

    console = stdout()
    judge = _critic(critic, console)
    wanted = items_named(load_dataset(data), _ids(ids, DEMO_ITEMS))
    folder = out or Path("runs") / f"coach-{planner.replace('/', '-')}"
    kept_in = PolicyRepository(repository, create=True)
    teller = _Teller(console, folder / "drives" if critic == "person" else None)
    console.print(
        plain(f"Coaching {planner} on {len(wanted)} items; {CRITIC_LABELS[judge.judge_id]}; simulated drives.")
    )
    coaching = Coach(
        folder, planner_named(planner, base_url), kept_in, judge, LAMPILOT_LIMITS, rounds=rounds, tell=teller.tell
    )
    again = f"What is done is kept in {folder} and {repository}; run the same command to go on."
    try:
        done = coaching.coach(wanted)
    except KeyboardInterrupt:
        console.print(plain(f"\nStopped. {again}"))
        raise typer.Exit(130) from None
    _table(console, done)
    usage = spent(RowStore(folder / "coaching.jsonl", "key").rows.values())
    tokens = usage.prompt_tokens + usage.completion_tokens
    price = "" if usage.cost_usd is None else f", {usage.cost_usd:.4f} USD"
    console.print(plain(f"{usage.requests} requests and {tokens} tokens in this folder so far{price}."))
    console.print(path_text(repository), plain(f"holds {len(kept_in.entries)} programs; {'; '.join(kept_in.labels)}"))
    if len(done) < len(wanted):
        console.print(plain(f"Stopped after {len(done)} of {len(wanted)} items. {again}"))
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


def _table(console: Console, done: tuple[Coached, ...]) -> None:
    from rich.table import Table

    from chauffeur.cli.console import plain

    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), title="Coached items", title_justify="left")
    for name in ("item", "rounds", "ending", "program"):
        table.add_column(name, justify="right" if name == "rounds" else "left")
    for one in done:
        table.add_row(one.item, str(one.rounds), _ENDINGS[one.ending], plain(one.kept))
    console.print()
    console.print(table)
