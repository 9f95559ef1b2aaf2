"""`chauffeur report` as people type it."""

from __future__ import annotations

import importlib
from pathlib import Path

import pytest
from report_folders import mixed, write_run
from small_run import Inline, quiet
from typer.testing import CliRunner

from chauffeur.bench.kernel.run import BenchRun, Effort
from chauffeur.cli.main import app


def _report(*arguments: object) -> tuple[int, str]:
    result = CliRunner().invoke(app, ["report", *map(str, arguments)])
    return result.exit_code, " ".join(result.output.split())


def test_one_run_is_reported_inside_it(tmp_path: Path) -> None:
    run = write_run(tmp_path / "run", mixed(), labels=("critic: evaluator",))
    code, said = _report(run)
    assert code == 0, said
    assert sorted(path.name for path in (run / "report").iterdir()) == ["report.html", "report.md", "report.tex"]
    assert "onboard [critic: evaluator]: did as asked in 12 of 24 items" in said
    assert "simulated drives" in said


def test_several_runs_are_reported_beside_them_or_where_asked(tmp_path: Path) -> None:
    runs = [write_run(tmp_path / name, mixed(), planner=name) for name in "ab"]
    assert _report(*runs)[0] == 0
    assert (tmp_path / "report" / "report.html").is_file()
    assert _report(*runs, "--out", tmp_path / "here", "--metrics", "paper")[0] == 0
    assert "lampilot-paper-v1" in (tmp_path / "here" / "report.md").read_text()


def test_of_a_run_of_another_benchmark_its_tables_are_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "examples"))
    right_of_way = importlib.import_module("right_of_way")
    folder, mixed_in = tmp_path / "run", write_run(tmp_path / "lampilot", mixed())
    BenchRun(folder, right_of_way.RightOfWay(), right_of_way.Polite()).run(quiet, Effort(engine=Inline))
    code, said = _report(folder)
    assert code == 0, said
    for line in (folder / "table.md").read_text(encoding="utf-8").splitlines():
        assert " ".join(line.split()) in said
    assert "report.json" in said
    assert "LaMPilot-Bench alone" in said
    assert not (folder / "report").exists()
    code, said = _report(folder, mixed_in)
    assert code == 2, "they cannot be compared"
    assert "right-of-way-v1" in said


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nowhere"], "No such run folder"),
        (["run", "--metrics", "inches"], "Unknown ruler 'inches'"),
        (["run", "run"], "given twice"),
        (["run", "other", "--inspect", "x.eval"], "holds one run"),
        (["run", "other"], "different rulers"),
        (["run", "--data", "nowhere"], "No such data folder"),
    ],
)
def test_bad_input_is_named_and_nothing_is_written(tmp_path: Path, arguments: list[str], said: str) -> None:
    write_run(tmp_path / "run", mixed())
    write_run(tmp_path / "other", mixed(), ruler="lampilot-paper-v1")
    before = sorted(tmp_path.rglob("*"))
    spelled = [word if word.startswith("-") or word in ("inches", "x.eval") else tmp_path / word for word in arguments]
    code, output = _report(*spelled)
    assert code == 2
    assert said in output and "Hint:" in output
    assert sorted(tmp_path.rglob("*")) == before
