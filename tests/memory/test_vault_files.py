"""What else can stand where a key, a salt or a profile belongs; and a salt that is lost: no data stays for ever."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from memory_trips import context, trip

from chauffeur.concept import Instruction, PersonId, ProfileError
from chauffeur.memory import VaultMemory
from chauffeur.memory.files import NotPlainFileError, open_plain, publish, read_plain, write_new
from chauffeur.memory.keys import KeyRing

pytestmark = pytest.mark.usefixtures("unsynced")

ANN, BEN = PersonId("Ann"), PersonId("Ben")


@pytest.fixture
def home(vault: VaultMemory, tmp_path: Path) -> Path:
    """A data directory with profiles of Ann and Ben."""
    for person in (ANN, BEN):
        vault.remember(trip(person, "drive faster"))
    vault.close()
    return tmp_path / "home"


def files_of(home: Path, person: PersonId) -> tuple[Path, Path]:
    alias = KeyRing(home / "keys").alias(person)
    return home / "keys" / f"{alias}.key", home / "profiles" / f"{alias}.db"


def wishes(home: Path, person: PersonId) -> list[str]:
    history = VaultMemory(home).recall(person, Instruction("drive faster"), context(), 3)
    return [item.instruction for item in history.items]


# A lost salt ---------------------------------------------------------------------------------------------------------


def test_a_lost_salt_is_not_replaced_while_there_are_profiles(home: Path) -> None:
    (home / "keys" / "salt").unlink()
    vault = VaultMemory(home)
    uses: list[Callable[[], object]] = [
        lambda: vault.recall(ANN, Instruction("drive faster"), context(), 3),
        lambda: vault.remember(trip("Ann", "drive faster")),
        lambda: vault.export(ANN),
    ]
    for use in uses:
        with pytest.raises(ProfileError, match=r"salt is missing, and without it no profile that is there is found"):
            use()
    assert not (home / "keys" / "salt").exists()
    assert vault.people() == (ANN, BEN), "they are there still"


@pytest.mark.parametrize("salt", [None, b"short", b"x" * 32])
def test_a_person_is_erased_without_the_salt_too(home: Path, salt: bytes | None) -> None:
    """Lost, damaged, or replaced by another one: what a profile says of itself is enough."""
    mine, others = files_of(home, ANN), files_of(home, BEN)
    (home / "keys" / "salt").unlink()
    if salt is not None:
        (home / "keys" / "salt").write_bytes(salt)
    vault = VaultMemory(home)
    assert vault.erase(PersonId(" Ann "))
    assert not any(path.exists() for path in mine)
    assert all(path.exists() for path in others)
    assert vault.people() == (BEN,)
    assert not vault.erase(ANN)


def test_after_the_last_one_is_erased_there_is_a_new_salt(home: Path) -> None:
    (home / "keys" / "salt").unlink()
    vault = VaultMemory(home)
    assert vault.erase(ANN)
    assert vault.erase(BEN)
    vault.remember(trip("Ann", "drive faster"))
    assert wishes(home, ANN) == ["drive faster"]


def test_both_profiles_of_one_person_go(home: Path) -> None:
    """A salt that was replaced left two profiles of one name."""
    (home / "keys" / "salt").write_bytes(b"y" * 32)
    VaultMemory(home).remember(trip("Ann", "drive slower"))
    assert VaultMemory(home).people() == (ANN, ANN, BEN)
    assert VaultMemory(home).erase(ANN)
    assert VaultMemory(home).people() == (BEN,)


def test_without_salt_and_passphrase_it_is_said_that_nothing_can_be_told(tmp_path: Path) -> None:
    home = tmp_path / "sealed"
    vault = VaultMemory(home, passphrase="open sesame")
    vault.remember(trip("Ann", "drive faster"))
    key, profile = files_of(home, ANN)
    (home / "keys" / "salt").unlink()
    with pytest.raises(ProfileError, match=f"cannot be told: .*salt is missing.* cannot be opened: {key.stem}"):
        VaultMemory(home).erase(ANN)
    assert key.exists()
    assert profile.exists()
    assert VaultMemory(home, passphrase="open sesame").erase(ANN)
    assert not key.exists()


# Something else where a file belongs ---------------------------------------------------------------------------------


def as_link(path: Path, victim: Path) -> None:
    path.unlink()
    path.symlink_to(victim)


def as_pipe(path: Path, victim: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def as_device(path: Path, victim: Path) -> None:
    path.unlink()
    path.symlink_to("/dev/zero")


def as_folder(path: Path, victim: Path) -> None:
    path.unlink()
    path.mkdir()


@pytest.mark.parametrize("change", [as_link, as_pipe, as_device, as_folder])
@pytest.mark.parametrize("which", ["key", "db", "salt", "lock", "wal"])
def test_nothing_but_a_file_is_read_or_written(
    home: Path, tmp_path: Path, which: str, change: Callable[[Path, Path], None]
) -> None:
    """A pipe would be waited for without an end, and a link could lead to any file of this person's."""
    key, profile = files_of(home, ANN)
    path = {
        "key": key,
        "db": profile,
        "salt": home / "keys" / "salt",
        "lock": home / "profiles" / "lock",
        "wal": profile.with_name(f"{profile.name}-wal"),
    }[which]
    path.touch()
    victim = tmp_path / "victim"
    content = path.read_bytes() or b"precious"
    victim.write_bytes(content)
    change(path, victim)
    vault = VaultMemory(home)
    for use in (
        lambda: vault.recall(ANN, Instruction("drive faster"), context(), 3),
        lambda: vault.remember(trip("Ann", "drive faster")),
    ):
        with pytest.raises(ProfileError, match="not a plain file"):
            use()
    assert victim.read_bytes() == content


@pytest.mark.parametrize("change", [as_link, as_pipe, as_device])
def test_a_profile_is_erased_whatever_stands_for_its_key(
    home: Path, tmp_path: Path, change: Callable[[Path, Path], None]
) -> None:
    key, profile = files_of(home, ANN)
    victim = tmp_path / "victim"
    victim.write_bytes(key.read_bytes())
    content = victim.read_bytes()
    change(key, victim)
    assert VaultMemory(home).erase(ANN)
    assert victim.read_bytes() == content, "a key that is a link was overwritten where it led to"
    assert not os.path.lexists(key)
    assert not profile.exists()
    assert VaultMemory(home).people() == (BEN,)


def test_a_link_that_leads_nowhere_makes_no_file(tmp_path: Path) -> None:
    nowhere = tmp_path / "nowhere"
    link = tmp_path / "keys"
    link.symlink_to(nowhere)
    for use in (lambda: read_plain(link), lambda: os.close(open_plain(link, os.O_RDWR | os.O_CREAT))):
        with pytest.raises(NotPlainFileError, match="not a plain file"):
            use()
    write_new(link, b"x")
    assert link.is_symlink()
    publish(link, b"whole")
    assert link.read_bytes() == b"whole"
    assert not link.is_symlink()
    assert not nowhere.exists()
