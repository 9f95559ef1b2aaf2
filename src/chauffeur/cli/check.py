"""`chauffeur check`: whether a plug-in of one's own keeps its contract."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from chauffeur.cli.examples import help_text
from chauffeur.cli.options import BaseUrl, BenchOptions
from chauffeur.concept import ConfigError
from chauffeur.concept.lab import needs_lab

if TYPE_CHECKING:
    from chauffeur.worlds.conformance import ConformanceFinding

EXAMPLES = help_text("check")

check_app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="markdown",
    help="Check whether a plug-in of your own keeps its contract.",
    epilog=EXAMPLES,
)


@check_app.callback()
def check() -> None:
    """Check whether a plug-in of your own keeps its contract."""


@check_app.command(epilog=EXAMPLES)
def world(
    name: Annotated[
        str, typer.Argument(metavar="MODULE[:NAME]", help="The world's class or factory, or a registered name.")
    ],
    scenario: Annotated[str, typer.Option(help="A built-in scenario to check it on.")] = "",
    config: Annotated[str, typer.Option(help="Configuration of the scenario, as JSON.")] = "{}",
    seed: Annotated[int, typer.Option(min=0, help="Seed of the scenario.")] = 0,
) -> None:
    """Run a world through the contract's checks: time, road graph, commands, perception, driver, and so on.

    Exit code 1 where a check finds something.
    """
    from chauffeur.worlds.conformance import check_world

    _tell(check_world(_world_class(name), _scenario(name, scenario, config, seed)))


@check_app.command(epilog=EXAMPLES)
def planner(
    name: Annotated[
        str, typer.Argument(metavar="PLANNER", help="A registered planner, or MODULE:NAME; then /ARGUMENT.")
    ],
    base_url: BaseUrl = None,
) -> None:
    """Ask a planner usual and strange things: who it is, plans that can be driven, no surprises.

    It is asked some twenty times. Exit code 1 where a check finds something.
    """
    from chauffeur.cli.parts import planner_options
    from chauffeur.driving.conformance import check_planner
    from chauffeur.planners.registry import make_planner

    options = planner_options(name, base_url)
    _tell(check_planner(make_planner(name, **options)))


@check_app.command(epilog=EXAMPLES)
def executor(
    name: Annotated[str, typer.Argument(metavar="MODULE:NAME", help="The executor's class or factory.")],
    policy: Annotated[str, typer.Option(metavar="MODULE:NAME", help="A policy of its kind to try it with.")],
    scenario: Annotated[str, typer.Option(help="A built-in scenario to drive it on.")] = "cruise",
) -> None:
    """Drive a policy with its executor: vouched for, finite commands, the same trip twice, held back by set-points.

    Exit code 1 where a check finds something.
    """
    from chauffeur.concept.registry import made, plugin_at
    from chauffeur.driving.conformance import check_executor

    tried = plugin_at(policy)
    tried = made("policy", policy, tried) if isinstance(tried, type) or not hasattr(tried, "kind") else tried
    _tell(check_executor(_maker("executor", name), tried, _scenario("", scenario, "{}", 0)))


@check_app.command(epilog=EXAMPLES)
def benchmark(
    name: Annotated[str, typer.Argument(metavar="BENCHMARK", help="A registered benchmark, or MODULE:NAME.")],
    option: BenchOptions = None,
) -> None:
    """Hold a benchmark against the kernel's protocol; its first item is run.

    Exit code 1 where a check finds something.
    """
    needs_lab("Checking a benchmark")
    from chauffeur.bench.kernel.benchmark import benchmark_from, make_benchmark
    from chauffeur.bench.kernel.conformance import check_benchmark
    from chauffeur.concept.registry import plugin_at

    given = read_options(option or [])
    own = ":" in name
    _tell(check_benchmark(benchmark_from(plugin_at(name), name, **given) if own else make_benchmark(name, **given)))


@check_app.command(epilog=EXAMPLES)
def api(
    name: Annotated[str, typer.Argument(metavar="API", help="A registered driving API, or MODULE:NAME.")],
) -> None:
    """Ask a driving API of your own on a motorway and at a crossing: its shape, answers, repetition and time.

    Exit code 1 where a check finds something.
    """
    from chauffeur.concept.registry import load_plugin, plugin_at
    from chauffeur.driving.conformance import check_api
    from chauffeur.programs.catalogue import GROUP

    _tell(check_api(plugin_at(name) if ":" in name else load_plugin(GROUP, name)))


def read_options(given: list[str]) -> dict[str, Any]:
    """Options of a benchmark: numbers and truth values as JSON writes them, all else as text. Raises ConfigError."""
    found: dict[str, Any] = {}
    for text in given:
        name, equals, value = text.partition("=")
        if not equals:
            raise ConfigError(f"{text!r} is no option.", hint="Write -o NAME=VALUE.")
        try:
            found[name] = json.loads(value)
        except ValueError:
            found[name] = value
    return found


def _tell(findings: Sequence[ConformanceFinding]) -> None:
    """Print what a kit found; exit code 1 where that is anything."""
    from rich.text import Text

    from chauffeur.cli.console import stdout
    from chauffeur.cli.failures import FAILED

    console = stdout()
    for finding in findings:
        console.print(Text("fails  " if finding.faults else "keeps  ", "red" if finding.faults else "green"), end="")
        console.print(Text(finding.check))
        for fault in finding.faults:
            console.print(Text(f"         {fault}"))
    failed = sum(bool(finding.faults) for finding in findings)
    console.print(f"{len(findings) - failed} of {len(findings)} checks keep the contract.")
    if failed:
        raise typer.Exit(FAILED)


def _maker(kind: str, name: str) -> Callable[..., Any]:
    """The class or function at `module:NAME`: a check makes several of its kind. Raises ConfigError."""
    from chauffeur.concept.registry import plugin_at

    found = plugin_at(name)
    if not callable(found):
        raise ConfigError(f"{name!r} is a {type(found).__name__}, and makes no {kind}.", hint="Name its class.")
    return found


def _world_class(name: str) -> Callable[[], Any]:
    """What makes the world at `module:NAME`, the only one of a module, or a registered one. Raises ConfigError."""
    from chauffeur.concept.registry import load_plugin, module_at, plugin_names

    module_name, _, class_name = name.partition(":")
    if not class_name and module_name in plugin_names("chauffeur.worlds"):
        return load_plugin("chauffeur.worlds", module_name)
    if class_name:
        return _maker("world", name)
    module = module_at(module_name)
    own = [
        one
        for one in vars(module).values()
        if isinstance(one, type) and one.__module__ == module.__name__ and hasattr(one, "capabilities")
    ]
    if len(own) != 1:
        raise ConfigError(f"{module_name} has {len(own)} worlds.", hint=f"Say which: {module_name}:Class.")
    return own[0]


def _scenario(name: str, scenario: str, config: str, seed: int) -> Any:
    """The scenario to check on. Raises ConfigError."""
    import json
    from dataclasses import replace

    from chauffeur.concept import ConfigError, Scenario
    from chauffeur.driving.scenarios import BUILT_IN

    built_in = {one.id: one for one in BUILT_IN}
    if scenario:
        if scenario not in built_in:
            raise ConfigError(f"Unknown scenario {scenario!r}.", hint=f"Known: {', '.join(built_in)}.")
        return replace(built_in[scenario], seed=seed or built_in[scenario].seed)
    try:
        given = json.loads(config)
    except ValueError as error:
        raise ConfigError(f"The configuration is no JSON: {error}.", hint="Give an object in braces.") from error
    if not isinstance(given, dict):
        raise ConfigError("The configuration is no JSON object.", hint="Give an object in braces.")
    first = next((one for one in BUILT_IN if one.world == name), None)
    if not given and first is not None:
        return replace(first, seed=seed or first.seed)
    return Scenario("check", name, given, seed)
