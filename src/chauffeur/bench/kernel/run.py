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
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, is_dataclass
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
        manifest: Manifest[Any] | None = None,
    ) -> None:
        """Open or continue a run.

        Args:
            folder: Where stages are stored.
            benchmark: What is run.
            planner: Who is asked; None where nobody is. Its `labels`, where it has them, stand in every row.
            shard: Which part of the run.
            manifest: What the run is about, where the benchmark freezes more than the kernel does.

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
        if manifest is None:
            about = {**benchmark.config, **({} if planner is None else {"planner": planner.id})}
            manifest = Manifest[Any].make(
                benchmark.id,
                about,
                benchmark.items(),
                model="" if planner is None else planner.model,
                labels=getattr(planner, "labels", ()),
                shard=shard,
            )
        self.manifest = manifest
        with sole_writer(folder):
            manifest.freeze(folder)
        self.stages = StageStore[Any].open(folder, benchmark, manifest)

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
            rows = self.score()
            self.stages.live.clear()
        vain = self._undriven()
        if self.halt is None and self.manifest.shard == WHOLE and self._all(vain):
            raise BenchError(
                f"None of the {len(self.items)} items could be driven or asked, so there is no score. {_reasons(vain)}",
                hint="The same command tries again."
                if all(one.failed for one in vain)
                else f"Is it the right file for this benchmark? Every item's reason is in {self.folder}.",
            )
        return rows

    def _undriven(self) -> list[ItemOutcome[Any]]:
        """Of the items that are accounted for, those of which nothing came for no fault of an answer."""
        outcomes = (self.stages.outcome(item) for item in self.items if self.stages.asked(item))
        return [one for one in outcomes if one.undriven]

    def _all(self, outcomes: Sequence[ItemOutcome[Any]]) -> bool:
        return 0 < len(outcomes) == sum(map(self.stages.asked, self.items))

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
            pipeline = Pipeline(self.stages, engine, caller, scribe, watch, effort.concurrency, self._rows)
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

    @property
    def about(self) -> Row:
        """Fields of the run that stand in every row."""
        about: Row = {"bench": self.benchmark.id, "chauffeur": __version__, "labels": list(self.manifest.labels)}
        if self._planner is not None:
            about |= {"planner": self._planner.id, "model": self._planner.model}
        return about

    def _rows(self, item: Any) -> list[Row]:
        """An item's rows, from what is stored of it; what only all rows together tell is not in them."""
        rows = self.benchmark.rows(self.stages.outcome(item))
        return [{"item": item.id} | self.about | _fields(row) for row in rows]

    def score(self) -> list[Row]:
        """All rows, from what is stored; written to `results.jsonl`, with `table.md`, `report.json` and
        `provenance.json`.

        Raises:
            DataError: They cannot be written.
        """
        found = [row for item in self.items for row in self._rows(item)]
        if isinstance(self.benchmark, ComparesRows):
            found = [dict(row) for row in self.benchmark.together(found)]
        lines = [json.dumps(row, ensure_ascii=True) for row in found]
        rows: list[Row] = [json.loads(line) for line in lines]  # as they are read again: tuples become lists
        undriven = self._undriven()
        filled = () if self._all(undriven) else tables(self.benchmark.tables, rows)
        asked = sum(map(self.stages.asked, self.items))
        judge = str(getattr(self.benchmark, "judge", ""))
        notes = [*self.manifest.labels, *([f"Judge: {judge}"] if judge else [])]
        if asked < len(self.items):
            notes.append(f"Partial: {asked} of {len(self.items)} items.")
        if undriven:
            share = 100.0 * len(undriven) / asked
            notes.append(f"Not driven: {len(undriven)} of {asked} items ({share:.0f} %). {_reasons(undriven)}")
        write_results(
            self.folder,
            {
                "results.jsonl": "".join(line + "\n" for line in lines),
                "table.md": report_markdown(self.benchmark.id, filled, notes),
                "report.json": as_json(
                    {"bench": self.benchmark.id, "judge": judge, "tables": [table.json for table in filled]}
                ),
                "provenance.json": as_json(self.manifest.provenance()),
            },
        )
        return rows


def _reasons(outcomes: Sequence[ItemOutcome[Any]]) -> str:
    """The most frequent reasons why nothing came of items, in words."""
    counts = Counter(one.why or "no reason is stored" for one in outcomes).most_common(_REASONS)
    return " ".join(f"{times} times: {why.rstrip('.')}." for why, times in counts)


def as_json(value: Any) -> str:
    """A file's text."""
    return json.dumps(value, indent=1, ensure_ascii=False) + "\n"


def write_results(folder: Path, files: dict[str, str]) -> None:
    """Write what came of a run. Raises DataError when it cannot be written."""
    for name, text in files.items():
        publish(folder / name, text.encode("utf-8", "replace"), "run's result")


def _fields(row: Any) -> Row:
    return asdict(row) if is_dataclass(row) and not isinstance(row, type) else dict(cast("Row", row))


async def _close(planner: Planner | Answerer | None) -> None:
    """Close a planner that has connections to close."""
    close: Any = getattr(planner, "close", None)
    if close is not None:
        with suppress(Exception):
            await close()
