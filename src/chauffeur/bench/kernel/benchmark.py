"""Protocol of a benchmark: items, what is asked for each, what is done with the answer, and how the rows are read.

The kernel does the rest, the same way for all: it paces and pays for the asking, spreads the work over processes,
stores every stage as it comes, goes on where a run stopped, and writes rows, tables and provenance. A benchmark is
registered as an entry point in the group `chauffeur.benchmarks`; `chauffeur bench` runs it by that name.
"""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Generic, Literal, Protocol, TypeVar, runtime_checkable

from chauffeur.bench.kernel.calls import Request
from chauffeur.bench.kernel.metrics import TableSpec
from chauffeur.bench.kernel.store import Row
from chauffeur.concept import ConfigError, Context, Plan, Scenario
from chauffeur.concept.registry import load_plugin, made
from chauffeur.planners.base import Answerer, Planner, Prose

GROUP: Final = "chauffeur.benchmarks"
"""Entry points of benchmarks: each is called with keyword options and gives a Benchmark."""


class BenchItem(Protocol):
    """One thing that is asked or driven."""

    @property
    def id(self) -> str:
        """Unique in its benchmark and the same for ever."""
        ...


class BenchJob(Protocol):
    """Work for a worker process: picklable. Items whose jobs have one key share one result."""

    @property
    def key(self) -> str:
        """Content hash of all that decides the result."""
        ...

    @property
    def near(self) -> str:
        """Jobs with the same text do best on the same worker, e.g. drives in one scene."""
        ...

    def run(self) -> Row:
        """The result: JSON, with `key`, `infra_failed` (whether only the machine is to blame) and, where the item's own
        data forbid to do it at all, `undriven`."""
        ...

    def spoiled(self, detail: str) -> Row:
        """The result where the worker died or failed in a way that was not foreseen; it has `infra_failed`."""
        ...


class RequestDesk(Protocol):
    """Services a benchmark may use while it makes a request."""

    async def context(self, scenario: Scenario) -> Context:
        """C of a scene, described once. Raises ChauffeurError when it cannot be set up."""
        ...

    async def ask(self, request: Request) -> Plan | Prose | None:
        """An earlier turn, asked at the item's cost; None when there is no answer."""
        ...


T = TypeVar("T", bound=BenchItem)


@dataclass(frozen=True, slots=True)
class ItemOutcome(Generic[T]):
    """Stored record of an item.

    Attributes:
        item: The item.
        answer: JSON form of the plan, or of the words; None when no one was asked, or none came.
        error: Why none came.
        result: What its job gave; None without one.
    """

    item: T
    answer: Row | None
    error: str
    result: Row | None

    @property
    def failed(self) -> bool:
        """True if it was tried in vain: no answer came, or the machine failed."""
        return bool(self.error and self.answer is None) or bool(self.result and self.result["infra_failed"])

    @property
    def undriven(self) -> bool:
        """True if it could not be done at all: tried in vain, or its own data forbid it."""
        return self.failed or bool(self.result and self.result.get("undriven"))

    @property
    def why(self) -> str:
        """Reason for the failure; empty where there was none."""
        return self.error or str((self.result or {}).get("detail") or "")


Asks = Literal["plans", "words", ""]
"""Answering party: a planner for plans, a model for words (`planners.base.Answerer`), or no one."""


