"""The score stage: from what was asked and what happened to one row per planned item, under one ruler.

It reads stored rows only, so it costs neither a token nor a simulation: another ruler is another scoring.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from chauffeur.bench.kernel.store import Row, RowStore
from chauffeur.bench.lampilot.families import family_of
from chauffeur.bench.lampilot.frozen import BENCH_VERSION, Frozen
from chauffeur.bench.lampilot.goals_more import answered_rightly
from chauffeur.bench.lampilot.metrics import points, ruler_named
from chauffeur.bench.lampilot.report import answers_note, family_lines, markdown
from chauffeur.bench.lampilot.rollout import BASELINES, REHEARSAL_SEED, ROLLOUT_VERSION, RolloutJob, not_driven
from chauffeur.drive.files import publish
from chauffeur.safety.shield import SHIELD_VERSION
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.dblv1 import Item

SCHEMA = "lampilot-results-v2"

NOT_ASKED = "Not asked: the run stopped before this item."

_INNER = ("key", "sample", "verdicts", "rollout", "signals", "rehearsal")
"""What a rollout row has for this stage only."""


@dataclass(slots=True)
class Stages:
    """A run's stored rows.

    Attributes:
        frozen: Its plan.
        contexts: C by sample.
        plans: Plans, or why there is none, by item.
        rollouts: What happened, by the key of what decided it.
    """

    frozen: Frozen
    contexts: RowStore
    plans: RowStore
    rollouts: RowStore
    _limits: dict[str, Any] = field(default_factory=dict[str, Any])
    _jobs: dict[str, RolloutJob] = field(default_factory=dict[str, RolloutJob])

    @classmethod
    def open(cls, folder: Path, frozen: Frozen) -> Stages:
        """Read a run folder's stages. Raises StorageError."""
        return cls(
            frozen,
            RowStore(folder / "contexts.jsonl", "sample"),
            RowStore(folder / "generate.jsonl", "item"),
            RowStore(folder / "rollout.jsonl", "key"),
            asdict(frozen.limits),
        )

    @property
    def stores(self) -> tuple[RowStore, ...]:
        """All of them."""
        return self.contexts, self.plans, self.rollouts

    @property
    def baseline(self) -> str:
        """One of BASELINES; empty when a planner plans."""
        planner = str(self.frozen.config["planner"])
        return planner if planner in BASELINES else ""

    @property
    def _rehearse(self) -> int:
        return int(self.frozen.config.get("rehearse", 0))

    @property
    def _shield(self) -> bool:
        return bool(self.frozen.config.get("shield", False))

    def plan(self, item: Item) -> dict[str, Any] | None:
        """The item's plan; None when there is none (yet)."""
        return self.plans.rows.get(item.id, {}).get("plan")

    def job(self, item: Item) -> RolloutJob | None:
        """The item's rollout; None when it has no plan."""
        plan = None if self.baseline else self.plan(item)
        if plan is None and not self.baseline:
            return None
        job = self._jobs.get(item.id)
        if job is None or job.plan is not plan:
            key = self._key(item.scenario.id, plan)
            job = RolloutJob(key, item.scenario, self.baseline, plan, self.frozen.limits, self._rehearse, self._shield)
            self._jobs[item.id] = job
        return job

    def _key(self, sample: str, plan: dict[str, Any] | None) -> str:
        """What decides a rollout: sample, policy, what the checks read of the plan, limits, versions."""
        decisive: Any = self.baseline
        if plan is not None:
            decisive = [plan["policy"], plan["refusal"], plan["intent"], plan["settings"]]
        parts = [ROLLOUT_VERSION, self.frozen.hashes[sample], decisive, self._limits]
        if self._rehearse:
            parts += [self._rehearse, REHEARSAL_SEED]
        if self._shield:
            parts.append(SHIELD_VERSION)
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:24]

    def asked(self, item: Item) -> bool:
        """Whether the item is accounted for: driven, or tried and failed."""
        job = self.job(item)
        return item.id in self.plans.rows if job is None else job.key in self.rollouts.rows

    @property
    def settled(self) -> bool:
        """Whether nothing is left to ask or to drive, what failed for want of infrastructure included."""
        jobs = [self.job(item) for item in self.frozen.items]
        rows = [None if job is None else self.rollouts.rows.get(job.key) for job in jobs]
        return all(row is not None and not row["infra_failed"] for row in rows)

    def result(self, item: Item, ruler: str) -> Row:
        """The item's row."""
        row = self.plans.rows.get(item.id, {})
        plan: dict[str, Any] = row.get("plan") or {}
        usage: dict[str, Any] = plan.get("usage") or {}
        job = self.job(item)
        rollout = None if job is None else self.rollouts.rows.get(job.key)
        if rollout is None:
            rollout = not_driven("not_driven", str(row.get("error") or NOT_ASKED), infra_failed=True)
        return {
            "item": item.id,
            "task": item.task,
            "family": family_of(item.task),
            "sample": item.scenario.id,
            "scenario_seed": str(item.scenario.seed),
            "command": item.command,
            "latency_s": plan.get("latency_s"),
            "prompt_tokens": usage.get("prompt_tokens"),
            "completion_tokens": usage.get("completion_tokens"),
            "cost_usd": usage.get("cost_usd"),
            "rollout_key": None if job is None else job.key,
            "intent": plan.get("intent", ""),
            "to_refuse": item.scenario.goal.get("type") == "RefuseEval",
            "answered_rightly": answered_rightly(
                item.scenario.goal, refused=bool(rollout["refused"]), success=bool(rollout["success"])
            ),
            **{name: value for name, value in rollout.items() if name not in _INNER},
            **points(rollout, ruler),
        }


