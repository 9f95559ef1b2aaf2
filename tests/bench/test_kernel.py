"""The kernel proves itself on a benchmark of questions that a stranger wrote, through the door for strangers."""

from __future__ import annotations

import importlib
import json
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from typer.testing import CliRunner

from chauffeur.bench.faithfulness import FaithfulnessBenchmark
from chauffeur.bench.hostile import HostileBenchmark, HostileConfig
from chauffeur.bench.kernel.benchmark import GROUP, make_benchmark
from chauffeur.bench.kernel.calls import Patience
from chauffeur.bench.kernel.conformance import faults
from chauffeur.bench.kernel.metrics import TableSpec, mean, share
from chauffeur.bench.kernel.report import fill
from chauffeur.bench.kernel.run import BenchRun, Effort
from chauffeur.bench.kernel.shards import Shard
from chauffeur.bench.lampilot import lampilot
from chauffeur.cli.main import app
from chauffeur.concept import ConfigError, PlannerError
from chauffeur.concept.registry import plugin_names
from chauffeur.planners.keyword import KeywordPlanner
from small_run import Inline, make_data, quiet

ROOT = Path(__file__).resolve().parents[2]
EFFORT = Effort(engine=Inline, patience=Patience(attempts=1))


@pytest.fixture
def stranger(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The example, installed as a package of somebody else's."""
    meta = tmp_path / "site" / "stranger-1.0.dist-info"
    meta.mkdir(parents=True)
    (meta / "METADATA").write_text("Metadata-Version: 2.1\nName: stranger\nVersion: 1.0\n")
    points = f"[{GROUP}]\nright-of-way = right_of_way:RightOfWay\n"
    (meta / "entry_points.txt").write_text(f"{points}[chauffeur.planners]\npolite = right_of_way:Polite\n")
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    monkeypatch.syspath_prepend(str(ROOT / "examples"))
    return importlib.import_module("right_of_way")


def test_a_strangers_benchmark_runs_by_its_name(stranger: ModuleType, tmp_path: Path) -> None:
    assert "right-of-way" in plugin_names(GROUP)
    command = ["bench", "right-of-way", "--planner", "polite", "--out", str(tmp_path / "run"), "--workers", "1"]
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0, done.output
    rows = [json.loads(line) for line in (tmp_path / "run" / "results.jsonl").read_text().splitlines()]
    assert {row["item"]: row["right"] for row in rows} == dict.fromkeys(("q1", "q2", "q3"), True)
    assert {(row["bench"], row["planner"], row["model"]) for row in rows} == {
        ("right-of-way-v1", "polite", "polite-v1")
    }
    assert "| all | 3 | 100.0 [29.2, 100.0] |" in (tmp_path / "run" / "table.md").read_text()
    (table,) = json.loads((tmp_path / "run" / "report.json").read_text())["tables"]
    assert table["lines"][-1]["metrics"]["right-of-way-right-v1"]["value"] == 1.0
    assert "right-of-way" in CliRunner().invoke(app, ["bench", "--help"]).output
    wrong = CliRunner().invoke(app, [*command[:-4], "--out", str(tmp_path / "x"), "-o", "colour=red"])
    assert wrong.exit_code == 2, wrong.output


def test_who_cannot_answer_is_not_asked(stranger: ModuleType, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="asks for words"):
        BenchRun(tmp_path / "run", stranger.RightOfWay(), KeywordPlanner())
    bench = HostileBenchmark(HostileConfig("polite", a_kind=1))
    with pytest.raises(ConfigError, match="asks for plans"):
        BenchRun(tmp_path / "run", bench, stranger.Polite())


def test_a_run_goes_on_where_it_stopped_and_its_shards_are_the_whole(stranger: ModuleType, tmp_path: Path) -> None:
    class Tired(stranger.Polite):
        left = 2
        asked: list[str] = []  # noqa: RUF012

        async def write(self, messages: Any) -> Any:
            self.asked.append(messages[-1]["content"])
            if len(self.asked) > self.left:
                raise PlannerError("Tired.")
            return await super().write(messages)

    folder, bench = tmp_path / "run", stranger.RightOfWay()
    run = BenchRun(folder, bench, Tired())
    assert len(run.run(quiet, EFFORT)) == 2 and run.spoiled == 1
    Tired.left = 99
    again = BenchRun(folder, bench, Tired())
    rows = again.run(quiet, EFFORT)
    assert (len(rows), len(Tired.asked), again.spoiled) == (3, 4, 0)
    parts = [BenchRun(tmp_path / str(n), bench, Tired(), shard=Shard(n, 2)).run(quiet, EFFORT) for n in (1, 2)]
    assert sorted(row["item"] for part in parts for row in part) == [row["item"] for row in rows]
    other = stranger.RightOfWay()
    other.config = {"questions": 9}
    with pytest.raises(ConfigError, match="another configuration"):
        BenchRun(folder, other, Tired())


def test_the_whole_takes_over_what_its_shards_have_done(stranger: ModuleType, tmp_path: Path) -> None:
    bench, folder = stranger.RightOfWay(), tmp_path / "run"
    whole = BenchRun(tmp_path / "whole", bench, stranger.Polite()).run(quiet, EFFORT)
    for shard in (Shard(1, 2), Shard(2, 2)):
        BenchRun(folder / shard.folder, bench, stranger.Polite(), shard=shard).run(quiet, EFFORT)

    class Silent(stranger.Polite):
        async def write(self, messages: Any) -> Any:
            raise AssertionError("asked again")

    assert BenchRun(folder, bench, Silent()).run(quiet, EFFORT) == whole
    for name in ("results.jsonl", "table.md", "report.json"):
        assert (folder / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()


def test_a_shard_of_another_run_is_passed_over(stranger: ModuleType, tmp_path: Path) -> None:
    other, shard = stranger.RightOfWay(), Shard(1, 1)
    other.config = {"questions": 9}
    BenchRun(tmp_path / "run" / shard.folder, other, stranger.Polite(), shard=shard).run(quiet, EFFORT)

    class Counting(stranger.Polite):
        asked = 0

        async def write(self, messages: Any) -> Any:
            Counting.asked += 1
            return await super().write(messages)

    assert len(BenchRun(tmp_path / "run", stranger.RightOfWay(), Counting()).run(quiet, EFFORT)) == Counting.asked == 3


def test_damaged_rows_are_told_and_done_again(stranger: ModuleType, tmp_path: Path) -> None:
    run = BenchRun(tmp_path / "run", stranger.RightOfWay(), stranger.Polite())
    rows = run.run(quiet, EFFORT)
    path = tmp_path / "run" / "generate.jsonl"
    path.write_bytes(path.read_bytes().replace(b'"item":"q2"', b'"item":"q9"'))
    again = BenchRun(tmp_path / "run", stranger.RightOfWay(), stranger.Polite())
    assert (again.damaged, again.unasked) == ({"generate.jsonl": 1}, 1)
    assert again.run(quiet, EFFORT) == rows


def test_the_built_in_benchmarks_and_the_example_conform(stranger: ModuleType, tmp_path: Path) -> None:
    data = make_data(tmp_path / "data", seeds=(17,))
    for bench in (
        stranger.RightOfWay(),
        FaithfulnessBenchmark(2),
        HostileBenchmark(HostileConfig("keyword", a_kind=1)),
        lampilot(str(data.path), "keyword"),
        lampilot(str(data.path), "idm"),
    ):
        assert faults(bench) == [], bench.id


def test_what_does_not_conform_is_said(stranger: ModuleType) -> None:
    @dataclass(frozen=True)
    class Thin:
        right: bool

    class Bad(stranger.RightOfWay):
        id = "bad"
        asks = "plans"
        row = Thin
        config = {"seed": object()}  # noqa: RUF012

        def items(self) -> Any:
            return (*super().items(), super().items()[0])

    found = " ".join(faults(Bad()))
    for fault in ("no version", "no JSON", "one id", "asks for plans with a list"):
        assert fault in found


def test_the_registry_refuses_a_second_metric_of_one_id() -> None:
    first = mean("test-length-v1", "length", "m", lambda row: row["length_m"])
    with pytest.raises(ConfigError, match="test-length-v1"):
        mean("test-length-v1", "width", "m", lambda row: row["width_m"])
    rows = [{"item": str(n), "length_m": None if n == 0 else float(n)} for n in range(12)]
    found = first.aggregate(rows)
    assert found.value == pytest.approx(6.0), "a row to which it does not apply is left out"
    assert found.low is not None and found.high is not None and found.low < 6.0 < found.high


def test_tables_resample_whole_clusters() -> None:
    good = share("test-good-v1", "good", lambda row: row["good"])
    rows = [{"item": str(n), "scene": str(n // 10), "good": n // 10 % 2 == 0} for n in range(200)]
    spec = TableSpec("", (good,), cluster="scene")
    (whole,) = fill(spec, rows).lines
    (wide,) = whole.found
    ((narrow,),) = (line.found for line in fill(replace(spec, cluster="item"), rows).lines)
    assert whole.items == 200 and wide.value == narrow.value == 0.5
    assert wide.high is not None and wide.low is not None and narrow.high is not None and narrow.low is not None
    assert wide.high - wide.low > 2.0 * (narrow.high - narrow.low)


def test_an_unknown_benchmark_names_the_nearest() -> None:
    with pytest.raises(ConfigError, match="Unknown benchmark"):
        make_benchmark("hostle")
