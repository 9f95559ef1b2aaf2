"""Contents of a run's folder: its definition, frozen before anything is asked (`plan.json`), and every stage."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Final, Generic, Self, TypeVar

from chauffeur.bench.kernel.benchmark import BenchItem, BenchJob, Benchmark, ItemOutcome, KeepsItems
from chauffeur.bench.kernel.shards import WHOLE, Shard
from chauffeur.bench.kernel.store import Row, RowStore, freeze
from chauffeur.concept import DataError
from chauffeur.concept.data import parse_json

T = TypeVar("T", bound=BenchItem)

PLAN: Final = "plan.json"
"""A manifest's file in the folder of its run."""
_MADE: Final = "made"
LIVE: Final = "live.jsonl"
"""File of the rows of a run that has not been scored yet."""


@dataclass(frozen=True)
class Manifest(Generic[T]):
    """Definition of a run; a folder continues no other.

    Attributes:
        bench: Id of the benchmark.
        config: What decided the run, as JSON.
        model: The planner's model; empty where no one is asked.
        labels: What must be said wherever a row is shown.
        shard: Which part of the run this is.
        items: This part's items, in the run's order.
        places: Place of each in the whole run, from 0.
        planned: Items of the whole run.
        more: What the benchmark keeps of this part's items (`kept`), so that a run can be shown without its data.
        made: How the benchmark was made, `name` and `options`; empty where that is not known. It decides nothing: data
            may have moved since.
    """

    bench: str
    config: dict[str, Any]
    model: str
    labels: tuple[str, ...]
    shard: Shard
    items: tuple[T, ...]
    places: tuple[int, ...]
    planned: int
    more: Mapping[str, Any]
    made: Mapping[str, Any]

    @classmethod
    def of(
        cls,
        benchmark: Benchmark[T],
        config: Mapping[str, Any],
        *,
        model: str = "",
        labels: Sequence[str] = (),
        shard: Shard = WHOLE,
        made: Mapping[str, Any] | None = None,
    ) -> Self:
        """Manifest of a run, or of a shard of it, that is to begin."""
        every = benchmark.items()
        places = tuple(place for place, item in enumerate(every) if shard.owns(item.id))
        items = tuple(every[place] for place in places)
        stored: dict[str, Any] = json.loads(json.dumps(dict(config)))
        more = benchmark.kept(items) if isinstance(benchmark, KeepsItems) else {}
        return cls(benchmark.id, stored, model, tuple(labels), shard, items, places, len(every), more, made or {})

    @property
    def about(self) -> dict[str, Any]:
        """Fields that all parts of one run must share."""
        return {
            "bench": self.bench,
            "config": self.config,
            "model": self.model,
            "labels": list(self.labels),
            "planned": self.planned,
        }

    def content(self) -> bytes:
        """The manifest as the file's content."""
        fields = {
            **self.about,
            "shard": str(self.shard),
            "items": [item.id for item in self.items],
            "places": list(self.places),
            **self.more,
            **({_MADE: self.made} if self.made else {}),
        }
        # One line a field: short enough to read with `head -c`, and not a line for every number.
        lines = (f"{json.dumps(name)}: {json.dumps(value, ensure_ascii=False)}" for name, value in fields.items())
        return ("{\n" + ",\n".join(lines) + "\n}\n").encode("utf-8", "surrogatepass")

    def freeze(self, folder: Path) -> None:
        """Store the manifest, or find that it is the one stored.

        Raises:
            ConfigError: The folder holds another run.
            DataError: What is stored is damaged or cannot be written.
        """
        path, content = folder / PLAN, self.content()

        def same(stored: bytes) -> bool:
            return stored == content or _deciding(parsed(path, stored)) == _deciding(json.loads(content))

        freeze(path, content, "run's plan", same)

    def provenance(self, more: Mapping[str, Any]) -> dict[str, Any]:
        """Versions, configuration and the machine; `more` is the benchmark's."""
        return {
            "bench": self.bench,
            **more,
            "config": self.config,
            "model": self.model,
            "labels": list(self.labels),
            "versions": versions(),
            "python": platform.python_version(),
            "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} CPUs",
        }


