"""A run at work: every item goes its own way from question to row, so simulations run while calls are in flight.

One event loop does the waiting; simulations run in the engine's processes, the disk is a thread's business. An item
that fails is a row that says so; only a full disk, a dead engine or the person at the keyboard stops the run.
"""

from __future__ import annotations

import asyncio
import hashlib
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from typing import Any, Final

from pydantic import TypeAdapter

from chauffeur.bench.kernel.benchmark import BenchItem, BenchJob
from chauffeur.bench.kernel.budget import Bill
from chauffeur.bench.kernel.calls import Caller, Reply, Request
from chauffeur.bench.kernel.engine import EngineError, WorkEngine
from chauffeur.bench.kernel.progress import Speedometer, Standing
from chauffeur.bench.kernel.stages import StageStore
from chauffeur.bench.kernel.store import Row, Scribe
from chauffeur.concept import ChauffeurError, Context, Scenario
from chauffeur.describe import describe
from chauffeur.driving.episode import make_world
from chauffeur.planners.transcript import ModelTurn

Watch = Callable[[Standing], None]
"""Is told where the run stands, a few times a second."""

TELL_S: Final = 0.25
context_adapter: TypeAdapter[Context] = TypeAdapter(Context)

_SPARE: Final = 32
"""Items made ready beyond those that may be in flight, so that a place never waits for a description."""


@dataclass(slots=True)
class Pipeline:
    """One run's work.

    Attributes:
        stages: Where everything is stored.
        engine: Who simulates.
        caller: Who asks the planner; None where nobody is asked.
        scribe: Who writes.
        watch: Who is told.
        most: Planner calls in flight at most.
        rows: Makes an item's rows, to be looked at while the run goes on.
    """

    stages: StageStore[Any]
    engine: WorkEngine
    caller: Caller | None
    scribe: Scribe
    watch: Watch
    most: int
    rows: Callable[[Any], list[Row]]
    _contexts: dict[str, asyncio.Task[Row]] = field(default_factory=dict[str, "asyncio.Task[Row]"])
    _drives: dict[str, asyncio.Task[Row]] = field(default_factory=dict[str, "asyncio.Task[Row]"])
    _count: dict[str, int] = field(default_factory=dict[str, int])
    _fresh: int = 0
    _speed: Speedometer = field(default_factory=Speedometer)

    async def work(self, broken: asyncio.Future[None]) -> None:
        """Ask and drive all that is not done yet.

        Args:
            broken: Is given an exception when the disk does not take a row.

        Raises:
            ChauffeurError: The disk is full, or no worker can be had.
        """
        self._count = dict.fromkeys(("asked", "done", "driven", "successes", "collisions", "failed"), 0)
        async with asyncio.TaskGroup() as always:
            guards = [always.create_task(_await(broken)), always.create_task(self._tell())]
            async with asyncio.TaskGroup() as group:
                todo = deque(self._begin(group))
                if self.caller is not None:
                    for _ in range(min(len(todo), self.most + _SPARE)):
                        group.create_task(self._ask(todo, self.caller, group))
            for guard in guards:
                guard.cancel()
        self.watch(self.standing())

    def _begin(self, group: asyncio.TaskGroup) -> Iterator[BenchItem]:
        """Set going what only has to be driven; gives what has to be asked: also what could not be had last time."""
        for item in self.stages.manifest.items:
            if self.stages.unanswered(item):
                yield item
                continue
            self._count["asked"] += self.caller is not None
            self._go_on(item, group, fresh=False)

    def _go_on(self, item: BenchItem, group: asyncio.TaskGroup, *, fresh: bool) -> None:
        """Do what is to be done with an item's answer."""
        job = self.stages.job(item)
        if job is not None:
            group.create_task(self._finish(item, job))
            return
        self._count["done"] += 1
        self._fresh += fresh
        self._show(item)

    def _show(self, item: BenchItem) -> None:
        """Keep an item's rows as they are now. Whatever is wrong with them is said when the run is scored."""
        with suppress(Exception):
            self.scribe.write(self.stages.live, {"item": item.id, "rows": self.rows(item)})

    async def _ask(self, todo: deque[BenchItem], caller: Caller, group: asyncio.TaskGroup) -> None:
        while todo and caller.halt is None:
            await asyncio.sleep(0)  # a planner that never waits must not keep the others from their turn
            if not todo:
                return
            item = todo.popleft()
            row = await self._plan(item, caller)
            if row is None:
                return
            self._count["asked"] += 1
            self._count["failed"] += row["plan"] is None
            self._go_on(item, group, fresh=True)

    async def _plan(self, item: BenchItem, caller: Caller) -> Row | None:
        """The item's answer, or why there is none, stored; None when the run has stopped asking."""
        before = Bill.read(self.stages.plans.rows.get(item.id, {}))
        row: Row = {"item": item.id, "plan": None, "error": ""}
        try:
            desk = _Desk(self, caller, before)
            request = await self.stages.benchmark.request(item, desk)
            answer = await caller.ask(request)
            if answer is None:
                return None
            before.add(answer.bill)
            row["error"] = answer.error
            if turns := [*desk.turns, *answer.turns]:
                row["turns"] = [self._kept(turn) for turn in turns]
            if answer.reply is not None:
                row["plan"] = asdict(answer.reply)
        except EngineError:
            raise
        except Exception as error:  # noqa: BLE001 - whatever is wrong with an item, it is one item
            row["error"] = _words(error)
        row["spent"] = asdict(before)
        try:
            self.scribe.write(self.stages.plans, row)
        except (TypeError, ValueError) as error:
            row |= {"plan": None, "error": f"The planner's answer cannot be stored: {error}."}
            self.scribe.write(self.stages.plans, row)
        return row

    def _kept(self, turn: ModelTurn) -> Row:
        """A turn as it is stored; a system message, which items share, is stored once and named by its hash."""
        if turn["role"] != "system":
            return {**turn}
        text = turn["text"].encode("utf-8", "replace").decode()
        name = hashlib.sha256(text.encode()).hexdigest()[:16]
        if name not in self.stages.systems.rows:
            self.scribe.write(self.stages.systems, {"sha256": name, "text": text})
        return {"role": "system", "sha256": name}

    async def context(self, scenario: Scenario) -> Context:
        """C of a scene, described once. Raises ChauffeurError when it cannot be set up."""
        sample = scenario.id
        row = self.stages.contexts.rows.get(sample)
        if row is None or row["error"]:
            task = self._contexts.get(sample)
            if task is None:
                task = self._contexts[sample] = asyncio.create_task(self._describe(scenario))
            row = await asyncio.shield(task)
        if row["error"]:
            raise ChauffeurError(row["error"])
        return context_adapter.validate_python(row["context"])

    async def _describe(self, scenario: Scenario) -> Row:
        sample = scenario.id
        try:
            row = await self.engine.run(describe_scene, scenario, near=sample, urgent=True)
        except EngineError:
            raise
        except Exception as error:  # noqa: BLE001 - a sample can break the simulator in any way; it is one sample
            row = {"sample": sample, "context": None, "error": _words(error)}
        self.scribe.write(self.stages.contexts, row)
        return row

    async def _finish(self, item: BenchItem, job: BenchJob) -> None:
        row = self.stages.rollouts.rows.get(job.key)
        if row is None or row["infra_failed"]:  # what the machine spoiled is driven again
            task = self._drives.get(job.key)
            if task is None:
                task = self._drives[job.key] = asyncio.create_task(self._drive(job))
            row = await asyncio.shield(task)
            self._fresh += 1
        self._count["done"] += 1
        self._count["failed"] += bool(row["infra_failed"])
        self._count["driven"] += not row["infra_failed"] and hasattr(self.stages.benchmark, "tally")
        tally = getattr(self.stages.benchmark, "tally", None)  # running scores, where a benchmark has any
        success, collision = (False, False) if tally is None else tally(row)
        self._count["successes"] += success
        self._count["collisions"] += collision
        self._show(item)

    async def _drive(self, job: BenchJob) -> Row:
        try:
            row = await self.engine.run(do_job, job, near=job.near)
            self.scribe.write(self.stages.rollouts, row)
        except EngineError:
            raise
        except Exception as error:  # noqa: BLE001 - see _describe
            row = job.spoiled(_words(error))
            self.scribe.write(self.stages.rollouts, row)
        return row

    async def _tell(self) -> None:
        while True:
            self.watch(self.standing())
            await asyncio.sleep(TELL_S)

    def standing(self) -> Standing:
        """Current progress of the run."""
        planned = len(self.stages.manifest.items)
        rate = self._speed.rate(asyncio.get_running_loop().time(), self._fresh)
        left = planned - self._count["done"]
        live: dict[str, Any] = {}
        if self.caller is not None:
            gate, total = self.caller.gate, self.caller.spending.total
            live = {
                "requests": total.requests,
                "usd": total.usd,
                "in_flight": gate.in_flight,
                "window": int(gate.window.limit),
                "held_s": gate.held_s,
            }
        return Standing(planned, **self._count, rate=rate, eta_s=left / rate if rate > 0.0 else None, **live)


