"""`chauffeur vehicle drive`, as it is typed."""

from __future__ import annotations

import json
import os
import pty
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from chauffeur.cli.main import app
from chauffeur.safety.audit import read_records, verify


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "vehicle.toml"
    path.write_text(
        'interface = "rosbridge"\nstack = "autoware.ai"\n[limits]\nmax_speed_mps = 10.0\n'
        '[rosbridge]\nurl = "ws://127.0.0.1:9"\n'
    )
    return path


def invoke(*arguments: object, typed: str | None = None) -> Result:
    return CliRunner().invoke(app, ["vehicle", "drive", *map(str, arguments)], input=typed)


def one_line(result: Result) -> str:
    return " ".join(result.output.split())


def test_help_has_examples() -> None:
    result = invoke("--help")
    assert result.exit_code == 0
    assert 'chauffeur vehicle drive vehicle.toml "Drive at 20 km/h."' in one_line(result)
    assert "130 ended with Ctrl-C" in one_line(result)


def test_a_dry_run_prints_lines_and_keeps_books(file: Path, tmp_path: Path) -> None:
    log = tmp_path / "audit.jsonl"
    result = invoke(file, "Drive at 20 km/h.", "evaluate: too fast", "--as", "ana", "--audit", log, "--dry-run")
    assert result.exit_code == 0, result.output
    lines = [line for line in result.output.splitlines() if line.startswith("rostopic pub ")]
    assert len(lines) == 2
    assert "velocity_max: 20.0," in lines[0]
    assert "Kept with your last wish." in one_line(result)
    assert "It was a dry run: nothing was published." in one_line(result)
    assert verify(log).ok
    assert [record.body["dry_run"] for _, record in read_records(log) if record.kind == "opened"] == [True]


def test_autoware_in_a_dry_run(tmp_path: Path) -> None:
    file = tmp_path / "vehicle.toml"
    file.write_text('interface = "ros2"\n[limits]\nmax_speed_mps = 10.0\n')
    result = invoke(file, "Drive at 20 km/h.", "--dry-run")
    assert result.exit_code == 0
    assert "ros2 topic pub --once" in result.output
    assert "max_velocity: 5.55" in result.output


def test_refusals_end_with_1(file: Path) -> None:
    result = invoke(file, "Drive at 90 km/h.", "--dry-run")
    assert result.exit_code == 1
    assert "“Drive at 90 km/h.” declined" in one_line(result)
    assert "rostopic" not in result.output


def test_context_from_a_file(file: Path, tmp_path: Path) -> None:
    services, log = tmp_path / "services.toml", tmp_path / "audit.jsonl"
    services.write_text('region = "germany"\n[position]\nat = [48.1, 11.5]\n')
    result = invoke(file, "Drive at 20 km/h.", "--context", services, "--audit", log, "--dry-run", "--quiet")
    assert result.exit_code == 0
    texts = [record.texts["context"]["text"] for _, record in read_records(log) if "context" in record.texts]
    assert "(Source: rules of Germany, " in texts[0]
    assert "Speed limit: not known (no map is loaded)." in texts[0]


def test_lines_of_a_file_are_taken_in_their_turn(file: Path) -> None:
    command = [sys.executable, "-c", "from chauffeur.cli.vehicle import vehicle_app; vehicle_app()", "drive", str(file)]
    done = subprocess.run(
        [*command, "--dry-run"],
        input="Drive at 20 km/h.\n\nslower\nstop\nend\nDrive at 30 km/h.\n",
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    caps = re.findall(r"velocity_max: ([\d.]+)", done.stdout)
    assert len(caps) == 3
    assert float(caps[0]) > float(caps[1]) > float(caps[2]) == 0.0


@pytest.mark.parametrize("leave", ["quit", "Exit.", "ok, bye!"])
def test_questions_and_leave_taking_ask_nothing_of_the_vehicle(file: Path, leave: str) -> None:
    lines = f"Drive at 20 km/h.\nWhy so slow?\nare we there yet?\nnever mind\n{leave}\nDrive at 30 km/h.\n"
    command = [sys.executable, "-c", "from chauffeur.cli.vehicle import vehicle_app; vehicle_app()", "drive", str(file)]
    typed = subprocess.run([*command, "--dry-run"], input=lines, capture_output=True, text=True, check=False)
    given = invoke(file, *lines.splitlines(), "--dry-run")
    for code, said in ((typed.returncode, typed.stdout), (given.exit_code, given.output)):
        assert len(re.findall(r"velocity_max: ([\d.]+)", said)) == 1, said
        assert "You end the session." in said
        assert "“are we there yet?” done" in " ".join(said.split())
        assert "“Drive at 30 km/h.”" not in said
        assert code == 1, "“Why so slow?” was asked back, and not done"


def test_without_a_vehicle_it_is_said(file: Path) -> None:
    pytest.importorskip("websockets", reason="websockets is not installed: pip install 'chauffeur[ros]'")
    result = invoke(file, "Drive at 20 km/h.", "--wait", 0.5)
    assert result.exit_code == 1
    assert "“Drive at 20 km/h.” not done" in one_line(result)
    assert "Nothing was published." in one_line(result)
    assert "Nothing was asked of the vehicle." in one_line(result)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--context", "none.toml"], "none.toml cannot be read"),
        (["--planner", "nobody"], "nobody"),
        (["--audit", "/dev/null/x"], "/dev/null/x"),
    ],
)
def test_bad_input_ends_with_2(file: Path, arguments: list[str], said: str) -> None:
    result = invoke(file, "x", "--dry-run", *arguments)
    assert result.exit_code == 2, result.output
    assert said in one_line(result)


def test_a_vehicle_file_that_is_none(tmp_path: Path) -> None:
    assert invoke(tmp_path / "none.toml", "x").exit_code == 2


@pytest.mark.parametrize("how", ["end", "SIGINT", "SIGTERM"])
def test_typed_at_a_terminal(file: Path, tmp_path: Path, how: str) -> None:
    log = tmp_path / "audit.jsonl"
    ours, theirs = pty.openpty()
    program = "from chauffeur.cli.vehicle import vehicle_app; vehicle_app()"
    command = [sys.executable, "-c", program, "drive", str(file), "--dry-run", "--audit", str(log)]
    with subprocess.Popen(
        command, stdin=theirs, stdout=theirs, stderr=subprocess.STDOUT, start_new_session=True
    ) as process:
        os.close(theirs)
        shown = b""

        def until(words: bytes) -> None:
            nonlocal shown
            while words not in shown:
                shown += os.read(ours, 4096)

        until(b"Type a wish")
        os.write(ours, b"Drive at 20 km/h.\n")
        until(b"nothing was published")
        if how == "end":
            os.write(ours, b"end\n")
        else:
            process.send_signal(getattr(signal, how))
        until(b"audit head")
        code = process.wait(timeout=20)
        os.close(ours)
    assert code == (0 if how == "end" else 130)
    assert b"The session is over" in shown
    found = verify(log)
    assert found.ok
    assert found.closed
    last = [json.loads(line)["body"] for line in log.read_text().splitlines() if '"kind":"outcome"' in line][-1]
    assert last["in_force_mps"] == pytest.approx(20.0 / 3.6, abs=0.03)
