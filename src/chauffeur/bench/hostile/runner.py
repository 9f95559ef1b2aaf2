"""The suite as a run on disk: ask -> check and drive -> judge. The same command goes on where it stopped.

Plans are stored by input and drives by what decides them, so inputs that a planner answers with the same program on the
same road share one drive.
"""

from __future__ import annotations

import asyncio
import hashlib
import json
import os
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

from chauffeur.bench.hostile.asking import HostileRequests
from chauffeur.bench.hostile.judging import RULER, served, verdict_of
from chauffeur.bench.hostile.loading import Input, data_sha256, hostile_inputs, lookalikes, sample
from chauffeur.bench.hostile.obedient import ObedientPlanner
from chauffeur.bench.hostile.rollout import ROLLOUT_VERSION, DriveJob, roll_out
from chauffeur.bench.hostile.scenes import scene_of
from chauffeur.bench.kernel.calls import Caller, Halt, Patience
from chauffeur.bench.kernel.engine import Engine, EngineError, LocalEngine, first_error
from chauffeur.bench.kernel.pace import Gate, Window
from chauffeur.bench.kernel.spending import Bill, Budget, Spending
from chauffeur.bench.kernel.standing import Speedometer, Standing
from chauffeur.bench.kernel.store import Row, RowStore, freeze, sole_writer
from chauffeur.concept import ChauffeurError, Context, Limits, Plan, PlanRequest, Scenario
from chauffeur.describe import describe
from chauffeur.drive.files import publish
from chauffeur.drive.session import scenario_hash
from chauffeur.planners.base import Planner
from chauffeur.planners.prompts import Setting, build_system_message
from chauffeur.worlds.highway import HighwayWorld

BENCH_VERSION: Final = "hostile-v1"
"""Suite, scenes, rollout and ruler together; stands in every result."""

_REQUESTS_A_PLAN: Final = 2
_SIMULATED: Final = "simulated drives (highway-env); hostile words written for this suite"

Watch = Callable[[Standing], None]


@dataclass(frozen=True, slots=True)
class HostileConfig:
    """What decides a run.

    Attributes:
        planner: Specification of the planner, `obedient` or `obedient/hidden` included.
        setting: Prompt for language models.
        a_kind: Inputs of each class, hostile and harmless alike; 0 for all.
        seed: Seed of that draw.
        screened: Whether wishes, history and service texts are screened on their way to the planner.
        limits: Bounds of every plan.
        shield: Whether the run-time shield has the last word, as it has in a drive; without it the rest is measured.
    """

    planner: str
    setting: Setting = "few-shot"
    a_kind: int = 0
    seed: int = 42
    screened: bool = True
    limits: Limits = field(default_factory=Limits)
    shield: bool = True

    @property
    def inputs(self) -> tuple[Input, ...]:
        """The inputs of the run. The obedient planner knows attacks only, so it gets no harmless wishes."""
        attacks = sample(hostile_inputs(), self.a_kind, self.seed)
        if self.planner.partition("/")[0] == "obedient":
            return attacks
        return attacks + sample(lookalikes(), self.a_kind, self.seed)


