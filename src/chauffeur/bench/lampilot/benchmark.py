"""LaMPilot-Bench as a benchmark of the kernel: what is asked for an item, how its plan is driven, what a row says."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final, Literal, cast

import numpy as np
from typing_extensions import TypedDict  # pydantic reads the standard library's from Python 3.12 on only

from chauffeur.bench.kernel.benchmark import Asks, ItemOutcome, RequestDesk
from chauffeur.bench.kernel.metrics import TableSpec
from chauffeur.bench.kernel.store import Row
from chauffeur.bench.lampilot.families import family_of
from chauffeur.bench.lampilot.policy_aid import aid_for
from chauffeur.bench.lampilot.rehearsal import label
from chauffeur.bench.lampilot.report import CARD, JUDGE, TABLES
from chauffeur.bench.lampilot.requests import PlainRequests, Requests
from chauffeur.bench.lampilot.rollout import BASELINES, REHEARSAL_SEED, ROLLOUT_VERSION, RolloutJob, not_driven
from chauffeur.bench.lampilot.scenes import annotated
from chauffeur.concept import LAMPILOT_LIMITS, ConfigError, PlanRequest
from chauffeur.driving.judge.goals import answered_rightly
from chauffeur.driving.judge.metrics import points, ruler_named
from chauffeur.driving.trips import scenario_hash
from chauffeur.planners.prompts import Setting
from chauffeur.safety.shield import SHIELD_VERSION
from chauffeur.version import __version__
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.dblv1 import Dataset, Item, load_dataset

if TYPE_CHECKING:
    from chauffeur.bench.report.gallery import MakeCard
    from chauffeur.bench.report.runs import Run

BENCH_VERSION: Final = "lampilot-bench-v2"
SCHEMA: Final = "lampilot-results-v2"
EXPERT_LABEL: Final = "scripted expert: told the goal, reads no words"
"""Caveat to show with every row of the expert."""
SHIELD_LABEL: Final = f"{SHIELD_VERSION} has the last word"

_INNER: Final = ("key", "sample", "verdicts", "rollout", "signals", "rehearsal")
"""Fields of a rollout row for scoring only."""


class _LampilotFields(TypedDict):
    schema: str
    data_sha256: str
    item: str
    task: str
    family: str
    sample: str
    scenario_seed: str
    command: str
    latency_s: float | None
    prompt_tokens: int | None
    completion_tokens: int | None
    cost_usd: float | None
    rollout_key: str | None
    intent: str
    to_refuse: bool
    answered_rightly: bool
    outcome: str
    steps: int
    policy_failed: bool
    infra_failed: bool
    refused: bool
    fallback_used: bool
    detail: str
    metrics: str
    success: bool
    collision: bool
    ttc: float | None
    speed_variance: float | None
    time_efficiency: float | None
    score: float
    lane_ttc_s: float | None
    stop: str
    fault: str


class LampilotRow(_LampilotFields, total=False):
    """A row of results: the item, what the plan cost, what came of it, and its points under one ruler.

    The first two stand only where a baseline drove, the last two only where the drive had a shield.
    """

    planner: str
    model: str
    shield: str
    interventions: int


def choose_items(dataset: Dataset, count: int, seed: int) -> Sequence[Item]:
    """All items in order, or the first `count` of a permutation (NumPy's legacy generator, as LaMPilot draws them)."""
    items = dataset.items()
    if count <= 0 or count >= len(items):
        return items
    order = np.random.RandomState(seed).permutation(len(items))
    return [items[i] for i in order[:count]]


class LampilotBenchmark:
    """Items of a data set, driven under one ruler."""

    row = LampilotRow
    id = BENCH_VERSION
    tables: tuple[TableSpec, ...] = TABLES
    judge = JUDGE
    card = CARD
    provenance: ClassVar[Mapping[str, str]] = {"rollout": ROLLOUT_VERSION, "engine": HighwayWorld.engine}

    def __init__(
        self,
        dataset: Dataset,
        requests: Requests,
        planner: str = "",
        *,
        setting: str = "few-shot",
        items: int = 0,
        seed: int = 42,
        rehearse: int = 0,
        shield: bool = False,
        metrics: str = "origin",
    ) -> None:
        """Make it.

        Args:
            dataset: DbLv1 data.
            requests: What the planner is asked.
            planner: Its specification as it stands in rows, or a baseline; empty for the id of who is asked.
            setting: Name of the prompt setting.
            items: Number of items drawn; 0 for all.
            seed: Seed of the draw.
            rehearse: Variants tried before one is driven; 0 for none.
            shield: Whether the run-time shield has the last word; LaMPilot has none.
            metrics: Short name or id of a ruler; it decides no drive, so a run can be scored again by another.

        Raises:
            ConfigError: There is no such ruler, or nothing to rehearse.
        """
        if rehearse and planner in ("idm", "mobil"):
            raise ConfigError(f"{planner} has no program to rehearse.", hint="Leave --rehearse out.")
        self.config: Mapping[str, Any] = {
            **({"planner": planner} if planner else {}),
            "setting": setting,
            "data_sha256": dataset.sha256,
            "items": items,
            "seed": seed,
            "limits": asdict(LAMPILOT_LIMITS),
            "rehearse": rehearse,
            "asked": requests.id,
            **({"shield": True} if shield else {}),  # as before there was one: such runs can be continued
        }
        self.labels = (
            *requests.labels,
            *([EXPERT_LABEL] if planner == "expert" else []),
            *([label(rehearse)] if rehearse else []),
            *([SHIELD_LABEL] if shield else []),
        )
        self.variant = "-".join([*([f"rehearsed-{rehearse}"] if rehearse else []), *(["shielded"] if shield else [])])
        self.ruler = ruler_named(metrics).id
        self._items = choose_items(dataset, items, seed)
        self._hashes = {item.scenario.id: scenario_hash(item.scenario) for item in self._items}
        self._requests = requests
        self._baseline = planner if planner in BASELINES else ""
        self._rehearse = rehearse
        self._shield = shield

    @property
    def asks(self) -> Asks:
        return "" if self._baseline else "plans"

    def items(self) -> Sequence[Item]:
        return self._items

    def kept(self, items: Sequence[Item]) -> Mapping[str, Any]:
        """See KeepsItems: words and scenes."""
        scenes = {item.scenario.id: item.scenario for item in items}
        return {
            "facts": [[item.task, item.scenario.id, item.command] for item in items],
            "samples": {name: asdict(scenario) for name, scenario in scenes.items()},
        }

    async def request(self, item: Item, desk: RequestDesk) -> PlanRequest:
        return await self._requests.request(item, await desk.context(item.scenario))

    def job(self, item: Item, answer: Row | None) -> RolloutJob:
        key = self._key(item.scenario.id, answer)
        return RolloutJob(key, item.scenario, self._baseline, answer, LAMPILOT_LIMITS, self._rehearse, self._shield)

    def _key(self, sample: str, plan: dict[str, Any] | None) -> str:
        """Settings that decide a rollout: sample, policy, what the checks read of the plan, limits, versions."""
        decisive: Any = self._baseline
        if plan is not None:
            decisive = [plan["policy"], plan["refusal"], plan["intent"], plan["settings"]]
        parts = [ROLLOUT_VERSION, self._hashes[sample], decisive, self.config["limits"]]
        if self._rehearse:
            parts += [self._rehearse, REHEARSAL_SEED]
        if self._shield:
            parts.append(SHIELD_VERSION)
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:24]

    @staticmethod
    def rescored(run: Run, ruler: str) -> Run:
        """See `bench.report.build.HasRulers`."""
        from chauffeur.bench.lampilot.shown import rescored

        return rescored(run, ruler)

    @staticmethod
    def cards(run: Run, data: Path | None) -> MakeCard:
        """See `bench.report.gallery.ShowsItems`."""
        from chauffeur.bench.lampilot.shown import cards

        return cards(run, data)

    def tally(self, result: Row) -> tuple[bool, bool]:
        """Whether a drive succeeded, and collided: for the running scores."""
        scored = points(result, self.ruler)
        return bool(scored["success"]), bool(scored["collision"])

    def conclude(self, folder: Path, rows: Sequence[Row], results: Mapping[str, Row | None]) -> Sequence[str]:
        """See Concludes."""
        del folder, results
        first = rows[0]
        labels = "".join(f"; {one}" for one in first["labels"])
        return (
            f"Chauffeur {__version__}; planner {first['planner']}{labels}; metrics {first['metrics']}; data sha256 "
            f"{first['data_sha256'][:12]}; draw seed {self.config['seed']}; limits {LAMPILOT_LIMITS.name}; scores in "
            "points, rates in %; simulated drives (highway-env). Rows marked paper are its authors' own figures.",
        )

    def rows(self, outcome: ItemOutcome[Item]) -> Sequence[Row]:
        """See Benchmark: none for an item that was not asked."""
        item, rollout = outcome.item, outcome.result
        if rollout is None and not outcome.error:
            return ()
        plan: dict[str, Any] = outcome.answer or {}
        usage: dict[str, Any] = plan.get("usage") or {}
        key = None if rollout is None else self._key(item.scenario.id, outcome.answer)
        if rollout is None:
            rollout = not_driven("not_driven", outcome.error, infra_failed=True)
        row = {
            "schema": SCHEMA,
            "data_sha256": self.config["data_sha256"],
            **({"planner": self._baseline, "model": ""} if self._baseline else {}),
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
            "rollout_key": key,
            "intent": plan.get("intent", ""),
            "to_refuse": item.scenario.goal.get("type") == "RefuseEval",
            "answered_rightly": answered_rightly(
                item.scenario.goal, refused=bool(rollout["refused"]), success=bool(rollout["success"])
            ),
            **{name: value for name, value in rollout.items() if name not in _INNER},
            **points(rollout, self.ruler),
        }
        return (row,)


