"""Data sets: where they are found, what is said where they are not, their cards, and that the package holds none."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import chauffeur
from chauffeur.concept import DataError
from chauffeur.concept.data import DATA_VARIABLE, data_folder, read_data

PACKAGE = Path(chauffeur.__file__).parent
DATA = PACKAGE.parents[1] / "data"
SETS = sorted(folder.name for folder in DATA.iterdir() if folder.is_dir())


def test_a_set_is_found_in_the_checkout_or_where_the_environment_says(tmp_path: Path) -> None:
    assert data_folder("onboard", {}) == DATA / "onboard"
    (tmp_path / "onboard").mkdir()
    assert data_folder("onboard", {DATA_VARIABLE: str(tmp_path)}) == tmp_path / "onboard"


def test_what_is_missing_is_told_with_where_to_get_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(DataError, match=r"'nothing' is not in .*data\. Restore it") as caught:
        data_folder("nothing", {})
    assert str(DATA) in str(caught.value)
    with pytest.raises(DataError, match=rf"'onboard' is not in .*{DATA_VARIABLE}"):
        data_folder("onboard", {DATA_VARIABLE: str(tmp_path)})
    (tmp_path / "passengers").mkdir()
    monkeypatch.setenv(DATA_VARIABLE, str(tmp_path))
    with pytest.raises(DataError, match=r"Cannot read .*wishes\.jsonl: No such file"):
        read_data("passengers", "wishes.jsonl")


def test_an_installed_package_plans_without_data_and_says_what_its_benchmarks_lack(tmp_path: Path) -> None:
    installed = tmp_path / "lib" / "site-packages"
    shutil.copytree(PACKAGE, installed / "chauffeur", ignore=shutil.ignore_patterns("__pycache__"))
    code = """
import chauffeur.bench.personalization, chauffeur.bench.hostile, chauffeur.bench.faithfulness, chauffeur.models.sorting
from chauffeur.bench.passengers import load_wishes
from chauffeur.concept import DataError
from chauffeur.planners import make_planner
assert make_planner("onboard").id == "onboard"
try:
    load_wishes()
except DataError as error:
    print(error)
"""
    environ = {"PYTHONPATH": str(installed), "PATH": "/usr/bin:/bin", "HOME": str(tmp_path)}
    run = subprocess.run(
        [sys.executable, "-c", code], env=environ, cwd=tmp_path, capture_output=True, text=True, timeout=600, check=True
    )
    assert "'passengers' is no part of the installed package" in run.stdout and DATA_VARIABLE in run.stdout


@pytest.mark.parametrize("name", SETS)
def test_every_set_has_a_card_that_counts_right(name: str) -> None:
    card = (DATA / name / "CARD.md").read_text(encoding="utf-8")
    assert re.findall(r"^- \*\*(.+?)\*\*:", card, re.MULTILINE) == ["What", "Written by", "Lines", "Used by", "Licence"]
    files = [path for path in (DATA / name).rglob("*") if path.is_file() and path.name != "CARD.md"]
    lines = sum(path.read_bytes().count(b"\n") for path in files)
    assert f"- **Lines**: {lines:,}" in card
    assert f"]({name}/CARD.md)" in (DATA / "README.md").read_text(encoding="utf-8")


def test_the_package_holds_no_data_sets() -> None:
    large = {
        path.relative_to(PACKAGE)
        for path in PACKAGE.rglob("*")
        if path.is_file() and path.stat().st_size > 100_000 and "__pycache__" not in path.parts
    }
    assert {path for path in large if "weights" not in path.parts} == set()
    rows = [path for path in PACKAGE.rglob("*") if path.suffix in (".tsv", ".csv", ".jsonl")]
    rows = [path for path in rows if path.parent.name != "snippets"]  # learned programs, which drive
    words = [path for room in ("bench", "models") for path in (PACKAGE / room).rglob("*.txt")]
    assert rows + words == []
