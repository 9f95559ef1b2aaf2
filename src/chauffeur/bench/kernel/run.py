"""A run of a benchmark as stages on disk: manifest -> answers -> results -> rows.

Each stage appends rows to its own file and skips what is there, so a run can be interrupted at any time and continued
by the same command. Changing a metric costs no job, changing the simulator costs no token. Items whose jobs have one
key share one result. This module puts a run together; `pipeline.py` is the run at work.
"""

from __future__ import annotations

import asyncio
import json
import os
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, is_dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final, cast

import numpy as np

from chauffeur.bench.kernel.benchmark import Benchmark, ComparesRows, ItemOutcome
from chauffeur.bench.kernel.budget import Bill, Price, Spending, SpendingBudget
from chauffeur.bench.kernel.calls import Caller, Halt, Patience
from chauffeur.bench.kernel.engine import LocalEngine, WorkEngine, first_error
from chauffeur.bench.kernel.pace import Gate, Window
from chauffeur.bench.kernel.pipeline import Pipeline, Watch
from chauffeur.bench.kernel.report import report_markdown, tables
from chauffeur.bench.kernel.shards import WHOLE, Shard
from chauffeur.bench.kernel.stages import Manifest, StageStore, take_over_shards
from chauffeur.bench.kernel.store import Row, Scribe, sole_writer
from chauffeur.concept import ChauffeurError, ConfigError
from chauffeur.driving import event_loop
from chauffeur.driving.files import publish
from chauffeur.planners.base import Answerer, Planner
from chauffeur.version import __version__

_REASONS: Final = 3
"""Reasons that are named of a run's items that were not driven."""


class BenchError(ChauffeurError):
    """A run came to nothing: not a single item could be driven."""


@dataclass(frozen=True, slots=True)
class Effort:
    """Resources a run may use; none of them changes a result.

    Attributes:
        workers: Simulation processes; 0 for one a core.
        concurrency: Planner calls in flight at most.
        budget: What the planner may cost.
        price: For endpoints whose price is not known.
        requests_a_plan: Most requests one plan may take, for the budget.
        patience: How often one plan is tried.
        engine: Makes who simulates, given `workers`.
    """

    workers: int = 0
    concurrency: int = 16
    budget: SpendingBudget = field(default_factory=SpendingBudget)
    price: Price | None = None
    requests_a_plan: int = 2
    patience: Patience = field(default_factory=Patience)
    engine: Callable[[int], WorkEngine] = LocalEngine


