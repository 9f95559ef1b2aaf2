"""What a run survives: damaged rows, impossible samples, a full disk, dying workers, and being killed itself. Whatever
happened, the same command ends in the same table, byte for byte."""

from __future__ import annotations

import json
import os
import random
import resource
import signal
import subprocess
import sys
from concurrent.futures import BrokenExecutor
from contextlib import suppress
from pathlib import Path
from typing import Any, ClassVar

import pytest

from chauffeur.bench.kernel.engine import LocalEngine, QueuedJob
from chauffeur.bench.kernel.run import Effort
from chauffeur.bench.kernel.store import RowStore
from chauffeur.concept import ConfigError, Plan, PlanRequest
from chauffeur.planners.registry import make_planner
from chauffeur.worlds.highway.dblv1 import Dataset
from processes import started, until
from small_run import COMMANDS, FAST, SEEDS, Inline, finish, make_data, make_run, outcome, quiet, recorded

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return make_data(tmp_path_factory.mktemp("robust") / "data", SEEDS[:3])


@pytest.fixture(scope="module")
def spec(tmp_path_factory: pytest.TempPathFactory) -> str:
    return recorded(tmp_path_factory.mktemp("robust") / "answers.jsonl")


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory, dataset: Dataset, spec: str) -> Path:
    folder = tmp_path_factory.mktemp("robust") / "undisturbed"
    finish(make_run(folder, dataset, spec), engine=LocalEngine)
    return folder


def _command(dataset: Dataset, spec: str, out: Path) -> list[str]:
    start = [sys.executable, "-c", "from chauffeur.cli.main import run; run()", "bench", "lampilot"]
    return [*start, "--data", str(dataset.path), "--planner", spec, "--out", str(out), "--workers", "1"]


class Counting:
    """A planner that counts what it is asked."""

    def __init__(self, spec: str) -> None:
        self._inner = make_planner(spec)
        self.id, self.model = self._inner.id, self._inner.model
        self.asked: list[str] = []

    async def plan(self, request: PlanRequest) -> Plan:
        self.asked.append(request.instruction.text)
        return await self._inner.plan(request)


def test_the_undisturbed_run_is_what_the_other_tests_mean(undisturbed: Path) -> None:
    rows = [json.loads(line) for line in (undisturbed / "results.jsonl").read_text().splitlines()]
    assert len(rows) == 3 * len(COMMANDS)
    assert {row["schema"] for row in rows} == {"lampilot-results-v2"}
    assert {row["metrics"] for row in rows} == {"lampilot-origin-v1"}
    by_command = {words: [row for row in rows if row["command"] == words] for words in COMMANDS}
    assert sum(row["success"] for row in by_command[COMMANDS[0]]) >= 2
    assert not any(row["success"] for row in by_command[COMMANDS[3]])
    assert all(row["refused"] and row["outcome"] == "refused" for row in by_command[COMMANDS[4]])
    assert not any(row["infra_failed"] for row in rows)
    first, second, other = (by_command[words][0]["rollout_key"] for words in COMMANDS[:3])
    assert first == second != other, "the same policy on the same sample is driven once"


def test_damaged_rows_are_done_again(tmp_path: Path, dataset: Dataset, spec: str, undisturbed: Path) -> None:
    rng = random.Random(4)
    folder = tmp_path / "run"
    folder.mkdir()
    spoiled_plans = 0
    for name in ("plan.json", "contexts.jsonl", "generate.jsonl", "rollout.jsonl", "results.jsonl", "table.md"):
        content = bytearray((undisturbed / name).read_bytes())
        if name.endswith(".jsonl"):
            lines = content.splitlines(keepends=True)
            for place in rng.sample(range(len(lines)), min(4, len(lines) - 1)):
                spoiled_plans += name == "generate.jsonl"
                at = rng.randrange(len(lines[place]) - 40)
                lines[place][at] ^= 1 << rng.randrange(7)
            content = bytearray(b"".join(lines))[: -rng.randrange(1, 200)]
        (folder / name).write_bytes(content)
    planner = Counting(spec)
    run = make_run(folder, dataset, spec, planner=planner)
    assert set(run.damaged) == {"contexts.jsonl", "generate.jsonl", "rollout.jsonl"}
    assert finish(run) == outcome(undisturbed)
    assert 1 <= len(planner.asked) <= spoiled_plans + 1, "only what was damaged is asked again"
    assert make_run(folder, dataset, spec).damaged == {}