def results(stages: Stages, ruler: str) -> list[Row]:
    """One row per planned item.

    Args:
        stages: What was asked and what happened.
        ruler: Short name or id of a ruler.

    Raises:
        ConfigError: There is no such ruler.
    """
    ruler = ruler_named(ruler).id
    frozen = stages.frozen
    about: Row = {
        "schema": SCHEMA,
        "metrics": ruler,
        "planner": frozen.config["planner"],
        "model": frozen.model,
        "data_sha256": frozen.config["data_sha256"],
        "chauffeur": version("chauffeur"),
        "labels": list(frozen.labels),
    }
    return [about | stages.result(item, ruler) for item in frozen.items]


def publish_results(folder: Path, stages: Stages, rows: list[Row]) -> None:
    """Write `results.jsonl`, `provenance.json` and `table.md`. Raises DataError when they cannot be written."""
    missing = sum(not stages.asked(item) for item in stages.frozen.items)
    notes = [*stages.frozen.labels, f"metrics {rows[0]['metrics']}"] if rows else []
    if answers := answers_note(rows):
        notes.append(answers)
    if missing:
        notes.append(f"partial: {missing} of {len(rows)} items have not been asked and count as not driven")
    table = markdown(*family_lines(rows)) if rows else "No items."
    files = {
        "results.jsonl": "".join(json.dumps(row, ensure_ascii=False) + "\n" for row in rows),
        "provenance.json": json.dumps(provenance(stages.frozen), indent=1, ensure_ascii=False) + "\n",
        "table.md": f"{', '.join(notes)}\n\n{table}\n",
    }
    for name, text in files.items():
        publish(folder / name, text.encode("utf-8", "replace"), "run's result")


def provenance(frozen: Frozen) -> Mapping[str, Any]:
    """Versions, hashes, seeds and the machine."""
    return {
        "bench": BENCH_VERSION,
        "rollout": ROLLOUT_VERSION,
        "config": frozen.config,
        "model": frozen.model,
        "labels": list(frozen.labels),
        "versions": {name: _version(name) for name in ("chauffeur", "numpy", "numba", "pydantic-monty")},
        "engine": HighwayWorld.engine,
        "python": platform.python_version(),
        "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} CPUs",
    }


def _version(distribution: str) -> str:
    try:
        return version(distribution)
    except PackageNotFoundError:
        return "not installed"
