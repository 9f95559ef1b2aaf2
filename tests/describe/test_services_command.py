"""`chauffeur show context`, as it is typed."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from test_services_map import write_file
from test_services_server import Asked, reply, roads_json, serving, traffic_json, weather_json
from typer.testing import CliRunner

from chauffeur.cli.main import app

STREET = [(48.137, 11.56), (48.137, 11.59)]


def run(*words: str) -> tuple[int, str]:
    result = CliRunner().invoke(app, ["show", "context", *words])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.output


def answer(asked: Asked) -> bytes:
    if asked.path == "/data/2.5/weather":
        return reply(weather_json(dt=None))
    if asked.path == "/api/interpreter":
        return reply(roads_json((7, {"highway": "primary", "name": "High Street", "maxspeed": "50"}, STREET)))
    return reply(traffic_json(STREET))


def test_a_map_and_a_region(tmp_path: Path) -> None:
    path = write_file(tmp_path / "town.osm.pbf")
    code, said = run("--at", "48.0,11.0", "--heading", "2", "--map", str(path), "--region", "germany")
    assert code == 0
    assert 'Road: motorway "A 9", one way.' in said
    assert "Speed limit: 120 km/h (33.3 m/s)." in said
    assert "Weather: not known (no such service is switched on)." in said
    assert "OpenStreetMap file town.osm.pbf" in said
    assert "OpenStreetMap contributors" in said


@pytest.mark.server
def test_services(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENWEATHER_API_KEY", "k1")
    monkeypatch.setenv("TOMTOM_API_KEY", "k2")
    with serving(answer) as service:
        asked = [f"--online={name}={service.url}" for name in ("weather", "map", "traffic")]
        code, said = run("--at=48.137,11.575", "--heading=90", *asked, "--budget=20", "--region=germany")
        assert code == 0
        assert "light rain" in said
        assert "High Street" in said
        assert "Traffic: slow, at 31 km/h where 72 km/h is usual." in said
        code, said = run("--at=48.137,11.575", "--heading=90", *asked, "--budget=20", "--json")
        told = json.loads(said)
        readings = {one["name"]: one for one in told["readings"]}
        assert readings["speed_limit"]["value"] == pytest.approx(50 / 3.6)
        assert readings["speed_limit"]["unit"] == "m/s"
        assert readings["rules"]["value"] is None
        assert readings["rules"]["note"] == "no region's rules are loaded"
        assert len(told["words"]) == 6


@pytest.mark.server
def test_a_service_that_is_late_is_said_to_be(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENWEATHER_API_KEY", "k1")
    with serving(lambda _: None) as service:
        code, said = run("--at=48.137,11.575", f"--online=weather={service.url}", "--budget=0.05")
    assert code == 0
    assert "Weather: not known (the service did not answer within 0.05 s)." in said
    assert "--budget 3" in said


def test_south_and_west_are_negative() -> None:
    code, said = run("--at", "-33.8688,-151.2093")
    assert code == 0
    assert "Road: not known (no map is loaded)." in said


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--at", "here"], "'here' is not a place."),
        (["--at", "1,2,3"], "is not a place."),
        (["--at", "91,0"], "is not a position."),
        (["--at", "48,11", "--region", "atlantis"], "no traffic rules for a region 'atlantis'"),
        (["--at", "48,11", "--map", "absent.osm.pbf"], "cannot be read"),
        (["--at", "48,11", "--online", "astrology"], "no online service 'astrology'"),
        (["--at", "48,11", "--budget", "-1"], "budget"),
        (["--at", "48,11", "--heading", "nan"], "is not a heading."),
        (["--at", "48,11", "--online", "map=nowhere"], "map_url is not an HTTP address."),
    ],
)
def test_what_cannot_be_used_is_said(words: list[str], said: str) -> None:
    code, output = run(*words)
    assert code == 2
    assert said in output
    assert "Hint:" in output


def test_help_shows_examples() -> None:
    code, said = run("--help")
    assert code == 0
    assert "chauffeur show context --at 48.137,11.575 --region germany" in said


def test_the_program_in_the_documentation_runs(tmp_path: Path) -> None:
    page = Path(__file__).resolve().parents[2] / "docs" / "services.md"
    (program,) = re.findall(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    path = tmp_path / "program.py"
    path.write_text(program, encoding="utf-8")
    done = subprocess.run([sys.executable, str(path)], capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr
    assert "Weather: not known (no such service is switched on)." in done.stdout
    assert "rules Germany  rules of Germany" in done.stdout