def test_a_deleted_plan_is_made_anew_and_another_run_is_refused(
    tmp_path: Path, dataset: Dataset, spec: str, undisturbed: Path
) -> None:
    planner = Counting(spec)
    folder = tmp_path / "run"
    folder.mkdir()
    for name in ("contexts.jsonl", "generate.jsonl", "rollout.jsonl"):
        (folder / name).write_bytes((undisturbed / name).read_bytes())
    assert finish(make_run(folder, dataset, spec, planner=planner)) == outcome(undisturbed)
    assert planner.asked == []
    with pytest.raises(ConfigError, match="another configuration"):
        make_run(folder, dataset, spec, items=7)


def test_impossible_samples_cost_only_themselves(
    tmp_path: Path, spec: str, dataset: Dataset, undisturbed: Path
) -> None:
    road = dict(dataset.items()[0].scenario.config)
    goal = {"type": "LaneChangeEval", "direction": "left"}
    bad: list[Any] = [
        {"env": {**road, "type": "no-such-road-v0"}, "eval": goal, "seed": 1},
        {"env": {**road, "vehicles_count": "many"}, "eval": goal, "seed": 1},
        {"env": road, "eval": {"type": "LaneChangeEval", "direction": "up"}, "seed": 1},
        {"env": road, "eval": {"type": 7}, "seed": 1},
        {"env": {}, "eval": {}, "seed": 1},
    ]
    spoiled = make_data(tmp_path / "data", SEEDS[:3], more=bad)
    run = make_run(tmp_path / "run", spoiled, spec)
    finish(run)
    rows = [json.loads(line) for line in (tmp_path / "run" / "results.jsonl").read_text().splitlines()]
    good = [json.loads(line) for line in (undisturbed / "results.jsonl").read_text().splitlines()]
    strip = ("data_sha256",)
    assert [{k: v for k, v in row.items() if k not in strip} for row in rows[: len(good)]] == [
        {k: v for k, v in row.items() if k not in strip} for row in good
    ]
    for row in rows[len(good) :]:
        asked_first = row["outcome"] == "refused"  # the planner declines before anything is driven
        assert row["infra_failed"] or asked_first, row
        assert row["detail"] and not row["success"] and row["score"] == 0.0
    assert run.halt is None and run.unasked == 0


class Mortal(LocalEngine):
    """Loses a worker now and then, idle or at work, but never two over the same job: that job would be given up."""

    victims: ClassVar[set[int]] = set()

    def __init__(self, workers: int) -> None:
        super().__init__(workers)
        self._chances = 0
        self._bereft: list[QueuedJob] = []

    async def run(self, work: Any, job: Any, *, near: str = "", urgent: bool = False) -> Any:
        self._strike()
        row = await super().run(work, job, near=near, urgent=urgent)
        self._strike()
        return row

    def _strike(self) -> None:
        self._chances += 1
        victim = self._workers[0]._pid
        # 0 while it is being replaced: that would be all of us.
        if self._chances >= 8 and victim > 0 and all(entry.done.done() for entry in self._bereft):
            self._chances = 0
            Mortal.victims.add(victim)
            with suppress(ProcessLookupError):  # struck before, while it was idle, and not missed yet
                os.kill(victim, signal.SIGKILL)

    async def _lost(self, entry: QueuedJob, worker: Any, error: BrokenExecutor) -> None:
        self._bereft.append(entry)
        await super()._lost(entry, worker, error)


def test_killed_workers_change_nothing(tmp_path: Path, dataset: Dataset, spec: str, undisturbed: Path) -> None:
    assert finish(make_run(tmp_path / "run", dataset, spec), workers=2, engine=Mortal) == outcome(undisturbed)
    assert len(Mortal.victims) >= 2


class Doomed(LocalEngine):
    """Kills the worker of one sample's drives, every time."""

    sick = True

    async def run(self, work: Any, job: Any, *, near: str = "", urgent: bool = False) -> Any:
        from work import die

        if Doomed.sick and near == "left_lc_s1" and not urgent:
            lives = Path(os.environ["TEST_LIVES"])
            lives.write_text("9")
            return await super().run(die, str(lives), near=near)
        return await super().run(work, job, near=near, urgent=urgent)


