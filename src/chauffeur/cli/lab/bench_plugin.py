"""`chauffeur bench` with the name of any installed benchmark: its options are the arguments of its class or function.

A benchmark declares an option once, with type, default and sentence, in the signature and the `Args:` of what its entry
point (`chauffeur.benchmarks`) names. How it is run is the same for all, and is declared here.
"""

from __future__ import annotations

import difflib
import inspect
import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Final, Literal, Union, get_args, get_origin, get_type_hints

import typer
from typer.core import TyperGroup

from chauffeur.cli.examples import help_text_or_none
from chauffeur.cli.lab.bench_run import carry_out, effort, finish, show_tables
from chauffeur.cli.options import (
    BaseUrl,
    Concurrency,
    MaxRequests,
    MaxUsd,
    Price,
    RayCluster,
    ShardPart,
    Workers,
)
from chauffeur.cli.parts import planner_options
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
    own = own_options(make)
    asked = asks(make)
    shared = [
        parameter
        for parameter in inspect.signature(_shared, eval_str=True).parameters.values()
        if parameter.name not in {option.name for option in own} and (asked or parameter.name not in _OF_ASKING)
    ]

    def run(**given: Any) -> None:
        run_named(name, make, [option.name for option in own], given)

    ordered = sorted([*own, *shared], key=lambda one: one.default is not inspect.Parameter.empty)
    named = [one.replace(kind=inspect.Parameter.KEYWORD_ONLY) for one in ordered]
    run.__signature__ = inspect.Signature(named)  # type: ignore[attr-defined]
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in [*own, *shared]}
    about = _about(name)[1] if name in _ABOUT else _first_line(make) or _about(name)[1]
    app = typer.Typer(rich_markup_mode="markdown", add_completion=False)
    app.command(name, help=about, epilog=help_text_or_none(f"bench_{name}"))(run)
    return typer.main.get_command(app)


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


def own_options(make: Any) -> list[inspect.Parameter]:
    """The options of a benchmark: a parameter each of its class or function, with the sentence of its docstring.

    A function that hands `**options` on has those of the class that it returns, too.
    """
    try:
        hints, parameters = (
            get_type_hints(make.__init__ if isinstance(make, type) else make),
            inspect.signature(make).parameters.values(),
        )
    except (TypeError, ValueError, NameError):
        return []
    said = _arguments(make)
    found = {
        one.name: inspect.Parameter(
            one.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=one.default,
            annotation=Annotated[
                _kind(hints.get(one.name, str)), typer.Option(*_flag(one.name), help=said.get(one.name, ""))
            ],
        )
        for one in parameters
        if one.kind not in (inspect.Parameter.VAR_KEYWORD, inspect.Parameter.VAR_POSITIONAL)
    }
    if any(one.kind is inspect.Parameter.VAR_KEYWORD for one in parameters) and isinstance(hints.get("return"), type):
        found |= {one.name: one for one in own_options(hints["return"]) if one.name not in found}
    return list(found.values())


def _flag(name: str) -> tuple[str, ...]:
    """The option's name where it is not that of the parameter: without its unit."""
    bare = re.sub(r"_(?:s|m|px|mps)$", "", name)
    return () if bare == name else (f"--{bare.replace('_', '-')}",)


def _kind(hint: Any) -> Any:
    """The type of an option: of a union that takes text, text; of an optional one, that type or None."""
    if get_origin(hint) in (Union, UnionType):
        kinds = [one for one in get_args(hint) if one is not NoneType]
        kind = str if str in kinds else _kind(kinds[0])
        return kind | None if NoneType in get_args(hint) else kind
    return hint if hint in (int, float, bool, str, Path) or get_origin(hint) is Literal else str


def _arguments(make: Any) -> dict[str, str]:
    """Sentences of the `Args:` of a docstring, by argument."""
    docs = [make.__doc__, make.__init__.__doc__] if isinstance(make, type) else [make.__doc__]
    text = "\n".join(inspect.cleandoc(doc) for doc in docs if doc)
    block = re.search(r"^Args:\n((?:[ ]+.*\n?|\n)+)", text, re.MULTILINE)
    if block is None:
        return {}
    found = re.findall(r"^ {4}(\w+): ((?:.*\n?)(?: {8}.*\n?)*)", block[1], re.MULTILINE)
    return {name: " ".join(words.split()) for name, words in found}


def _first_line(make: Any) -> str:
    return (inspect.getdoc(make) or "").partition("\n\n")[0]


def asks(make: Any) -> bool:
    """True if a planner or model is asked, as far as the class tells: that of the result, where a function makes it."""
    kind = make if isinstance(make, type) else get_type_hints(make).get("return") if callable(make) else type(make)
    takes_planner = not isinstance(make, type) and "planner" in inspect.signature(make).parameters
    return bool(getattr(kind, "asks", "plans")) or takes_planner


def run_named(name: str, make: Any, own: Sequence[str], given: Mapping[str, Any]) -> None:
    """Run a benchmark, or go on with its run, and show what came of it.

    Raises:
        ConfigError: Options make no sense.
        Exit: The run stopped asking, or items failed for want of infrastructure.
    """
    from chauffeur.bench.kernel.benchmark import Concludes, benchmark_from
    from chauffeur.bench.kernel.report import tables
    from chauffeur.bench.kernel.run import BenchRun
    from chauffeur.bench.kernel.shards import WHOLE, Shard
    from chauffeur.cli.console import plain, stdout

    console = stdout()
    bench = benchmark_from(make, name, **{option: given[option] for option in own})
    planner, who = given.get("planner"), None
    if bench.asks:
        planner, who = _asked(bench, planner, given.get("base_url"))
    part = WHOLE if given["shard"] is None else Shard.parse(given["shard"], os.environ)
    variant = str(getattr(bench, "variant", ""))
    parts = [name, *([str(planner).replace("/", "-")] if planner else []), *([variant] if variant else [])]
    folder = given["out"] or Path("runs") / "-".join(parts)
    run = BenchRun(folder if part == WHOLE else folder / part.folder, bench, who, shard=part)
    asking = {option: given[option] for option in ("concurrency", *_BUDGET) if option in given}
    work = effort(given["workers"], **asking, ray=given["ray"])
    rows = carry_out(console, run, lambda watch: run.run(watch, work), bench.id)
    if rows:
        show_tables(console, tables(bench.tables, rows))
        if isinstance(bench, Concludes):
            results = {item.id: run.stages.outcome(item).result for item in run.items}
            for line in bench.conclude(run.folder, rows, results):
                console.print(plain(line), soft_wrap=True)
    finish(console, run)


def _asked(bench: Any, planner: str | None, base_url: str | None) -> tuple[str, Any]:
    """The specification of who is asked, and what answers.

    Raises:
        ConfigError: A model has to be named, or there is none of that name.
    """
    from chauffeur.planners.registry import make_answerer, make_planner

    if planner is None and bench.asks == "words":
        raise ConfigError("Nobody is asked.", hint="Name a model with --planner, e.g. openai/gpt-4o.")
    spec = planner or "onboard"
    make = getattr(bench, "planner_of", None) or (make_planner if bench.asks == "plans" else make_answerer)
    return spec, make(spec, **planner_options(spec, base_url))
