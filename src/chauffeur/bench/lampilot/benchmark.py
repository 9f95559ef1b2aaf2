"""LaMPilot-Bench as a benchmark of the kernel: what is asked for an item, how its plan is driven, what a row says."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from typing_extensions import TypedDict  # pydantic reads the standard library's from Python 3.12 on only

from chauffeur.bench.kernel.benchmark import Asks, ItemOutcome, RequestDesk
from chauffeur.bench.kernel.metrics import TableSpec
from chauffeur.bench.kernel.store import Row
from chauffeur.bench.lampilot.families import family_of
from chauffeur.bench.lampilot.frozen import BENCH_VERSION, Frozen
from chauffeur.bench.lampilot.report import CARD, JUDGE, TABLES
from chauffeur.bench.lampilot.requests import Requests
from chauffeur.bench.lampilot.rollout import BASELINES, REHEARSAL_SEED, ROLLOUT_VERSION, RolloutJob, not_driven
from chauffeur.concept import ConfigError, PlanRequest
from chauffeur.driving.judge.goals import answered_rightly
from chauffeur.driving.judge.metrics import points, ruler_named
from chauffeur.safety.shield import SHIELD_VERSION
from chauffeur.worlds.highway.dblv1 import Item

if TYPE_CHECKING:
    from chauffeur.bench.report.gallery import MakeCard
    from chauffeur.bench.report.runs import Run

NOT_ASKED: Final = "Not asked: the run stopped before this item."

_INNER: Final = ("key", "sample", "verdicts", "rollout", "signals", "rehearsal")
"""Fields of a rollout row for scoring only."""


class _LampilotFields(TypedDict):
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

    The last two stand only where the drive had a shield.
    """

    shield: str
    interventions: int


class LampilotBenchmark:
    """The items of a frozen plan, driven under one ruler."""

    row = LampilotRow
    id = BENCH_VERSION
    tables: tuple[TableSpec, ...] = TABLES
    judge = JUDGE
    card = CARD

    def __init__(self, frozen: Frozen, requests: Requests | None = None, ruler: str = "origin") -> None:
        """Make it.

        Args:
            frozen: What the run is about.
            requests: What the planner is asked; None where what is stored is only scored.
            ruler: Short name or id of a ruler.

        Raises:
            ConfigError: There is no such ruler.
        """
        self.frozen = frozen
        self.ruler = ruler_named(ruler).id
        self._requests = requests
        self._limits = asdict(frozen.limits)
        planner = str(frozen.config["planner"])
        self._baseline = planner if planner in BASELINES else ""
        self._rehearse = int(frozen.config.get("rehearse", 0))
        self._shield = bool(frozen.config.get("shield", False))

    @property
    def config(self) -> Mapping[str, Any]:
        return self.frozen.config

    @property
    def asks(self) -> Asks:
        return "" if self._baseline else "plans"

    def items(self) -> Sequence[Item]:
        return self.frozen.items

    async def request(self, item: Item, desk: RequestDesk) -> PlanRequest:
        if self._requests is None:
            raise ConfigError("A plan read from its folder can be scored, not asked for.")
        return await self._requests.request(item, await desk.context(item.scenario))

    def job(self, item: Item, answer: Row | None) -> RolloutJob:
        key = self._key(item.scenario.id, answer)
        frozen = self.frozen
        return RolloutJob(key, item.scenario, self._baseline, answer, frozen.limits, self._rehearse, self._shield)

    def _key(self, sample: str, plan: dict[str, Any] | None) -> str:
        """Settings that decide a rollout: sample, policy, what the checks read of the plan, limits, versions."""
        decisive: Any = self._baseline
        if plan is not None:
            decisive = [plan["policy"], plan["refusal"], plan["intent"], plan["settings"]]
        parts = [ROLLOUT_VERSION, self.frozen.hashes[sample], decisive, self._limits]
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

    def rows(self, outcome: ItemOutcome[Item]) -> Sequence[Row]:
        item, rollout = outcome.item, outcome.result
        plan: dict[str, Any] = outcome.answer or {}
        usage: dict[str, Any] = plan.get("usage") or {}
        key = None if rollout is None and self.asks and outcome.answer is None else self.job(item, outcome.answer).key
        if rollout is None:
            rollout = not_driven("not_driven", outcome.error or NOT_ASKED, infra_failed=True)
        row = {
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
