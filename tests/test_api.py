"""Chauffeur from Python, as the README shows it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import chauffeur
from chauffeur.concept import ConfigError, InstructionError, ScenarioError
from chauffeur.drive.recording import read_trip

BLOCKS = re.findall(
    r"^```python\n(.*?)^```",
    (Path(__file__).resolve().parents[1] / "README.md").read_text(encoding="utf-8"),
    re.MULTILINE | re.DOTALL,
)


def _run(block: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    exec(compile(block, "README.md", "exec"), {"__name__": "__main__"})


def test_every_name_of_the_front_page_can_be_had() -> None:
    for name in chauffeur.__all__:
        assert getattr(chauffeur, name) is not None
    with pytest.raises(AttributeError, match="nothing_like_it"):
        chauffeur.nothing_like_it  # noqa: B018


def test_a_wish_is_driven(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    _run(BLOCKS[0], tmp_path, monkeypatch)
    assert capsys.readouterr().out.startswith("success ")
    assert read_trip(tmp_path / "ada.mcap").trip.instruction.person == "ada"


def test_a_planner_is_plugged_in(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    _run(BLOCKS[1], tmp_path, monkeypatch)
    assert capsys.readouterr().out.strip() == "ended"


def test_a_benchmark_is_run_and_gone_on_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A smaller one than the README's; the second call finds all done."""
    block = BLOCKS[2].replace('"passengers", planner="onboard"', '"faithfulness", items=2')
    assert block != BLOCKS[2]
    _run(block, tmp_path, monkeypatch)
    results = (tmp_path / "runs/onboard/results.jsonl").read_text()
    assert capsys.readouterr().out.startswith(f"{len(results.splitlines())} rows")
    _run(block, tmp_path, monkeypatch)
    assert (tmp_path / "runs/onboard/results.jsonl").read_text() == results


def test_errors_are_told_before_anything_moves(tmp_path: Path) -> None:
    with pytest.raises(InstructionError, match="empty"):
        chauffeur.drive_wish(" ")
    with pytest.raises(ScenarioError, match="moon"):
        chauffeur.drive_wish("Overtake.", scenario="moon")
    with pytest.raises(ConfigError, match="no_such"):
        chauffeur.run_benchmark("no_such", out=tmp_path / "run")
    assert not (tmp_path / "run").exists()
