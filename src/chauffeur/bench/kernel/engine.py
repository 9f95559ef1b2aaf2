"""Engines of a run's simulations: processes on this machine. `cluster.py` has the same for a Ray cluster."""

from __future__ import annotations

import asyncio
import logging
import multiprocessing
import os
import signal
import threading
from collections import OrderedDict, deque
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing.connection import wait
from typing import Any, Final, Protocol

from chauffeur.bench.kernel.store import Row
from chauffeur.concept import ChauffeurError

_log = logging.getLogger(__name__)

Work = Callable[[Any], Row]
"""Work of a worker: a function of a module, of one picklable value."""

LIVES: Final = 2
"""Workers one job may take with it before it is given up."""
JOB_LIMIT_S: Final = 900.0
"""Longest a job may take; the longest episode takes seconds."""
_FALSE_STARTS: Final = 3
"""Workers that may die before they begin with a job; from then on the job itself is taken for the cause."""
_NICE: Final = 5
_begun: Any = None
"""In a worker: 1 once it has begun with its job, in memory that its parent reads, also when it is dead."""


class WorkerLostError(ChauffeurError):
    """The process that did a job died of it, or did not finish, as often as a job may do that."""


class EngineError(ChauffeurError):
    """No worker can be started."""


class WorkEngine(Protocol):
    """Runs jobs on as many workers as there are."""

    @property
    def slots(self) -> int:
        """Jobs that run at a time."""
        ...

    async def start(self) -> None:
        """Make it ready. Raises ChauffeurError when no worker can be had."""
        ...

    async def run(self, work: Work, job: Any, *, near: str = "", urgent: bool = False) -> Row:
        """One job's row.

        Args:
            work: What to do.
            job: What with.
            near: Jobs with the same text do best on the same worker, which may have kept something of the last one.
            urgent: Whether others wait for the result; goes first.

        Raises:
            WorkerLostError: It took its workers with it.
            Exception: Whatever the work raised.
        """
        ...

    def close(self, *, now: bool) -> None:
        """End the workers; `now` cuts off what they are doing."""
        ...


@dataclass(slots=True, eq=False)
class QueuedJob:
    """A job on its way; `lost` counts the workers it took with it."""

    work: Work
    job: Any
    near: str
    urgent: bool
    done: asyncio.Future[Row]
    lost: int = 0


@dataclass(slots=True)
class JobQueue:
    """Jobs that wait: urgent ones first, then by kinship, in the order in which the kin came."""

    _urgent: deque[QueuedJob] = field(default_factory=deque[QueuedJob])
    _kin: OrderedDict[str, deque[QueuedJob]] = field(default_factory=OrderedDict[str, deque[QueuedJob]])
    _came: asyncio.Condition = field(default_factory=asyncio.Condition)

    async def put(self, job: QueuedJob) -> None:
        """Have a job wait."""
        async with self._came:
            if job.urgent:
                self._urgent.append(job)
            else:
                self._kin.setdefault(job.near, deque()).append(job)
            self._came.notify()

    async def get(self, near: str, others: set[str]) -> QueuedJob:
        """The next job for a worker that last did `near`, while other workers are at `others`."""
        async with self._came:
            while not self._urgent and not self._kin:
                await self._came.wait()
            if self._urgent:
                return self._urgent.popleft()
            if near not in self._kin:
                near = next((kin for kin in self._kin if kin not in others), next(iter(self._kin)))
            jobs = self._kin[near]
            job = jobs.popleft()
            if not jobs:
                del self._kin[near]
            return job


