"""`chauffeur bench coach` with a person at a terminal, and `chauffeur model policies` on what it left behind."""

from __future__ import annotations

import os
import re
import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

sys.path.append(str(Path(__file__).resolve().parents[1] / "bench"))

from coached_data import DESCRIPTION, GO_LEFT, IDLE, USE_IT, make_data, reply, server_module
from terminal import WITHIN_S, at_a_terminal, until

from chauffeur.cli.main import app
from chauffeur.memory.policies import PolicyRepository

MODEL = server_module()
stream = MODEL.stream
# A test run started in the background has Ctrl-C ignored, and its children would inherit that.
RUN = (
    "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); from chauffeur.cli.main import run; run()"
)
COMMAND = [sys.executable, "-c", RUN, "bench", "coach"]


@pytest.fixture
def server() -> Iterator[Any]:
    running = MODEL.ModelServer()
    yield running
    running.close()


@pytest.fixture
def options(tmp_path: Path, server: Any, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    make_data(tmp_path / "data")
    return [
        "--data", str(tmp_path / "data"), "--planner", "openai/m", "--base-url", server.url,
        "--repository", str(tmp_path / "policies"), "--out", str(tmp_path / "run"), "--ids", "left_lc_s0_c0",
    ]  # fmt: skip


def plain(text: str) -> str:
    return " ".join(re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", text).split())


@pytest.mark.server
@pytest.mark.slow
def test_a_person_at_the_terminal(server: Any, options: list[str], tmp_path: Path) -> None:
    server.script(stream(reply(IDLE)), stream(reply(GO_LEFT)), stream(DESCRIPTION))
    with at_a_terminal([*COMMAND, *options]) as (process, screen):
        shown = plain(until(process, screen, "How was it? success, commit, skip, quit, or say what was wrong"))
        assert "critic: person; simulated drives" in shown and "; time or road ran out" in shown and "def idle" in shown
        assert (tmp_path / "run" / "drives" / "left_lc_s0_c0-1.html").stat().st_size > 10_000
        os.write(screen, b"You never changed lane.\n")
        assert "round 2" in until(process, screen, "How was it?")
        process.send_signal(signal.SIGINT)  # while it waits for an answer
        until(process, screen, "run the same command to go on")
        assert process.wait(WITHIN_S) == 130
    assert "The passenger says: You never changed lane." in server.requests[1].body["messages"][-1]["content"]

    with at_a_terminal([*COMMAND, *options]) as (process, screen):
        shown = plain(until(process, screen, "How was it?"))
        assert "round 2: Done after" in shown and "Changed lane to the left." in shown
        os.write(screen, b"success\n")
        until(process, screen, "kept as go_left()")
        assert process.wait(WITHIN_S) == 0
    assert len(server.requests) == 3, "nothing is asked for twice"
    (entry,) = PolicyRepository(tmp_path / "policies").entries
    assert (entry.judged_by, entry.critiques) == ("person", ("You never changed lane.",))
    assert entry.description == DESCRIPTION


@pytest.mark.server
@pytest.mark.slow
def test_the_evaluator_as_critic_is_labelled_and_the_end_of_input_keeps_what_is_done(
    server: Any, options: list[str], tmp_path: Path
) -> None:
    runner = CliRunner()
    server.script(stream(reply(IDLE)))
    stopped = runner.invoke(app, ["bench", "coach", *options], input="")
    assert stopped.exit_code == 0 and "Stopped after 0 of 1 items" in plain(stopped.output)
    server.script(stream(reply(IDLE)), stream(reply(GO_LEFT)), stream(DESCRIPTION))
    done = runner.invoke(app, ["bench", "coach", *options, "--critic", "evaluator"])
    assert done.exit_code == 0, done.output
    told = plain(done.output)
    assert told.count("critic: evaluator (not a person)") == 2 and "kept as go_left()" in told
    assert "The car never changed into the left lane." in told
    for arguments in ([], ["go_left"]):
        shown = runner.invoke(app, ["show", "policies", str(tmp_path / "policies"), *arguments])
        assert "evaluator (not a person)" in plain(shown.output), shown.output


def test_bad_options_are_named(options: list[str]) -> None:
    runner = CliRunner()
    for arguments in (["--critic", "robot"], ["--ids", "left_lc_s9_c9"], ["--ids", ""], ["--ids", "demo12"]):
        assert runner.invoke(app, ["bench", "coach", *options, *arguments]).exit_code != 0


@pytest.mark.server
def test_policies_are_listed_shown_described_shared_and_pruned(server: Any, options: list[str], tmp_path: Path) -> None:
    runner = CliRunner()

    def run(*arguments: str, answer: str | None = None) -> str:
        group = "show" if arguments[0] == "policies" else "model"
        words = arguments if group == "show" else ("policies", *arguments)
        result = runner.invoke(app, [group, *words], input=answer)
        assert result.exit_code == 0, result.output
        return plain(result.output)

    server.script(stream(reply(GO_LEFT)), stream(DESCRIPTION), stream(reply(USE_IT)), stream(DESCRIPTION))
    items = "left_lc_s0_c0,left_lc_s1_c1"
    assert runner.invoke(app, ["bench", "coach", *options, "--critic", "evaluator", "--ids", items]).exit_code == 0
    folder = str(tmp_path / "policies")
    listed = run("policies", folder, "--for", "to the left please")
    assert "go_left()" in listed and "left_and_say_so()" in listed and "Change lanes to the left." in listed
    shown = run("policies", folder, "go_left")
    assert "by the model" in shown and "def go_left():" in shown and "left_lc_s0_c0" in shown and "openai/m" in shown
    assert "Moves over." in run("describe", folder, "go_left", "Moves over.")
    assert "by a person" in run("policies", folder, "go_left")

    out = tmp_path / "team.jsonl"
    assert "1 programs written" in run("export", folder, str(out), "go_left")
    with out.open("ab") as file:
        file.write(b'{"schema": "chauffeur-policy-v1", "name": "\x1b[2J"}\n')
    told = run("add", str(tmp_path / "mine"), str(out))
    assert "1 programs added" in told and "not believed" in told
    told = run("add", str(tmp_path / "all"), folder, str(tmp_path / "mine"))
    assert "policies: 2 programs added, 0 known already." in told and "mine: 0 programs added, 1 known already." in told
    assert "received from policies" in run("policies", str(tmp_path / "all"), "go_left")

    assert runner.invoke(app, ["model", "policies", "prune", folder, "go_left"], input="n\n").exit_code != 0
    assert len(PolicyRepository(Path(folder)).entries) == 2
    assert "1 programs taken out" in run("prune", folder, "go_left", answer="y\n")
    assert "Nothing to take out." in run("prune", folder, "--judged-by", "person")
    assert "1 programs taken out; 0 are left" in run("prune", folder, "--judged-by", "evaluator", "--yes")
    missing = runner.invoke(app, ["show", "policies", str(tmp_path / "nowhere")])
    assert missing.exit_code != 0
