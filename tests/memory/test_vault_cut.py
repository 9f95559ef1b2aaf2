"""A profile cut at any byte: said in words, or read as far as it is whole; never a wrong trip, nor another's trouble.

What kill -9 leaves is another matter, and nothing confirmed is lost by it: the file, or the file and its log.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from memory_trips import Clock, context, trip

from chauffeur.concept import Feedback, Instruction, PersonId, ProfileError
from chauffeur.memory import VaultMemory, cipher

pytestmark = pytest.mark.usefixtures("unsynced")

ANN, BEN = PersonId("Ann"), PersonId("Ben")
TRIPS = 30
PAGE = 4096


@pytest.fixture(scope="module")
def made(unsynced: None, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A home as kill -9 leaves it: Ann's last ten trips are confirmed and still in the log."""
    folder = tmp_path_factory.mktemp("cut")
    vault = VaultMemory(folder / "made", clock=Clock())
    vault.remember(trip("Ben", "drive faster"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cipher, "BUSY_S", 0.0)
        reader = None
        for number in range(TRIPS):
            if number == TRIPS - 10:
                (path,) = [one for one in (folder / "made").rglob("*.db") if one.stem == vault._ring.alias(ANN)]
                key = vault._ring.find(path.stem)
                assert key is not None
                reader = cipher.connect(path, key)
                reader.execute("BEGIN")
                reader.execute("SELECT count(*) FROM trips").fetchall()
            vault.remember(trip("Ann", "drive faster", id=str(number)), Feedback("too fast", speed=-1))
        shutil.copytree(folder / "made", folder / "left", ignore=shutil.ignore_patterns("*-shm"))
        assert reader is not None
        reader.close()
        vault.close()
    yield folder / "left"


def of_ann(home: Path, suffix: str) -> Path:
    alias = VaultMemory(home)._ring.alias(ANN)
    return home / "profiles" / f"{alias}.{suffix}"


def trips_of(vault: VaultMemory, person: PersonId) -> list[str]:
    return [one["trip"] for one in json.loads(vault.export(person))["trips"]]


def test_what_was_confirmed_is_there_after_a_kill(made: Path, tmp_path: Path) -> None:
    home = tmp_path / "home"
    shutil.copytree(made, home)
    assert of_ann(home, "db-wal").stat().st_size > 10 * PAGE
    vault = VaultMemory(home, clock=Clock())
    assert trips_of(vault, ANN) == [str(number) for number in range(TRIPS)]
    vault.remember(trip("Ann", "drive faster", id="more"))
    assert of_ann(home, "db-wal").stat().st_size == 0
    assert len(vault.recall(ANN, Instruction("drive faster"), context(), 99).items) == TRIPS + 1


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(part=st.floats(0.0, 1.0), which=st.sampled_from(["db", "db-wal"]), on_page=st.booleans(), log=st.booleans())
@example(part=0.0, which="db", on_page=True, log=True)
@example(part=0.0, which="db-wal", on_page=True, log=True)
@example(part=0.999, which="db", on_page=False, log=False)
@example(part=0.5, which="db", on_page=True, log=True)
def test_a_profile_cut_anywhere(made: Path, tmp_path: Path, part: float, which: str, on_page: bool, log: bool) -> None:
    home = tmp_path / "home"
    shutil.rmtree(home, ignore_errors=True)
    shutil.copytree(made, home)
    if not log and which == "db":
        of_ann(home, "db-wal").unlink()
    path = of_ann(home, which)
    size = int(part * path.stat().st_size)
    if on_page:
        header, frame = (0, PAGE) if which == "db" else (32, PAGE + 24)
        size = min(size, header + max(0, size - header) // frame * frame)
    with path.open("r+b") as file:
        file.truncate(size)

    vault = VaultMemory(home, clock=Clock())
    confirmed = [str(number) for number in range(TRIPS)]
    whole = True
    for use in (
        lambda: trips_of(vault, ANN),
        lambda: [one.trip_id for one in vault.recall(ANN, Instruction("drive faster"), context(), 99).items],
        lambda: trips_of(vault, ANN),
    ):
        try:
            kept = use()
        except ProfileError as error:
            whole = False
            assert "'Ann'" in error.message
            assert "Other profiles are not affected" in error.hint
        else:
            # A cut log is a shorter log: what is read is what was once the whole profile.
            assert sorted(kept, key=int) == confirmed[: len(kept)]
            assert which == "db-wal" or len(kept) == (TRIPS if log else TRIPS - 10)
            assert len(kept) >= TRIPS - 10
    try:
        vault.remember(trip("Ann", "drive faster", id="77"))
    except ProfileError:
        assert not whole
    else:
        assert whole
        assert trips_of(vault, ANN)[-1] == "77"

    assert trips_of(vault, BEN) == ["t1"]
    vault.remember(trip("Ben", "hurry up"))
    assert BEN in vault.people()
    assert vault.erase(ANN)
    assert not [one for one in home.rglob("*") if path.stem in one.name]
    vault.remember(trip("Ann", "drive faster", id="anew"))
    assert trips_of(vault, ANN) == ["anew"]
    vault.close()


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(part=st.floats(0.0, 0.9999), value=st.integers(1, 255), which=st.sampled_from(["db", "db-wal"]))
def test_a_changed_byte_anywhere_gives_no_wrong_trip(
    made: Path, tmp_path: Path, part: float, value: int, which: str
) -> None:
    home = tmp_path / "home"
    shutil.rmtree(home, ignore_errors=True)
    shutil.copytree(made, home)
    path = of_ann(home, which)
    content = bytearray(path.read_bytes())
    content[int(part * len(content))] ^= value
    path.write_bytes(content)
    vault = VaultMemory(home, clock=Clock())
    for use in (
        lambda: trips_of(vault, ANN),
        lambda: [one.trip_id for one in vault.recall(ANN, Instruction("drive faster"), context(), 99).items],
    ):
        try:
            kept = use()
        except ProfileError as error:
            assert "'Ann'" in error.message
        else:
            assert sorted(kept, key=int) == [str(number) for number in range(len(kept))]
    assert trips_of(vault, BEN) == ["t1"]
    vault.close()
