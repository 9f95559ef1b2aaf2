"""Retention and privacy mode: settings of an installation, kept to by the vault, and never guessed."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from memory_trips import Clock, trip

from chauffeur.concept import ConfigError, PersonId
from chauffeur.memory import VaultMemory
from chauffeur.memory.privacy import PRIVACY_FILE, RETENTION_DAYS, Privacy, read_privacy, write_privacy

pytestmark = pytest.mark.usefixtures("unsynced")

Wishes = Callable[..., list[str]]
ANN = PersonId("Ann")


def test_ninety_days_are_kept_unless_somebody_says_otherwise(tmp_path: Path) -> None:
    assert RETENTION_DAYS == 90
    assert read_privacy(tmp_path) == Privacy(90, keeps=True)
    write_privacy(Privacy(30, keeps=False), tmp_path)
    assert read_privacy(tmp_path) == Privacy(30, keeps=False)
    assert (tmp_path / PRIVACY_FILE).stat().st_mode & 0o077 == 0


def test_in_privacy_mode_nothing_new_is_kept_and_what_is_there_is_recalled(
    tmp_path: Path, clock: Clock, wishes: Wishes
) -> None:
    VaultMemory(tmp_path, clock=clock).remember(trip("Ann", "drive faster"))
    before = {path: path.read_bytes() for path in tmp_path.rglob("*.db")}
    write_privacy(Privacy(keeps=False), tmp_path)
    private = VaultMemory(tmp_path, clock=clock)
    private.remember(trip("Ann", "drive much faster"))
    private.remember(trip("Ben", "hurry up"))
    assert wishes(private, "Ann") == ["drive faster"]
    assert {path: path.read_bytes() for path in tmp_path.rglob("*.db")} == before, "not a byte was written"


def test_the_sweeper_deletes_what_is_too_old_of_everybody(tmp_path: Path, clock: Clock) -> None:
    vault = VaultMemory(tmp_path, clock=clock)
    for person in ("Ann", "Ben"):
        vault.remember(trip(person, "drive faster"))
    clock.pass_by(days=40)
    vault.remember(trip("Ann", "hurry up"))
    assert vault.sweep() == 0
    write_privacy(Privacy(30), tmp_path)
    assert VaultMemory(tmp_path, clock=clock).sweep() == 2
    kept = [each["instruction"] for each in json.loads(vault.export(ANN))["trips"]]
    assert kept == ["hurry up"]
    write_privacy(Privacy(None), tmp_path)
    clock.pass_by(days=4000)
    assert VaultMemory(tmp_path, clock=clock).sweep() == 0


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"{}",
        b"[]",
        b"\xff",
        b'{"retention_days": 0, "keeps": true}',
        b'{"retention_days": 9, "keeps": 1}',
        b'{"retention_days": "9", "keeps": true}',
        b'{"retention_days": true, "keeps": true}',
    ],
)
def test_broken_settings_are_said_and_not_guessed(tmp_path: Path, content: bytes) -> None:
    (tmp_path / PRIVACY_FILE).write_bytes(content)
    with pytest.raises(ConfigError, match="privacy settings"):
        VaultMemory(tmp_path)


@pytest.mark.parametrize("days", [0, -1, 10**9])
def test_a_retention_that_is_none_is_refused(tmp_path: Path, days: int) -> None:
    with pytest.raises(ConfigError, match="days"):
        write_privacy(Privacy(days), tmp_path)
    assert not (tmp_path / PRIVACY_FILE).exists()
