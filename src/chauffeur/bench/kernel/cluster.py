"""A run's simulations on a Ray cluster. Every node needs the same version of Chauffeur; planner calls stay here."""

from __future__ import annotations

import asyncio
import logging
import os
import secrets
import shutil
import tempfile
from importlib import import_module
from importlib.metadata import version
from typing import Any, Final
from urllib.parse import urlsplit

from chauffeur.bench.kernel.engine import (
    JOB_LIMIT_S,
    LIVES,
    EngineError,
    JobQueue,
    QueuedJob,
    Work,
    WorkerLostError,
    hand,
)
from chauffeur.bench.kernel.store import Row
from chauffeur.concept import ConfigError, MissingExtraError

_log = logging.getLogger(__name__)

MOVES: Final = 20
"""Nodes that may die under one job before it is given up: a node's death says nothing about the job."""
_AHEAD: Final = 2
"""Jobs handed to Ray for each CPU, so that none waits for this process; the rest stay here, the urgent ones first."""
_LOOK_S: Final = 5.0
_KNOCK_S: Final = 10.0


class RayEngine:
    """Runs jobs as tasks of one CPU each. A node that dies costs its jobs a second start, and nothing else.

    Args:
        address: `local` starts a cluster for this run on this machine, guarded by a token that only this run knows;
            `auto` takes the one that runs here; `host:port` and `ray://host:port` name one.
        workers: CPUs of the cluster that `local` starts; other clusters know their own size.
    """

    def __init__(self, address: str, workers: int, *, job_limit_s: float = JOB_LIMIT_S) -> None:
        self._address = address
        self._cpus = workers
        self._limit_s = job_limit_s
        self._ray: Any = None
        self._mine = False
        self._folder = ""
        self._queue = JobQueue()
        self._remote: dict[Work, Any] = {}
        self._tasks: set[asyncio.Task[None]] = set()

    @property
    def slots(self) -> int:
        """CPUs of the cluster as last seen."""
        return self._cpus

    async def start(self) -> None:
        """Join or start the cluster.

        Raises:
            MissingExtraError: Ray is not installed.
            ConfigError: There is no such cluster, or a node has no or another Chauffeur.
            EngineError: The cluster has no CPUs.
        """
        self._ray = _import_ray(own_cluster=self._address == "local")
        await self._knock()
        self._join()
        await self._check_nodes()
        self._look()
        if self._cpus < 1:
            raise EngineError(f"The Ray cluster {self._address} has no CPUs.")
        self._keep(asyncio.create_task(self._watch()))

    async def _knock(self) -> None:
        """See that somebody answers at an address: Ray itself would try for minutes."""
        if self._address in ("local", "auto"):
            return
        place = urlsplit(self._address if "://" in self._address else f"//{self._address}")
        try:
            async with asyncio.timeout(_KNOCK_S):
                _, writer = await asyncio.open_connection(place.hostname, place.port)
        except (OSError, TimeoutError, ValueError) as error:
            raise self._nobody(str(error) or f"no answer within {_KNOCK_S:g} s") from error
        writer.close()

    def _nobody(self, why: str) -> ConfigError:
        return ConfigError(
            f"There is no Ray cluster to be had at {self._address!r}: {why}.",
            hint="Use --ray local to start one here, or start one with `ray start --head` and give its host:port.",
        )

    def _join(self) -> None:
        ray = self._ray
        if ray.is_initialized():
            return
        quiet: dict[str, Any] = {"log_to_driver": False, "logging_level": logging.ERROR}
        self._mine = True
        try:
            if self._address == "local":
                self._folder = tempfile.mkdtemp(prefix="chauffeur-ray-")
                ray.init(
                    "local",
                    num_cpus=self._cpus,
                    include_dashboard=False,
                    _temp_dir=self._folder,
                    **quiet,
                )
            else:
                ray.init(self._address, **quiet)
        except (OSError, ValueError, RuntimeError, ray.exceptions.RayError) as error:
            raise self._nobody(_first_line(error)) from error

    async def _check_nodes(self) -> None:
        """Every node must do what this process would do."""
        strategies: Any = import_module("ray.util.scheduling_strategies")

        here = version("chauffeur")
        nodes = [node for node in self._ray.nodes() if node["Alive"] and node["Resources"].get("CPU", 0) >= 1]
        asked: list[tuple[str, Any]] = []
        for node in nodes:
            place = strategies.NodeAffinitySchedulingStrategy(node["NodeID"], soft=False)
            task = self._ray.remote(num_cpus=0, max_retries=2)(installed).options(scheduling_strategy=place)
            asked.append((node["NodeManagerAddress"], task.remote()))
        for name, reference in asked:
            try:
                there = await asyncio.wrap_future(reference.future())
            except (self._ray.exceptions.TaskUnschedulableError, self._ray.exceptions.NodeDiedError):
                continue  # it died just now, and will get no work
            except Exception as error:  # noqa: BLE001 - whatever it raises, this node cannot do our work
                there = f"no Chauffeur that can be imported ({str(error).strip().splitlines()[-1]})"
            if there != here:
                raise ConfigError(
                    f"The Ray node {name} has {there}, this machine has {here}.",
                    hint=f"Install chauffeur=={here} on every node of the cluster.",
                )

    def _look(self) -> None:
        """Take notice of how large the cluster is now; more CPUs take more jobs at a time."""
        self._cpus = int(self._ray.cluster_resources().get("CPU", 0))
        while len(self._tasks) < _AHEAD * self._cpus:
            self._keep(asyncio.create_task(self._serve()))

    def _keep(self, task: asyncio.Task[None]) -> None:
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _watch(self) -> None:
        while True:
            await asyncio.sleep(_LOOK_S)
            self._look()

    async def run(self, work: Work, job: Any, *, near: str = "", urgent: bool = False) -> Row:
        """See Engine; kin is not kept together, because Ray chooses the worker."""
        entry = QueuedJob(work, job, near, urgent, asyncio.get_running_loop().create_future())
        await self._queue.put(entry)
        return await entry.done

    def close(self, *, now: bool) -> None:
        """See Engine. A cluster that was running before stays."""
        del now  # tasks of a driver that has gone are ended by Ray
        for task in self._tasks:
            task.cancel()
        if self._mine and self._ray is not None:
            self._ray.shutdown()
        if self._folder:
            shutil.rmtree(self._folder, ignore_errors=True)

    async def _serve(self) -> None:
        while True:
            entry = await self._queue.get("", set())
            try:
                hand(entry.done, await self._do(entry))
            except Exception as error:  # noqa: BLE001 - what the work raised goes to whoever asked for it
                hand(entry.done, error=error)

    async def _do(self, entry: QueuedJob) -> Row:
        errors = self._ray.exceptions
        moved = 0
        while True:
            reference = self._submit(entry)
            try:
                async with asyncio.timeout(self._limit_s):
                    return await asyncio.wrap_future(reference.future())
            except errors.RayTaskError as error:
                raise getattr(error, "cause", None) or error from None
            except TimeoutError:
                self._ray.cancel(reference, force=True)
                entry.lost += 1
                why = f"the job did not finish within {self._limit_s:g} s"
            except (errors.WorkerCrashedError, errors.OutOfMemoryError) as error:
                entry.lost += 1
                why = _first_line(error)
            except (errors.NodeDiedError, errors.ObjectLostError, errors.LocalRayletDiedError) as error:
                moved += 1
                why = _first_line(error)
            _log.warning("a job on %s was lost and starts again: %s", entry.near or "no sample", why)
            if entry.lost >= LIVES or moved >= MOVES:
                raise WorkerLostError(f"The simulation process was lost {max(entry.lost, moved)} times: {why}")

    def _submit(self, entry: QueuedJob) -> Any:
        task = self._remote.get(entry.work)
        if task is None:
            task = self._ray.remote(num_cpus=1, max_retries=0, scheduling_strategy="SPREAD")(entry.work)
            self._remote[entry.work] = task
        return task.remote(entry.job)


def installed() -> str:
    """Version of Chauffeur where this runs: on a node."""
    return version("chauffeur")


def _first_line(error: Exception) -> str:
    return (str(error).strip() or type(error).__name__).splitlines()[0].rstrip(".")


def _import_ray(*, own_cluster: bool) -> Any:
    """Ray, without what it would otherwise do unasked: report its use, and write a token to the home folder."""
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    if own_cluster and not any(name.startswith("RAY_AUTH_") for name in os.environ):
        # Ray guards a new cluster with a token, as it should: its ports can be reached from the network. Given one, it
        # keeps it to the cluster's processes; else it would write one to the home folder.
        os.environ["RAY_AUTH_TOKEN"] = secrets.token_hex(32)
    try:
        ray: Any = import_module("ray")
    except ImportError as error:
        raise MissingExtraError("Ray is not installed.", extra="cluster") from error
    return ray
