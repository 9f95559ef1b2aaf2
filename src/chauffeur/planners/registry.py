"""Planners by name: `onboard`, `meaning`, `keyword`, `openai/<model>`, `replay/<path>`, and what else is installed.

A planner is registered as an entry point in the group `chauffeur.planners`; the built-in ones use the same door:

    [project.entry-points."chauffeur.planners"]
    mine = "my_package.planner:MyPlanner"

The object has a classmethod (or function) `from_spec(argument: str, **options) -> Planner`. `argument` is what stands
after the first slash of the specification, "" without one; `options` are keyword arguments that it names itself, so
that a mistyped one is refused. Nothing of a planner is imported before it is asked for.

Without a package, `my_module:MyPlanner` is as good a name, with `/argument` where it takes one: the module is looked
for as `python -m` does.
"""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Callable

from chauffeur.concept import ConfigError
from chauffeur.concept.registry import load_plugin, made, plugin_at, plugin_names
from chauffeur.planners.base import Answerer, Planner

GROUP = "chauffeur.planners"


def planner_names() -> tuple[str, ...]:
    """Names of all registered planners, sorted."""
    return plugin_names(GROUP)


def make_planner(spec: str, **options: object) -> Planner:
    """The planner a specification names.

    >>> chauffeur.make_planner("openai/gpt-4o", base_url="http://localhost:8040/v1").id
    'openai/gpt-4o'

    Args:
        spec: `name` or `name/argument`; or `module:NAME` of a planner, or of a class or function that makes one.
        **options: Settings of that planner, e.g. `base_url` for `openai`.

    Raises:
        ConfigError: Unknown name or setting, a setting the planner refuses, or a planner that cannot be imported.
    """
    return _checked(spec, _make(spec, options))


def _checked(name: str, planner: object) -> Planner:
    if not isinstance(planner, Planner) or isinstance(planner, type):
        raise ConfigError(
            f"{name!r} is not a planner, and makes none ({type(planner).__name__}).",
            hint="A planner has id, model, and an async method plan(request).",
        )
    return planner


def make_answerer(spec: str, **options: object) -> Answerer:
    """The model a specification names, for questions that are answered in words; it need not be a planner.

    Raises:
        ConfigError: As `make_planner`; or it writes no words.
    """
    model = _make(spec, options)
    if not isinstance(model, Answerer):
        raise ConfigError(f"{spec!r} answers no questions.", hint="Name a language model, e.g. openai/gpt-4o.")
    return model


def make_model(spec: str, **options: object) -> Planner | Answerer:
    """What a specification names, be it a planner or a model that only answers questions. Raises ConfigError."""
    model = _make(spec, options)
    return model if isinstance(model, Answerer) else _checked(spec, model)


def _make(spec: str, options: dict[str, object]) -> object:
    name, _, argument = spec.strip().partition("/")
    if ":" not in name:
        return _built(name, _builder(name), argument, options)
    found = plugin_at(name)
    build = getattr(found, "from_spec", None)
    if callable(build):
        return _built(name, build, argument, options)
    if argument:
        raise ConfigError(f"Planner {name!r} takes no argument ({argument!r}).", hint="Give it a from_spec(argument).")
    ready = isinstance(found, Planner | Answerer) and not isinstance(found, type)
    return found if ready else made("planner", name, found, **options)


def _built(name: str, build: Callable[..., object], argument: str, options: dict[str, object]) -> object:
    _check_options(name, build, argument, options)
    return made("planner", name, build, argument, **options)


def takes_option(spec: str, option: str) -> bool:
    """True if the planner a specification names has a setting of that name. Raises ConfigError as `make_planner`."""
    name = spec.strip().partition("/")[0]
    build = getattr(plugin_at(name), "from_spec", None) if ":" in name else _builder(name)
    return build is not None and option in _options_of(inspect.signature(build))


def _options_of(signature: inspect.Signature) -> list[str]:
    return [name for name, one in signature.parameters.items() if one.kind is inspect.Parameter.KEYWORD_ONLY]


def _builder(name: str) -> Callable[..., object]:
    build = getattr(load_plugin(GROUP, name), "from_spec", None)
    if not callable(build):
        raise ConfigError(f"The entry point {name!r} has no from_spec(argument, **options).")
    return build


def _check_options(name: str, build: Callable[..., object], argument: str, options: dict[str, object]) -> None:
    signature = inspect.signature(build)
    try:
        signature.bind(argument, **options)
    except TypeError as error:
        takes = _options_of(signature)
        unknown = next((option for option in options if option not in takes), "")
        close = difflib.get_close_matches(unknown, takes, n=1)
        guess = f"Did you mean {close[0]!r}? " if close else ""
        listed = f"It takes: {', '.join(takes)}." if takes else "It takes no options."
        raise ConfigError(f"Planner {name!r}: {error}.", hint=guess + listed) from error
