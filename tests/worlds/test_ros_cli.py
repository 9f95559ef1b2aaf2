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
from typer.testing import CliRunner, Result

pytest.importorskip("websockets", reason="websockets is not installed: pip install 'chauffeur[ros]'")

from rosbridge_server import ENGAGE, FOLLOWER, REPLANNER, Bridge, eventually, free_port

from chauffeur.cli.main import app
from chauffeur.worlds.ros import VehicleError
from chauffeur.worlds.ros.engage import WORDS, engage
from chauffeur.worlds.ros.rosbridge import RosbridgeSettings

pytestmark = pytest.mark.server

COMMANDS = ["check", "apply", "release", "watch", "engage", "disengage"]


def invoke(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["vehicle", *map(str, arguments)])


def one_line(result: Result) -> str:
    return " ".join(result.output.split())


@pytest.fixture
def bridge() -> Iterator[Bridge]:
    server = Bridge()
    yield server
    server.close()


@pytest.fixture
def file(bridge: Bridge, tmp_path: Path) -> Path:
    return written(tmp_path / "vehicle.toml", bridge.url)


def written(path: Path, url: str, stack: str = "autoware.ai") -> Path:
    path.write_text(
        f'interface = "rosbridge"\nstack = "{stack}"\n[limits]\nmax_speed_mps = 10.0\n[rosbridge]\nurl = "{url}"\n'
    )
    return path


def test_help_has_examples(file: Path) -> None:
    told = CliRunner().invoke(app, ["vehicle", "--help"])
    assert "chauffeur vehicle apply vehicle.toml --speed 8 --dry-run" in one_line(told)
    for command in COMMANDS:
        assert invoke(command, "--help").exit_code == 0


def test_a_dry_run_prints_lines_and_needs_no_vehicle(file: Path, bridge: Bridge) -> None:
    result = invoke("apply", file, "--speed", 8, "--look-ahead", 10, "--dry-run")
    assert result.exit_code == 0
    lines = [line for line in result.output.splitlines() if line.startswith("rostopic pub ")]
    assert len(lines) == 2
    assert "velocity_max: 28.8," in lines[0]
    assert "param_flag: 0, velocity: 28.8, lookahead_distance: 10.0," in lines[1]
    assert "nothing was published" in result.output
    assert not bridge.clients


def test_apply_and_release_reach_the_vehicle(file: Path, bridge: Bridge) -> None:
    assert invoke("check", file).exit_code == 0
    assert not bridge.published
    result = invoke("apply", file, "--speed", 8)
    assert result.exit_code == 0
    assert "Planned speeds are capped at 28.8 km/h" in result.output
    eventually(lambda: [topic for topic, _ in bridge.published] == [REPLANNER, FOLLOWER])
    assert bridge.published[0][1]["velocity_max"] == pytest.approx(28.8)
    assert invoke("release", file).exit_code == 0
    eventually(lambda: bridge.published[-1][1].get("velocity_max") == pytest.approx(36.0))


def test_what_cannot_be_done_is_said(file: Path, tmp_path: Path) -> None:
    refused = invoke("apply", file, "--speed", 30)
    assert refused.exit_code == 1
    assert "allows 0 to 10 m/s (36 km/h)" in one_line(refused)
    away = written(tmp_path / "away.toml", f"ws://127.0.0.1:{free_port()}")
    alone = invoke("apply", away, "--speed", 5, "--wait", 0.5)
    assert alone.exit_code == 1
    assert "the connection is refused" in one_line(alone)
    assert "Not delivered: the vehicle was not asked." in one_line(alone)
    assert invoke("check", away, "--wait", 0.5).exit_code == 1
    assert invoke("check", tmp_path / "none.toml").exit_code == 2
    watched = invoke("watch", away, "--duration", 1)
    assert watched.exit_code == 0
    assert "the connection is refused" in one_line(watched)


