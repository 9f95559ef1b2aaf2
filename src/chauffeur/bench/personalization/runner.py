"""The study as a run on disk: every passenger and task is a row; the same command goes on where it stopped."""

from __future__ import annotations

import asyncio
import hashlib
import json
import platform
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

from chauffeur.bench.kernel.engine import Engine, LocalEngine, WorkerLostError, first_error
from chauffeur.bench.kernel.shards import WHOLE, Shard
from chauffeur.bench.kernel.standing import Speedometer, Standing
from chauffeur.bench.kernel.store import Row, RowStore, freeze, sole_writer
from chauffeur.bench.personalization.population import draw_passengers
from chauffeur.bench.personalization.sayings import Half, sayings_sha256
from chauffeur.bench.personalization.scenes import TASKS, scenes_of
from chauffeur.bench.personalization.study import BENCH_VERSION, StudyJob, do_job, versions
from chauffeur.concept import ChauffeurError, ConfigError
from chauffeur.drive.files import publish
from chauffeur.drive.session import scenario_hash
from chauffeur.planners.registry import make_planner

SIMULATED: Final = "simulated passengers in simulated drives; nobody was asked and nobody was driven"
"""Stands beside every figure."""

Watch = Callable[[Standing], None]


@dataclass(frozen=True, slots=True)
class StudyConfig:
    """What decides a run.

    Attributes:
        passengers: How many simulated people.
        seed: They, their moods and their words are drawn from it.
        planner: Who plans without and with memory.
        half: Which half of the wordings is said.
        trips: How many trips the memory learns from, for each task.
    """

    passengers: int = 100
    seed: int = 1
    planner: str = "talk2drive"
    half: Half = "test"
    trips: int = 5


class StudyRun:
    """One run in one folder.

    Attributes:
        folder: Where it is stored.
        config: What decides it.
        jobs: All of it, or the shard's part.
        failed: Why jobs of this process failed, by key.
    """

    def __init__(
        self, folder: Path, config: StudyConfig, *, shard: Shard = WHOLE, options: tuple[tuple[str, Any], ...] = ()
    ) -> None:
        """Open or continue a run.

        Args:
            folder: Where its rows are stored.
            config: What decides it.
            shard: Which part of it is done here.
            options: Of the planner, e.g. its endpoint.

        Raises:
            ConfigError: The folder holds a run with another configuration, or the configuration makes no sense.
            DataError: The stored configuration is damaged.
            StorageError: The folder cannot be used.
        """
        if config.trips < 0:
            raise ConfigError(f"{config.trips} trips are less than none.", hint="Learn from 0 trips or more.")
        self.folder, self.config = folder, config
        self.failed: dict[str, str] = {}
        self.model = make_planner(config.planner, **dict(options)).model
        people = draw_passengers(config.passengers, config.seed)
        every = [
            StudyJob(f"{one.id}.{task}", number, task, config.seed, config.planner, config.half, config.trips, options)
            for number, one in enumerate(people)  # person by person: what is done at any time is a whole study
            for task in TASKS
        ]
        self.jobs = tuple(job for job in every if shard.owns(job.key))
        with sole_writer(folder):
            self._freeze()
        self._store = RowStore(folder / "trips.jsonl", "key")

    @property
    def damaged(self) -> int:
        """Damaged rows found when the run was opened; their jobs are done again."""
        return len(self._store.damaged)

    def run(self, watch: Watch, *, workers: int = 1, engine: Callable[[int], Engine] = LocalEngine) -> list[Row]:
        """Do what is not done yet; the rows of all trips.

        Raises:
            ConfigError: Another process works in this folder.
            ChauffeurError: The disk is full, or no worker can be had. What was stored stays.
        """
        with sole_writer(self.folder):
            missing = [job for job in self.jobs if job.key not in self._store.rows]
            try:
                if missing:
                    asyncio.run(self._work(missing, watch, engine(workers)))
            except BaseExceptionGroup as group:
                raise first_error(group) from group
            finally:
                self._store.close()
            rows = self.rows()
            lines = "".join(json.dumps(row, ensure_ascii=True) + "\n" for row in rows)
            publish(self.folder / "results.jsonl", lines.encode(), "results")
            return rows

    def rows(self) -> list[Row]:
        """One row a trip, from what is stored."""
        common: Row = {
            "planner": self.config.planner,
            "model": self.model,
            "half": self.config.half,
            "bench": BENCH_VERSION,
            "note": SIMULATED,
        }
        found: list[Row] = []
        for job in self.jobs:
            row = self._store.rows.get(job.key)
            if row is not None:
                found += [{"passenger": row["passenger"], **trip, **common} for trip in row["trips"]]
        return found

    @property
    def done(self) -> int:
        """Jobs that have a row."""
        return sum(job.key in self._store.rows for job in self.jobs)

    def _freeze(self) -> None:
        content = {
            **asdict(self.config),
            **versions(),
            "model": self.model,
            "sayings_sha256": sayings_sha256(),
            "scenes_sha256": _scenes_sha256(),
            "simulated": SIMULATED,
        }
        text = (json.dumps(content, indent=1) + "\n").encode()
        if freeze(self.folder / "config.json", text):
            where = {"chauffeur": version("chauffeur"), "python": platform.python_version(), "numpy": version("numpy")}
            publish(self.folder / "versions.json", (json.dumps(where, indent=1) + "\n").encode(), "run's versions")

    async def _work(self, missing: list[StudyJob], watch: Watch, engine: Engine) -> None:
        speed, todo, whole = Speedometer(), iter(missing), False
        try:
            await engine.start()
            async with asyncio.TaskGroup() as group:
                for _ in range(engine.slots):
                    group.create_task(self._serve(todo, engine, watch, speed))
            whole = True
        finally:
            engine.close(now=not whole)

    async def _serve(self, todo: Iterator[StudyJob], engine: Engine, watch: Watch, speed: Speedometer) -> None:
        for job in todo:
            try:
                row = await engine.run(do_job, job)
            except WorkerLostError as error:
                self.failed[job.key] = str(error)
            except ChauffeurError as error:  # an endpoint that does not answer is no takeover
                self.failed[job.key] = str(error)
            else:
                self._store.append(row)
            watch(self._standing(speed))

    def _standing(self, speed: Speedometer) -> Standing:
        done = self.done
        rate = speed.rate(time.monotonic(), done)
        left = len(self.jobs) - done
        return Standing(
            planned=len(self.jobs),
            asked=done,
            done=done,
            driven=0,
            failed=len(self.failed),
            rate=rate,
            eta_s=left / rate if rate > 0.0 else None,
        )


def _scenes_sha256() -> str:
    hashes = [scenario_hash(scene) for task in TASKS for scene in scenes_of(task)]
    return hashlib.sha256("\n".join(hashes).encode()).hexdigest()
