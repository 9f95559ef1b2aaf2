"""Files stay open from recall to recall: what others write, replace, cut or erase is noticed all the same."""

from __future__ import annotations

import gc
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from memory_trips import Clock, context, trip

from chauffeur.concept import Feedback, Instruction, PersonId, ProfileError
from chauffeur.memory import VaultMemory, cipher, profile
from chauffeur.memory import vault as vault_module
from chauffeur.memory.columns import Columns
from chauffeur.memory.similarity import ENCODER, encode

pytestmark = pytest.mark.usefixtures("unsynced")

ANN, BEN = PersonId("Ann"), PersonId("Ben")
Wishes = Callable[..., list[str]]


@pytest.fixture(autouse=True)
def _files_settle_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """So that files stay open although these tests write to them all the time."""
    monkeypatch.setattr(vault_module, "_SETTLED_NS", -(10**18))


def opened(vault: VaultMemory) -> profile.Profile:
    (one,) = vault._opened.values()
    return one.profile


def columns(vault: VaultMemory) -> Columns:
    (one,) = vault._opened.values()
    return one.index.columns


def vectors(columns: Columns) -> npt.NDArray[np.float32]:
    return columns._marks._vectors[:, columns._kinds.values]


def loads(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """A list that grows with every reading of the whole index."""
    read: list[int] = []
    entries = profile.Profile._entries

    def counted(self: profile.Profile) -> list[object]:
        read.append(1)
        return entries(self)  # type: ignore[return-value]

    monkeypatch.setattr(profile.Profile, "_entries", counted)
    return read


def test_a_file_stays_open_and_its_columns_follow_what_is_written(
    vault: VaultMemory, wishes: Wishes, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    read = loads(monkeypatch)
    vault.remember(trip("Ann", "drive faster"))
    assert wishes(vault, "Ann") == ["drive faster"]
    first = opened(vault)
    for number in range(5):
        vault.remember(trip("Ann", "hurry up", id=str(number)), Feedback("too fast", speed=-1))
        vault.attach_feedback(ANN, Feedback("too close", gap=-1), str(number))
        assert len(wishes(vault, "Ann")) == 2 + number
    assert columns(vault).signs[1].tolist() == [0, -1, -1, -1, -1, -1]
    vault.forget_last(ANN)
    assert len(wishes(vault, "Ann")) == 5
    clock.pass_by(days=91)
    vault.remember(trip("Ann", "faster, please"))
    assert wishes(vault, "Ann") == ["faster, please"]
    assert opened(vault) is first
    assert len(read) == 1, "the index was read from the file once, when it was opened"


def test_what_the_columns_became_is_what_is_read_from_the_file(vault: VaultMemory, clock: Clock) -> None:
    wishes = ["drive faster", "slow down", "keep a distance of 20 meters", "go 100 km/h", "turn left"]
    for number in range(30):
        vault.remember(trip("Ann", wishes[number % 5], id=str(number), world="ab"[number % 2]))
        if number % 3 == 0:
            vault.attach_feedback(ANN, Feedback("x", comfort=-1), str(number // 2))
        if number % 7 == 0:
            vault.forget_last(ANN)
        clock.pass_by(days=10)
        vault.recall(ANN, Instruction("drive faster"), context(), 3)
    grown = columns(vault)
    read = profile.Index().columns
    read.extend(opened(vault)._entries())
    kept = grown.rows >= 0
    assert np.array_equal(grown.rows[kept], read.rows)
    assert np.array_equal(grown.whens[kept], read.whens)
    assert np.array_equal(grown.judged[kept], read.judged)
    assert np.array_equal(vectors(grown)[:, kept], vectors(read))
    for mine, other in zip(grown.signs, read.signs, strict=True):
        assert np.array_equal(mine[kept], other)


def test_what_another_process_writes_is_seen_at_once(vault: VaultMemory, tmp_path: Path, wishes: Wishes) -> None:
    other = VaultMemory(tmp_path / "home", clock=vault._clock)
    for number in range(6):
        writer, reader = (vault, other) if number % 2 else (other, vault)
        writer.remember(trip("Ann", f"drive faster {number}"))
        assert len(wishes(reader, "Ann")) == number + 1
    vault.forget_last(ANN)
    assert len(wishes(other, "Ann")) == 5
    other.attach_feedback(ANN, Feedback("too fast", speed=-1))
    assert columns_after_recall(vault, wishes).judged.tolist() == [False, False, False, False, True]


def columns_after_recall(vault: VaultMemory, wishes: Wishes) -> Columns:
    wishes(vault, "Ann")
    return columns(vault)


def test_a_write_after_another_process_wrote_does_not_hide_it(
    vault: VaultMemory, tmp_path: Path, wishes: Wishes
) -> None:
    other = VaultMemory(tmp_path / "home", clock=vault._clock)
    vault.remember(trip("Ann", "drive faster"))
    wishes(vault, "Ann")
    other.remember(trip("Ann", "hurry up"))
    vault.remember(trip("Ann", "faster, please"))
    assert sorted(wishes(vault, "Ann")) == ["drive faster", "faster, please", "hurry up"]


def test_what_another_process_erased_is_never_recalled_and_its_columns_are_overwritten(
    vault: VaultMemory, tmp_path: Path, wishes: Wishes
) -> None:
    vault.remember(trip("Ann", "drive faster"))
    vault.remember(trip("Ben", "drive faster"))
    assert wishes(vault, "Ann") == ["drive faster"]
    read = next(one.index.columns for one in vault._opened.values() if one.profile.person == ANN)
    numbers = read._marks._vectors, read.rows, read.whens
    other = VaultMemory(tmp_path / "home", clock=vault._clock)
    assert other.erase(ANN)
    assert wishes(vault, "Ben") == ["drive faster"], "to look at anybody is enough"
    assert not any(one.any() for one in numbers)
    assert len(vault._opened) == 1
    other.remember(trip("Ann", "hurry up"))
    assert wishes(vault, "Ann") == ["hurry up"]
    other.erase(ANN)
    other.remember(trip("Ann", "faster, please"))
    assert wishes(vault, "Ann") == ["faster, please"], "also where there is a new file under the old name"
    vault.remember(trip("Ann", "hurry up"))
    assert sorted(wishes(other, "Ann")) == ["faster, please", "hurry up"]


@pytest.mark.parametrize("way", ["erase", "close", "dropped"])
def test_nothing_read_of_a_person_stays_in_the_process(tmp_path: Path, wishes: Wishes, way: str) -> None:
    vault = VaultMemory(tmp_path)
    for number in range(5):
        vault.remember(trip("Ann", f"keep a distance of {number} meters"))
    assert len(wishes(vault, "Ann", "keep a distance of 3 meters")) == 5
    read, held = columns(vault), vault._opened
    numbers = [read._marks._vectors, read.rows, read.whens, read._marks._amounts.values]
    assert all(one.any() for one in numbers)
    if way == "erase":
        assert vault.erase(ANN)
        assert wishes(vault, "Ann", "keep a distance of 3 meters") == []
    elif way == "close":
        vault.close()
    else:
        del vault
        gc.collect()
    assert not any(one.any() for one in numbers)
    assert held == {}
    if way == "close":
        assert len(wishes(vault, "Ann", "keep a distance of 3 meters")) == 5


def test_after_a_write_the_file_alone_is_the_profile(vault: VaultMemory, tmp_path: Path, wishes: Wishes) -> None:
    for number in range(3):
        vault.remember(trip("Ann", f"drive faster {number}"))
    wishes(vault, "Ann")
    home, copy = tmp_path / "home", tmp_path / "copy"
    (copy / "profiles").mkdir(parents=True)
    (path,) = home.rglob("*.db")
    (copy / "profiles" / path.name).write_bytes(path.read_bytes())
    assert len(wishes(VaultMemory(copy, keys=home / "keys", clock=vault._clock), "Ann")) == 3
    for one in (home / "profiles").iterdir():
        assert one.stat().st_mode & 0o077 == 0


def test_a_file_cut_or_changed_while_it_is_open_is_said(vault: VaultMemory, tmp_path: Path, wishes: Wishes) -> None:
    for number in range(40):
        vault.remember(trip("Ann", f"drive faster {number}"))
    vault.remember(trip("Ben", "drive faster"))
    (path,) = [one for one in (tmp_path / "home").rglob("*.db") if one.stem == vault._ring.alias(ANN)]
    whole = path.read_bytes()
    for content in (whole[: len(whole) // 2], whole[:100], b"", os.urandom(len(whole))):
        assert len(wishes(vault, "Ann", k=50)) == 40
        path.write_bytes(content)
        with pytest.raises(ProfileError, match="'Ann'"):
            wishes(vault, "Ann")
        assert wishes(vault, "Ben") == ["drive faster"]
        path.write_bytes(whole)


def test_a_lost_key_closes_the_file(vault: VaultMemory, tmp_path: Path, wishes: Wishes) -> None:
    vault.remember(trip("Ann", "drive faster"))
    wishes(vault, "Ann")
    numbers = columns(vault)._marks._vectors
    (path,) = (tmp_path / "home").rglob("*.key")
    path.unlink()
    with pytest.raises(ProfileError, match="has no key"):
        wishes(vault, "Ann")
    assert not numbers.any()
    assert vault._opened == {}


def test_a_file_that_changed_just_now_is_opened_anew(vault: VaultMemory, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two changes within one tick of the file clock look the same from outside."""
    monkeypatch.setattr(vault_module, "_SETTLED_NS", 10**18)
    vault.remember(trip("Ann", "drive faster"))
    vault.recall(ANN, Instruction("drive faster"), context(), 3)
    first = opened(vault)
    vault.recall(ANN, Instruction("drive faster"), context(), 3)
    assert opened(vault) is not first
    assert len(columns(vault)) == 1


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
def test_a_forked_process_opens_its_own(vault: VaultMemory, wishes: Wishes) -> None:
    vault.remember(trip("Ann", "drive faster"))
    wishes(vault, "Ann")
    child = os.fork()
    if child == 0:
        seen = wishes(vault, "Ann") == ["drive faster"]
        vault.remember(trip("Ann", "hurry up"))
        vault.close()
        os._exit(0 if seen and len(vault_module._inherited) == 1 else 1)
    assert os.waitpid(child, 0)[1] == 0
    assert sorted(wishes(vault, "Ann")) == ["drive faster", "hurry up"]
    assert vault_module._inherited == []


def test_files_of_earlier_versions_are_read(vault: VaultMemory, wishes: Wishes, clock: Clock) -> None:
    """Vectors with their zeros, no weather, no index by time; and vectors of an encoder that is no more."""
    for number, text in enumerate(["drive faster", "drive at 100 km/h", "hurry up"]):
        vault.remember(trip("Ann", text, id=str(number)))
    before = vault.recall(ANN, Instruction("drive faster"), context(), 5)
    connection = opened(vault)._connection
    for row, text in ((1, "drive faster"), (2, "drive at 100 km/h")):
        vector = encode(text).tobytes()
        connection.execute("UPDATE marks SET encoder = ?, vector = ? WHERE id = ?", (ENCODER, vector, row))
    connection.execute("UPDATE marks SET encoder = 'words-v0', vector = x'00', tags = 0 WHERE id = 3")
    connection.execute("DROP INDEX trips_by_time")
    vault.close()
    assert vault.recall(ANN, Instruction("drive faster"), context(), 5) == before
    assert len(before.items) > 1
    vault.remember(trip("Ann", "faster, please"))
    assert opened(vault)._all("SELECT count(*) FROM sqlite_master WHERE name = 'trips_by_time'") == [(1,)]


def test_a_checkpoint_that_fails_loses_nothing(
    vault: VaultMemory, wishes: Wishes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Somebody reads for long: the write waits for them as long as for any lock, then stands in the log."""
    monkeypatch.setattr(cipher, "BUSY_S", 0.05)
    vault.remember(trip("Ann", "drive faster"))
    (path,) = (tmp_path / "home").rglob("*.db")
    key = vault._ring.find(path.stem)
    assert key is not None
    reader = cipher.connect(path, key)
    reader.execute("BEGIN")
    reader.execute("SELECT count(*) FROM trips").fetchall()
    vault.remember(trip("Ann", "hurry up"))
    assert sorted(wishes(vault, "Ann")) == ["drive faster", "hurry up"]
    assert reader.execute("SELECT count(*) FROM trips").fetchall() == [(1,)], "a reader sees one state of the file"
    reader.close()
    assert sorted(wishes(VaultMemory(tmp_path / "home", clock=vault._clock), "Ann")) == ["drive faster", "hurry up"]


def test_open_profiles_are_few_and_never_cross(vault: VaultMemory, wishes: Wishes) -> None:
    for number in range(20):
        vault.remember(trip(f"p{number}", f"drive faster {number}"))
    for number in range(20):
        assert wishes(vault, f"p{number}") == [f"drive faster {number}"]
    assert len(vault._opened) == 8