class BenchRun:
    """One run, or one shard of it, in one folder.

    Attributes:
        halt: Why it stopped asking before the end; None when it did not.
        repeated: Calls sent again, word for word, after a time-out.
    """

    def __init__(
        self,
        folder: Path,
        benchmark: Benchmark[Any],
        planner: Planner | Answerer | None = None,
        *,
        shard: Shard = WHOLE,
        made: Mapping[str, Any] | None = None,
    ) -> None:
        """Open or continue a run.

        Args:
            folder: Where stages are stored.
            benchmark: What is run.
            planner: Who is asked; None where nobody is. Its `labels`, where it has them, stand in every row.
            shard: Which part of the run.
            made: How the benchmark was made (`name`, `options`); by that `merge_shards` makes it again.

        Raises:
            ConfigError: The folder holds a run with another configuration, or the planner is none for this benchmark.
            DataError: Its manifest is damaged.
            StorageError: The folder cannot be used.
        """
        wanted = {"plans": Planner, "words": Answerer}.get(benchmark.asks)
        if wanted is not None and not isinstance(planner, wanted):
            raise ConfigError(
                f"{benchmark.id} asks for {benchmark.asks}, which {getattr(planner, 'id', 'nobody')} does not give.",
                hint="Name a planner for plans, a language model for words.",
            )
        self.folder = folder
        self.benchmark = benchmark
        self.halt: Halt | None = None
        self.repeated = 0
        self._planner = planner if benchmark.asks else None
        self.manifest = Manifest[Any].of(
            benchmark,
            {**({} if planner is None else {"planner": planner.id}), **benchmark.config},
            model="" if planner is None else planner.model,
            labels=(*getattr(planner, "labels", ()), *getattr(benchmark, "labels", ())),
            shard=shard,
            made=made,
        )
        with sole_writer(folder):
            self.manifest.freeze(folder)
        self.stages = StageStore[Any].open(folder, benchmark, self.manifest)

    @property
    def items(self) -> Any:
        """The items of this run."""
        return self.manifest.items

    @property
    def damaged(self) -> dict[str, int]:
        """Damaged rows found when the run was opened, by file; their items are done again."""
        return {store.path.name: len(store.damaged) for store in self.stages.stores if store.damaged}

    @property
    def unasked(self) -> int:
        """Items that have been neither done nor tried."""
        return sum(not self.stages.asked(item) for item in self.items)

    @property
    def spoiled(self) -> int:
        """Items that were tried and failed for want of infrastructure; the next run tries them again."""
        outcomes = (self.stages.outcome(item) for item in self.items if self.stages.asked(item))
        return sum(one.failed for one in outcomes)

    def run(self, watch: Watch, effort: Effort | None = None) -> list[Row]:
        """Do all that is not done yet and score; afterwards `halt` says whether, and why, it stopped asking before
        the end. Interrupting keeps everything finished. What its shards have done in folders beneath it is taken over.

        Args:
            watch: Is told where the run stands.
            effort: How hard to work.

        Raises:
            ConfigError: Another process works in this folder.
            BenchError: Not a single item could be driven.
            ChauffeurError: The disk is full, or no worker can be had. What was stored stays.
        """
        with sole_writer(self.folder):
            try:
                if self.manifest.shard == WHOLE and not self.stages.settled:
                    take_over_shards(self.stages, self.folder)
                if not self.stages.settled:
                    event_loop.run(self._work(watch, effort or Effort()))
            except BaseExceptionGroup as group:
                raise first_error(group) from group
            finally:
                for store in (*self.stages.stores, self.stages.live):
                    store.close()
            rows = score(self.folder, self.stages)
            self.stages.live.clear()
        asked = [self.stages.outcome(item) for item in self.items if self.stages.asked(item)]
        vain = [one for one in asked if one.undriven]
        if self.halt is None and self.manifest.shard == WHOLE and 0 < len(vain) == len(asked):
            raise BenchError(
                f"None of the {len(self.items)} items could be driven or asked, so there is no score. {_reasons(vain)}",
                hint="The same command tries again."
                if all(one.failed for one in vain)
                else f"Is it the right file for this benchmark? Every item's reason is in {self.folder}.",
            )
        return rows

    async def _work(self, watch: Watch, effort: Effort) -> None:
        loop = asyncio.get_running_loop()
        broken: asyncio.Future[None] = loop.create_future()

        def fail(error: ChauffeurError) -> None:
            loop.call_soon_threadsafe(lambda: None if broken.done() else broken.set_exception(error))

        scribe = Scribe(fail)
        engine = effort.engine(effort.workers or os.cpu_count() or 1)
        caller = self._caller(effort)
        whole = False
        try:
            await engine.start()
            self.stages.live.clear()
            pipeline = Pipeline(
                self.stages, engine, caller, scribe, watch, effort.concurrency, partial(rows_of, self.stages)
            )
            await pipeline.work(broken)
            whole = True
        finally:
            engine.close(now=not whole)
            if broken.done() and not broken.cancelled():
                broken.exception()  # it has been raised by whoever waited for it
            self.halt, self.repeated = (None, 0) if caller is None else (caller.halt, caller.repeated)
            try:
                scribe.close()
            finally:
                await _close(self._planner)

    def _caller(self, effort: Effort) -> Caller | None:
        if self._planner is None:
            return None
        total, dearest = Bill(), None
        for row in self.stages.plans.rows.values():
            total.add(Bill.read(row))
            usage = (row.get("plan") or {}).get("usage") or {}
            if usage.get("requests") and usage.get("cost_usd") is not None:
                dearest = max(dearest or 0.0, float(usage["cost_usd"]))
        return Caller(
            self._planner,
            Gate(Window(effort.concurrency)),
            Spending(effort.budget, total, dearest, effort.requests_a_plan),
            np.random.default_rng(0),
            effort.price,
            effort.patience,
        )


