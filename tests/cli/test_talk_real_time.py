"""`chauffeur talk` in real time: given wishes in turn, the wheel, how it ends, and a session that was killed."""

from __future__ import annotations

import json
import os
import pty
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from terminal import WITHIN_S, at_a_terminal, until
from typer.testing import CliRunner, Result

from chauffeur.cli.lines import MOST_CHARACTERS, Lines
from chauffeur.cli.main import app
from chauffeur.driving.recorder import unanswered
from chauffeur.safety.audit import read_records, verify

WISH = "Hold the lane for a moment."
DECLINED = "Turn into a boat."
PROGRAM = """def drive():
    say("Holding the [bold]lane[/].")
    for _ in range(10):
        yield autopilot()
"""
COMMAND = [sys.executable, "-c", "from chauffeur.cli.main import run; run()", "talk"]


@pytest.fixture(scope="module")
def answers(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Specification of a planner that needs no model."""
    path = tmp_path_factory.mktemp("answers") / "answers.jsonl"
    plan = {"thoughts": {"text": "The lane is good."}, "policy": {"kind": "program", "source": PROGRAM}}
    no = {"thoughts": {"text": ""}, "policy": None, "refusal": "A car cannot fly."}
    lines = [{"version": 1, "instruction": w, "plan": p} for w, p in ((WISH, plan), (DECLINED, no))]
    path.write_text("\n".join(json.dumps(line) for line in lines))
    return f"replay/{path}"


@pytest.fixture(scope="module")
def silent_endpoint() -> Iterator[str]:
    """A server that takes a request and never answers."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield f"http://127.0.0.1:{server.getsockname()[1]}/v1"


def invoke(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["talk", *map(str, arguments)])


def one_line(text: str) -> str:
    return " ".join(text.split())


# Before anything moves ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--scenario", "nowhere"), "Unknown scenario 'nowhere'"),
        (("--limits", "none"), "Unknown limits 'none'"),
        ((WISH, "  "), "The wish is empty"),
        (("x" * 3000,), "The wish has 3000 characters"),
        (("--duration", "0"), "--duration"),
    ],
)
def test_what_cannot_be_driven_is_said_at_once(arguments: tuple[str, ...], said: str) -> None:
    result = invoke(*arguments)
    assert result.exit_code == 2
    assert said in result.output


def test_a_log_that_cannot_be_had_is_refused_before_the_drive(tmp_path: Path) -> None:
    log = tmp_path / "no.jsonl"
    log.write_text("not a log\n")
    result = invoke("--audit", log)
    assert result.exit_code == 2
    assert "not an audit log" in result.output


def test_help_has_examples() -> None:
    result = invoke("--help")
    assert result.exit_code == 0
    assert "Examples:" in result.output


# A drive whose wishes are given ---------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def given(answers: str, tmp_path_factory: pytest.TempPathFactory) -> tuple[subprocess.CompletedProcess[str], Path]:
    """A drive with a wish as argument, and lines of a file: done, its log."""
    folder = tmp_path_factory.mktemp("given")
    log = folder / "audit.jsonl"
    wishes = folder / "wishes.txt"
    wishes.write_text(f"{DECLINED}\n\n{'x' * 3000}\nstop\nnever\n")
    command = [*COMMAND, WISH, "--planner", answers, "--audit", str(log), "--time-scale", "2", "--no-realtime"]
    with wishes.open() as lines:
        done = subprocess.run(command, stdin=lines, capture_output=True, text=True, timeout=WITHIN_S, check=False)
    return done, log


def test_what_was_asked_and_what_became_of_it_is_said(given: tuple[subprocess.CompletedProcess[str], Path]) -> None:
    done, _ = given
    said = one_line(done.stdout)
    told = [
        f"w1 asked “{WISH}”",
        "w1 thinks The lane is good.",
        "w1 says “Holding the [bold]lane[/].”",
        "w1 done",
        f"w2 asked “{DECLINED}”",
        "w2 declined A car cannot fly.",
        "The wish has 3000 characters",
        "Stopping.",
        "“never” is not asked.",
        "The car stands",
        f"“{WISH}” done",
        f"“{DECLINED}” declined",
        "periods of 50 ms were missed.",
        "As any other program (default)",
        "audit head",
    ]
    for words in told:
        assert words in said, (words, done.stdout, done.stderr)
    in_turn = [said.index(words) for words in told if words[:3] in ("w1 ", "w2 ") and "thinks" not in words]
    assert in_turn == sorted(in_turn), "one after the other"
    assert "simulated" in said
    assert "\x1b" not in done.stdout, "no colour and no moving cursor in a pipe"
    assert done.returncode == 1, "a wish was declined"


