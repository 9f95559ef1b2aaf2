"""LaMPilot-Bench as four stages on disk: plan -> generate -> rollout -> score.

Each stage appends rows to its own file and skips what is there, so a run can be interrupted at any time and continued
by the same command. Changing a metric costs no rollout, changing the simulator costs no token. Items whose planner gave
the same policy for the same sample share one rollout.
"""

from __future__ import annotations

import asyncio
import hashlib
import json
import multiprocessing
import os
import platform
import signal
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from chauffeur.bench.lampilot.families import family_of
from chauffeur.bench.lampilot.report import family_lines, markdown
from chauffeur.bench.lampilot.rollout import (
    BASELINES,
    ROLLOUT_VERSION,
    RolloutJob,
    context_adapter,
    describe_sample,
    not_driven,
    roll_out,
)
from chauffeur.bench.store import Row, RowStore
from chauffeur.concept import (
    LAMPILOT_LIMITS,
    ChauffeurError,
    ConfigError,
    Instruction,
    Limits,
    PlannerError,
    PlanRequest,
    Scenario,
)
from chauffeur.drive.files import publish
from chauffeur.drive.session import scenario_hash
from chauffeur.planners.base import Planner
from chauffeur.planners.prompts import Setting, build_system_message
from chauffeur.worlds.highway.dblv1 import Dataset, Item

BENCH_VERSION = "lampilot-bench-v1"

Progress = Callable[[str, int, int], None]
"""Called as (stage, done, total)."""


@dataclass(frozen=True, slots=True)
class RunConfig:
    """What decides a run; stored with it, and compared when it is continued.

    Attributes:
        planner: Planner spec, or a baseline's name.
        setting: `few-shot` or `zero-shot`, for planners that read S.
        data_sha256: Hash of the data set.
        items: Number of items drawn, 0 for all.
        seed: Seed of the draw.
        limits: Bounds for the checks.
    """

    planner: str
    setting: Setting
    data_sha256: str
    items: int
    seed: int
    limits: Limits = LAMPILOT_LIMITS