class LocalEngine:
    """Worker processes on this machine. Each is a pool of one, so that a death is of one known job.

    A job whose worker dies is done again by a fresh one; a worker that dies idle is replaced and nobody is blamed.
    """

    def __init__(self, workers: int, *, job_limit_s: float = JOB_LIMIT_S) -> None:
        self._context = multiprocessing.get_context("spawn")
        self._limit_s = job_limit_s
        self._queue = JobQueue()
        self._workers = [_Worker(self._context) for _ in range(workers)]
        self._tasks: list[asyncio.Task[None]] = []

    @property
    def slots(self) -> int:
        """Number of processes."""
        return len(self._workers)

    async def start(self) -> None:
        """Start the processes. Raises EngineError."""
        await asyncio.gather(*(worker.start() for worker in self._workers))
        self._tasks = [asyncio.create_task(self._serve(worker)) for worker in self._workers]

    async def run(self, work: Work, job: Any, *, near: str = "", urgent: bool = False) -> Row:
        entry = QueuedJob(work, job, near, urgent, asyncio.get_running_loop().create_future())
        await self._queue.put(entry)
        return await entry.done

    def close(self, *, now: bool) -> None:
        for task in self._tasks:
            task.cancel()
        for worker in self._workers:
            worker.close(now=now)

    async def _serve(self, worker: _Worker) -> None:
        while True:
            others = {other.near for other in self._workers if other is not worker}
            entry = await self._queue.get(worker.near, others)
            worker.near = entry.near
            if entry.done.done():  # whoever asked has gone
                continue
            try:
                row = await worker.do(entry.work, entry.job, self._limit_s)
            except BrokenExecutor as error:
                await self._lost(entry, worker, error)
            except Exception as error:  # noqa: BLE001 - what the work raised goes to whoever asked for it
                hand(entry.done, error=error)
            else:
                hand(entry.done, row)

    async def _lost(self, entry: QueuedJob, worker: _Worker, error: BrokenExecutor) -> None:
        entry.lost += 1
        _log.warning("a simulation process was lost (%s) with a job on %s", error, entry.near or "no sample")
        try:
            await worker.restart()
        except EngineError as fault:
            hand(entry.done, error=fault)
            return
        if entry.lost >= LIVES:
            hand(entry.done, error=WorkerLostError(f"The simulation process was lost {entry.lost} times: {error}"))
        else:
            await self._queue.put(entry)


def hand(future: asyncio.Future[Row], row: Row | None = None, error: Exception | None = None) -> None:
    """Give a result, or why there is none, to whoever still waits for it."""
    if future.done():
        return
    if error is not None:
        future.set_exception(error)
    elif row is not None:
        future.set_result(row)


def first_error(group: BaseExceptionGroup[BaseException]) -> BaseException:
    """The error that stopped a run, out of the groups that its tasks wrapped it in."""
    error: BaseException = group
    while isinstance(error, BaseExceptionGroup):
        error = error.exceptions[0]
    return error


class _Worker:
    """One process, started anew when it dies."""

    def __init__(self, context: Any) -> None:
        self.near = ""
        self._context = context
        self._pool: ProcessPoolExecutor | None = None
        self._pid = 0
        self._begun: Any = None

    async def start(self) -> None:
        self._begun = self._context.RawValue("q", 0)
        self._pool = ProcessPoolExecutor(1, mp_context=self._context, initializer=_settle_in, initargs=(self._begun,))
        try:
            self._pid = await asyncio.wrap_future(self._pool.submit(os.getpid))
        except BrokenExecutor as error:
            raise EngineError(
                "A simulation process dies as soon as it is started.", hint="Run: chauffeur doctor"
            ) from error

    async def restart(self) -> None:
        self.close(now=True)
        await self.start()

    async def do(self, work: Work, job: Any, limit_s: float) -> Row:
        """The work's row. Raises BrokenExecutor when the process died of it or had to be ended."""
        for _ in range(_FALSE_STARTS):
            try:
                return await self._do_once(work, job, limit_s)
            except BrokenProcessPool:
                if self._begun.value:
                    raise
            # It died while it was idle, which its pool notices late: the job may have been handed to it all the same.
            await self.restart()
        raise BrokenExecutor(f"{_FALSE_STARTS} processes died before they began with it")

    async def _do_once(self, work: Work, job: Any, limit_s: float) -> Row:
        self._begun.value = 0
        future = self._submit(work, job)
        try:
            async with asyncio.timeout(limit_s):
                return await asyncio.wrap_future(future)
        except TimeoutError:
            if future.done() and not future.cancelled():  # the work's own
                raise
            raise BrokenExecutor(f"the job did not finish within {limit_s:g} s") from None

    def _submit(self, work: Work, job: Any) -> Any:
        if self._pool is None:
            raise EngineError("The simulation process could not be started again.")
        return self._pool.submit(_begin, work, job)

    def close(self, *, now: bool) -> None:
        if self._pool is None:
            return
        if now and self._pid:
            with suppress(OSError):
                os.kill(self._pid, getattr(signal, "SIGKILL", signal.SIGTERM))
        self._pool.shutdown(wait=not now, cancel_futures=True)
        self._pool = None
        self._pid = 0


def _settle_in(begun: Any) -> None:
    """Set a worker up: the parent handles Ctrl-C and has priority, and the worker ends with it."""
    global _begun  # noqa: PLW0603 - a worker's process has no other place for what it is given at its start
    _begun = begun
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with suppress(OSError, AttributeError):
        os.nice(_NICE)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _begin(work: Work, job: Any) -> Row:
    """Do a job, in a worker."""
    _begun.value = 1
    return work(job)


def _end_with(sentinel: int) -> None:
    wait([sentinel])
    os._exit(1)
