"""What is installed behind entry points, of whom, and whether it loads."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from chauffeur.cli.main import app
from chauffeur.concept.registry import plugins

POINTS = """[chauffeur.planners]
fine = toy_planner:Toy
gone = toy_planner:Absent
missing = no_such_module.inner:Toy
onboard = toy_planner:Toy
[chauffeur.checks]
loud = toy_loud:check
[chauffeur.sensors]
eye = toy_planner:Toy
"""


def invoke(*arguments: str) -> Result:
    return CliRunner().invoke(app, list(arguments))


@pytest.fixture
def toys(tmp_path: Path) -> Iterator[None]:
    meta = tmp_path / "toys-1.5.dist-info"
    meta.mkdir()
    (meta / "METADATA").write_text("Metadata-Version: 2.1\nName: toys\nVersion: 1.5\n")
    (meta / "entry_points.txt").write_text(POINTS)
    (tmp_path / "toy_planner.py").write_text("class Toy:\n    pass\n")
    (tmp_path / "toy_loud.py").write_text("raise RuntimeError('not today')\n")
    sys.path.append(str(tmp_path))  # behind Chauffeur's own, whose names it cannot take
    yield
    sys.path.remove(str(tmp_path))
    for name in ("toy_planner", "toy_loud"):
        sys.modules.pop(name, None)


def _line(output: str, name: str) -> str:
    return next(line for line in output.splitlines() if line.startswith(f"  {name} "))


def test_built_in_parts_are_all_there() -> None:
    result = invoke("plugins")
    assert result.exit_code == 0, result.output
    for name in ("highway", "onboard", "lampilot", "vault"):
        assert "built in" in _line(result.output, name)
    assert "built in: program, parameters" in result.output and "minimum_speed" in result.output


def test_a_package_of_somebody_elses_is_named_with_what_is_wrong(toys: None) -> None:
    result = invoke("plugins")
    assert result.exit_code == 1
    assert "toys 1.5, third party" in _line(result.output, "fine")
    assert "does not load" not in _line(result.output, "gone"), "a module that is there is not run to see"
    assert "there is no module no_such_module.inner" in " ".join(result.output.split())
    assert "toy_planner" not in sys.modules and "toy_loud" not in sys.modules
    assert "chauffeur.sensors" in result.output, "a group that nobody knows is shown as well"
    shadowed = [one for one in plugins() if one.name == "onboard"]
    assert [(one.built_in, one.shadowed) for one in shadowed] == [(True, False), (False, True)]


def test_loading_says_what_breaks(toys: None) -> None:
    result = invoke("plugins", "--load")
    said = " ".join(result.output.split())
    assert result.exit_code == 1
    assert "AttributeError" in said and "RuntimeError: not today" in said and "ModuleNotFoundError" in said


def test_a_screen_of_80_columns_loses_nothing(toys: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("chauffeur.cli.console._PIPED_WIDTH", 80)
    output = invoke("plugins").output
    assert max(map(len, output.splitlines())) <= 80
    assert {one.name for one in plugins()} <= {line.split()[0] for line in output.splitlines() if line[:2] == "  "}
