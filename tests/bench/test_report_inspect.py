"""The Inspect log, read back with Inspect's own reader where that is installed."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

from chauffeur.bench.lampilot.benchmark import LampilotBenchmark
from chauffeur.bench.lampilot.report import COMPLETION, SCORE_TABLE
from chauffeur.bench.report.inspect_log import FORMATS, log_content, write_inspect_log
from chauffeur.bench.report.runs import Run, load_run
from chauffeur.concept import ConfigError, DataError, MissingExtraError
from report_folders import HOSTILE, mixed, outcome, write_run

INSTALLED = importlib.util.find_spec("inspect_ai") is not None
needs_inspect = pytest.mark.skipif(
    not INSTALLED, reason='Inspect AI is not installed: pip install "chauffeur-lab[inspect]"'
)


@pytest.fixture
def run(tmp_path: Path) -> Run:
    labels = ("critic: evaluator",)
    return load_run(write_run(tmp_path / "run", mixed(), labels=labels, command=HOSTILE, row={"cost_usd": 0.01}))


def test_every_item_is_a_sample_with_its_result(run: Run) -> None:
    log = log_content(run, SCORE_TABLE)
    assert [sample["id"] for sample in log["samples"]] == [f"{row['item']}#{n}" for n, row in enumerate(run.rows)]
    assert {"simulated drives", "critic: evaluator"} <= set(log["eval"]["tags"])
    metrics = log["results"]["scores"][0]["metrics"]
    completion = COMPLETION.aggregate(run.rows, "sample")
    assert metrics["lampilot-completion-v1"]["value"] == completion.value == 0.5
    assert metrics["lampilot-completion-v1"]["metadata"]["low_95"] == completion.low
    broken = [sample for sample in log["samples"] if "error" in sample]
    assert len(broken) == sum(row["infra_failed"] for row in run.rows)
    assert log["results"]["completed_samples"] == len(run.rows) - len(broken)


def test_nothing_completed_is_no_metric(tmp_path: Path) -> None:
    run = load_run(write_run(tmp_path / "run", [[outcome("timeout")]]))
    metrics = log_content(run, SCORE_TABLE)["results"]["scores"][0]["metrics"]
    assert "lampilot-table-ttc-v1" not in metrics and metrics["lampilot-driving-score-v1"]["value"] == 0.0


def test_a_log_has_a_known_ending(run: Run, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="no name for an Inspect log"):
        write_inspect_log(tmp_path / "log.csv", run, LampilotBenchmark)


@pytest.mark.skipif(INSTALLED, reason="Inspect AI is installed here")
def test_without_inspect_the_command_that_installs_it_is_named(run: Run, tmp_path: Path) -> None:
    with pytest.raises(MissingExtraError) as error:
        write_inspect_log(tmp_path / "log.eval", run, LampilotBenchmark)
    assert error.value.hint.endswith('[inspect]"')
    assert list(tmp_path.glob("*log.eval*")) == []


@needs_inspect
@pytest.mark.parametrize("suffix", FORMATS)
def test_inspect_reads_it_back(run: Run, tmp_path: Path, suffix: str) -> None:
    from inspect_ai.log import read_eval_log

    path = write_inspect_log(tmp_path / "deep" / f"log{suffix}", run, LampilotBenchmark)
    log = read_eval_log(str(path))
    assert log.status == "success"
    assert log.eval.task == "chauffeur/lampilot-bench-v2"
    assert set(log.eval.tags or ()) >= {"simulated drives", "critic: evaluator"}
    assert log.results is not None and log.samples is not None
    (score,) = log.results.scores
    assert score.metrics["lampilot-completion-v1"].value == 0.5
    by_id = {sample.id: sample for sample in log.samples}
    for number, row in enumerate(run.rows):
        sample = by_id[f"{row['item']}#{number}"]
        assert sample.input == row["command"]
        assert sample.scores is not None
        value = sample.scores["lampilot-bench-v2"].value
        assert isinstance(value, dict)
        assert value["lampilot-completion-v1"] == row["success"]
        assert sample.scores["lampilot-bench-v2"].answer == row["outcome"].replace("_", " ")
        assert sample.messages[-1].role == "assistant" and "yield autopilot()" in sample.messages[-1].text
        assert sum(usage.input_tokens for usage in sample.model_usage.values()) == row["prompt_tokens"]
        assert (sample.error is not None) == row["infra_failed"]
    assert [name.name for name in path.parent.iterdir()] == [path.name]


@needs_inspect
def test_a_folder_that_cannot_be_written_is_said(run: Run, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(DataError, match="cannot be written"):
        write_inspect_log(tmp_path / "file" / "log.eval", run, LampilotBenchmark)
