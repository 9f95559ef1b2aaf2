"""Benchmarks that a planner can take, with the options of a profile; of each other one the reason and the remedy."""

from __future__ import annotations

import inspect
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, Final, Literal, cast, get_args, get_type_hints

from chauffeur.bench.kernel.benchmark import GROUP, Benchmark, benchmark_from
from chauffeur.bench.kernel.headline import CardPart, usual_part
from chauffeur.concept import ChauffeurError, ConfigError
from chauffeur.concept.extras import install_command
from chauffeur.concept.registry import load_plugin, plugin_names
from chauffeur.driving import event_loop
from chauffeur.driving.aptitude import kinds_written
from chauffeur.planners.base import Answerer, Planner
from chauffeur.planners.registry import make_model

Profile = Literal["quick", "full"]
Options = Mapping[str, Mapping[str, Any]]
"""Options of benchmarks, by name."""


@dataclass(frozen=True, slots=True)
class Evaluated:
    """Who is evaluated.

    Attributes:
        made: The planner, or the model that answers questions.
        spec: Its specification, by which workers make it again; empty where only the object is known.
        base_url: Address of its endpoint, where one was given.
    """

    made: Planner | Answerer
    spec: str = ""
    base_url: str = ""

    @classmethod
    def of(cls, planner: str | Planner | Answerer, base_url: str = "", **options: Any) -> Evaluated:
        """Make a candidate of a specification, or take the object. Raises ConfigError as `make_planner`."""
        if not isinstance(planner, str):
            return cls(planner)
        given = {"base_url": base_url, **options} if base_url else options
        return cls(make_model(planner, **given), planner, base_url)


@dataclass(frozen=True, slots=True)
class PlannedPart:
    """A benchmark on its way to a score card.

    Attributes:
        name: As it is registered.
        benchmark: Made with the profile's options; None where it is not run.
        part: Its headlines.
        why: Reason why it is not run; empty where it is.
        remedy: What would change that.
    """

    name: str
    benchmark: Benchmark[Any] | None
    part: CardPart | None
    why: str = ""
    remedy: str = ""


_NO_PLANNER: Final = "It asks no planner: it measures a part of Chauffeur that all planners share."


LEFT_OUT: Final = "It was left out."


class _NotRun(Exception):  # noqa: N818 - a verdict, caught below
    def __init__(self, why: str, remedy: str = "") -> None:
        super().__init__(why)
        self.why, self.remedy = why, remedy


def planned_parts(
    who: Evaluated, profile: Profile, options: Options, only: Sequence[str] = ()
) -> tuple[PlannedPart, ...]:
    """Every installed benchmark, in the order of names; those not in `only`, where that names some, are left out.

    A planner is asked four wishes, to know what it writes (`driving.aptitude`).

    Raises:
        ConfigError: No such profile, or options of a benchmark that is not installed.
        ChauffeurError: The planner gives no plan at all.
    """
    if profile not in get_args(Profile):
        raise ConfigError(f"There is no profile {profile!r}.", hint=f"Take {' or '.join(get_args(Profile))}.")
    names = plugin_names(GROUP)
    if unknown := {*options, *only} - set(names):
        raise ConfigError(f"There is no benchmark {sorted(unknown)[0]!r}.", hint=f"Known: {', '.join(names)}.")
    kinds = event_loop.run(_asked(who.made)) if isinstance(who.made, Planner) else {}
    return tuple(
        PlannedPart(name, None, None, LEFT_OUT)
        if only and name not in only
        else _planned(name, who, profile, options.get(name, {}), kinds)
        for name in names
    )


async def _asked(planner: Planner) -> dict[str, str]:
    try:
        return await kinds_written(planner)
    finally:
        if (close := getattr(planner, "close", None)) is not None:
            await close()


def part_of(name: str) -> CardPart | None:
    """What a registered benchmark says of score cards; None where it says nothing. Raises ConfigError."""
    return cast("CardPart | None", getattr(_kind(load_plugin(GROUP, name)), "card", None))


def _kind(make: Any) -> Any:
    """The class of what an entry point makes; the object where it is made already."""
    return make if isinstance(make, type) or not callable(make) else get_type_hints(make).get("return")


