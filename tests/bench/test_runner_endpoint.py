"""A run against a model behind a real HTTP server on loopback: paced, within its budget, going on after anything."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from coached_data import server_module
from typer.testing import CliRunner

from chauffeur.bench.kernel.budget import Price, SpendingBudget
from chauffeur.bench.kernel.run import Effort
from chauffeur.bench.report.runs import load_run
from chauffeur.cli.main import app
from chauffeur.planners.registry import make_planner
from chauffeur.worlds.highway.dblv1 import Dataset
from processes import started, until
from small_run import COMMANDS, FAST, LEFT, SEEDS, Inline, make_data, make_run, quiet

pytestmark = [pytest.mark.slow, pytest.mark.server, pytest.mark.timeout(1200)]

MODEL = server_module()
REPLY = f"Thoughts: Left.\n\n```python{LEFT.format(patience=1)}```\n"


@dataclass
class Endpoint:
    """Answers after a while, refuses more than so many at a time, and does as its script says first."""

    latency_s: float = 0.0
    cap: int = 10**9
    faults: list[Any] = field(default_factory=list)
    answered: int = 0
    refused: int = 0
    busiest: int = 0
    busy: int = 0
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def __call__(self, exchange: Any) -> None:
        with self._lock:
            fault = self.faults.pop(0) if self.faults else None
            refuse = fault is None and self.busy >= self.cap
            self.refused += refuse
            self.busy += not refuse
            self.busiest = max(self.busiest, self.busy)
        if refuse:
            MODEL.fails(429, "Too many at a time.")(exchange)
            return
        if fault is None:
            exchange.pause(self.latency_s)
        with self._lock:
            self.busy -= 1  # before the client can know and send the next
            self.answered += fault is None
        (fault or MODEL.whole(REPLY))(exchange)


@pytest.fixture
def server() -> Iterator[Any]:
    running = MODEL.ModelServer()
    yield running
    running.close()


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return make_data(tmp_path_factory.mktemp("endpoint") / "data")


@pytest.fixture(scope="module")
def few(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return make_data(tmp_path_factory.mktemp("endpoint") / "few", SEEDS[:2])


def _planner(server: Any) -> Any:
    return make_planner("openai/m", base_url=server.url, attempts=1, stream=False, cache=False)


def _rows(folder: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (folder / "results.jsonl").read_text().splitlines()]


def test_an_endpoint_that_takes_few_at_a_time_loses_no_item(tmp_path: Path, server: Any, dataset: Dataset) -> None:
    endpoint = Endpoint(0.05, cap=5)
    server.script(endpoint)
    run = make_run(tmp_path / "run", dataset, "openai/m", planner=_planner(server))
    seen: list[Any] = []
    rows = run.run(seen.append, Effort(engine=Inline, concurrency=64))
    assert not any(row["infra_failed"] for row in rows) and run.halt is None
    assert endpoint.busiest == 5 and endpoint.answered == 30
    assert endpoint.refused < 60
    assert {row["prompt_tokens"] for row in rows} == {1000}
    assert all(row["latency_s"] >= 0.05 for row in rows)
    assert seen[-1].done == seen[-1].planned == 30 and seen[-1].requests == 30 + endpoint.refused
    assert seen[-1].completion == pytest.approx(sum(row["success"] for row in rows) / 30)


def test_faults_that_pass_are_not_seen_in_the_results(tmp_path: Path, server: Any, dataset: Dataset) -> None:
    clean = make_run(tmp_path / "clean", dataset, "openai/m", planner=_planner(server))
    server.script(Endpoint())
    expected = clean.run(quiet, Effort(engine=Inline))
    endpoint = Endpoint(0.01)
    endpoint.faults = [
        MODEL.fails(429, "Slow down.", retry_after_ms="50"),
        MODEL.fails(500, "Oops."),
        MODEL.fails(503, "Overloaded."),
        MODEL.body(b"{}", "application/json"),
        MODEL.body(b"not json", "application/json"),
        MODEL.reset_after(),
        MODEL.whole(None),
    ]
    server.script(endpoint)
    run = make_run(tmp_path / "run", dataset, "openai/m", planner=_planner(server))
    rows = run.run(quiet, Effort(engine=Inline, patience=FAST, concurrency=4))
    same = [name for name in rows[0] if name not in ("latency_s", "prompt_tokens", "completion_tokens")]
    failed = [row for row in rows if row["infra_failed"]]
    assert len(failed) <= 1, "two attempts are enough for all but one in a burst"
    rows = make_run(tmp_path / "run", dataset, "openai/m", planner=_planner(server)).run(quiet, Effort(engine=Inline))
    assert [[row[name] for name in same] for row in rows] == [[row[name] for name in same] for row in expected]


def test_an_asked_wait_is_kept(tmp_path: Path, server: Any, dataset: Dataset) -> None:
    endpoint = Endpoint(0.0, faults=[MODEL.fails(429, "Wait.", retry_after="2")])
    server.script(endpoint)
    run = make_run(tmp_path / "run", dataset, "openai/m", items=2, planner=_planner(server))
    started = time.monotonic()
    rows = run.run(quiet, Effort(engine=Inline, concurrency=1))
    assert time.monotonic() - started >= 2.0
    assert not any(row["infra_failed"] for row in rows)


def test_budgets_in_requests_and_money_go_on_with_larger_ones(tmp_path: Path, server: Any, dataset: Dataset) -> None:
    endpoint = Endpoint(0.01)
    server.script(endpoint)
    price = Price(100.0, 1000.0)  # 1000 tokens in, 200 out: 0.3 USD a plan
    folder = tmp_path / "run"

    def go(budget: SpendingBudget) -> Any:
        run = make_run(folder, dataset, "openai/m", planner=_planner(server))
        run.run(quiet, Effort(engine=Inline, budget=budget, price=price))
        return run

    first = go(SpendingBudget(max_requests=7))
    assert first.halt is not None and first.halt.budget
    assert endpoint.answered in (6, 7) and first.unasked == 30 - endpoint.answered
    rows = _rows(folder)
    assert len(rows) == 30 - first.unasked, "one row for each item that was asked"
    assert f"Partial: {len(rows)} of 30 items" in (folder / "table.md").read_text()

    second = go(SpendingBudget(max_usd=5.0))
    assert second.halt is not None and "5 USD" in second.halt.why
    assert endpoint.answered == 16, "what was spent before counts: 16 x 0.3 = 4.8"
    last = go(SpendingBudget(max_usd=9.01, max_requests=30))
    assert last.halt is None and last.unasked == 0 and endpoint.answered == 30
    assert sum(row["cost_usd"] for row in _rows(folder)) == pytest.approx(9.0)
    assert "Partial" not in (folder / "table.md").read_text()


def _options(dataset: Dataset, server: Any, out: Path, *more: str) -> list[str]:
    where = ["--data", str(dataset.path), "--planner", "openai/m", "--base-url", server.url, "--out", str(out)]
    return ["bench", "lampilot", *where, "--workers", "1", *more]


@pytest.fixture
def command(monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[int, str]]:
    """Runs the command in this process: its exit code and words."""
    monkeypatch.setattr("chauffeur.bench.kernel.engine.LocalEngine", Inline)

    def run(dataset: Dataset, server: Any, out: Path, *more: str) -> tuple[int, str]:
        done = CliRunner().invoke(app, _options(dataset, server, out, *more))
        return done.exit_code, " ".join(done.output.split())

    return run


def test_the_command_says_that_its_budget_is_used_up(
    tmp_path: Path, server: Any, few: Dataset, command: Callable[..., tuple[int, str]]
) -> None:
    server.script(Endpoint())
    out = tmp_path / "run"
    code, said = command(few, server, out, "--max-requests", "4")
    assert code == 3, said
    assert "The budget of 4 requests is used up" in said
    assert "have not been asked" in said
    code, said = command(few, server, out, "--max-usd", "1")
    assert code == 3 and "--price IN/OUT" in said
    code, said = command(few, server, out, "--max-usd", "1", "--price", "0.1/0.4")
    assert code == 0, said
    assert not any(row["infra_failed"] for row in _rows(out))


def test_a_key_that_is_refused_stops_the_run_at_once(
    tmp_path: Path, server: Any, few: Dataset, command: Callable[..., tuple[int, str]]
) -> None:
    server.script(MODEL.fails(401, "Bad key."))
    code, said = command(few, server, tmp_path / "run")
    assert code == 1 and "401" in said, said
    assert len(server.requests) <= 16
    server.script(Endpoint())
    code, said = command(few, server, tmp_path / "run")
    assert code == 0 and not any(row["infra_failed"] for row in _rows(tmp_path / "run")), said


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_a_run_stopped_with_calls_in_flight_asks_for_nothing_twice(
    tmp_path: Path, server: Any, few: Dataset, command: Callable[..., tuple[int, str]], how: signal.Signals
) -> None:
    endpoint = Endpoint(0.4)
    server.script(endpoint)
    out = tmp_path / "run"
    chauffeur = [sys.executable, "-c", "from chauffeur.cli.main import run; run()"]
    options = _options(few, server, out, "--concurrency", "2")
    plans = out / "generate.jsonl"
    with started([*chauffeur, *options], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        until(lambda: plans.exists() and plans.read_bytes().count(b"\n") >= 3, "three answers")
        process.send_signal(how)
        text, _ = process.communicate(timeout=600)
    assert process.returncode == (130 if how == signal.SIGINT else -9), text
    if how == signal.SIGINT:
        assert "run the same command to go on" in " ".join(text.split())
    kept = plans.read_bytes().count(b"\n")
    assert 3 <= kept < len(few.items())
    until(lambda: not endpoint.busy, "calls in flight come to their ends")
    endpoint.answered, endpoint.latency_s = 0, 0.0
    code, said = command(few, server, out)
    assert code == 0, said
    assert endpoint.answered <= len(few.items()) - kept, "what was answered and stored is not asked again"
    asked = [json.loads(line)["item"] for line in plans.read_text().splitlines()]
    assert len(asked) == len(set(asked)) == len(few.items())
    rows = _rows(out)
    assert len(rows) == len(asked) and not any(row["infra_failed"] for row in rows)
    assert {row["command"] for row in rows if row["success"]} == set(COMMANDS)


def test_the_conversation_of_an_item_is_kept_with_its_repair(tmp_path: Path, server: Any, few: Dataset) -> None:
    server.script(
        MODEL.whole("Thoughts: Up.\n\n```python\ndef go():\n    fly()\n    yield autopilot()\n```\n"), Endpoint()
    )
    make_run(tmp_path / "run", few, "openai/m", items=2, planner=_planner(server)).run(
        quiet, Effort(engine=Inline, concurrency=1)
    )
    run = load_run(tmp_path / "run")
    systems = run.stage("systems", "sha256")
    assert len(systems) == 1, "both items were told the same, which is stored once"
    told = [run.turns(answer, systems) for answer in run.stage("generate", "item").values()]
    roles = sorted(([turn["role"] for turn in turns] for turns in told), key=len)
    assert roles == [["system", "user", "assistant"], ["system", "user", "assistant", "user", "assistant"]]
    repaired = max(told, key=len)
    assert "set_target_lane" in repaired[0]["text"] and any(words in repaired[1]["text"] for words in COMMANDS)
    assert "fly()" in repaired[2]["text"] and "fly" in repaired[3]["text"] and repaired[4]["text"] == REPLY


def test_rows_can_be_read_while_a_run_goes_on(tmp_path: Path, server: Any, few: Dataset) -> None:
    server.script(Endpoint())
    folder = tmp_path / "run"
    seen: list[tuple[str, int]] = []

    def watch(standing: Any) -> None:
        if (folder / "live.jsonl").is_file():
            run = load_run(folder)
            seen.append((run.state, run.done))

    run = make_run(folder, few, "openai/m", items=4, planner=_planner(server))
    rows = run.run(watch, Effort(engine=Inline, concurrency=1))
    assert seen and {state for state, _ in seen} == {"running"} and seen[-1][1] >= seen[0][1]
    assert not (folder / "live.jsonl").exists()
    done = load_run(folder)
    assert (done.state, list(done.rows)) == ("finished", rows)
