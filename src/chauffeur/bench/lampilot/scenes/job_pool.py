"""Jobs spread over all cores, results as they come."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from typing import Any

from chauffeur.bench.kernel.engine import LocalEngine, Work
from chauffeur.bench.kernel.store import Row

Progress = Callable[[int, int], None]
"""Called as (done, of)."""


def spread(work: Work, jobs: Sequence[Any], workers: int, take: Callable[[Row], None]) -> None:
    """Do all jobs on worker processes. Ctrl-C and the first failure end the workers at once.

    Args:
        work: What to do: a function of a module, of one picklable value.
        jobs: What with.
        workers: Number of processes.
        take: Called with each result as it comes, in this process.

    Raises:
        WorkerLostError: A job took its workers with it.
        Exception: Whatever the work or `take` raised.
    """
    if jobs:
        asyncio.run(_all(work, jobs, min(workers, len(jobs)), take))


async def _all(work: Work, jobs: Sequence[Any], workers: int, take: Callable[[Row], None]) -> None:
    engine = LocalEngine(workers)
    finished = False
    try:
        await engine.start()
        for result in asyncio.as_completed([engine.run(work, job) for job in jobs]):
            take(await result)
        finished = True
    finally:
        engine.close(now=not finished)
