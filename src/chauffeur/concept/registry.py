"""Plug-ins through Python entry points: built-in parts and third-party ones use the same door."""

from __future__ import annotations

import difflib
import inspect
from importlib.metadata import entry_points
from typing import Any

from chauffeur.concept.errors import ChauffeurError, ConfigError


def plugin_names(group: str) -> tuple[str, ...]:
    """Names registered in an entry-point group such as `chauffeur.planners`, sorted."""
    return tuple(sorted({point.name for point in entry_points(group=group)}))


def load_plugin(group: str, name: str) -> Any:
    """The object registered under a name.

    Raises:
        ConfigError: No such name (with the nearest one), or the plug-in cannot be imported.
    """
    kind = _singular(group.rsplit(".", 1)[-1])
    found = [point for point in entry_points(group=group) if point.name == name]
    if not found:
        known = plugin_names(group)
        near = difflib.get_close_matches(name, known, n=1)
        hint = f"Did you mean {near[0]!r}?" if near else f"Known: {', '.join(known) or 'none'}."
        raise ConfigError(f"Unknown {kind} {name!r}.", hint=hint)
    try:
        return found[0].load()
    except (ImportError, AttributeError) as error:
        raise ConfigError(f"The {kind} {name!r} cannot be loaded: {error}.", hint="Run: chauffeur doctor") from error


def made(kind: str, name: str, make: object, *arguments: object, **options: object) -> Any:
    """What a plug-in's class or function makes. It is foreign code: whatever it raises is told with its name.

    Raises:
        ConfigError: It makes nothing, does not take these arguments, or broke.
    """
    if not callable(make):
        raise ConfigError(f"{name!r} is a {type(make).__name__}, and makes no {kind}.", hint="Name a class or factory.")
    try:
        signature = inspect.signature(make)
    except (TypeError, ValueError):  # some built-in callables tell none
        signature = None
    if signature is not None:
        try:
            signature.bind(*arguments, **options)
        except TypeError as error:
            takes = ", ".join(signature.parameters) or "nothing"
            raise ConfigError(f"{kind.capitalize()} {name!r}: {error}.", hint=f"It takes: {takes}.") from error
    try:
        return make(*arguments, **options)
    except ChauffeurError:
        raise
    except Exception as error:  # a third party's code may raise anything
        raise ConfigError(
            f"{kind.capitalize()} {name!r} could not be made: {type(error).__name__}: {error}.",
            hint="Mend the plug-in, or what it was given.",
        ) from error


def _singular(plural: str) -> str:
    return f"{plural[:-3]}y" if plural.endswith("ies") else plural.removesuffix("s")
