"""The Inspect log, read back with Inspect's own reader where that is installed."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest
from report_folders import HOSTILE, mixed, outcome, write_run

from chauffeur.bench.lampilot.report import summarise
from chauffeur.bench.report.inspect_log import FORMATS, log_content, write_inspect_log
from chauffeur.bench.report.runs import Run, load_run
from chauffeur.bench.report.tables import RowSampling
from chauffeur.concept import ConfigError, DataError, MissingExtraError

HOW = RowSampling(draws=200)
INSTALLED = importlib.util.find_spec("inspect_ai") is not None
needs_inspect = pytest.mark.skipif(
    not INSTALLED, reason='Inspect AI is not installed: pip install "chauffeur[inspect]"'
)


@pytest.fixture
def run(tmp_path: Path) -> Run:
    labels = ("critic: evaluator",)
    return load_run(write_run(tmp_path / "run", mixed(), labels=labels, command=HOSTILE, row={"cost_usd": 0.01}))


def test_every_item_is_a_sample_with_its_result(run: Run) -> None:
    log = log_content(run, HOW)
    assert [sample["id"] for sample in log["samples"]] == [row["item"] for row in run.rows]
    assert {"simulated drives", "critic: evaluator"} <= set(log["eval"]["tags"])
    metrics = log["results"]["scores"][0]["metrics"]
    summary = summarise("all", run.rows)
    assert metrics["driving_score"]["value"] == pytest.approx(summary.driving_score)
    assert metrics["completion"]["value"] == pytest.approx(summary.completion)
    assert metrics["completion"]["metadata"]["low_95"] < summary.completion
    broken = [sample for sample in log["samples"] if "error" in sample]
    assert len(broken) == sum(row["infra_failed"] for row in run.rows)
    assert log["results"]["completed_samples"] == len(run.rows) - len(broken)


def test_nothing_completed_is_no_metric(tmp_path: Path) -> None:
    run = load_run(write_run(tmp_path / "run", [[outcome("timeout")]]))
    metrics = log_content(run, HOW)["results"]["scores"][0]["metrics"]
    assert "ttc" not in metrics and metrics["driving_score"]["value"] == 0.0


def test_a_log_has_a_known_ending(run: Run, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="no name for an Inspect log"):
        write_inspect_log(tmp_path / "log.csv", run, HOW)


@pytest.mark.skipif(INSTALLED, reason="Inspect AI is installed here")
def test_without_inspect_the_command_that_installs_it_is_named(run: Run, tmp_path: Path) -> None:
    with pytest.raises(MissingExtraError) as error:
        write_inspect_log(tmp_path / "log.eval", run, HOW)
    assert error.value.hint.endswith('[inspect]"')
    assert list(tmp_path.glob("*log.eval*")) == []


@needs_inspect
@pytest.mark.parametrize("suffix", FORMATS)
def test_inspect_reads_it_back(run: Run, tmp_path: Path, suffix: str) -> None:
    from inspect_ai.log import read_eval_log

    path = write_inspect_log(tmp_path / "deep" / f"log{suffix}", run, HOW)
    log = read_eval_log(str(path))
    assert log.status == "success"
    assert log.eval.task == "chauffeur/lampilot"
    assert set(log.eval.tags or ()) >= {"simulated drives", "critic: evaluator"}
    assert log.results is not None and log.samples is not None
    (score,) = log.results.scores
    assert score.metrics["driving_score"].value == pytest.approx(summarise("all", run.rows).driving_score)
    by_id = {sample.id: sample for sample in log.samples}
    for row in run.rows:
        sample = by_id[row["item"]]
        assert sample.input == row["command"]
        assert sample.scores is not None
        value = sample.scores["lampilot"].value
        assert isinstance(value, dict)
        assert value["success"] == row["success"] and value["score"] == row["score"]
        assert sample.scores["lampilot"].answer == row["outcome"]
        assert sample.messages[-1].role == "assistant" and "yield autopilot()" in sample.messages[-1].text
        assert sum(usage.input_tokens for usage in sample.model_usage.values()) == row["prompt_tokens"]
        assert (sample.error is not None) == row["infra_failed"]
    assert [name.name for name in path.parent.iterdir()] == [path.name]


@needs_inspect
def test_a_folder_that_cannot_be_written_is_said(run: Run, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(DataError, match="cannot be written"):
        write_inspect_log(tmp_path / "file" / "log.eval", run, HOW)
