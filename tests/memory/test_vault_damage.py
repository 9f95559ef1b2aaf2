"""Damaged files, lost keys, killed processes: said in words, and never another profile's trouble."""

from __future__ import annotations

import json
import os
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from memory_trips import context, trip

from chauffeur.concept import Feedback, Instruction, PersonId, ProfileError
from chauffeur.memory import VaultMemory, files, keys, profile
from chauffeur.memory.cipher import DatabaseError
from chauffeur.memory.keys import KeyRing

ANN, BEN = PersonId("Ann"), PersonId("Ben")
Wishes = Callable[..., list[str]]


@pytest.fixture
def home(tmp_path: Path) -> Path:
    return tmp_path / "home"


def of(home: Path, person: str, suffix: str) -> Path:
    """A person's file."""
    alias = KeyRing(home / "keys").alias(PersonId(person))
    return home / {"db": "profiles", "key": "keys"}[suffix] / f"{alias}.{suffix}"


@pytest.fixture
def two(vault: VaultMemory) -> VaultMemory:
    for number in range(20):
        vault.remember(trip("Ann", f"drive faster {number}"))
    vault.remember(trip("Ben", "drive faster"))
    return vault


def refused(vault: VaultMemory, person: PersonId = ANN) -> ProfileError:
    """The error that every use of a profile gives; other profiles go on."""
    uses: list[Callable[[], object]] = [
        lambda: vault.recall(person, Instruction("drive faster"), context(), 3),
        lambda: vault.remember(trip(person, "drive faster")),
        lambda: vault.attach_feedback(person, Feedback("x")),
        lambda: vault.forget_last(person),
        lambda: vault.export(person),
    ]
    error = None
    for use in uses:
        with pytest.raises(ProfileError) as caught:
            use()
        error = caught.value
    assert error is not None
    assert "Other profiles are not affected" in error.hint or "CHAUFFEUR_PASSPHRASE" in error.hint
    return error


def test_foreign_files_are_said(two: VaultMemory, home: Path, caplog: pytest.LogCaptureFixture) -> None:
    path = of(home, "Ann", "db")
    for content in (b"hello", os.urandom(16384), of(home, "Ben", "db").read_bytes()):
        path.write_bytes(content)
        assert "'Ann'" in refused(two).message
        assert two.people() == (BEN,)
    assert "profile left out" in caplog.text
    path.unlink()
    with sqlite3.connect(path) as plain:
        plain.execute("CREATE TABLE about (name, value)")
    refused(two)


def test_a_flipped_bit_is_noticed(two: VaultMemory, home: Path) -> None:
    path = of(home, "Ann", "db")
    content = bytearray(path.read_bytes())
    content[2000] ^= 1
    path.write_bytes(content)
    refused(two)


def test_another_version_is_not_touched(vault: VaultMemory, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(profile, "VERSION", "chauffeur-profile-99")
        vault.remember(trip("Ann", "drive faster"))
    assert "unknown version 'chauffeur-profile-99'" in refused(vault).message


def test_a_lost_key_is_said(two: VaultMemory, home: Path, wishes: Wishes) -> None:
    path = of(home, "Ann", "key")
    content = path.read_bytes()
    path.unlink()
    assert "has no key" in refused(two).message
    assert wishes(two, "Ben") == ["drive faster"]
    assert two.people() == (BEN,)
    path.write_bytes(content)
    assert len(wishes(two, "Ann")) == 10
    path.unlink()
    assert two.erase(ANN)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is damaged"), (b"\xff", "is damaged"), (b"[]", "is damaged"), (b"{}", "is damaged"),
        (b'{"format": "x"}', "unknown form 'x'"), (b'{"format": "chauffeur-key-1", "key": "zz"}', "is damaged"),
        (b'{"format": "chauffeur-key-1", "key": "00"}', "holds 1 bytes"),
        (b'{"format": "chauffeur-key-1"}', "passphrase"),
        (b'{"format": "chauffeur-key-1", "key": 3}', "is damaged"),
    ],
)  # fmt: skip
def test_a_damaged_key_is_said(two: VaultMemory, home: Path, content: bytes, words: str) -> None:
    of(home, "Ann", "key").write_bytes(content)
    fresh = VaultMemory(home)
    assert words in refused(fresh).message
    assert fresh.people() == (BEN,)


