"""Checks that a benchmark keeps to the protocol: what the kernel, its workers and its report rely on."""

from __future__ import annotations

import asyncio
import json
import pickle
import re
from collections.abc import Iterator
from dataclasses import asdict, is_dataclass
from typing import Any, Final, get_args

from pydantic import TypeAdapter, ValidationError

from chauffeur.bench.kernel.benchmark import Asks, Benchmark, ItemOutcome
from chauffeur.bench.kernel.calls import Request
from chauffeur.bench.kernel.metrics import registered
from chauffeur.bench.kernel.pipeline import context_adapter, describe_scene
from chauffeur.bench.kernel.report import tables
from chauffeur.bench.kernel.store import Row
from chauffeur.concept import ChauffeurError, Context, Plan, PlanRequest, Scenario, Thoughts, Usage
from chauffeur.planners.base import Prose
from chauffeur.worlds.conformance import ConformanceFinding

_VERSIONED: Final = re.compile(r"[\w./-]{1,80}-v\d{1,4}")
_REFUSED: Final = Plan(Thoughts("No."), None, refusal="No.", planner="conformance", model="conformance")


class _Desk:
    """Describes scenes, and answers nothing."""

    async def context(self, scenario: Scenario) -> Context:
        row = describe_scene(scenario)
        if row["error"]:
            raise ChauffeurError(row["error"])
        return context_adapter.validate_python(row["context"])

    async def ask(self, request: Request) -> None:
        del request


def check_benchmark(benchmark: Benchmark[Any]) -> tuple[ConformanceFinding, ...]:
    """Run every check on a benchmark and return their findings.

    Its first item is asked about, answered with a refusal or with no words, and done: a drive of that item may be
    simulated.
    """
    return (
        ConformanceFinding("what it is", tuple(_of_itself(benchmark))),
        ConformanceFinding("items", tuple(_of_items(benchmark))),
        ConformanceFinding("the first item", tuple(_of_first(benchmark))),
    )


def faults(benchmark: Benchmark[Any]) -> list[str]:
    """Faults of a benchmark, in sentences; empty when it conforms."""
    return [fault for finding in check_benchmark(benchmark) for fault in finding.faults]


def _of_itself(benchmark: Benchmark[Any]) -> Iterator[str]:
    if not _VERSIONED.fullmatch(benchmark.id):
        yield f"The id {benchmark.id!r} has no version, e.g. `mine-v1`."
    if benchmark.asks not in get_args(Asks):
        yield f"It asks for {benchmark.asks!r}, which is none of {get_args(Asks)}."
    try:
        json.dumps(dict(benchmark.config))
    except (TypeError, ValueError) as error:
        yield f"Its config is no JSON: {error}."
    known = registered()
    for measure in (measure for spec in benchmark.tables for measure in spec.measures):
        if measure not in known:
            yield f"The metric {measure.id!r} is not registered."
        if not _VERSIONED.fullmatch(measure.id):
            yield f"The metric {measure.id!r} has no version."


def _of_items(benchmark: Benchmark[Any]) -> Iterator[str]:
    ids = [item.id for item in benchmark.items()]
    if not ids:
        yield "It has no items."
    if len(set(ids)) < len(ids):
        yield "Two of its items have one id."
    if ids != [item.id for item in benchmark.items()]:
        yield "Its items come in another order the second time."


def _of_first(benchmark: Benchmark[Any]) -> Iterator[str]:
    item = next(iter(benchmark.items()), None)
    if item is None:
        return
    yield from _of_rows(benchmark, ItemOutcome(item, None, "not asked", None))
    answer = None
    if benchmark.asks:
        request = asyncio.run(benchmark.request(item, _Desk()))
        if isinstance(request, PlanRequest) != (benchmark.asks == "plans"):
            yield f"It asks for {benchmark.asks} with a {type(request).__name__}."
            return
        reply = _REFUSED if benchmark.asks == "plans" else Prose("", whole=True, model="conformance", usage=Usage())
        answer = _stored(asdict(reply))
    job = benchmark.job(item, answer)
    if job is None:
        yield from _of_rows(benchmark, ItemOutcome(item, answer, "", None))
        return
    again = benchmark.job(item, answer)
    if again is None or again.key != job.key:
        yield "The same answer gives a job with another key the second time."
    pickle.dumps(job)  # as it goes to a worker; what cannot be said there is raised here
    for result in (job.spoiled("the worker died"), job.run()):
        if result.get("key") != job.key or not isinstance(result.get("infra_failed"), bool):
            yield "A result lacks the job's `key`, or `infra_failed`."
        else:
            yield from _of_rows(benchmark, ItemOutcome(item, answer, "", _stored(result)))


def _of_rows(benchmark: Benchmark[Any], outcome: ItemOutcome[Any]) -> Iterator[str]:
    adapter: TypeAdapter[Any] = TypeAdapter(benchmark.row)
    rows: list[Row] = []
    for row in benchmark.rows(outcome):
        fields = asdict(row) if is_dataclass(row) and not isinstance(row, type) else row
        try:
            adapter.validate_python(fields)
            rows.append({"item": outcome.item.id, **_stored(fields)})
        except (ValidationError, TypeError, ValueError) as error:
            yield f"A row is no {benchmark.row.__name__}: {error}"
    for table in tables(benchmark.tables, rows):
        json.dumps(table.json)


def _stored(value: Any) -> Any:
    """As it is read again."""
    return json.loads(json.dumps(value))