class HostileRun:
    """One run of the suite in one folder."""

    def __init__(self, folder: Path, config: HostileConfig, planner: Planner) -> None:
        """Open or continue a run.

        Args:
            folder: Where its stages are stored.
            config: What decides it.
            planner: Who plans.

        Raises:
            ConfigError: The folder holds a run with another configuration.
            DataError: The inputs or the stored configuration are damaged.
            StorageError: The folder cannot be used.
        """
        self.folder = folder
        self.config = config
        self.inputs = config.inputs
        self.halt: Halt | None = None
        self._planner = planner
        self._scenes = {one.id: scene_of(one) for one in self.inputs}
        with sole_writer(folder):
            self._freeze()
        self._plans = RowStore(folder / "plans.jsonl", "id")
        self._drives = RowStore(folder / "drives.jsonl", "key")
        self._tasks: dict[str, asyncio.Task[None]] = {}
        self._contexts: dict[str, Context] = {}
        self._done = 0
        self._fresh = 0

    @property
    def damaged(self) -> dict[str, int]:
        """Damaged rows found when the run was opened, by file; their inputs are done again."""
        return {store.path.name: len(store.damaged) for store in (self._plans, self._drives) if store.damaged}

    @property
    def unasked(self) -> int:
        """Inputs that have no plan yet."""
        return sum(self._plan_of(one) is None for one in self.inputs)

    def run(
        self, watch: Watch, *, workers: int = 0, concurrency: int = 16, engine: Callable[[int], Engine] = LocalEngine
    ) -> list[Row]:
        """Ask and drive what is not done yet, and judge all; afterwards `halt` says whether the run stopped asking.

        Args:
            watch: Is told where the run stands.
            workers: Simulation processes; 0 for one a core.
            concurrency: Planner calls in flight at most.
            engine: Makes who simulates, given their number.

        Raises:
            ConfigError: Another process works in this folder.
            ChauffeurError: The disk is full, or no worker can be had. What was stored stays.
        """
        with sole_writer(self.folder):
            try:
                missing = [one for one in self.inputs if self._missing(one)]
                self._done = len(self.inputs) - len(missing)
                if missing:
                    asyncio.run(self._work(missing, watch, engine(workers or os.cpu_count() or 1), concurrency))
            except BaseExceptionGroup as group:
                raise first_error(group) from group
            finally:
                self._plans.close()
                self._drives.close()
            rows = self.rows()
            lines = "".join(json.dumps(row, ensure_ascii=True) + "\n" for row in rows)
            publish(self.folder / "results.jsonl", lines.encode(), "results")
            return rows

    def rows(self) -> list[Row]:
        """One row per input that has been driven or refused, judged, from what is stored."""
        rows: list[Row] = []
        for one in self.inputs:
            plan = self._plan_of(one)
            job = None if plan is None else self._job(one, plan)
            drive = None if job is None else self._drives.rows.get(job.key)
            if plan is None or drive is None:
                continue
            row: Row = {"id": one.id, "kind": one.kind, "hostile": one.hostile}
            row |= {"aim": one.aim, "wanted": one.wanted}
            row |= {"planner": self._planner.id, "model": self._planner.model, "intent": plan["intent"]}
            row |= {
                "screened": self.config.screened,
                "shield": self.config.shield,
                "scene": drive["scene"],
                "limits": self.config.limits.name,
            }
            row |= verdict_of(drive)
            row |= {"served": None if one.hostile else served(one, drive), "detail": drive["detail"]}
            row |= {"drive": drive["drive"], "bench": BENCH_VERSION, "ruler": RULER, "note": _SIMULATED}
            rows.append(row)
        return rows

    def _freeze(self) -> None:
        config = {**asdict(self.config), "bench": BENCH_VERSION, "rollout": ROLLOUT_VERSION, "data": data_sha256()}
        config["scenes"] = {scene.id: scenario_hash(scene)[:12] for scene in self._scenes.values()}
        content = (json.dumps({**config, "model": self._planner.model}, indent=1) + "\n").encode()
        freeze(self.folder / "config.json", content)

    def _plan_of(self, one: Input) -> dict[str, Any] | None:
        row = self._plans.rows.get(one.id)
        return None if row is None or row["error"] else row["plan"]

    def _job(self, one: Input, plan: dict[str, Any]) -> DriveJob:
        scene = self._scenes[one.id]
        parts = [ROLLOUT_VERSION, scenario_hash(scene), plan["policy"], plan["refusal"], plan["intent"]]
        parts += [plan["settings"], asdict(self.config.limits), self.config.shield]
        key = hashlib.sha256(json.dumps(parts, sort_keys=True).encode("utf-8", "surrogatepass")).hexdigest()[:24]
        return DriveJob(key, scene, plan, self.config.limits, self.config.shield)

    def _missing(self, one: Input) -> bool:
        plan = self._plan_of(one)
        row = None if plan is None else self._drives.rows.get(self._job(one, plan).key)
        return row is None or bool(row["infra_failed"])

    async def _work(self, missing: list[Input], watch: Watch, engine: Engine, concurrency: int) -> None:
        limits = self.config.limits
        requests = HostileRequests(
            build_system_message(self.config.setting, limits=limits), limits, self.config.screened
        )
        caller = Caller(
            self._planner,
            Gate(Window(concurrency)),
            Spending(Budget(), Bill(), None, _REQUESTS_A_PLAN),
            np.random.default_rng(self.config.seed),
            None,
            Patience(),
        )
        speed = Speedometer()
        todo = iter(missing)
        whole = False
        try:
            await engine.start()
            async with asyncio.TaskGroup() as group:
                for _ in range(concurrency):
                    group.create_task(self._serve(todo, requests, caller, engine, watch, speed))
            whole = True
        finally:
            engine.close(now=not whole)
            self.halt = caller.halt
            close: Any = getattr(self._planner, "close", None)
            if close is not None:
                with suppress(Exception):
                    await close()
        watch(self._standing(speed, caller))

    async def _serve(
        self,
        todo: Iterator[Input],
        requests: HostileRequests,
        caller: Caller,
        engine: Engine,
        watch: Watch,
        speed: Speedometer,
    ) -> None:
        for one in todo:
            if caller.halt is not None:
                return
            await asyncio.sleep(0)  # a planner that never waits must not keep the drives from their turn
            plan = self._plan_of(one)
            if plan is None:
                plan = await self._asked(one, requests, caller)
            if plan is not None:
                await self._driven(self._job(one, plan), engine)
                self._done += 1
            self._fresh += 1
            watch(self._standing(speed, caller))

    async def _asked(self, one: Input, requests: HostileRequests, caller: Caller) -> dict[str, Any] | None:
        async def ask(request: PlanRequest) -> Plan | None:
            answer = await caller.ask(request)
            return None if answer is None else answer.plan

        try:
            request = await requests.request(one, self._context(self._scenes[one.id]), ask)
        except Exception as error:  # noqa: BLE001 - whatever is wrong with an input, it is one input
            self._plans.append({"id": one.id, "plan": None, "error": f"{type(error).__name__}: {error}"})
            return None
        answer = await caller.ask(request)
        if answer is None:
            return None
        plan = None if answer.plan is None else json.loads(json.dumps(asdict(answer.plan)))
        self._plans.append({"id": one.id, "plan": plan, "error": answer.error})
        return plan

    def _context(self, scene: Scenario) -> Context:
        if scene.id not in self._contexts:
            self._contexts[scene.id] = describe(HighwayWorld().reset(scene))
        return self._contexts[scene.id]

    async def _driven(self, job: DriveJob, engine: Engine) -> None:
        row = self._drives.rows.get(job.key)
        if row is not None and not row["infra_failed"]:
            return
        task = self._tasks.get(job.key)
        if task is None:
            task = self._tasks[job.key] = asyncio.create_task(self._drive(job, engine))
        await asyncio.shield(task)

    async def _drive(self, job: DriveJob, engine: Engine) -> None:
        try:
            row = await engine.run(roll_out, job, near=job.scenario.id)
            row = json.loads(json.dumps(row))  # as it is read again: tuples become lists
        except EngineError:
            raise
        except Exception as error:  # noqa: BLE001 - whatever a drive dies of, it is one drive
            detail = str(error) if isinstance(error, ChauffeurError) else f"{type(error).__name__}: {error}"
            row = {"key": job.key, "scene": job.scenario.id, "rollout": ROLLOUT_VERSION, "infra_failed": True}
            row |= {"refused_by": "", "detail": detail, "drive": None}
        self._drives.append(row)

    def _standing(self, speed: Speedometer, caller: Caller) -> Standing:
        rate = speed.rate(asyncio.get_running_loop().time(), self._fresh)
        left = len(self.inputs) - self._done
        return Standing(
            planned=len(self.inputs),
            asked=len(self._plans.rows),
            done=self._done,
            requests=caller.spending.total.requests,
            in_flight=caller.gate.in_flight,
            window=int(caller.gate.window.limit),
            held_s=caller.gate.held_s,
            rate=rate,
            eta_s=left / rate if rate > 0.0 else None,
        )


def planner_of(spec: str, **options: Any) -> Planner:
    """The planner a specification names: the suite's own `obedient`, or a registered one.

    Raises:
        ConfigError: Unknown, or an option it does not take.
    """
    name, _, argument = spec.partition("/")
    if name == "obedient":
        return ObedientPlanner(hostile_inputs(), argument)
    from chauffeur.planners.registry import make_planner

    return make_planner(spec, **options)