def test_a_key_that_cannot_be_read_is_said(two: VaultMemory, home: Path) -> None:
    path = of(home, "Ann", "key")
    path.unlink()
    path.mkdir()
    assert "cannot be read" in refused(VaultMemory(home)).message


def test_a_damaged_salt_is_said(two: VaultMemory, home: Path) -> None:
    (home / "keys" / "salt").write_bytes(b"short")
    with pytest.raises(ProfileError, match="has 5 bytes instead of 32"):
        VaultMemory(home).recall(ANN, Instruction("x"), context(), 1)


def test_a_key_that_vanishes_while_it_is_made_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(keys, "write_new", lambda path, content: None)
    with pytest.raises(ProfileError, match="disappeared"):
        KeyRing(tmp_path).find_or_make("a")


def test_a_disk_that_refuses_is_said(two: VaultMemory, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*args: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("chauffeur.memory.vault.create_profile", full)
    with pytest.raises(ProfileError, match="No space left") as caught:
        two.remember(trip("Cleo", "drive faster"))
    assert caught.value.retryable


def test_a_failed_write_leaves_nothing_half_done(two: VaultMemory, home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = two.export(ANN)
    monkeypatch.setattr(profile, "feedback_body", lambda feedback: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        two.remember(trip("Ann", "drive faster"), Feedback("x"))
    monkeypatch.undo()
    assert json.loads(two.export(ANN))["trips"] == json.loads(before)["trips"]


def test_a_write_waits_for_no_lock_for_ever(two: VaultMemory, home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from chauffeur.memory import cipher

    monkeypatch.setattr(cipher, "BUSY_S", 0.05)
    key = KeyRing(home / "keys").find(of(home, "Ann", "key").stem)
    assert key is not None
    other = cipher.connect(of(home, "Ann", "db"), key)
    other.execute("BEGIN IMMEDIATE")
    with pytest.raises(ProfileError) as caught:
        two.remember(trip("Ann", "drive faster"))
    assert caught.value.retryable
    other.close()
    two.remember(trip("Ann", "drive faster"))


def test_a_missing_file_is_no_new_database(tmp_path: Path) -> None:
    from chauffeur.memory import cipher

    with pytest.raises(DatabaseError):
        cipher.connect(tmp_path / "none.db", b"k" * 32)
    assert not (tmp_path / "none.db").exists()


def test_what_a_crash_left_behind_is_swept_away(vault: VaultMemory, home: Path, wishes: Wishes) -> None:
    vault.remember(trip("Ben", "drive faster"))
    alias = KeyRing(home / "keys").alias(ANN)
    (home / "profiles" / f"{alias}.draft").write_bytes(b"half")
    (home / "keys" / f"{alias}.key.0123.draft").write_bytes(b"half")
    vault.remember(trip("Ann", "drive faster"))
    assert wishes(vault, "Ann") == ["drive faster"]
    vault.erase(ANN)
    assert not [path for path in home.rglob("*") if alias in path.name]


def test_a_key_made_before_a_crash_is_used(vault: VaultMemory, home: Path, wishes: Wishes) -> None:
    vault.remember(trip("Ann", "drive faster"))
    of(home, "Ann", "db").unlink()
    assert wishes(vault, "Ann") == []
    vault.remember(trip("Ann", "hurry up"))
    assert wishes(vault, "Ann") == ["hurry up"]


# Passphrase ----------------------------------------------------------------------------------------------------------


def test_sealed_keys_open_only_with_the_passphrase(home: Path, wishes: Wishes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CHAUFFEUR_PASSPHRASE", "correct horse")
    VaultMemory(home).remember(trip("Ann", "drive faster"))
    assert wishes(VaultMemory(home), "Ann") == ["drive faster"]
    assert b'"key"' not in of(home, "Ann", "key").read_bytes()
    assert "does not open" in refused(VaultMemory(home, passphrase="battery staple")).message
    assert "is sealed" in refused(VaultMemory(home, passphrase="")).message
    text = of(home, "Ann", "key").read_text()
    of(home, "Ann", "key").write_text(text.replace('"salt": "', '"salt": "00'))
    assert "does not open" in refused(VaultMemory(home)).message


def test_setting_a_passphrase_seals_keys_made_without_one(home: Path, wishes: Wishes) -> None:
    VaultMemory(home).remember(trip("Ann", "drive faster"))
    assert b'"key"' in of(home, "Ann", "key").read_bytes()
    assert wishes(VaultMemory(home, passphrase="p"), "Ann") == ["drive faster"]
    assert b'"key"' not in of(home, "Ann", "key").read_bytes()
    assert wishes(VaultMemory(home, passphrase="p"), "Ann") == ["drive faster"]


def test_two_people_under_one_passphrase_have_different_keys(home: Path) -> None:
    vault = VaultMemory(home, passphrase="p")
    vault.remember(trip("Ann", "drive faster"))
    vault.remember(trip("Ben", "drive faster"))
    ring = KeyRing(home / "keys", "p")
    assert ring.find(ring.alias(ANN)) != ring.find(ring.alias(BEN))


# Files ---------------------------------------------------------------------------------------------------------------


def test_the_first_writer_wins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "f"
    files.write_new(path, b"one")
    files.write_new(path, b"two")
    assert path.read_bytes() == b"one"
    monkeypatch.setattr(Path, "exists", lambda self: False)
    files.write_new(path, b"three")
    assert path.read_bytes() == b"one"
    assert list(tmp_path.iterdir()) == [path]


# Processes -----------------------------------------------------------------------------------------------------------

WRITER = """
import sys
sys.path.insert(0, sys.argv[1])
from pathlib import Path
from memory_trips import trip
from chauffeur.memory import VaultMemory
vault = VaultMemory(Path(sys.argv[2]))
for number in range(int(sys.argv[5])):
    vault.remember(trip(sys.argv[3], f"drive faster {sys.argv[4]}.{number}"))
    print(f"{sys.argv[4]}.{number}", flush=True)
"""


def writer(home: Path, person: str, name: str, count: int) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", WRITER, str(Path(__file__).parent), str(home), person, name, str(count)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)


def remembered(home: Path, person: PersonId) -> list[str]:
    return [one["instruction"].split()[-1] for one in json.loads(VaultMemory(home).export(person))["trips"]]


def test_kill_9_while_writing_loses_nothing_acknowledged(home: Path) -> None:
    acknowledged: list[str] = []
    for round_number in range(5):
        process = writer(home, "Ann", str(round_number), 10_000)
        assert process.stdout is not None
        acknowledged.append(process.stdout.readline().strip())
        time.sleep(0.05 + 0.037 * round_number)
        process.send_signal(signal.SIGKILL)
        acknowledged += process.stdout.read().split()
        process.wait()
        kept = remembered(home, ANN)
        assert set(acknowledged) <= set(kept)
        assert len(kept) <= len(acknowledged) + round_number + 1
    assert len(acknowledged) > 5
    assert VaultMemory(home).people() == (ANN,)


def test_processes_that_write_at_once_lose_nothing(home: Path) -> None:
    processes = [writer(home, person, f"w{n}", 15) for n, person in enumerate(["Ann", "Ann", "Ann", "Ben"])]
    for process in processes:
        assert process.wait(timeout=600) == 0
        assert process.stdout is not None
        process.stdout.close()
    assert sorted(remembered(home, ANN)) == sorted(f"w{n}.{i}" for n in range(3) for i in range(15))
    assert len(remembered(home, BEN)) == 15


def test_a_profile_erased_between_making_and_writing_is_made_again(
    vault: VaultMemory, wishes: Wishes, monkeypatch: pytest.MonkeyPatch
) -> None:
    ensure = vault._ensure
    times = 0

    def ensure_then_lose(person: PersonId) -> None:
        nonlocal times
        ensure(person)
        times += 1
        if times == 1:
            vault.erase(person)

    monkeypatch.setattr(vault, "_ensure", ensure_then_lose)
    vault.remember(trip("Ann", "drive faster"))
    assert times == 2
    assert wishes(vault, "Ann") == ["drive faster"]


def test_the_vault_serves_threads(vault: VaultMemory, wishes: Wishes) -> None:
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda n: vault.remember(trip("Ann", f"drive faster {n}")), range(20)))
        assert all(len(found) == 10 for found in pool.map(lambda _: wishes(vault, "Ann"), range(8)))