@dataclass(slots=True)
class _Desk:
    """See RequestDesk; what earlier turns cost is put on the item's bill, and what was said is kept."""

    pipeline: Pipeline
    caller: Caller
    bill: Bill
    turns: list[ModelTurn] = field(default_factory=list[ModelTurn])

    async def context(self, scenario: Scenario) -> Context:
        return await self.pipeline.context(scenario)

    async def ask(self, request: Request) -> Reply | None:
        answer = await self.caller.ask(request)
        if answer is None:
            return None
        self.bill.add(answer.bill)
        self.turns.extend(answer.turns)
        return answer.reply


def describe_scene(scenario: Scenario) -> Row:
    """C of a scene, as a row keyed by `sample`; `error` says why it cannot be set up. A worker's work."""
    try:
        observation = make_world(scenario).reset(scenario)
    except ChauffeurError as error:
        return {"sample": scenario.id, "context": None, "error": str(error)}
    return {"sample": scenario.id, "context": asdict(describe(observation)), "error": ""}


def do_job(job: BenchJob) -> Row:
    """A worker's work."""
    return job.run()


async def _await(broken: asyncio.Future[None]) -> None:
    await broken


def _words(error: Exception) -> str:
    if isinstance(error, ChauffeurError):
        return str(error)
    text = f"{type(error).__name__}: {error}"
    with suppress(IndexError):
        text = text.splitlines()[0][:500]
    return f"Failed in a way that was not foreseen: {text}."
