from __future__ import annotations

import inspect
import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from typer.testing import CliRunner

from chauffeur.bench.openloop import OpenLoopBenchmark
from chauffeur.cli.lab.bench_plugin import command_of
from chauffeur.cli.main import app
from chauffeur.concept.registry import load_plugin
from chauffeur.worlds.highway.scenarios import BUILT_IN


@pytest.fixture
def data(tmp_path: Path) -> Path:
    folder = tmp_path / "data"
    folder.mkdir()
    scenario = next(s for s in BUILT_IN if s.id == "following")
    samples = [
        {"env": scenario.config, "eval": {"type": "ACCEvalbySpeed", "speed": 5}, "seed": seed}
        for seed in (9, 19, 23, 24, 25, 29)
    ]
    (folder / "dec_abs_speed5.json").write_text(json.dumps({"commands": ["Go at 5 m/s."], "samples": samples}))
    return folder


def test_bad_options_are_named(data: Path, tmp_path: Path) -> None:
    runner = CliRunner()
    for arguments in (
        ["--data", str(tmp_path / "nowhere")],
        ["--data", str(data), "--planner", "onbord"],
        ["--data", str(data), "--setting", "ten-shot"],
    ):
        assert runner.invoke(app, ["bench", "lampilot", *arguments]).exit_code != 0


@pytest.mark.slow
def test_ctrl_c_keeps_what_is_done_and_the_same_command_goes_on(data: Path, tmp_path: Path) -> None:
    out = tmp_path / "run"
    command = [sys.executable, "-c", "from chauffeur.cli.main import run; run()", "bench", "lampilot"]
    command += ["--data", str(data), "--planner", "idm", "--out", str(out), "--workers", "1"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    rows = out / "rollout.jsonl"
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline and not (rows.exists() and rows.read_text().count("\n") >= 2):
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    text, _ = process.communicate(timeout=600)
    assert process.returncode == 130, text
    assert "run the same command to go on" in " ".join(text.split())
    kept = rows.read_text().splitlines()
    assert 2 <= len(kept) < 6

    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert rows.read_text().splitlines()[: len(kept)] == kept
    results = [json.loads(line) for line in (out / "results.jsonl").read_text().splitlines()]
    assert len(results) == 6
    assert "paper: Human driver" in done.stdout


@pytest.mark.parametrize("name", ["faithfulness", "hostile", "leaderboard", "motion", "openloop", "personalization"])
def test_the_options_of_a_benchmark_are_those_it_states(name: str) -> None:
    """Each parameter of its class or function, with its default and the sentence of its docstring."""
    make = load_plugin("chauffeur.benchmarks", name)
    options = {one.name: one for one in command_of(name).params}
    stated = dict(inspect.signature(make).parameters)
    if "options" in stated:  # handed on to the class that is made
        del stated["options"]
        stated = {**inspect.signature(OpenLoopBenchmark).parameters, **stated}
    for parameter in stated.values():
        option = options[parameter.name]
        assert option.required == (parameter.default is inspect.Parameter.empty)
        assert option.required or option.default == parameter.default
        assert option.help, parameter.name
    assert {"out", "workers", "shard", "ray"} <= set(options)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("bench faithfulness --bogus 1", "No such option"),
        ("bench personalization --half other", "other"),
        ("bench nuplanqa --planner keyword", "--data"),
        ("bench leaderboard --seeds a,b", "no seeds"),
        ("bench faithfulnes", "faithfulness"),
    ],
)
def test_a_slip_in_an_option_is_said(line: str, said: str) -> None:
    result = CliRunner().invoke(app, line.split())
    assert result.exit_code == 2 and said in " ".join(result.output.split()), result.output