def made_by(name: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """How a benchmark was made, as a manifest keeps it: paths are absolute, what is no JSON is left out."""
    kept = {key: str(value.absolute()) if isinstance(value, Path) else value for key, value in options.items()}
    plain = {key: value for key, value in kept.items() if isinstance(value, str | int | float | bool | None)}
    return {"name": name, "options": plain}


def _deciding(fields: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in fields.items() if name != _MADE}


def read_plan(folder: Path) -> dict[str, Any]:
    """The fields of a run folder's manifest. Raises DataError: there is none, or it is damaged."""
    path = folder / PLAN
    try:
        return parsed(path, path.read_bytes())
    except OSError as error:
        raise DataError(f"Cannot read {path}: {error.strerror or error}.", hint="Is it a run's folder?") from error


def parsed(path: Path, raw: bytes) -> dict[str, Any]:
    """A manifest's fields. Raises DataError when they are damaged."""
    try:
        value = parse_json(raw)
    except ValueError as error:
        raise DataError(
            f"{path} is damaged ({error}).",
            hint="Delete it and run the same command: what was asked and driven is kept.",
        ) from error
    return value if isinstance(value, dict) else {}


@dataclass(slots=True)
class StageStore(Generic[T]):
    """A run's stored rows.

    Attributes:
        benchmark: Whose run it is.
        manifest: What it is about.
        contexts: C by scene.
        plans: Answers, or why there is none, by item.
        rollouts: What the jobs gave, by the key of what decided it.
        systems: System messages that models were given, by their hash; answers name them.
        live: Rows of the items done so far, to be looked at while the run goes on; `results.jsonl` takes its place.
    """

    benchmark: Benchmark[T]
    manifest: Manifest[T]
    contexts: RowStore
    plans: RowStore
    rollouts: RowStore
    systems: RowStore
    live: RowStore
    _jobs: dict[str, tuple[Row | None, BenchJob | None]] = field(
        default_factory=dict[str, "tuple[Row | None, BenchJob | None]"]
    )

    @classmethod
    def open(cls, folder: Path, benchmark: Benchmark[T], manifest: Manifest[T]) -> Self:
        """Read a run folder's stages. Raises StorageError."""
        return cls(
            benchmark,
            manifest,
            RowStore(folder / "contexts.jsonl", "sample"),
            RowStore(folder / "generate.jsonl", "item"),
            RowStore(folder / "rollout.jsonl", "key"),
            RowStore(folder / "systems.jsonl", "sha256"),
            RowStore(folder / LIVE, "item", durable=False),
        )

    @property
    def stores(self) -> tuple[RowStore, ...]:
        """All that a resume reads."""
        return self.contexts, self.plans, self.rollouts, self.systems

    def answer(self, item: T) -> Row | None:
        """The item's answer; None when there is none (yet)."""
        return self.plans.rows.get(item.id, {}).get("plan")

    def unanswered(self, item: T) -> bool:
        """True if the item has still to be asked."""
        return bool(self.benchmark.asks) and self.answer(item) is None

    def job(self, item: T) -> BenchJob | None:
        """Job for the item's answer; None when there is none yet, or nothing to do."""
        answer = self.answer(item)
        if self.benchmark.asks and answer is None:
            return None
        known = self._jobs.get(item.id)
        if known is None or known[0] is not answer:
            known = self._jobs[item.id] = (answer, self.benchmark.job(item, answer))
        return known[1]

    def asked(self, item: T) -> bool:
        """True if the item is accounted for: done, or tried and failed."""
        if self.unanswered(item):
            return item.id in self.plans.rows
        job = self.job(item)
        return job is None or job.key in self.rollouts.rows

    @property
    def settled(self) -> bool:
        """True if nothing is left to ask or to do, what failed for want of infrastructure included."""
        return all(not self.unanswered(item) and self._done(self.job(item)) for item in self.manifest.items)

    def _done(self, job: BenchJob | None) -> bool:
        row = None if job is None else self.rollouts.rows.get(job.key)
        return job is None or (row is not None and not row["infra_failed"])

    def outcome(self, item: T) -> ItemOutcome[T]:
        """Stored record of an item."""
        job = self.job(item)
        error = str(self.plans.rows.get(item.id, {}).get("error") or "")
        result = None if job is None else self.rollouts.rows.get(job.key)
        return ItemOutcome(item, self.answer(item), error, result)


def take_over_shards(stages: StageStore[Any], folder: Path) -> None:
    """Append what shards of this run have in the folders beneath its own, so that it is not done again.

    Folders of other runs are passed over, and so is what failed there and is present here. Raises StorageError.
    """
    for part in sorted(folder.glob("shard-*-of-*")):
        try:
            about = read_plan(part)
        except DataError:
            continue
        if all(about.get(name) == value for name, value in stages.manifest.about.items()):
            adopt(stages, part)


def adopt(stages: StageStore[Any], part: Path) -> None:
    """Append the rows of another folder of the same run: what is absent here, or failed here only. Raises
    StorageError."""
    for store in stages.stores:
        there = RowStore(part / store.path.name, store.key).rows
        rows = [row for key, row in sorted(there.items()) if key not in store.rows or _better(row, store.rows[key])]
        if rows:
            store.append(*rows)


def _better(row: Row, known: Row) -> bool:
    """True if a row has what another one of the same key was tried for in vain."""
    return _in_vain(known) and not _in_vain(row)


def _in_vain(row: Row) -> bool:
    return bool(row.get("infra_failed") or (row.get("error") and not row.get("plan")))


def versions() -> dict[str, str]:
    """Of Chauffeur, and of the libraries that decide what a drive comes to."""
    return {name: _version(name) for name in ("chauffeur", "numpy", "numba", "pydantic-monty")}


def _version(distribution: str) -> str:
    try:
        return version(distribution)
    except PackageNotFoundError:
        return "not installed"