def test_an_item_that_kills_its_workers_is_recorded_and_tried_again_next_time(
    tmp_path: Path, dataset: Dataset, spec: str, undisturbed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TEST_LIVES", str(tmp_path / "lives"))
    run = make_run(tmp_path / "run", dataset, spec)
    finish(run, engine=Doomed)
    rows = [json.loads(line) for line in (tmp_path / "run" / "results.jsonl").read_text().splitlines()]
    lost = [row for row in rows if row["infra_failed"]]
    assert {row["sample"] for row in lost} == {"left_lc_s1"}
    assert all("lost 2 times" in row["detail"] for row in lost)
    good = {row["item"]: row for row in map(json.loads, (undisturbed / "results.jsonl").read_text().splitlines())}
    assert all(row == good[row["item"]] for row in rows if not row["infra_failed"])
    monkeypatch.setattr(Doomed, "sick", False)
    assert finish(make_run(tmp_path / "run", dataset, spec), engine=Doomed) == outcome(undisturbed)


def test_kill_9_and_the_same_command_again(tmp_path: Path, dataset: Dataset, spec: str, undisturbed: Path) -> None:
    out = tmp_path / "run"
    command = _command(dataset, spec, out)
    driven = out / "rollout.jsonl"
    for rows in (1, 4):
        with started(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
            until(lambda rows=rows: driven.exists() and driven.read_bytes().count(b"\n") >= rows, f"{rows} drives")
            assert process.poll() is None, "it is killed in the middle"
            process.kill()
            process.wait()
            until(lambda session=process.pid: not _left_of(session), "workers and sandboxes end with it")
    driven.write_bytes(driven.read_bytes()[:-17])  # as if the last write had been cut off by a power failure
    assert finish(make_run(out, dataset, spec)) == outcome(undisturbed)


def _left_of(session: int) -> list[str]:
    """Processes of a session that live on."""
    left: list[str] = []
    for entry in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = entry.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[3]) == session and fields[0] != "Z":
            left.append(entry.parent.name)
    return left


def test_a_full_disk_stops_the_run_and_loses_nothing(
    tmp_path: Path, dataset: Dataset, spec: str, undisturbed: Path
) -> None:
    out = tmp_path / "run"
    command = _command(dataset, spec, out)

    def small_files() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (9_000, 9_000))

    full = subprocess.run(
        command, capture_output=True, text=True, timeout=600, check=False, preexec_fn=small_files, env=_no_cache()
    )
    assert full.returncode == 1, full.stdout + full.stderr
    assert "Cannot write to" in full.stderr and "goes on where it stopped" in " ".join(full.stderr.split())
    assert not (out / "results.jsonl").exists()
    kept = {name: RowStore(out / f"{name}.jsonl", key) for name, key in (("generate", "item"), ("rollout", "key"))}
    assert kept["generate"].rows and not any(store.damaged for store in kept.values())
    assert finish(make_run(out, dataset, spec)) == outcome(undisturbed)


def _no_cache() -> dict[str, str]:
    return {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}


def test_two_runs_do_not_work_in_one_folder(tmp_path: Path, dataset: Dataset, spec: str) -> None:
    run = make_run(tmp_path / "run", dataset, spec)

    def second(standing: Any) -> None:
        with pytest.raises(ConfigError, match="Another process"):
            make_run(tmp_path / "run", dataset, spec)

    run.run(second, Effort(patience=FAST, engine=Inline))


def test_scoring_again_asks_and_drives_nothing(tmp_path: Path, dataset: Dataset, spec: str, undisturbed: Path) -> None:
    folder = tmp_path / "run"
    folder.mkdir()
    for path in undisturbed.iterdir():
        (folder / path.name).write_bytes(path.read_bytes())
    planner = Counting(spec)

    def nobody(workers: int) -> Any:
        raise AssertionError("no worker is needed")

    paper = make_run(folder, dataset, spec, planner=planner, metrics="paper").run(quiet, Effort(engine=nobody))
    assert {row["metrics"] for row in paper} == {"lampilot-paper-v1"} and planner.asked == []
    origin = make_run(folder, dataset, spec, planner=planner).run(quiet, Effort(engine=nobody))
    assert outcome(folder) == outcome(undisturbed)
    assert [row["rollout_key"] for row in paper] == [row["rollout_key"] for row in origin]
    assert any(a["ttc"] != b["ttc"] for a, b in zip(origin, paper, strict=True))
    with pytest.raises(ConfigError, match="Unknown ruler"):
        make_run(folder, dataset, spec, metrics="thumb")
