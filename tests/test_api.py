"""Chauffeur from Python, as the README shows it."""

from __future__ import annotations

import ast
import asyncio
import doctest
import inspect
import re
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest

sys.path.append(str(Path(__file__).resolve().parent / "planners"))
from server import ModelServer

import chauffeur
from chauffeur.concept import ConfigError, InstructionError, ScenarioError
from chauffeur.driving.recording import read_trip

ROOT = Path(__file__).resolve().parents[1]
_PYTHON = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)
BLOCKS = _PYTHON.findall((ROOT / "README.md").read_text(encoding="utf-8"))
NOTEBOOK = {
    title: _PYTHON.findall(text)
    for title, _, text in (
        section.partition("\n")
        for section in (ROOT / "docs" / "notebooks.md").read_text(encoding="utf-8").split("\n## ")[1:]
    )
}
"""Cells of each section of the page on notebooks."""


def _run(block: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    exec(compile(block, "README.md", "exec"), {"__name__": "__main__"})


def test_what_is_offered_is_shown_without_being_imported() -> None:
    with pytest.raises(AttributeError, match="nothing_like_it"):
        chauffeur.nothing_like_it  # noqa: B018
    shown = "import sys, chauffeur; print(*dir(chauffeur)); print('numpy' in sys.modules)"
    output = subprocess.run([sys.executable, "-c", shown], capture_output=True, text=True, check=True).stdout
    assert output.splitlines() == [" ".join(sorted(chauffeur.__all__)), "False"]


def _slow(names: Iterable[str], *slow: str) -> list[Any]:
    return [pytest.param(one, marks=pytest.mark.slow) if one in slow else one for one in names]


@pytest.mark.parametrize(
    "name", _slow(["", *sorted({*chauffeur.__all__} - {"__version__"})], "evaluate", "run_benchmark")
)
def test_every_name_has_an_example_that_runs(name: str, tmp_path: Path) -> None:
    known = {"chauffeur": chauffeur, "asyncio": asyncio, "folder": tmp_path}
    found = getattr(chauffeur, name) if name else chauffeur
    (test,) = (
        one
        for one in doctest.DocTestFinder(recurse=False).find(found, name or "chauffeur", globs=known)
        if one.examples
    )
    outcome = doctest.DocTestRunner(optionflags=doctest.FAIL_FAST).run(test)
    assert outcome.attempted and not outcome.failed


async def _cells(blocks: list[str]) -> list[object]:
    """Run blocks one after the other as a notebook does, in a running event loop; what each shows at its end."""
    names: dict[str, object] = {"__name__": "__main__"}
    shown: list[object] = []
    for block in blocks:
        tree = ast.parse(block)
        last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
        begun = eval(compile(tree, "notebooks.md", "exec", flags=ast.PyCF_ALLOW_TOP_LEVEL_AWAIT), names)
        if inspect.iscoroutine(begun):
            await begun
        shown.append(None if last is None else eval(compile(ast.Expression(last.value), "notebooks.md", "eval"), names))
    return shown


@pytest.mark.parametrize("title", _slow(NOTEBOOK, "Evaluate an endpoint"))
def test_a_notebook_runs(title: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CHAUFFEUR_API_KEY", "of-no-use")
    blocks = NOTEBOOK[title]
    if title == "Tables and plots":
        pytest.importorskip("pandas")
        pytest.importorskip("matplotlib").use("agg")
    if title == "Evaluate an endpoint":
        server = ModelServer()
        try:
            *_, rows = asyncio.run(_cells([block.replace("http://localhost:8040/v1", server.url) for block in blocks]))
            assert server.requests
        finally:
            server.close()
        assert len(rows) and len(repr(rows)) < 200 and rows._repr_markdown_().startswith("#")
        return
    assert asyncio.run(_cells(blocks))


def test_a_wish_is_driven(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    _run(BLOCKS[0], tmp_path, monkeypatch)
    assert capsys.readouterr().out.startswith("success ")
    assert read_trip(tmp_path / "ada.mcap").trip.instruction.person == "ada"


def test_a_benchmark_is_run_and_gone_on_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The second call finds all done."""
    block = 'rows = chauffeur.run_benchmark("faithfulness", out="runs/onboard", items=2)\nprint(len(rows), "rows")'
    _run(f"import chauffeur\n\n{block}", tmp_path, monkeypatch)
    results = (tmp_path / "runs/onboard/results.jsonl").read_text()
    assert capsys.readouterr().out.startswith(f"{len(results.splitlines())} rows")
    _run(f"import chauffeur\n\n{block}", tmp_path, monkeypatch)
    assert (tmp_path / "runs/onboard/results.jsonl").read_text() == results


def test_errors_are_told_before_anything_moves(tmp_path: Path) -> None:
    with pytest.raises(InstructionError, match="empty"):
        chauffeur.drive(" ")
    with pytest.raises(ScenarioError, match="moon"):
        chauffeur.drive("Overtake.", scenario="moon")
    with pytest.raises(ConfigError, match="no_such"):
        chauffeur.run_benchmark("no_such", out=tmp_path / "run")
    assert not (tmp_path / "run").exists()