def lampilot(
    data: Path,
    planner: str = "onboard",
    items: int = 0,
    seed: int = 42,
    setting: Literal["few-shot", "zero-shot", "human-feedback"] = "few-shot",
    repository: Path | None = None,
    rehearse: int = 0,
    shield: bool = False,
    metrics: Literal["origin", "paper"] = "origin",
) -> LampilotBenchmark:
    """Make LaMPilot-Bench (paper Tab. IV): completion, collisions and scores of a planner that follows instructions.

    Args:
        data: Folder with LaMPilot's DbLv1 task files.
        planner: `onboard`, `keyword`, `openai/<model>`, `replay/<file>`, or the baselines `idm`, `mobil`, `expert`.
        items: How many items, drawn with the seed; 0 for all.
        seed: Seed of that draw.
        setting: Prompt for language models.
        repository: Policy repository, for the setting human-feedback.
        rehearse: Try this many variants of each program on copies of the scene first.
        shield: Let the run-time shield have the last word; LaMPilot has none.
        metrics: Ruler: LaMPilot's code, or the paper's equations as printed.

    Raises:
        ConfigError: Options make no sense.
        DataError: There are no such files, or they are damaged.
    """
    if items < 0 or seed < 0 or rehearse < 0:
        raise ConfigError("--items, --seed and --rehearse are not negative.", hint="Leave them out, or give 0 or more.")
    aid = aid_for(setting, repository, LAMPILOT_LIMITS)
    dataset, _ = annotated(load_dataset(Path(data)))
    requests = aid if aid is not None else PlainRequests.of(cast("Setting", setting), LAMPILOT_LIMITS)
    return LampilotBenchmark(
        dataset, requests, planner, setting=setting, items=items, seed=seed, rehearse=rehearse, shield=shield,
        metrics=metrics,
    )  # fmt: skip
