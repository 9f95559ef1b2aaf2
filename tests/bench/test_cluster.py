"""The same run on a Ray cluster: two nodes on this machine, one of which dies half way."""

from __future__ import annotations

import asyncio
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
import work

from chauffeur.bench.kernel.cluster import RayEngine
from chauffeur.bench.kernel.engine import WorkerLostError
from chauffeur.bench.kernel.run import Effort
from chauffeur.concept import ConfigError, MissingExtraError
from small_run import FAST, finish, make_data, make_run, outcome, recorded

pytestmark = [
    pytest.mark.slow,
    pytest.mark.server,
    pytest.mark.skipif(find_spec("ray") is None, reason="Ray is not installed: pip install 'chauffeur-lab[cluster]'"),
]


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    patch = pytest.MonkeyPatch()
    patch.setenv("RAY_USAGE_STATS_ENABLED", "0")
    patch.setenv("RAY_AUTH_MODE", "token")
    patch.setenv("RAY_AUTH_TOKEN", "f" * 64)
    patch.setenv("PYTHONPATH", os.pathsep.join([str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")]))
    patch.setenv("XDG_CACHE_HOME", os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache"))  # compiled kernels
    patch.setenv("HOME", str(tmp_path_factory.mktemp("home")))
    from ray.cluster_utils import Cluster  # only now: Ray reads its environment when it is imported

    # Not pytest's own folder: the path of a socket must be short.
    with tempfile.TemporaryDirectory(prefix="ray-", ignore_cleanup_errors=True) as folder:
        patch.setenv("RAY_TMPDIR", folder)
        (Path(folder) / "ray").mkdir()
        notices = {"health_check_initial_delay_ms": 0, "health_check_period_ms": 500, "health_check_timeout_ms": 2000}
        head = {"num_cpus": 1, "include_dashboard": False, "_system_config": notices}
        made = Cluster(initialize_head=True, head_node_args=head)
        yield made
        made.shutdown()
    patch.undo()


def _with_engine(address: str, do: Any, **options: Any) -> Any:
    async def run() -> Any:
        engine = RayEngine(address, 1, **options)
        try:
            await engine.start()
            return await do(engine)
        finally:
            engine.close(now=False)

    return asyncio.run(run())


def test_a_node_that_dies_half_way_changes_nothing(tmp_path: Path, cluster: Any) -> None:
    dataset = make_data(tmp_path / "data")
    spec = recorded(tmp_path / "answers.jsonl")
    finish(make_run(tmp_path / "local", dataset, spec))
    second = cluster.add_node(num_cpus=1)
    killed: list[int] = []
    where: set[str] = set()

    class Watched(RayEngine):
        async def run(self, work: Any, job: Any, **options: Any) -> Any:
            row = await super().run(work, job, **options)
            if len(killed) == 0 and hasattr(job, "key"):
                import ray

                where.update(node["NodeID"] for node in ray.nodes() if node["Alive"])
                # The whole node, its workers included, as if its power had failed.
                cluster.remove_node(second, allow_graceful=False)
                killed.append(1)
            return row

    run = make_run(tmp_path / "ray", dataset, spec)
    run.run(lambda standing: None, Effort(patience=FAST, engine=partial(Watched, cluster.address)))
    assert killed and len(where) == 2, "there were two nodes, and one was killed while drives were going on"
    assert outcome(tmp_path / "ray") == outcome(tmp_path / "local")


def test_jobs_that_kill_raise_or_hang(tmp_path: Path, cluster: Any) -> None:
    once, always = tmp_path / "once", tmp_path / "always"
    once.write_text("1")
    always.write_text("9")

    async def do(engine: RayEngine) -> None:
        assert (await engine.run(work.die, str(once)))["survived"]
        with pytest.raises(WorkerLostError, match="lost 2 times"):
            await engine.run(work.die, str(always))
        with pytest.raises(ValueError, match="no such lane"):
            await engine.run(work.fail, "no such lane")
        rows = await asyncio.gather(*(engine.run(work.echo, i) for i in range(30)))
        assert [row["job"] for row in rows] == list(range(30))
        with pytest.raises(WorkerLostError, match="did not finish"):
            await engine.run(work.nap, 3600.0)

    _with_engine(cluster.address, do, job_limit_s=5.0)
    assert always.read_text() == "7"


def test_a_node_with_another_chauffeur_is_named(cluster: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("chauffeur.bench.kernel.cluster.version", lambda name: "99.0")
    with pytest.raises(ConfigError, match=r"The Ray node .* has 0.*, this machine has 99\.0"):
        _with_engine(cluster.address, lambda engine: None)


@pytest.mark.parametrize("address", ["127.0.0.1:1", "ray://127.0.0.1:1", "nonsense", "127.0.0.1:port"])
def test_no_cluster_there_is_said_at_once(address: str) -> None:
    with pytest.raises(ConfigError, match=f"There is no Ray cluster to be had at '{address}'"):
        _with_engine(address, lambda engine: None)


def test_without_ray_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(MissingExtraError, match="not installed") as caught:
        _with_engine("local", lambda engine: None)
    assert caught.value.hint.endswith('[cluster]"')


def test_a_cluster_of_its_own_leaves_nothing_behind(tmp_path: Path) -> None:
    """In a process of its own, whose home is looked at afterwards."""
    script = """
import asyncio, os, sys
sys.path.insert(0, sys.argv[1])
import work
from chauffeur.bench.kernel.cluster import RayEngine
async def main():
    engine = RayEngine("local", 1)
    await engine.start()
    assert engine.slots == 1
    assert os.environ["RAY_USAGE_STATS_ENABLED"] == "0"
    assert os.environ["RAY_AUTH_MODE"] == "token", "guarded"
    print((await engine.run(work.echo, 7))["job"])
    engine.close(now=True)
asyncio.run(main())
"""
    environ = {name: value for name, value in os.environ.items() if not name.startswith("RAY_")}
    (tmp_path / "home").mkdir()
    here = str(Path(__file__).parent)
    environ |= {"HOME": str(tmp_path / "home"), "PYTHONPATH": here}
    done = subprocess.run(
        [sys.executable, "-c", script, here], capture_output=True, text=True, timeout=600, check=False, env=environ
    )
    assert done.returncode == 0 and done.stdout.split()[-1] == "7", done.stdout + done.stderr
    assert not list((tmp_path / "home").glob(".ray*")), "no token, no settings"
