"""`chauffeur bench` with the name of any installed benchmark: its options are the arguments of its class or function.
`merge` puts the shards of a run together.

A benchmark declares an option once, with type, default and sentence, in the signature and the `Args:` of what its entry
point (`chauffeur.benchmarks`) names. How it is run is the same for all, and is declared here.
"""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Final, get_type_hints

import typer
from typer.core import TyperGroup

from chauffeur.cli.examples import help_text_or_none
from chauffeur.cli.lab.bench_run import merge_folders, run_named
from chauffeur.cli.lab.generated import command_taking, options_of
from chauffeur.cli.options import (
    BaseUrl,
    BenchOptions,
    Concurrency,
    MaxRequests,
    MaxUsd,
    Price,
    RayCluster,
    ShardPart,
    Workers,
)
from chauffeur.cli.parts import named_values
from chauffeur.concept import ConfigError
from chauffeur.concept.registry import load_plugin, plugin_names

GROUP = "chauffeur.benchmarks"
_ABOUT: Final = {
    "faithfulness": (
        "Are explanations that misstate their program found?",
        "Explanations and programs, aligned and not: precision, recall and false alarms of the judge.",
    ),
    "hostile": (
        "Attacks by words, and wishes that look like them.",
        "Hostile words: 618 attacks in ten classes, and 270 harmless wishes that look like them.",
    ),
    "instructions": (
        "Commands to park and drive, closed loop (Tab. XIII).",
        "Commands driven closed loop: interactive parking and short drives (paper Tab. XIII).",
    ),
    "lampilot": (
        "LaMPilot-Bench: instructions, driven (Tab. IV).",
        "LaMPilot-Bench (paper Tab. IV): completion, collisions and scores of a planner that follows instructions.",
    ),
    "leaderboard": (
        "CARLA Leaderboard 1.0: RC, IP, DS (Tab. V).",
        "CARLA Leaderboard 1.0 anywhere: RC, IP and DS over routes with traffic, lights and scenarios.",
    ),
    "motion": (
        "Gains in five kinds of weather (Tab. XI).",
        "Gains for three manoeuvres in five kinds of weather: comfort, safety, alignment (paper Tab. XI).",
    ),
    "motion-passengers": (
        "Takeovers with gains, by memory (Fig. 14-15).",
        "Takeovers of simulated passengers by directness and memory, with gains (paper Fig. 14-15).",
    ),
    "nuplanqa": (
        "Questions about pictures of a road (Tab. VI).",
        "Nine subtasks in four-way questions about pictures of a road, beside a baseline that sees none.",
    ),
    "openloop": (
        "Waypoints from a front picture (Tab. XII, doScenes).",
        "Waypoints over three seconds from a front picture, or over six with an instruction (paper Tab. XII).",
    ),
    "passengers": (
        "Hand-written wishes: driven, asked, or refused.",
        "Hand-written wishes with the right outcome each: driven, asked back about, or refused.",
    ),
    "personalization": (
        "Takeovers, without and with memory (Tab. VIII-X).",
        "Takeover rates of simulated passengers, without and with memory (paper Tab. VIII, IX, X).",
    ),
    "realization": (
        "Labelled commands, driven and judged by labels.",
        "Labelled commands, staged, driven by what was read of them, and judged by the labels.",
    ),
}
"""What our own are, in a list and in their help, without loading them: a list must not import what they need."""


class BenchGroup(TyperGroup):
    """The commands written by hand, and one for each other benchmark that is installed."""

    def list_commands(self, ctx: Any) -> list[str]:
        known = super().list_commands(ctx)
        return [*known, *(name for name in plugin_names(GROUP) if name not in known)]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        command = super().get_command(ctx, cmd_name)
        return command if command is not None or cmd_name not in plugin_names(GROUP) else _listed(cmd_name)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        if args and not args[0].startswith("-") and args[0] not in self.list_commands(ctx):
            near = difflib.get_close_matches(args[0], self.list_commands(ctx), n=1)
            hint = f"Did you mean {near[0]!r}?" if near else "Run: chauffeur bench --help"
            raise ConfigError(f"There is no benchmark {args[0]!r}.", hint=hint)
        name, command, rest = super().resolve_command(ctx, args)
        own = command is None or name is None or super().get_command(ctx, name) is not None
        return name, command if own else command_of(str(name)), rest