def _planned(
    name: str, who: Evaluated, profile: Profile, own: Mapping[str, Any], kinds: Mapping[str, str]
) -> PlannedPart:
    part = None
    try:
        part = part_of(name)
        benchmark = _made(name, part, who, profile, own, kinds)
        return PlannedPart(name, benchmark, part or usual_part(benchmark.tables))
    except _NotRun as verdict:
        return PlannedPart(name, None, part, verdict.why, verdict.remedy)
    except ChauffeurError as error:
        return PlannedPart(name, None, part, error.message, error.hint)


def _made(
    name: str,
    part: CardPart | None,
    who: Evaluated,
    profile: Profile,
    own: Mapping[str, Any],
    kinds: Mapping[str, str],
) -> Benchmark[Any]:
    """The benchmark for a candidate. Raises _NotRun where the two do not go together, ChauffeurError as the kernel."""
    make = load_plugin(GROUP, name)
    takes = inspect.signature(make).parameters if callable(make) else {}
    asker = "planner" if part is None else part.planner
    told = getattr(_kind(make), "asks", None)  # a property tells it of the made benchmark alone
    if told == "words":
        _answers("words", who)
    if told == "" and asker not in takes:
        raise _NotRun(_NO_PLANNER)
    if told == "" and not who.spec:
        raise _NotRun("Its workers make the planner anew, by name.", "Give a specification, e.g. module:Class.")
    if told == "" and who.base_url and "base_url" not in takes:
        raise _NotRun("Its workers are told no --base-url.", "Set CHAUFFEUR_BASE_URL in its place.")
    if part is not None:
        _fits(part, who, kinds)
        if part.extra is not None and find_spec(part.extra[1]) is None:
            raise _NotRun(f"It needs {part.extra[1]}, which is not installed.", install_command(part.extra[0]))
    given = {} if part is None else dict(part.quick if profile == "quick" else part.full)
    given |= own
    if "data" in takes and takes["data"].default is inspect.Parameter.empty and "data" not in given:
        given["data"] = _data(name)
    if asker in takes:
        given[asker] = who.spec or who.made.id
    if who.base_url and "base_url" in takes:
        given["base_url"] = who.base_url
    benchmark = benchmark_from(make, name, **given)
    _answers(benchmark.asks or "plans", who)
    return benchmark


def _answers(asks: str, who: Evaluated) -> None:
    """Raise _NotRun for a candidate that does not give what is asked for, plans or words."""
    if asks == "words" and not isinstance(who.made, Answerer):
        raise _NotRun(f"It asks for words; {who.made.id} answers no questions.", "Name a model, e.g. openai/gpt-4o.")
    if asks == "plans" and not isinstance(who.made, Planner):
        raise _NotRun(f"It asks for plans; {who.made.id} plans nothing.", "Name a planner.")


def _fits(part: CardPart, who: Evaluated, kinds: Mapping[str, str]) -> None:
    """Raise _NotRun for a planner that writes nothing that the benchmark drives."""
    if part.drives:
        _answers("plans", who)
    for place, wanted in part.drives.items():
        kind = kinds.get(place)
        if kind is not None and kind not in wanted:
            said = " or ".join(_KINDS.get(one, one) for one in wanted)
            found = _KINDS.get(kind, kind) if kind else "nothing that can be driven"
            why = f"It drives {said}; asked in the scenario {place}, {who.made.id} wrote {found}."
            raise _NotRun(why, f"Planners that write {_KINDS[wanted[0]]}: {_WRITERS[wanted[0]]}.")


_KINDS: Final = {
    "program": "programs",
    "parameters": "parameters",
    "action_matrix": "gains",
    "trajectory": "trajectories",
}
_WRITERS: Final = {
    "program": "onboard, meaning, openai/MODEL",
    "parameters": "talk2drive, talk2drive/openai/MODEL",
    "action_matrix": "vlm, gains, motion/openai/MODEL",
    "trajectory": "vilad",
}


def _data(name: str) -> str:
    """Folder of a benchmark's data from the environment. Raises _NotRun where none is named."""
    variable = f"CHAUFFEUR_{name.upper().replace('-', '_')}"
    if folder := os.environ.get(variable, ""):
        return folder
    raise _NotRun("It needs a folder of data.", f"Name it: -o {name}.data=FOLDER, or {variable} in the environment.")
