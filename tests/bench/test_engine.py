"""Worker processes that die, hang and raise: each costs what it was doing, and nothing else."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
import work

from chauffeur.bench.kernel.engine import EngineError, LocalEngine, WorkerLostError


def _with_engine(do: Callable[[LocalEngine], Awaitable[Any]], workers: int = 2, **options: Any) -> Any:
    async def run() -> Any:
        engine = LocalEngine(workers, **options)
        try:
            await engine.start()
            return await do(engine)
        finally:
            engine.close(now=False)

    return asyncio.run(run())


def _gone(pid: int) -> bool:
    try:
        stat = Path(f"/proc/{pid}/stat").read_text()
    except (FileNotFoundError, ProcessLookupError):  # the second: it was reaped between the opening and the reading
        return True
    return stat.rpartition(")")[2].split()[0] == "Z"


def test_jobs_are_spread_and_kin_stays_together() -> None:
    async def do(engine: LocalEngine) -> list[dict[str, Any]]:
        jobs = [(near, n) for n in range(10) for near in "abcd"]
        return list(await asyncio.gather(*(engine.run(work.echo, job, near=job[0]) for job in jobs)))

    rows = _with_engine(do)
    assert len({row["pid"] for row in rows}) == 2
    homes = Counter((row["job"][0], row["pid"]) for row in rows)
    assert len(homes) <= 6, "a sample's jobs go to the worker that has it, until the other has nothing else to do"


def test_urgent_jobs_go_first() -> None:
    async def do(engine: LocalEngine) -> list[str]:
        order: list[str] = []

        async def one(name: str, urgent: bool) -> None:
            await engine.run(work.nap, 0.01, near=name, urgent=urgent)
            order.append(name)

        tasks = [asyncio.create_task(one(f"slow{i}", False)) for i in range(10)]
        await asyncio.sleep(0)
        tasks.append(asyncio.create_task(one("urgent", True)))
        await asyncio.gather(*tasks)
        return order

    assert "urgent" in _with_engine(do, workers=1)[:3]


def test_what_the_work_raises_reaches_who_asked() -> None:
    async def do(engine: LocalEngine) -> dict[str, Any]:
        with pytest.raises(ValueError, match="no such lane"):
            await engine.run(work.fail, "no such lane")
        with pytest.raises((TypeError, AttributeError)):
            await engine.run(work.echo, lambda: None)  # cannot be sent to a process
        return await engine.run(work.echo, 1)

    assert _with_engine(do, workers=1)["job"] == 1


@pytest.mark.slow
def test_a_job_whose_worker_dies_is_done_again(tmp_path: Path) -> None:
    lives = tmp_path / "lives"
    lives.write_text("1")

    async def do(engine: LocalEngine) -> list[dict[str, Any]]:
        jobs = [engine.run(work.die, str(lives))] + [engine.run(work.echo, i) for i in range(20)]
        return list(await asyncio.gather(*jobs))

    first, *others = _with_engine(do)
    assert first["survived"] and [row["job"] for row in others] == list(range(20))


@pytest.mark.slow
def test_a_job_that_kills_twice_is_given_up_and_the_others_go_on(tmp_path: Path) -> None:
    lives = tmp_path / "lives"
    lives.write_text("99")

    async def do(engine: LocalEngine) -> list[Any]:
        jobs = [engine.run(work.echo, i) for i in range(20)]
        jobs.insert(3, engine.run(work.die, str(lives)))
        return list(await asyncio.gather(*jobs, return_exceptions=True))

    rows = _with_engine(do)
    assert isinstance(rows.pop(3), WorkerLostError)
    assert [row["job"] for row in rows] == list(range(20))
    assert lives.read_text() == "97", "two workers, not one more"


@pytest.mark.slow
@pytest.mark.parametrize("noticed", [False, True])
def test_a_worker_killed_while_idle_is_replaced_and_nobody_is_blamed(tmp_path: Path, noticed: bool) -> None:
    lives = tmp_path / "lives"

    async def do(engine: LocalEngine) -> list[int]:
        pids = [(await engine.run(work.echo, 0))["pid"]]
        for _ in range(2):
            lives.write_text("1")
            os.kill(pids[-1], signal.SIGKILL)
            while noticed and not _gone(pids[-1]):
                await asyncio.sleep(0.01)
            # It takes one worker with it, and may: the one that died before was not its doing.
            pids.append((await engine.run(work.die, str(lives)))["pid"])
        return pids

    assert len(set(_with_engine(do, workers=1))) == 3


@pytest.mark.slow
def test_a_job_that_no_worker_can_begin_is_given_up_and_the_others_go_on() -> None:
    async def do(engine: LocalEngine) -> list[Any]:
        jobs = [engine.run(work.echo, 1), engine.run(work.echo, work.Poison()), engine.run(work.echo, 2)]
        return list(await asyncio.gather(*jobs, return_exceptions=True))

    first, poisoned, last = _with_engine(do, workers=1)
    assert isinstance(poisoned, WorkerLostError) and "before they began" in str(poisoned)
    assert (first["job"], last["job"]) == (1, 2)


@pytest.mark.slow
def test_a_job_that_hangs_is_cut_off() -> None:
    async def do(engine: LocalEngine) -> Any:
        with pytest.raises(WorkerLostError, match="did not finish"):
            await engine.run(work.nap, 3600.0)
        return await engine.run(work.echo, 5)

    started = time.monotonic()
    assert _with_engine(do, workers=1, job_limit_s=0.3)["job"] == 5
    assert time.monotonic() - started < 30


@pytest.mark.slow
def test_workers_do_not_outlive_a_run_that_was_killed() -> None:
    script = """
import asyncio, sys
sys.path.insert(0, sys.argv[1])
import work
from chauffeur.bench.kernel.engine import LocalEngine
async def main():
    engine = LocalEngine(2)
    await engine.start()
    rows = await asyncio.gather(*(engine.run(work.echo, i) for i in range(8)))
    print(*{row["pid"] for row in rows}, flush=True)
    await engine.run(work.nap, 600.0)
if __name__ == "__main__":
    asyncio.run(main())
"""
    run = subprocess.Popen(
        [sys.executable, "-c", script, str(Path(__file__).parent)], stdout=subprocess.PIPE, text=True
    )
    assert run.stdout is not None
    pids = [int(pid) for pid in run.stdout.readline().split()]
    assert pids and not any(_gone(pid) for pid in pids)
    run.send_signal(signal.SIGKILL)
    run.wait()
    deadline = time.monotonic() + 20
    while time.monotonic() < deadline and not all(_gone(pid) for pid in pids):
        time.sleep(0.05)
    assert all(_gone(pid) for pid in pids), "one idle, one busy: both have gone with their parent"


def test_a_machine_that_cannot_start_a_worker_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("multiprocessing.spawn.get_executable", lambda: b"/bin/false")
    with pytest.raises(EngineError, match="dies as soon as it is started"):
        _with_engine(lambda engine: engine.run(work.echo, 1), workers=1)