def test_quietly_it_prints_how_it_ended_alone(answers: str) -> None:
    options = ["--planner", answers, "--quiet", "--no-realtime", "--time-scale", "5", "--scenario", "cruise"]
    done = subprocess.run(
        [*COMMAND, WISH, *options], stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=WITHIN_S,
        check=False,
    )  # fmt: skip
    assert len(done.stdout.splitlines()) == 1 and "The car stands" in done.stdout, done.stdout
    assert done.returncode == 0, "the wish was driven"


def test_the_log_tells_of_every_wish(given: tuple[subprocess.CompletedProcess[str], Path]) -> None:
    _, log = given
    assert verify(log).ok
    outcomes = [record.body["outcome"] for _, record in read_records(log) if record.kind == "outcome"]
    assert outcomes == ["finished", "declined", "refused", "halt", "unasked", "stopped"]
    assert unanswered(log) == ()


# A session that is killed, and the one after it -----------------------------------------------------------------------


def test_a_killed_session_loses_no_wish(silent_endpoint: str, answers: str, tmp_path: Path) -> None:
    log = tmp_path / "audit.jsonl"
    options = ["--planner", "openai/silent", "--base-url", silent_endpoint, "--audit", str(log), "--no-realtime"]
    process = subprocess.Popen(
        [*COMMAND, "Slow down a bit.", *options],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        start_new_session=True,
        env=os.environ | {"OPENAI_API_KEY": "none"},
    )
    assert process.stdout is not None
    with process.stdout as screen:
        until(process, screen.fileno(), "Slow down a bit.")
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    assert [each.text for each in unanswered(log)] == ["Slow down a bit."]
    _type_and_interrupt(log, answers)
    assert verify(log).ok
    assert unanswered(log) == ()


def _type_and_interrupt(log: Path, answers: str) -> None:
    """Drive at a terminal with the same log: it names the lost wish, takes typed lines, and ends with Ctrl-C."""
    command = [*COMMAND, "--planner", answers, "--audit", str(log), "--no-realtime", "--time-scale", "3"]
    with at_a_terminal(command) as (process, screen):
        shown = until(process, screen, "no plan")
        assert "Without an answer since the last session: w1 “Slow down a bit.”" in shown
        os.write(screen, DECLINED.replace("over", "ovee\x7fr").encode())
        assert DECLINED in until(process, screen, DECLINED), "what is typed is shown, as it was corrected"
        os.write(screen, b"\r")
        until(process, screen, "A car cannot fly.")
        for typed, answer in (
            ("take over", "You have the wheel: keys move the car"),
            ("brake", "you have the wheel"),
            (WISH, "You have the wheel; give it back"),
            ("give back", "The car has the wheel again."),
            (WISH, "The lane is good."),
        ):
            os.write(screen, f"{typed}\r".encode())
            assert answer in until(process, screen, answer)
        process.send_signal(signal.SIGINT)
        assert "The car stands" in until(process, screen, "audit head")
        assert process.wait(WITHIN_S) == 130


# Lines ----------------------------------------------------------------------------------------------------------------


def test_lines_of_a_pipe_come_as_they_are_written() -> None:
    ours, theirs = os.pipe()
    with Lines(ours) as lines:
        assert lines.read(0.0) == []
        os.write(theirs, b"Go fast")
        assert lines.read(1.0) == []
        os.write(theirs, "er.\r\nÜberhol\nand".encode())
        assert lines.read(1.0) == ["Go faster.", "Überhol"]
        os.write(theirs, b"x" * 4096)
        assert lines.read(1.0) == []
        os.close(theirs)
        assert lines.read(1.0) == ["and" + "x" * 4096]
        assert not lines.open
        assert lines.read(0.0) == []
    os.close(ours)


def test_a_line_without_end_is_cut() -> None:
    ours, theirs = os.pipe()
    with Lines(ours) as lines:
        for _ in range(4):
            os.write(theirs, b"x" * 4096)
            assert lines.read(1.0) == []
        assert len(lines.typed) == MOST_CHARACTERS
    os.close(ours)
    os.close(theirs)


@pytest.mark.parametrize(
    ("typed", "line"),
    [
        ("Go fas\x7f\x7f\x7f\x7fo\r", "Goo"),
        ("no\x15yes\r", "yes"),
        ("go now\x17on\r", "goon"),
        ("g\x1b[Do\x1bOA\x07!\r", "go!"),
        ("a\tb\r", "a b"),
        ("\x7f\x17\x15a\r", "a"),
    ],
)
def test_a_typed_line_is_edited(typed: str, line: str) -> None:
    ours, theirs = pty.openpty()
    with Lines(theirs, edited=True) as lines:
        os.write(ours, typed.encode())
        assert lines.read(1.0) == [line]
        assert lines.typed == ""
        os.write(ours, b"\x04")
        assert lines.read(1.0) == []
        assert not lines.open
    os.close(ours)
    os.close(theirs)


def test_nobody_types_where_there_is_no_input() -> None:
    with Lines(None) as lines:
        assert lines.read(0.0) == []
        assert not lines.open
