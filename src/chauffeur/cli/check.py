"""`chauffeur check`: whether a plug-in of one's own keeps its contract."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

import typer

from chauffeur.cli.options import BaseUrl, BenchOptions
from chauffeur.concept import ConfigError
from chauffeur.concept.lab import needs_lab
from chauffeur.concept.registry import load_plugin, made, module_at, plugin_at, plugin_names

if TYPE_CHECKING:
    from chauffeur.worlds.conformance import ConformanceFinding

_TAKES: Final[dict[str, tuple[str, ...]]] = {
    "world": ("scenario", "config", "seed"),
    "planner": ("base_url",),
    "executor": ("policy", "scenario"),
    "benchmark": ("option",),
    "api": (),
}
"""Options that a kind of plug-in is checked with."""


def check(
    kind: Annotated[
        Literal["world", "planner", "executor", "benchmark", "api"], typer.Argument(metavar="KIND", help="What it is.")
    ],
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME",
            help="MODULE:NAME of its class or factory, or a registered name; of a planner, then /ARGUMENT.",
        ),
    ],
    scenario: Annotated[str, typer.Option(help="Of a world, an executor: a built-in scenario to check it on.")] = "",
    config: Annotated[str, typer.Option(help="Of a world: configuration of the scenario, as JSON.")] = "{}",
    seed: Annotated[int, typer.Option(min=0, help="Of a world: seed of the scenario.")] = 0,
    policy: Annotated[
        str, typer.Option(metavar="MODULE:NAME", help="Of an executor: a policy of its kind to try it with.")
    ] = "",
    base_url: BaseUrl = None,
    option: BenchOptions = None,
) -> None:
    """Check whether a plug-in of your own, a world, planner, executor, benchmark or driving API, keeps its contract.

    A world is run through time, road graph, commands, perception, driver, and so on. A planner is asked usual and
    strange things, some twenty times. An executor drives a policy twice. Of a benchmark the first item is run. A
    driving API is asked on a motorway and at a crossing. Exit code 1 where a check finds something.
    """
    given = {"scenario": scenario, "config": config != "{}", "seed": seed, "policy": policy}
    given |= {"base_url": base_url, "option": option}
    if strange := [one for one, value in given.items() if value and one not in _TAKES[kind]]:
        raise ConfigError(f"A {kind} is not checked with --{strange[0].replace('_', '-')}.", hint="Leave it out.")
    match kind:
        case "world":
            from chauffeur.worlds.conformance import check_world

            _tell(check_world(_world_class(name), _scenario(name, scenario, config, seed)))
        case "planner":
            _tell(_of_planner(name, base_url))
        case "executor":
            _tell(_of_executor(name, policy, scenario or "cruise"))
        case "benchmark":
            _tell(_of_benchmark(name, option or []))
        case "api":
            from chauffeur.driving.conformance import check_api
            from chauffeur.programs.catalogue import GROUP

            _tell(check_api(plugin_at(name) if ":" in name else load_plugin(GROUP, name)))


def _of_planner(name: str, base_url: str | None) -> Sequence[ConformanceFinding]:
    from chauffeur.cli.parts import planner_options
    from chauffeur.driving.conformance import check_planner
    from chauffeur.planners.registry import make_planner

    return check_planner(make_planner(name, **planner_options(name, base_url)))


def _of_executor(name: str, policy: str, scenario: str) -> Sequence[ConformanceFinding]:
    from chauffeur.driving.conformance import check_executor

    if not policy:
        raise ConfigError("An executor is tried with a policy of its kind.", hint="Name one: --policy MODULE:NAME.")
    tried = plugin_at(policy)
    tried = made("policy", policy, tried) if isinstance(tried, type) or not hasattr(tried, "kind") else tried
    return check_executor(_maker("executor", name), tried, _scenario("", scenario, "{}", 0))


def _of_benchmark(name: str, option: Sequence[str]) -> Sequence[ConformanceFinding]:
    needs_lab("Checking a benchmark")
    from chauffeur.bench.kernel.benchmark import benchmark_from, make_benchmark
    from chauffeur.bench.kernel.conformance import check_benchmark
    from chauffeur.cli.parts import named_values

    given = named_values(option)
    own = ":" in name
    return check_benchmark(benchmark_from(plugin_at(name), name, **given) if own else make_benchmark(name, **given))


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

    found = plugin_at(name)
    if not callable(found):
        raise ConfigError(f"{name!r} is a {type(found).__name__}, and makes no {kind}.", hint="Name its class.")
    return found


def _world_class(name: str) -> Callable[[], Any]:
    """What makes the world at `module:NAME`, the only one of a module, or a registered one. Raises ConfigError."""

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
