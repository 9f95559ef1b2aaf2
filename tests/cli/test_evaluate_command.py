"""`chauffeur evaluate` on the terminal: the card, its comparison, and what is refused."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from chauffeur.cli.main import app

sys.path.append(str(Path(__file__).resolve().parents[1] / "bench"))
from small_run import make_data

MINE = """
from chauffeur.concept import Plan, Program, Thoughts

class Left:
    id, model = "left", "left-v1"
    async def plan(self, request):
        source = "def go():\\n    ego = get_ego_vehicle()\\n    set_target_lane(get_left_lane(ego))\\n"
        source += "    while True:\\n        yield autopilot()\\n"
        return Plan(Thoughts("Left."), Program(source), planner=self.id, model=self.model)
"""


def invoke(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["evaluate", *arguments])


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("evaluate")
    make_data(folder / "data")
    (folder / "left_planner.py").write_text(MINE)
    return folder


def _run(place: Path, out: str, items: int = 4) -> Result:
    options = ("-o", f"lampilot.data={place / 'data'}", "-o", f"lampilot.items={items}", "--workers", "1")
    return invoke("lampilot", "--planner", "left_planner:Left", "--out", str(place / out), *options)


@pytest.mark.slow
def test_a_planner_of_a_file_has_a_card(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(place)
    monkeypatch.setattr("chauffeur.cli.console._PIPED_WIDTH", 80)
    result = _run(place, "first")
    assert result.exit_code == 0, result.output
    said = " ".join(result.output.split())
    assert "lampilot: 4 items" in said and "driving score, pt ↑" in said and "55.9" in said
    assert "Tab. IV: GPT-4, 3-shot" in said and "Shared:" in said and "simulated drives (highway-env)" in said.lower()
    assert "of processor time" in said
    figures = [line for line in result.output.splitlines() if "figure" not in line and "runs" not in line]
    assert max(len(line) for line in figures if str(place) not in line) <= 80
    entry = next(one for one in json.loads((place / "first" / "card.json").read_text())["entries"] if one["figures"])
    assert entry["name"] == "lampilot" and entry["cpu_s"] > 0.0
    report = CliRunner().invoke(app, ["report", str(place / "first" / "lampilot"), "--out", str(place / "report")])
    assert report.exit_code == 0, report.output

    again = _run(place, "second")
    assert again.exit_code == 0, again.output
    same = invoke("--compare", str(place / "first"), str(place / "second"))
    assert same.exit_code == 0 and "+0.0" in same.output and "Not compared" not in same.output

    other = _run(place, "third", items=5)
    assert other.exit_code == 0, other.output
    refused = invoke("--compare", str(place / "first"), str(place / "third"))
    assert refused.exit_code == 1
    assert "Data or options differ: items 4 and 5." in " ".join(refused.output.split())


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--profile", "huge"], "no profile 'huge'"),
        (["nonsense"], "no benchmark 'nonsense'"),
        (["-o", "data=there"], "names no benchmark"),
        (["-o", "lampilot.data"], "is no option"),
        (["--planner", "nobody"], "Unknown planner 'nobody'"),
        (["--compare", "nowhere", "nowhere"], "There is no score card at nowhere"),
    ],
)
def test_what_cannot_be_used_is_said_and_nothing_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], words: str
) -> None:
    monkeypatch.chdir(tmp_path)
    planner = [] if "--planner" in arguments else ["--planner", "keyword"]
    result = invoke(*planner, *arguments)
    assert result.exit_code == 2
    assert words in " ".join(result.output.split())
    assert not list(tmp_path.iterdir())