def rows_of(stages: StageStore[Any], item: Any) -> list[Row]:
    """An item's rows, from what is stored of it; what only all rows together tell is not in them."""
    manifest = stages.manifest
    about: Row = {"bench": manifest.bench, "chauffeur": __version__, "labels": list(manifest.labels)}
    if stages.benchmark.asks:
        about |= {"planner": manifest.config.get("planner", ""), "model": manifest.model}
    return [{"item": item.id} | about | _fields(row) for row in stages.benchmark.rows(stages.outcome(item))]


def score(folder: Path, stages: StageStore[Any]) -> list[Row]:
    """All rows of a run, from what is stored; written to `results.jsonl`, with `table.md`, `report.json` and
    `provenance.json`.

    Raises:
        DataError: They cannot be written.
    """
    benchmark, manifest = stages.benchmark, stages.manifest
    found = [row for item in manifest.items for row in rows_of(stages, item)]
    if isinstance(benchmark, ComparesRows):
        found = [dict(row) for row in benchmark.together(found)]
    lines = [json.dumps(row, ensure_ascii=True) for row in found]
    rows: list[Row] = [json.loads(line) for line in lines]  # as they are read again: tuples become lists
    asked = [stages.outcome(item) for item in manifest.items if stages.asked(item)]
    undriven = [one for one in asked if one.undriven]
    filled = () if 0 < len(undriven) == len(asked) else tables(benchmark.tables, rows)
    judge = str(getattr(benchmark, "judge", ""))
    notes = [*manifest.labels, *([f"Judge: {judge}"] if judge else [])]
    if len(asked) < len(manifest.items):
        notes.append(f"Partial: {len(asked)} of {len(manifest.items)} items.")
    if undriven:
        share = 100.0 * len(undriven) / len(asked)
        notes.append(f"Not driven: {len(undriven)} of {len(asked)} items ({share:.0f} %). {_reasons(undriven)}")
    told = {"bench": benchmark.id, "judge": judge, "tables": [table.json for table in filled]}
    files = {
        "results.jsonl": "".join(line + "\n" for line in lines),
        "table.md": report_markdown(benchmark.id, filled, notes),
        "report.json": as_json(told),
        "provenance.json": as_json(manifest.provenance(getattr(benchmark, "provenance", {}))),
    }
    write_results(folder, files)
    return rows


def write_results(folder: Path, files: Mapping[str, str]) -> None:
    """Write what came of a run. Raises DataError when it cannot be written."""
    for name, text in files.items():
        publish(folder / name, text.encode("utf-8", "replace"), "run's result")


def _reasons(outcomes: Sequence[ItemOutcome[Any]]) -> str:
    """The most frequent reasons why nothing came of items, in words."""
    counts = Counter(one.why or "no reason is stored" for one in outcomes).most_common(_REASONS)
    return " ".join(f"{times} times: {why.rstrip('.')}." for why, times in counts)


def as_json(value: Any) -> str:
    """A file's text."""
    return json.dumps(value, indent=1, ensure_ascii=False) + "\n"


def _fields(row: Any) -> Row:
    return asdict(row) if is_dataclass(row) and not isinstance(row, type) else dict(cast("Row", row))


async def _close(planner: Planner | Answerer | None) -> None:
    """Close a planner that has connections to close."""
    close: Any = getattr(planner, "close", None)
    if close is not None:
        with suppress(Exception):
            await close()
