"""`chauffeur me`: a person sees, takes and erases what is remembered; settings are kept to and shown."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from chauffeur.cli.main import app
from chauffeur.concept import ConfigError


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("CHAUFFEUR_HOME", str(tmp_path / "home"))
    monkeypatch.setenv("COLUMNS", "200")
    return tmp_path / "home"


def run(*words: str, code: int = 0) -> str:
    result = CliRunner().invoke(app, list(words))
    assert result.exit_code == code, (result.output, result.exception)
    return result.output


def driven(wish: str = "Turn right.") -> str:
    """A drive of the baseline, which knows the left turn and not the right one."""
    return run("drive", wish, "--as", "ana", "--planner", "keyword", code=int(wish == "Turn right."))


def test_a_profile_from_the_first_trip_to_its_end(home: Path, tmp_path: Path) -> None:
    assert "Nothing is remembered of ana." in run("me", "show", "--as", "ana")
    driven()
    run("feedback", "A bit too slow.", "--as", "ana")
    shown = run("me", "show", "--as", "ana")
    assert "Turn right." in shown
    assert "not done" in shown, "the word for it is that of every screen"
    assert "A bit too slow." in shown
    assert "1 trips in all" in shown
    assert "for 90 days" in shown
    assert "Turn right" not in run("me", "show", "--as", "ben"), "nobody reads another person's profile"
    run("me", "export", "--as", "ana", "--out", str(tmp_path / "ana.json"))
    assert json.loads((tmp_path / "ana.json").read_text())["trips"][0]["feedback"][0]["text"] == "A bit too slow."
    assert "Forgotten: “Turn right.”" in run("me", "forget-last", "--as", "ana")
    assert "Nothing is remembered of ana." in run("me", "forget-last", "--as", "ana")
    assert "Erased: the profile of ana." in run("me", "erase", "--as", "ana", "--yes")
    assert "There was no profile of ana." in run("me", "erase", "--as", "ana", "--yes")
    assert not list(home.rglob("*.key")), "the key is gone, and with it whatever copy of the file there is"


def test_to_erase_is_asked_first(home: Path) -> None:
    driven()
    assert CliRunner().invoke(app, ["me", "erase", "--as", "ana"], input="n\n").exit_code != 0
    assert "Turn right." in run("me", "show", "--as", "ana")


def test_privacy_mode_is_seen_wherever_somebody_drives(home: Path) -> None:
    assert "Privacy mode" not in driven()
    run("me", "privacy", "on")
    assert "Privacy mode: nothing of this drive is kept in the profile of ana." in driven("Turn left.")
    shown = run("me", "show", "--as", "ana")
    assert "Privacy mode is on" in shown
    assert "Turn left." not in shown
    run("me", "privacy", "off")
    driven("Turn left.")
    assert "Turn left." in run("me", "show", "--as", "ana")


def test_settings_that_are_none_are_refused_and_broken_ones_can_be_set_again(home: Path) -> None:
    for words in (("retention", "never"), ("retention", "0"), ("privacy", "maybe")):
        result = CliRunner().invoke(app, ["me", *words])
        assert result.exit_code != 0
        assert isinstance(result.exception, ConfigError) or result.exit_code == 2
    home.mkdir(exist_ok=True)
    (home / "privacy.json").write_text("{")
    assert CliRunner().invoke(app, ["me", "show", "--as", "ana"]).exit_code != 0
    assert "for 7 days" in run("me", "retention", "7")
    assert "Privacy mode is on" in run("me", "show", "--as", "ana"), "what may have been wished is not given up"


def test_limits_of_a_person_are_shown(home: Path) -> None:
    home.mkdir()
    (home / "limits.toml").write_text("[ana]\nmax_speed_kmh = 100\n")
    assert "never above 100 km/h" in run("me", "show", "--as", "ana")
