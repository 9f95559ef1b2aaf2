"""`chauffeur vehicle`: what it prints, what it publishes, and that engaging takes a person at a terminal."""

from __future__ import annotations

import os
import pty
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner, Result

pytest.importorskip("rosbags", reason="rosbags is not installed: pip install 'chauffeur[ros]'")

import ros_graph as ros
from ros_graph import ENGAGE, FOLLOWER, REPLANNER, Master, Subscriber, eventually

from chauffeur.cli.failures import FriendlyGroup
from chauffeur.cli.vehicle import vehicle_app
from chauffeur.worlds.ros.engage import WORDS

pytestmark = pytest.mark.server

COMMANDS = ["check", "apply", "release", "watch", "engage", "disengage"]

app = typer.Typer(cls=FriendlyGroup)


@app.callback()
def root() -> None:
    """As the `chauffeur` command."""


app.add_typer(vehicle_app, name="vehicle")


def invoke(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["vehicle", *map(str, arguments)])


def one_line(result: Result) -> str:
    return " ".join(result.output.split())


@pytest.fixture
def master() -> Iterator[Master]:
    graph = Master()
    yield graph
    graph.close()


@pytest.fixture
def file(master: Master, tmp_path: Path) -> Path:
    path = tmp_path / "vehicle.toml"
    path.write_text(f'interface = "ros1"\n[limits]\nmax_speed_mps = 10.0\n[ros1]\nmaster = "{master.uri}"\n')
    return path


def test_help_has_examples(file: Path) -> None:
    assert "chauffeur vehicle apply vehicle.toml --speed 8 --dry-run" in one_line(invoke("--help"))
    for command in COMMANDS:
        assert invoke(command, "--help").exit_code == 0


def test_a_dry_run_prints_lines_and_needs_no_vehicle(file: Path, master: Master) -> None:
    result = invoke("apply", file, "--speed", 8, "--look-ahead", 10, "--dry-run")
    assert result.exit_code == 0
    lines = [line for line in result.output.splitlines() if line.startswith("rostopic pub ")]
    assert len(lines) == 2
    assert "velocity_max: 28.8," in lines[0]
    assert "param_flag: 0, velocity: 28.8, lookahead_distance: 10.0," in lines[1]
    assert "nothing was published" in result.output
    assert not master.calls


def test_apply_and_release_reach_the_vehicle(file: Path, master: Master) -> None:
    follower, replanner = Subscriber(master, FOLLOWER), Subscriber(master, REPLANNER)
    with ros.closing_all(follower, replanner):
        assert invoke("check", file).exit_code == 0
        assert not follower.got
        assert not replanner.got
        result = invoke("apply", file, "--speed", 8)
        assert result.exit_code == 0
        assert "Planned speeds are capped at 28.8 km/h" in result.output
        eventually(lambda: replanner.got)
        assert ros.replanner_of(replanner.got[-1][0])["velocity_max"] == pytest.approx(28.8)
        eventually(lambda: follower.got)
        assert invoke("release", file).exit_code == 0
        eventually(lambda: ros.replanner_of(replanner.got[-1][0])["velocity_max"] == pytest.approx(36.0))


def test_what_cannot_be_done_is_said(file: Path, tmp_path: Path) -> None:
    refused = invoke("apply", file, "--speed", 30)
    assert refused.exit_code == 1
    assert "allows 0 to 10 m/s (36 km/h)" in one_line(refused)
    alone = invoke("apply", file, "--speed", 5, "--wait", 0.5)
    assert alone.exit_code == 1
    assert "Nobody listens to" in one_line(alone)
    assert "Not delivered: the vehicle was not asked." in one_line(alone)
    assert invoke("check", file, "--wait", 0.5).exit_code == 1
    assert invoke("check", tmp_path / "none.toml").exit_code == 2
    watched = invoke("watch", file, "--duration", 1)
    assert watched.exit_code == 0
    assert "Nobody listens to" in one_line(watched)


def test_engaging_takes_no_input_from_a_file(file: Path, master: Master) -> None:
    result = CliRunner().invoke(app, ["vehicle", "engage", str(file)], input="\n".join(WORDS))
    assert result.exit_code == 2
    assert "person at a terminal" in one_line(result)
    assert not master.calls
    dry = file.with_name("dry.toml")
    dry.write_text('interface = "dry-run"\n[limits]\nmax_speed_mps = 10.0\n')
    for command in ("engage", "disengage"):
        assert invoke(command, dry).exit_code == 2


@pytest.mark.parametrize("right", [True, False])
def test_engaging_takes_a_typed_word(file: Path, master: Master, right: bool) -> None:
    interface = Subscriber(master, ENGAGE, "/ssc_interface")
    ours, theirs = pty.openpty()
    command = [
        sys.executable,
        "-c",
        "from chauffeur.cli.vehicle import vehicle_app; vehicle_app()",
        "engage",
        str(file),
    ]
    with (
        ros.closing_all(interface),
        subprocess.Popen(
            command, stdin=theirs, stdout=theirs, stderr=subprocess.DEVNULL, start_new_session=True
        ) as process,
    ):
        os.close(theirs)
        shown = b""
        while b"to engage" not in shown:
            shown += os.read(ours, 4096)
        found = re.search(rb"Type (\w+) to engage", shown)
        assert found
        assert not interface.got
        os.write(ours, (found[1] if right else b"engage") + b"\n")
        assert (process.wait(timeout=20) == 0) is right
        assert [data for data, _ in interface.got] == ([b"\x01"] if right else [])
        os.close(ours)
    if right:
        again = Subscriber(master, ENGAGE, "/ssc_interface")
        with ros.closing_all(again):
            assert invoke("disengage", file).exit_code == 0
            eventually(lambda: [data for data, _ in again.got] == [b"\x00"])
