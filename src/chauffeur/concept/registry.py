"""Plug-ins through Python entry points: built-in parts and third-party ones use the same door."""

from __future__ import annotations

import difflib
import inspect
import os
import sys
from dataclasses import dataclass
from importlib import import_module
from importlib.machinery import PathFinder
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from types import ModuleType
from typing import Any, Final

from chauffeur.concept.errors import ChauffeurError, ConfigError
from chauffeur.concept.extras import LAB

GROUPS: Final = (
    "chauffeur.worlds",
    "chauffeur.planners",
    "chauffeur.executors",
    "chauffeur.apis",
    "chauffeur.checks",
    "chauffeur.benchmarks",
    "chauffeur.memories",
    "chauffeur.commands",
)
"""Entry-point groups that are read, in the order of the loop."""
OWN: Final = ("chauffeur", LAB)
"""Distributions whose parts are built in."""


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


def module_at(name: str) -> ModuleType:
    """A module by its name, found as `python -m` finds it: the current folder counts. Raises ConfigError."""
    if os.getcwd() not in sys.path:  # noqa: PTH109 - compared with what stands there as text
        sys.path.insert(0, os.getcwd())  # noqa: PTH109
    try:
        return import_module(name)
    except (ImportError, ValueError, TypeError) as error:
        raise ConfigError(f"The module {name!r} cannot be loaded: {error}.", hint="Check its name.") from error


def plugin_at(where: str) -> Any:
    """The object at `module:NAME`. Raises ConfigError: there is no such module, or nothing of that name in it."""
    module_name, _, name = where.partition(":")
    module = module_at(module_name)
    if not name or not hasattr(module, name):
        raise ConfigError(f"{module_name} has no {name!r}.", hint="Say MODULE:NAME.")
    return getattr(module, name)


@dataclass(frozen=True, slots=True)
class Plugin:
    """An entry point as it is installed; nothing of it is imported.

    Attributes:
        group: E.g. `chauffeur.planners`.
        name: As it is called for.
        where: `module:NAME`.
        package: The distribution that registers it; empty where its metadata name none.
        version: Of that distribution.
        shadowed: Whether another package's entry point of this name is the one that is loaded.
    """

    group: str
    name: str
    where: str
    package: str
    version: str
    shadowed: bool = False

    @property
    def built_in(self) -> bool:
        """True if it ships with Chauffeur."""
        return self.package in OWN

    def fault(self, *, load: bool = False) -> str:
        """Why it cannot be loaded, in words; empty where nothing speaks against it.

        Args:
            load: Import it. Otherwise its module is looked for and not run, so that what it needs stays unknown.
        """
        if not load:
            module = self.where.partition(":")[0].strip()
            return "" if _module_there(module) else f"there is no module {module}"
        point = EntryPoint(self.name, self.where, self.group)
        try:
            point.load()
        except Exception as error:  # noqa: BLE001 - a third party's module may raise anything
            return f"{type(error).__name__}: {error}"
        return ""


def plugins() -> tuple[Plugin, ...]:
    """Everything that is registered in a group of Chauffeur, in the order of `GROUPS`, built-in parts first."""
    found: dict[tuple[str, str, str, str], Plugin] = {}
    first: set[tuple[str, str]] = set()
    everything = entry_points()
    others = sorted(group for group in everything.groups if group.startswith("chauffeur.") and group not in GROUPS)
    for group in (*GROUPS, *others):
        for point in everything.select(group=group):
            package, version = (point.dist.name, point.dist.version) if point.dist is not None else ("", "")
            key = (group, point.name, point.value, package)
            if key not in found:
                shadowed = (group, point.name) in first
                found[key] = Plugin(group, point.name, point.value, package, version, shadowed)
                first.add((group, point.name))
    order = [*GROUPS, *others]
    return tuple(sorted(found.values(), key=lambda one: (order.index(one.group), not one.built_in, one.name)))


def _module_there(name: str) -> bool:
    """True if a module can be found; neither it nor the packages above it are run."""
    top, *below = name.split(".")
    whole = top
    try:
        found = find_spec(top)  # also asks the finders of editable installs
        for part in below:
            whole = f"{whole}.{part}"
            inside = None if found is None else found.submodule_search_locations
            found = None if inside is None else PathFinder.find_spec(whole, inside)
    except (ImportError, ValueError):
        return False
    return found is not None


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