class LampilotRun:
    """One run in one folder."""

    def __init__(self, folder: Path, dataset: Dataset, config: RunConfig, planner: Planner | None) -> None:
        """Open or continue a run.

        Args:
            folder: Where stages are stored.
            dataset: DbLv1 data.
            config: What decides the run.
            planner: Who plans; None for the baselines.

        Raises:
            ConfigError: The folder holds a run with another configuration.
            DataError: A stage file in it is damaged.
        """
        if planner is None and config.planner not in BASELINES:
            raise ConfigError(f"{config.planner!r} is no baseline.", hint=f"Baselines: {', '.join(BASELINES)}.")
        self.folder = folder
        self.config = config
        self._planner = planner
        self.items = choose_items(dataset, config.items, config.seed)
        samples = {item.scenario.id: item.scenario for item in self.items}
        self._scenario_hashes = {name: scenario_hash(scenario) for name, scenario in samples.items()}
        self._freeze_plan()
        self._contexts = RowStore(folder / "contexts.jsonl", "sample")
        self._plans = RowStore(folder / "generate.jsonl", "item")
        self._rollouts = RowStore(folder / "rollout.jsonl", "key")

    def _freeze_plan(self) -> None:
        plan = {
            "bench": BENCH_VERSION,
            "config": asdict(self.config),
            "model": "" if self._planner is None else self._planner.model,
            "items": [item.id for item in self.items],
        }
        path = self.folder / "plan.json"
        if path.exists():
            if json.loads(path.read_text(encoding="utf-8")) != json.loads(json.dumps(plan)):
                raise ConfigError(
                    f"{self.folder} holds a run with another configuration.",
                    hint="Continue it with the options it was started with, or choose another --out folder.",
                )
            return
        publish(path, json.dumps(plan, indent=1, ensure_ascii=False).encode(), "run's plan")

    def run(self, workers: int, progress: Progress, concurrency: int = 8) -> list[Row]:
        """All stages that are not done yet; returns the result rows. Interrupting keeps everything finished."""
        context = multiprocessing.get_context("spawn")
        pool = ProcessPoolExecutor(max_workers=workers, mp_context=context, initializer=_worker_setup)
        try:
            if self._planner is not None:
                self._describe(pool, progress)
                asyncio.run(self._generate(self._planner, progress, concurrency))
            self._roll_out(pool, progress)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for worker in multiprocessing.active_children():  # a rollout cut short is done again; do not wait for it
                worker.terminate()
            raise
        else:
            pool.shutdown()
        finally:
            for store in (self._contexts, self._plans, self._rollouts):
                store.close()
        return self.score()

    def _describe(self, pool: ProcessPoolExecutor, progress: Progress) -> None:
        samples = {item.scenario.id: item.scenario for item in self.items}
        _spread(pool, describe_sample, samples, self._contexts, lambda done: progress("describe", done, len(samples)))

    async def _generate(self, planner: Planner, progress: Progress, concurrency: int) -> None:
        # A failed call is tried again on resume; a plan, or a planner's refusal, is kept.
        todo = [i for i in self.items if not (row := self._plans.rows.get(i.id)) or row["error"]]
        gate = asyncio.Semaphore(concurrency)
        done = len(self.items) - len(todo)
        progress("generate", done, len(self.items))
        system = build_system_message(self.config.setting, limits=self.config.limits)

        async def one(item: Item) -> None:
            nonlocal done
            context = self._contexts.rows[item.scenario.id]
            row: Row = {"item": item.id, "plan": None, "error": ""}
            if context["error"]:
                row["error"] = context["error"]
            else:
                request = PlanRequest(
                    Instruction(item.command, source="benchmark"),
                    context_adapter.validate_python(context["context"]),
                    system,
                    limits=self.config.limits,
                )
                async with gate:
                    try:
                        row["plan"] = asdict(await planner.plan(request))
                    except PlannerError as error:
                        row["error"] = str(error)
            self._plans.append(row)
            done += 1
            progress("generate", done, len(self.items))

        for start in range(0, len(todo), 256):
            await asyncio.gather(*(one(item) for item in todo[start : start + 256]))

    def _job(self, item: Item) -> RolloutJob | None:
        """The item's rollout; None when it has no plan because its planner failed."""
        plan: dict[str, Any] | None = None
        if self._planner is not None:
            plan = self._plans.rows[item.id]["plan"]
            if plan is None:
                return None
        baseline = self.config.planner if self._planner is None else ""
        return RolloutJob(self._key(item.scenario, plan, baseline), item.scenario, baseline, plan, self.config.limits)

    def _key(self, scenario: Scenario, plan: dict[str, Any] | None, baseline: str) -> str:
        """What decides a rollout: sample, policy, what the checks read of the plan, limits, versions."""
        decisive: Any = baseline
        if plan is not None:
            decisive = [plan["policy"], plan["refusal"], plan["intent"], plan["settings"]]
        parts = [ROLLOUT_VERSION, self._scenario_hashes[scenario.id], decisive, asdict(self.config.limits)]
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:24]

    def _roll_out(self, pool: ProcessPoolExecutor, progress: Progress) -> None:
        jobs = {job.key: job for item in self.items if (job := self._job(item)) is not None}
        _spread(pool, roll_out, jobs, self._rollouts, lambda done: progress("rollout", done, len(jobs)))

    def score(self) -> list[Row]:
        """One row per planned item, written to `results.jsonl`, with the table in `table.md`."""
        about: Row = {
            "schema": "lampilot-results-v1",
            "planner": self.config.planner,
            "model": "" if self._planner is None else self._planner.model,
            "data_sha256": self.config.data_sha256,
            "chauffeur": version("chauffeur"),
        }
        rows = [about | self._result(item) for item in self.items]
        files = {
            "results.jsonl": "".join(json.dumps(row, ensure_ascii=False) + "\n" for row in rows),
            "provenance.json": json.dumps(self.provenance(), indent=1),
            "table.md": markdown(*family_lines(rows)) + "\n",
        }
        for name, text in files.items():
            publish(self.folder / name, text.encode(), "run's result")
        return rows

    def _result(self, item: Item) -> Row:
        base: Row = {
            "item": item.id,
            "task": item.task,
            "family": family_of(item.task),
            "sample": item.scenario.id,
            "scenario_seed": str(item.scenario.seed),
            "command": item.command,
        }
        job = self._job(item)
        if job is None:
            return base | not_driven("not_driven", self._plans.rows[item.id]["error"], infra_failed=True)
        plan = job.plan or {}
        usage = plan.get("usage", {})
        rollout = {k: v for k, v in self._rollouts.rows[job.key].items() if k not in ("key", "sample", "verdicts")}
        cost = {
            "latency_s": plan.get("latency_s"),
            "prompt_tokens": usage.get("prompt_tokens", 0),
            "completion_tokens": usage.get("completion_tokens", 0),
            "cost_usd": usage.get("cost_usd"),
        }
        return base | cost | {"rollout_key": job.key, "intent": plan.get("intent", "")} | rollout

    def provenance(self) -> dict[str, Any]:
        """Versions, hashes, seeds and the machine."""
        return {
            "bench": BENCH_VERSION,
            "rollout": ROLLOUT_VERSION,
            "config": asdict(self.config),
            "model": "" if self._planner is None else self._planner.model,
            "versions": {name: version(name) for name in ("chauffeur", "highway-env", "numpy", "pydantic-monty")},
            "python": platform.python_version(),
            "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} CPUs",
        }


def _spread(
    pool: ProcessPoolExecutor,
    work: Callable[[Any], Row],
    jobs: Mapping[str, Any],
    store: RowStore,
    done: Callable[[int], None],
) -> None:
    """Do the jobs whose key the store does not have, storing each row as it comes and saying how many are done."""
    futures = [pool.submit(work, job) for key, job in jobs.items() if key not in store.rows]
    finished = len(jobs) - len(futures)
    done(finished)
    for future in as_completed(futures):
        store.append(future.result())
        finished += 1
        done(finished)


def choose_items(dataset: Dataset, count: int, seed: int) -> Sequence[Item]:
    """All items in order, or the first `count` of a permutation (NumPy's legacy generator, as LaMPilot draws them)."""
    items = dataset.items()
    if count <= 0 or count >= len(items):
        return items
    order = np.random.RandomState(seed).permutation(len(items))
    return [items[i] for i in order[:count]]


def _worker_setup() -> None:
    # Ctrl-C is the parent's business.
    signal.signal(signal.SIGINT, signal.SIG_IGN)


class LampilotBenchmark:
    """Entry of the benchmark registry."""

    id = BENCH_VERSION

    @staticmethod
    def open_run(folder: Path, dataset: Dataset, config: RunConfig, planner: Planner | None) -> LampilotRun:
        """Open or continue a run; see LampilotRun. Raises ChauffeurError subclasses only."""
        try:
            return LampilotRun(folder, dataset, config, planner)
        except OSError as error:
            raise ChauffeurError(f"Cannot use the run folder {folder}: {error.strerror}.") from error