class Benchmark(Protocol[T]):
    """One benchmark, with everything that decides its results.

    It may have, too: `judge`, who judges, in words; `labels`, what must be said wherever a row is shown; `variant`, its
    options as the name of the default run folder shows them; `provenance`, versions beside the kernel's own.
    """

    @property
    def id(self) -> str:
        """Versioned: changes whenever the same answers could give other rows."""
        ...

    @property
    def config(self) -> Mapping[str, Any]:
        """All that decides a run beside planner and code, as JSON: options, seed, hash of the data, versions."""
        ...

    @property
    def asks(self) -> Asks:
        """Kind of answers it asks for."""
        ...

    @property
    def row(self) -> type:
        """Type of its rows: a frozen dataclass, or a TypedDict."""
        ...

    @property
    def tables(self) -> Sequence[TableSpec]:
        """Tables of its rows: the metrics, and the columns that group them."""
        ...

    def items(self) -> Sequence[T]:
        """All items of the run, in its order. The same every time."""
        ...

    async def request(self, item: T, desk: RequestDesk) -> Request:
        """Make the request for an item. Raises ChauffeurError when it cannot be asked."""
        ...

    def job(self, item: T, answer: Row | None) -> BenchJob | None:
        """Job that a worker does with the answer, e.g. driving it; None where the answer itself is the result."""
        ...

    def rows(self, outcome: ItemOutcome[T]) -> Sequence[Any]:
        """The item's rows, values of `row`; none where there is nothing to be said (yet). Cheap: it scores what is
        stored, so a metric can change without anything being asked or driven again."""
        ...


@runtime_checkable
class ComparesRows(Protocol):
    """Optional part of a benchmark whose rows can only be completed beside the others."""

    def together(self, rows: Sequence[Row]) -> Sequence[Row]:
        """All rows of the run, as `rows` gave them, completed; as many, in the same order."""
        ...


@runtime_checkable
class Concludes(Protocol):
    """Optional part of a benchmark that reports more of a run than its tables."""

    def conclude(self, folder: Path, rows: Sequence[Row], results: Mapping[str, Row | None]) -> Sequence[str]:
        """Lines beneath the tables; files of its own are written into the run's folder.

        Args:
            folder: The run's.
            rows: All that were written.
            results: What the jobs gave, by item.
        """
        ...


@runtime_checkable
class KeepsItems(Protocol):
    """Optional part of a benchmark whose runs can be shown without the data they were drawn from."""

    def kept(self, items: Sequence[Any]) -> Mapping[str, Any]:
        """What is kept of items in `plan.json`, as JSON fields beside the kernel's own."""
        ...


class Unasked:
    """A benchmark whose jobs need no answers: it asks nobody."""

    asks: Asks = ""

    async def request(self, item: Any, desk: RequestDesk) -> Request:
        raise NotImplementedError(f"{item.id} is not asked about")


def make_benchmark(name: str, **options: Any) -> Benchmark[Any]:
    """The benchmark registered under a name.

    Raises:
        ConfigError: No such name, or an option it does not take.
    """
    return benchmark_from(load_plugin(GROUP, name), name, **options)


def takes_planner(make: Any) -> bool:
    """True if a benchmark's class or function is told who is asked: it drives with it, or notes it."""
    return callable(make) and "planner" in inspect.signature(make).parameters


def asked_by(
    benchmark: Benchmark[Any], planner: str | Planner | Answerer | None, **options: Any
) -> Planner | Answerer | None:
    """Who answers a benchmark's requests; None where it makes none.

    Args:
        benchmark: Makes the requests.
        planner: Who; by its specification `options` belong to it. By default `onboard`, for plans.

    Raises:
        ConfigError: A model has to be named, or there is none of that name.
    """
    if not benchmark.asks or not isinstance(planner, str | None):
        return planner if benchmark.asks and not isinstance(planner, str) else None
    if planner is None and benchmark.asks == "words":
        raise ConfigError("Nobody is asked.", hint="Name a model with --planner, e.g. openai/gpt-4o.")
    from chauffeur.planners.registry import make_answerer, make_planner

    make = getattr(benchmark, "planner_of", None) or (make_planner if benchmark.asks == "plans" else make_answerer)
    return make(planner or "onboard", **options)


def benchmark_from(found: Any, name: str, **options: Any) -> Benchmark[Any]:
    """The benchmark that an object of a module is, or makes of options: a class or a function.

    Raises:
        ConfigError: It takes no such option, or broke.
    """
    if isinstance(found, type) or not hasattr(found, "items"):
        return made("benchmark", name, found, **options)
    if options:
        raise ConfigError(f"The benchmark {name!r} is made already, and takes no options.", hint="Name its class.")
    return found
