"""The pages for a task do what they say: their commands run as they are written, one after the other."""

from __future__ import annotations

import re
import shlex
import shutil
import sys
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest
from typer.testing import CliRunner

sys.path.append(str(Path(__file__).resolve().parent / "planners"))
from server import ModelServer

from chauffeur.cli.main import app
from chauffeur.concept import Program
from chauffeur.driving.recording import read_trip

DOCS = Path(__file__).resolve().parents[1] / "docs"
SUITE = "chauffeur bench scenes generate --out suite --items 8 --extras 0"
BLOCKS = re.compile(r"^```(\w+)\n(.*?)^```", re.MULTILINE | re.DOTALL)

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def endpoint() -> Iterator[str]:
    """A chat-completions server on loopback."""
    server = ModelServer()
    yield server.url
    server.close()


@pytest.fixture(scope="module")
def suite(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small suite that two pages make by the same line."""
    folder = tmp_path_factory.mktemp("made")
    run([SUITE], folder)
    return folder / "suite"


def blocks(page: str, language: str) -> list[str]:
    found = [text for kind, text in BLOCKS.findall((DOCS / page).read_text(encoding="utf-8")) if kind == language]
    assert found, f"{page} has no block of {language}"
    return found


def commands(page: str) -> list[str]:
    return [line for block in blocks(page, "sh") for line in block.splitlines() if line.startswith("chauffeur ")]


def write(page: str, language: str, folder: Path) -> list[Path]:
    """The page's files of a language; the first line of each names it."""
    folder.mkdir(exist_ok=True)
    written: list[Path] = []
    for text in blocks(page, language):
        path = folder / text.split("\n", 1)[0].removeprefix("# ")
        path.write_text(text, encoding="utf-8")
        written.append(path)
    return written


def run(lines: Sequence[str], folder: Path, *, path: Path | None = None, ends: int = 0) -> list[str]:
    """What each line prints; every one must end with an exit code."""
    said: list[str] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setenv("COLUMNS", "100")
        patch.setenv("CHAUFFEUR_API_KEY", "none")
        if path is not None:
            patch.syspath_prepend(path)
        for line in lines:
            program, *words = shlex.split(line)
            assert program == "chauffeur"
            done = CliRunner().invoke(app, words)
            assert done.exit_code == ends, f"{line}\n{done.output}\n{done.exception}"
            said.append(" ".join(done.stdout.split()))
    return said


@pytest.mark.server
def test_a_model_of_ones_own_is_evaluated(endpoint: str, suite: Path, tmp_path: Path) -> None:
    lines = [line.replace("http://localhost:8040/v1", endpoint) for line in commands("evaluate-your-model.md")]
    assert sum(endpoint in line for line in lines) == 4, "nothing asks another endpoint"
    first, made, *bench, passengers, hostile = lines
    assert made == SUITE
    assert "passengers" in passengers and "hostile" in hostile, "long; the tests of these benchmarks run them"
    shutil.copytree(suite, tmp_path / "suite")
    run([first], tmp_path, ends=1)  # the server's program holds a speed, which is not what was asked
    run(bench, tmp_path)
    trip = read_trip(tmp_path / "trips" / "first" / "trip.mcap").trip
    assert trip.plan.planner == "openai/Qwen/Qwen2.5-7B-Instruct" and isinstance(trip.plan.policy, Program)
    assert (tmp_path / "runs" / "report" / "report.html").stat().st_size > 10_000


def test_a_planner_of_ones_own_drives(tmp_path: Path) -> None:
    package = tmp_path / "my-planner"
    (module,) = write("your-planner.md", "python", package)
    (file,) = write("your-planner.md", "toml", package)
    project = tomllib.loads(file.read_text(encoding="utf-8"))["project"]
    assert module.name == "my_planner.py"
    info = package / "my_planner-0.1.0.dist-info"  # what an installer leaves
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n")
    ((group, points),) = project["entry-points"].items()
    (info / "entry_points.txt").write_text(
        "\n".join([f"[{group}]", *(f"{name} = {at}" for name, at in points.items())])
    )
    drive, bench = commands("your-planner.md")
    assert bench.startswith("chauffeur bench passengers --planner mine/22")
    run([drive], tmp_path, path=package)
    plan = read_trip(tmp_path / "trips" / "mine" / "trip.mcap").trip.plan
    assert (plan.planner, plan.model, plan.thoughts.text) == ("mine", "mine-v1", "I drive at 22.0 m/s.")


def test_a_vehicle_is_asked_without_one(tmp_path: Path) -> None:
    write("your-vehicle.md", "toml", tmp_path)
    check, apply, _, verified = run(commands("your-vehicle.md"), tmp_path)
    assert "0 to 28.8 km/h" in check
    assert "/config/waypoint_replanner" in apply
    assert "As it was written" in verified


def test_a_suite_stands_in_for_dblv1(suite: Path, tmp_path: Path) -> None:
    made, *lines = commands("dblv1.md")
    assert made == SUITE
    shutil.copytree(suite, tmp_path / "suite")
    said = run(lines, tmp_path)
    assert "every scene is solved by the expert" in said[0]
