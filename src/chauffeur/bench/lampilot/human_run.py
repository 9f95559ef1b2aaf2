"""The run folder of a human driver: the same files as every run's, filled one drive at a time.

Beside the usual stages stand `attempts.jsonl` (drives begun) and `traces.jsonl` (what the hands did). Rows are only
ever added. A drive begun counts: one that was broken off is failed, and no item is driven twice. The draw is a
permutation of the items, so the same command with another `--items` goes further, or ends the run where it stands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from chauffeur.bench.kernel.shards import WHOLE
from chauffeur.bench.kernel.store import Row, RowStore, another_run
from chauffeur.bench.lampilot.frozen import BENCH_VERSION, Frozen
from chauffeur.bench.lampilot.human import (
    BROKEN_OFF,
    PLANNER,
    HandTrace,
    drive_again,
    hand_plan,
    noted,
    trace_adapter,
)
from chauffeur.bench.lampilot.metrics import ORIGIN
from chauffeur.bench.lampilot.results import open_stages, publish_results, results
from chauffeur.bench.lampilot.rollout import ROLLOUT_VERSION
from chauffeur.concept import LAMPILOT_LIMITS, ChauffeurError, ConfigError, DataError
from chauffeur.describe import describe
from chauffeur.drive.files import publish
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.dblv1 import Dataset, Item


@dataclass(frozen=True, slots=True)
class HumanConfig:
    """What decides a human driver's run.

    Attributes:
        driver: Name of the person.
        assist: Whether the lane is kept while nobody steers.
        data_sha256: Hash of the data set.
        items: Number of items drawn, 0 for all.
        seed: Seed of the draw.
        planner: Always `human`.
    """

    driver: str
    assist: bool
    data_sha256: str
    items: int
    seed: int
    planner: str = PLANNER

    @property
    def labels(self) -> tuple[str, ...]:
        """What must be said wherever a row is shown."""
        return (f"human driver ({self.driver})", *(["lane-keeping assist"] if self.assist else []))


class HumanRun:
    """One person's run in one folder. One process at a time may use it (`sole_writer`)."""

    def __init__(self, folder: Path, dataset: Dataset, config: HumanConfig, ruler_id: str = ORIGIN.id) -> None:
        """Open or continue a run.

        Args:
            folder: Where it lies.
            dataset: DbLv1 data.
            config: What decides the run.
            ruler_id: What its rows are scored by; the same drives can be scored by another one later.

        Raises:
            ConfigError: The folder holds another run, or one that went further than `config.items`.
            DataError: Its plan is damaged.
            StorageError: It cannot be read.
        """
        self.folder = folder
        self.config = config
        self.ruler_id = ruler_id
        self.items = draw(dataset, config.items, config.seed)
        self._attempts = RowStore(folder / "attempts.jsonl", "item")
        self._traces = RowStore(folder / "traces.jsonl", "item")
        frozen = Frozen(
            bench=BENCH_VERSION,
            config=asdict(config) | {"setting": "", "limits": asdict(LAMPILOT_LIMITS)},
            model=config.driver,
            labels=config.labels,
            shard=WHOLE,
            items=tuple(self.items),
            places=tuple(range(len(self.items))),
            planned=len(self.items),
        )
        self._freeze(frozen)
        self._stages = open_stages(folder, frozen)

    def _freeze(self, frozen: Frozen) -> None:
        """Store the plan; unlike other runs' it may grow, and shrink to what has been driven."""
        path = self.folder / "plan.json"
        if path.exists():
            if _without_count(Frozen.read(self.folder)) != _without_count(frozen):
                raise another_run(self.folder)
            if self._attempts.rows.keys() - {item.id for item in self.items}:
                raise ConfigError(
                    f"{self.done} items of the run in {self.folder} have been driven; they stay in it.",
                    hint=f"Give --items {self.done} or more.",
                )
        publish(path, frozen.content(), "run's plan")

    @property
    def done(self) -> int:
        """Items that have been begun, or can never be driven."""
        return len(self._attempts.rows)

    def next_item(self) -> Item | None:
        """The first item that has not been begun; None when all have."""
        return next((item for item in self.items if item.id not in self._attempts.rows), None)

    def describe(self, item: Item, world: HighwayWorld) -> None:
        """Keep the context of an item's sample, from a world just reset to it. Raises StorageError."""
        if item.scenario.id not in self._stages.contexts.rows:
            context = asdict(describe(world.observe()))
            self._stages.contexts.append({"sample": item.scenario.id, "context": context, "error": ""})

    def begin(self, item: Item, when: str) -> None:
        """From now on the item's drive counts. `when` is ISO 8601 UTC. Raises StorageError."""
        self._attempts.append({"item": item.id, "begun": when})

    def finish(self, item: Item, trace: HandTrace, happened: Row) -> None:
        """Keep a drive that came to its end: the trace first, from which all else can be made again.

        Raises:
            StorageError: The disk did not take it; it can be tried again.
        """
        self._traces.append({"item": item.id, "trace": asdict(trace)})
        self._keep_plan(item, trace)
        self._keep_rollout(item, noted(happened, trace))

    def skip(self, item: Item, error: ChauffeurError) -> None:
        """Keep that an item's sample cannot be set up. Raises StorageError."""
        self._stages.plans.append({"item": item.id, "plan": None, "error": str(error)})
        self._attempts.append({"item": item.id, "begun": ""})

    def trace(self, item_id: str) -> HandTrace | None:
        """What the hands did on an item; None when its drive has no stored end.

        Raises:
            DataError: The trace is damaged.
        """
        row = self._traces.rows.get(item_id)
        if row is None:
            return None
        try:
            return trace_adapter.validate_python(row["trace"])
        except (KeyError, ValueError) as error:
            raise DataError(f"{self._traces.path} holds a damaged trace of {item_id}.") from error

    def rows(self) -> list[Row]:
        """Result rows of the items begun so far, in the plan's order.

        Raises:
            DataError: A trace is damaged.
            StorageError: What was missing in the files was made again, and the disk did not take it.
        """
        for item in self.items:
            if item.id in self._attempts.rows:
                self._complete(item)
        return [row for row in results(self._stages, self.ruler_id) if row["item"] in self._attempts.rows]

    def score(self) -> list[Row]:
        """Result rows of the items begun so far; `results.jsonl`, provenance and table are written for all items.

        Raises: See `rows`; DataError when they cannot be written.
        """
        rows = self.rows()
        publish_results(self.folder, self._stages, results(self._stages, self.ruler_id))
        return rows

    def close(self) -> None:
        """Close the files."""
        for store in (self._attempts, self._traces, *self._stages.stores):
            store.close()

    def _complete(self, item: Item) -> None:
        """What a crash left out of the files of an item that was begun."""
        if item.id not in self._stages.plans.rows:
            self._keep_plan(item, self.trace(item.id))
        job = self._stages.job(item)
        if job is not None and job.key not in self._stages.rollouts.rows:
            trace = self.trace(item.id)
            self._keep_rollout(item, BROKEN_OFF if trace is None else drive_again(item.scenario, trace))

    def _keep_plan(self, item: Item, trace: HandTrace | None) -> None:
        plan = asdict(hand_plan(self.config.driver, trace))
        del plan["latency_s"], plan["usage"]  # unknown of a person, which is not nought
        self._stages.plans.append({"item": item.id, "plan": plan, "error": ""})

    def _keep_rollout(self, item: Item, happened: Row) -> None:
        job = self._stages.job(item)
        assert job is not None, "the plan row was written before"
        about = {"key": job.key, "sample": item.scenario.id, "rollout": ROLLOUT_VERSION}
        self._stages.rollouts.append(about | happened)


def draw(dataset: Dataset, count: int, seed: int) -> Sequence[Item]:
    """The first `count` (0: all) of a permutation of the items, drawn as LaMPilot draws them."""
    items = dataset.items()
    order = np.random.RandomState(seed).permutation(len(items))
    return [items[i] for i in (order[:count] if count > 0 else order)]


def _without_count(plan: Frozen) -> dict[str, Any]:
    return {name: value for name, value in plan.config.items() if name != "items"}
