"""The exchangeable parts a command line can name: planner, limits, speech engine, referee."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from chauffeur.concept import LAMPILOT_LIMITS, ConfigError, Limits, MissingExtraError, Parameters, Plan, Scenario

if TYPE_CHECKING:
    from chauffeur.describe.services.sources import SourceSettings
    from chauffeur.drive.episode import Referee
    from chauffeur.drive.talk.hearing import Engine
    from chauffeur.planners.base import Planner
    from chauffeur.planners.prompts import Setting
    from chauffeur.worlds.base import World

_LIMITS = {"default": Limits(), "lampilot": LAMPILOT_LIMITS}


def needs(extra: str, what: str, *modules: str) -> None:
    """Say before any work is done that an extra is missing. Nothing is imported.

    Args:
        extra: The extra of this package that brings the modules.
        what: Who needs it, as the subject of a sentence.
        modules: Top-level modules.

    Raises:
        MissingExtraError: One cannot be found; the hint installs the extra for this interpreter.
    """
    missing = [name for name in modules if not _importable(name)]
    if missing:
        from chauffeur.cli.doctor import install_command

        raise MissingExtraError(f"{what} needs {', '.join(missing)}.", hint=f"Run: {install_command(extra)}")


def _importable(name: str) -> bool:
    try:
        return find_spec(name) is not None
    except ValueError:  # it is being kept from being imported
        return False


def limits_named(name: str) -> Limits:
    """Limits by name. Raises ConfigError for an unknown one."""
    if name not in _LIMITS:
        raise ConfigError(f"Unknown limits {name!r}.", hint=f"Use one of: {', '.join(_LIMITS)}.")
    return _LIMITS[name]


def setting_named(name: str) -> Setting:
    """Prompt setting by name. Raises ConfigError for an unknown one."""
    if name not in ("few-shot", "zero-shot"):
        raise ConfigError(f"Unknown setting {name!r}.", hint="Use few-shot or zero-shot.")
    return name


def planner_named(spec: str, base_url: str | None, on_text: Callable[[str, int], None] | None = None) -> Planner:
    """Planner by specification; `on_text` gets a language model's reply as it is written.

    Raises:
        ConfigError: Unknown, or it takes no endpoint.
    """
    from chauffeur.planners.registry import make_planner, takes_option

    options: dict[str, Any] = {} if base_url is None else {"base_url": base_url}
    if on_text is not None and takes_option(spec, "on_text"):
        options["on_text"] = on_text
    return make_planner(spec, **options)


def planner_for(spec: str, scenario: Scenario) -> str:
    """The planner that was named, else one that can drive there: in a parking lot the one that parks."""
    return spec or ("talk2drive" if scenario.world == "parking" else "onboard")


def engine_named(spec: str) -> Engine | None:
    """The speech engine a specification names; None for `none`.

    Raises:
        ConfigError: There is no such engine.
    """
    from chauffeur.drive.talk.hearing import Engine
    from chauffeur.speech.engines import ENGINES

    name, _, model = spec.strip().partition("/")
    if name not in (*ENGINES, "none"):
        raise ConfigError(f"Unknown speech engine {spec!r}.", hint=f"Known: {', '.join(ENGINES)}, none.")
    return Engine(name, model, favoured=True) if name != "none" else None


def referee_for(world: World, scenario: Scenario, plan: Plan) -> Referee | None:
    """The judge of a trip: LaMPilot's by the scenario's own goal, else what the planner understood, else none. In a
    parking lot, the judge of the spot that is meant.

    Raises:
        ScenarioError: There is no such spot.
    """
    if scenario.world == "parking":
        return _parking_referee(world, plan)
    from chauffeur.bench.lampilot.understood import referee_for as judge

    return judge(world, scenario, plan)


def _parking_referee(world: World, plan: Plan) -> Referee | None:
    from chauffeur.worlds.parking import ParkingReferee, ParkingWorld

    place = plan.policy.route if isinstance(plan.policy, Parameters) else ""
    return ParkingReferee(world, world.spot(place)) if place and isinstance(world, ParkingWorld) else None


def not_kept(person: str) -> str:
    """What to tell a person of whom nothing new is kept; empty where it is."""
    from chauffeur.memory.privacy import read_privacy

    if not person or read_privacy().keeps:
        return ""
    return f"Privacy mode: nothing of this drive is kept in the profile of {person}."


def standing_sources() -> SourceSettings | None:
    """Where the context of this person's drives is completed from; None where their file does not exist.

    Raises:
        ConfigError: The file cannot be used.
    """
    from chauffeur.drive.surroundings import services_file

    path = services_file()
    if path is None:
        return None
    from chauffeur.describe.services.sources import read_sources

    return read_sources(path)
