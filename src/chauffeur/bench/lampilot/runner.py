"""LaMPilot-Bench as stages on disk: plan -> generate -> rollout -> score.

Each stage appends rows to its own file and skips what is there, so a run can be interrupted at any time and continued
by the same command. Changing a metric costs no rollout, changing the simulator costs no token. Items whose planner gave
the same policy for the same sample share one rollout. This module puts a run together; `pipeline.py` is the run.
"""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from chauffeur.bench.kernel.calls import Caller, Halt, Patience
from chauffeur.bench.kernel.engine import Engine, LocalEngine, first_error
from chauffeur.bench.kernel.pace import Gate, Window
from chauffeur.bench.kernel.shards import WHOLE, Shard
from chauffeur.bench.kernel.spending import Bill, Budget, Price, Spending
from chauffeur.bench.kernel.store import Row, Scribe, sole_writer
from chauffeur.bench.lampilot.asking import PlainRequests, Requests
from chauffeur.bench.lampilot.frozen import BENCH_VERSION, Frozen, RunConfig, choose_items
from chauffeur.bench.lampilot.metrics import ruler_named
from chauffeur.bench.lampilot.pipeline import Pipeline, Watch
from chauffeur.bench.lampilot.results import Stages, publish_results, results
from chauffeur.bench.lampilot.rollout import BASELINES
from chauffeur.concept import ChauffeurError, ConfigError
from chauffeur.drive.rehearsal import label
from chauffeur.planners.base import Planner
from chauffeur.safety.shield import SHIELD_VERSION
from chauffeur.worlds.highway.dblv1 import Dataset

__all__ = ["BENCH_VERSION", "Effort", "LampilotBenchmark", "LampilotRun", "RunConfig", "choose_items"]


EXPERT_LABEL = "scripted expert: told the goal, reads no words"
SHIELD_LABEL = f"{SHIELD_VERSION} has the last word"
"""What must be said wherever a row of the expert is shown."""


@dataclass(frozen=True, slots=True)
class Effort:
    """How hard a run works; none of it changes a result.

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
    budget: Budget = field(default_factory=Budget)
    price: Price | None = None
    requests_a_plan: int = 2
    patience: Patience = field(default_factory=Patience)
    engine: Callable[[int], Engine] = LocalEngine


class LampilotRun:
    """One run, or one shard of it, in one folder."""

    def __init__(
        self,
        folder: Path,
        dataset: Dataset,
        config: RunConfig,
        planner: Planner | None,
        *,
        shard: Shard = WHOLE,
        requests: Requests | None = None,
    ) -> None:
        """Open or continue a run.

        Args:
            folder: Where stages are stored.
            dataset: DbLv1 data.
            config: What decides the run.
            planner: Who plans; None for the baselines. A planner's `labels`, where it has them, stand in every row.
            shard: Which part of the run.
            requests: What the planner is asked; None for the plain wish under `config.setting`.

        Raises:
            ConfigError: The folder holds a run with another configuration.
            DataError: Its plan is damaged.
            StorageError: The folder cannot be used.
        """
        if planner is None and config.planner not in BASELINES:
            raise ConfigError(f"{config.planner!r} is no baseline.", hint=f"Baselines: {', '.join(BASELINES)}.")
        self.folder = folder
        self.config = config
        self.halt: Halt | None = None
        self.repeated = 0
        self._planner = planner
        self._requests = requests or _plain(config)
        labels: tuple[str, ...] = (*getattr(planner, "labels", ()), *getattr(requests, "labels", ()))
        if config.planner == "expert":
            labels = (*labels, EXPERT_LABEL)
        if config.rehearse:
            if config.planner in ("idm", "mobil"):
                raise ConfigError(f"{config.planner} has no program to rehearse.", hint="Leave --rehearse out.")
            labels = (*labels, label(config.rehearse))
        if config.shield:
            labels = (*labels, SHIELD_LABEL)
        frozen = Frozen.make(dataset, config, "" if planner is None else planner.model, labels, shard)
        with sole_writer(folder):
            frozen.freeze(folder)
        self.stages = Stages.open(folder, frozen)

    @property
    def items(self) -> Any:
        """The items of this run."""
        return self.stages.frozen.items

    @property
    def damaged(self) -> dict[str, int]:
        """Damaged rows found when the run was opened, by file; their items are done again."""
        return {store.path.name: len(store.damaged) for store in self.stages.stores if store.damaged}

    @property
    def unasked(self) -> int:
        """Items that have been neither driven nor tried."""
        return sum(not self.stages.asked(item) for item in self.items)

    def run(self, watch: Watch, effort: Effort | None = None, *, ruler: str = "origin") -> list[Row]:
        """Do all that is not done yet and score; afterwards `halt` says whether, and why, it stopped asking before
        the end. Interrupting keeps everything finished.

        Args:
            watch: Is told where the run stands.
            effort: How hard to work.
            ruler: Short name or id of the ruler to score by.

        Raises:
            ConfigError: Another process works in this folder, or the ruler is unknown.
            ChauffeurError: The disk is full, or no worker can be had. What was stored stays.
        """
        ruler = ruler_named(ruler).id
        with sole_writer(self.folder):
            try:
                if not self.stages.settled:
                    asyncio.run(self._work(watch, effort or Effort(), ruler))
            except BaseExceptionGroup as group:
                raise first_error(group) from group
            finally:
                for store in self.stages.stores:
                    store.close()
            return self.score(ruler)

    async def _work(self, watch: Watch, effort: Effort, ruler: str) -> None:
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
            pipeline = Pipeline(self.stages, engine, caller, self._requests, scribe, watch, ruler, effort.concurrency)
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
            np.random.default_rng(self.config.seed),
            effort.price,
            effort.patience,
        )

    def score(self, ruler: str = "origin") -> list[Row]:
        """One row per planned item, from what is stored; written to `results.jsonl`, the table to `table.md`.

        Raises:
            DataError: They cannot be written.
        """
        rows = results(self.stages, ruler)
        publish_results(self.folder, self.stages, rows)
        return rows


def _plain(config: RunConfig) -> Requests:
    """Requests of a setting that needs nothing but words and situation. Raises ConfigError for another."""
    if config.setting == "human-feedback":
        raise ConfigError("The setting human-feedback needs the requests of a policy repository.")
    return PlainRequests.of(config.setting, config.limits)


async def _close(planner: Planner | None) -> None:
    """Close a planner that has connections to close."""
    close: Any = getattr(planner, "close", None)
    if close is not None:
        with suppress(Exception):
            await close()


class LampilotBenchmark:
    """Entry of the benchmark registry."""

    id = BENCH_VERSION

    @staticmethod
    def open_run(
        folder: Path, dataset: Dataset, config: RunConfig, planner: Planner | None, **options: Any
    ) -> LampilotRun:
        """Open or continue a run; see LampilotRun. Raises ChauffeurError subclasses only."""
        return LampilotRun(folder, dataset, config, planner, **options)
