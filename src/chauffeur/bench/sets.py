"""Generated data sets: what decides a set stands in its folder, and work is spread over processes."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from chauffeur.bench.kernel.engine import LocalEngine, Work
from chauffeur.bench.kernel.store import Row
from chauffeur.concept import ConfigError
from chauffeur.driving.files import publish


def claim(folder: Path, wanted: Mapping[str, Any], name: str = "config.json", indent: int | None = None) -> None:
    """Begin a set in a folder, or continue it.

    Args:
        folder: Of the set.
        wanted: What decides it.
        name: File that holds that.
        indent: Of the JSON.

    Raises:
        ConfigError: The folder holds a set of another configuration.
        DataError: The disk refuses the file.
    """
    path = folder / name
    if not path.is_file():
        folder.mkdir(parents=True, exist_ok=True)
        publish(path, (json.dumps(wanted, indent=indent) + "\n").encode(), "configuration")
        return
    try:
        held = json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        held = None
    if held != json.loads(json.dumps(wanted)):
        raise ConfigError(
            f"{folder} holds a set of another configuration or version.",
            hint="Continue it with the options it was started with, or choose another --out folder.",
        )


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