def test_a_file_for_a_ros_1_master_says_what_to_write(tmp_path: Path) -> None:
    file = tmp_path / "vehicle.toml"
    file.write_text('interface = "ros1"\n[limits]\nmax_speed_mps = 10.0\n[ros1]\nmaster = "http://127.0.0.1:11311"\n')
    for command in (("check",), ("drive", "Drive at 20 km/h.", "--dry-run"), ("engage",)):
        result = invoke(command[0], file, *command[1:])
        assert result.exit_code == 2
        assert 'interface = "rosbridge", stack = "autoware.ai"' in one_line(result)


def test_engaging_takes_no_input_from_a_file(file: Path, bridge: Bridge, tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["vehicle", "engage", str(file)], input="\n".join(WORDS))
    assert result.exit_code == 2
    assert "person at a terminal" in one_line(result)
    dry = tmp_path / "dry.toml"
    dry.write_text('interface = "dry-run"\n[limits]\nmax_speed_mps = 10.0\n')
    for other in (dry, written(tmp_path / "autoware.toml", bridge.url, "autoware")):
        for command in ("engage", "disengage"):
            assert invoke(command, other).exit_code == 2
    assert not bridge.clients


@pytest.mark.parametrize("right", [True, False])
def test_engaging_takes_a_typed_word(file: Path, bridge: Bridge, right: bool) -> None:
    bridge.nodes[ENGAGE] = ["/ssc_interface"]
    ours, theirs = pty.openpty()
    command = [
        sys.executable,
        "-c",
        "from chauffeur.cli.vehicle import vehicle_app; vehicle_app()",
        "engage",
        str(file),
    ]
    with subprocess.Popen(
        command, stdin=theirs, stdout=theirs, stderr=subprocess.DEVNULL, start_new_session=True
    ) as process:
        os.close(theirs)
        shown = b""
        while b"to engage" not in shown:
            shown += os.read(ours, 4096)
        found = re.search(rb"Type (\w+) to engage", shown)
        assert found
        assert not bridge.clients
        os.write(ours, (found[1] if right else b"engage") + b"\n")
        assert (process.wait(timeout=20) == 0) is right
        os.close(ours)
    engaged = [(ENGAGE, {"data": True})] if right else []
    assert bridge.published == engaged
    if right:
        assert invoke("disengage", file).exit_code == 0
        assert bridge.published == [*engaged, (ENGAGE, {"data": False})]


@pytest.mark.parametrize(("has_rosapi", "words"), [(True, "No node listens"), (False, "rosapi does not answer")])
def test_nothing_is_engaged_unconfirmed_and_disengaging_is_sent_regardless(
    file: Path, bridge: Bridge, has_rosapi: bool, words: str
) -> None:
    """A latched `true` must not wait for a node that starts later; a `false` may."""
    bridge.has_rosapi = has_rosapi
    where = RosbridgeSettings(bridge.url)
    with pytest.raises(VehicleError, match=words):
        engage(where, WORDS[0], WORDS[0], within_s=0.3)
    assert bridge.published == []
    result = invoke("disengage", file, "--wait", 0.5)
    assert result.exit_code == 1
    assert words in one_line(result)
    assert bridge.published == [(ENGAGE, {"data": False})]


def test_a_server_that_refuses_or_is_away_engages_nothing(bridge: Bridge) -> None:
    bridge.types[ENGAGE] = "std_msgs/String"
    bridge.nodes[ENGAGE] = ["/ssc_interface"]
    with pytest.raises(VehicleError, match="but it is std_msgs/String"):
        engage(RosbridgeSettings(bridge.url), WORDS[0], WORDS[0])
    assert bridge.published == []
    for url in (f"ws://127.0.0.1:{free_port()}", "http://127.0.0.1"):
        with pytest.raises(VehicleError, match="rosbridge server"):
            engage(RosbridgeSettings(url), WORDS[0], WORDS[0], within_s=0.5)