def _listed(name: str) -> Any:
    """A command as a list of commands shows it: the benchmark is not imported."""
    app = typer.Typer(add_completion=False)
    app.command(name, help=_about(name)[0])(lambda: None)
    return typer.main.get_command(app)


def _about(name: str) -> tuple[str, str]:
    said = f"The benchmark {name!r}, from an installed package."
    return _ABOUT.get(name, (said, said))


def command_of(name: str) -> Any:
    """The click command of a benchmark.

    Raises:
        ConfigError: There is no such benchmark, or it cannot be loaded.
    """
    make = load_plugin(GROUP, name)
    own = options_of(make)
    asked = asks(make)
    shared = [
        parameter
        for parameter in inspect.signature(_shared, eval_str=True).parameters.values()
        if parameter.name not in {option.name for option in own} and (asked or parameter.name not in _OF_ASKING)
    ]

    def run(**given: Any) -> None:
        run_named(name, make, {option.name: given[option.name] for option in own}, given)

    about = _about(name)[1] if name in _ABOUT else _first_line(make) or _about(name)[1]
    return command_taking(name, [*own, *shared], run, help=about, epilog=help_text_or_none(f"bench {name}"))


def _shared(
    planner: Annotated[
        str | None, typer.Option(help="Who is asked: a planner, `onboard` by default; of questions, a model.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Run folder; one begun there is continued.")] = None,
    base_url: BaseUrl = None,
    concurrency: Concurrency = 16,
    max_usd: MaxUsd = None,
    max_requests: MaxRequests = None,
    price: Price = None,
    workers: Workers = None,
    shard: ShardPart = None,
    ray: RayCluster = None,
) -> None:
    """Declare what every benchmark's command takes beside its own options."""


_BUDGET: Final = ("max_usd", "max_requests", "price")
_OF_ASKING: Final = frozenset({"planner", "base_url", "concurrency", *_BUDGET})


def _first_line(make: Any) -> str:
    return (inspect.getdoc(make) or "").partition("\n\n")[0]


def asks(make: Any) -> bool:
    """True if a planner or model is asked, as far as the class tells: that of the result, where a function makes it."""
    kind = make if isinstance(make, type) else get_type_hints(make).get("return") if callable(make) else type(make)
    told = not isinstance(make, type) and "planner" in inspect.signature(make).parameters
    return bool(getattr(kind, "asks", "plans")) or told


bench_app = typer.Typer(
    cls=BenchGroup,
    no_args_is_help=True,
    rich_markup_mode="markdown",
    help="Run a benchmark of the field. Results are simulated drives.",
)


@bench_app.callback()
def bench() -> None:
    """Benchmarks."""


@bench_app.command(short_help="Put the shards of a run together.")
def merge(
    out: Annotated[Path, typer.Argument(help="Folder for the whole run.")],
    shards: Annotated[list[Path], typer.Argument(help="Folders of all its shards.")],
    option: BenchOptions = None,
) -> None:
    """Put the shards of a run together, and score it as if it had been one.

    The benchmark is made again by the options that the shards were begun with; -o says what differs, e.g. where its
    data are now.
    """
    from chauffeur.bench.kernel.merge import made_of

    name, options = made_of(shards[0])
    make = load_plugin(GROUP, name)
    merge_folders(out, shards, name, make, _typed(make, {**options, **named_values(option or [])}))


def _typed(make: Any, given: Mapping[str, Any]) -> dict[str, Any]:
    """Stored options as the benchmark's command would have read them, what is not given by its default.

    Raises:
        ConfigError: There is none of that name.
        UsageError: One has a value that it cannot have.
    """
    found: dict[str, Any] = {}

    def take(**read: Any) -> None:
        found.update(read)

    own = options_of(make)
    if strange := given.keys() - {one.name for one in own}:
        raise ConfigError(
            f"The benchmark has no option {min(strange)!r}.", hint=f"It has: {', '.join(one.name for one in own)}."
        )
    command, line = command_taking("merge", own, take), list[str]()
    for one in command.params:
        value = given.get(one.name)
        if isinstance(value, bool):
            line += one.opts[:1] if value else one.secondary_opts[:1]
        elif value is not None:
            line += [one.opts[0], str(value)]
    command.main(line, standalone_mode=False)
    return found
