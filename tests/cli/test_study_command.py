"""`chauffeur study` and `chauffeur bench personalization` as somebody types them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from chauffeur.cli.main import app

runner = CliRunner()


def run(*words: str) -> Result:
    return runner.invoke(app, list(words))


def said(result: Result) -> str:
    return " ".join(result.output.split())


@pytest.fixture
def lab(tmp_path: Path) -> str:
    folder = str(tmp_path / "lab")
    made = run("study", "new", folder, "--participants", "2", "--seed", "1", "--learning", "1")
    assert made.exit_code == 0, made.output
    assert "30 trips each" in said(made)
    return folder


def test_a_trip_from_consent_to_the_analysis(lab: str, tmp_path: Path) -> None:
    shown = run("study", "next", lab)
    assert "P001, trip 1 of 30, system L" in said(shown)
    assert "has not consented" in said(shown)
    assert "keyword" not in said(shown)
    assert run("study", "record", lab, "--participant", "P001", "--number", "1", "--takeover").exit_code != 0
    assert run("study", "consent", lab, "--participant", "P001").exit_code == 0
    driven = run("study", "next", lab, "--words", "Could you go a bit faster?")
    assert driven.exit_code == 0, driven.output
    assert "Driven, in simulation" in said(driven)
    record = ("study", "record", lab, "--participant", "P001", "--number", "1", "--takeover")
    kept = run(*record, "--rating", "3", "--comment", "A bit too slow.")
    assert "The memory heard the comment" in said(kept)
    assert "trip 2 of 30" in said(run("study", "next", lab))
    table = tmp_path / "trips.csv"
    assert run("study", "export", lab, "--out", str(table)).exit_code == 0
    assert "A bit too slow." in table.read_text(encoding="utf-8")
    assert run("study", "unblind", lab).exit_code != 0
    assert run("study", "unblind", lab, "--early").exit_code == 0


def test_the_operator_alone_is_told_which_system_it_is(lab: str) -> None:
    assert "without a profile" not in said(run("study", "next", lab))
    assert "with the participant's profile" in said(run("study", "next", lab, "--operator"))


def test_who_withdraws_is_asked_about_and_erased(lab: str) -> None:
    run("study", "consent", lab, "--participant", "P001")
    run("study", "record", lab, "--participant", "P001", "--number", "1", "--no-takeover")
    refused = runner.invoke(app, ["study", "withdraw", lab, "--participant", "P001"], input="n\n")
    assert refused.exit_code == 1
    assert "1 records of P001 are erased" in said(run("study", "withdraw", lab, "--participant", "P001", "--yes"))
    assert "P002, trip 1" in said(run("study", "next", lab))


def test_mistakes_are_said(lab: str, tmp_path: Path) -> None:
    assert run("study", "next", str(tmp_path / "none")).exit_code != 0
    assert run("study", "export", lab).exit_code != 0
    assert run("study", "consent", lab, "--participant", "Ana").exit_code != 0
    assert run("bench", "personalization", "--half", "other").exit_code != 0


def test_help_has_examples() -> None:
    for words in (("study",), ("bench", "personalization")):
        plain = re.sub(r"\x1b\[[0-9;]*m", "", run(*words, "--help").output)
        assert "Examples" in plain
        assert "imulated" in plain
