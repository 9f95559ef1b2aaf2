"""The memory in Chroma: the same promises, and nothing left of what was forgotten."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from memory_trips import Clock, chroma_memory, context, trip

from chauffeur.concept import Feedback, Instruction, MissingExtraError, PersonId, ProfileError
from chauffeur.memory import Memory, VaultMemory, interpret_feedback
from chauffeur.memory.chroma import ChromaMemory, _blank

try:
    import chromadb  # pyright: ignore[reportMissingImports]
except ImportError:
    chromadb = None

ANN, BEN = PersonId("Ann"), PersonId("Ben")


@pytest.mark.skipif(chromadb is not None, reason="Chroma is installed")
def test_without_chroma_the_extra_is_named() -> None:
    with pytest.raises(MissingExtraError, match=r"-m pip install .*\[chroma\]"):
        ChromaMemory()


@pytest.fixture
def memory(tmp_path: Path, clock: Clock) -> ChromaMemory:
    return chroma_memory(tmp_path / "home", clock)


def recalled(memory: Memory, person: PersonId, text: str = "drive faster", k: int = 3) -> list[str]:
    return [one.instruction for one in memory.recall(person, Instruction(text), context(), k).items]


def spelled(folder: Path, *words: str) -> set[str]:
    """Words that any file spells."""
    content = b"".join(path.read_bytes() for path in folder.rglob("*") if path.is_file())
    return {word for word in words if any(word.encode(code) in content for code in ("utf-8", "utf-16-le"))}


def test_it_ranks_as_the_vault_does(memory: ChromaMemory, tmp_path: Path, clock: Clock) -> None:
    vault = VaultMemory(tmp_path / "vault", clock=clock)
    wishes = [
        "drive faster",
        "slow down",
        "keep a distance of 20 meters",
        "hurry up",
        "turn left",
        "do not turn left",
        "",
    ]
    for number in range(14):
        said = interpret_feedback(["too fast", "too slow", "too close"][number % 3]) if number % 4 == 0 else None
        one = trip("Ann", wishes[number % 7], id=str(number), world=("highway", "intersection")[number % 2])
        weather = ("weather", ("light rain", "clear sky")[number % 2])
        situation = replace(one.context.situation, scene=(weather,))
        one = replace(one, context=replace(one.context, situation=situation))
        memory.remember(one, said)
        vault.remember(one, said)
        clock.pass_by(days=2)
    for text in ("I'm in a hurry", "drive slower", "keep 22 meters distance", "turn left", "sing"):
        found, wanted = (each.recall(ANN, Instruction(text), one.context, 4).items for each in (memory, vault))
        assert [replace(item, similarity=0.0) for item in found] == [replace(item, similarity=0.0) for item in wanted]
        assert [item.similarity for item in found] == pytest.approx([item.similarity for item in wanted], abs=1e-5)
    assert json.loads(memory.export(ANN))["trips"] == json.loads(vault.export(ANN))["trips"]
    assert memory.latest(ANN, "highway", 3) == vault.latest(ANN, "highway", 3)


def test_what_was_forgotten_is_in_no_file(memory: ChromaMemory, tmp_path: Path) -> None:
    memory.remember(trip("Ann", "drive xylophone", thoughts="marmalade"))
    memory.remember(trip("Ann", "drive zeppelin faster", id="t2", thoughts="quicksand"), Feedback("hippopotamus"))
    words = ("xylophone", "marmalade", "zeppelin", "quicksand", "hippopotamus")
    assert spelled(tmp_path, *words) == set(words), "Chroma does not encrypt"
    forgotten = memory.forget_last(ANN)
    assert forgotten is not None
    assert (forgotten.trip_id, forgotten.feedback[0].text) == ("t2", "hippopotamus")
    assert spelled(tmp_path, *words) == {"xylophone", "marmalade"}
    assert recalled(memory, ANN, "drive xylophone") == ["drive xylophone"]
    memory.remember(trip("Ann", "drive faster"))
    assert len(json.loads(memory.export(ANN))["trips"]) == 2
    assert memory.erase(ANN)
    assert spelled(tmp_path, *words, "Ann") == set()
    assert sorted(path.name for path in tmp_path.rglob("*") if path.is_file()) == ["lock", "salt"]
    assert not memory.erase(ANN)


def test_no_profile_is_read_through_another_person(memory: ChromaMemory, tmp_path: Path) -> None:
    for person in ("Ann", "Ben"):
        memory.remember(trip(person, "drive faster"))
    folders = {name: tmp_path / "home" / "chroma" / memory._ring.alias(PersonId(name)) for name in ("Ann", "Ben")}
    assert memory.erase(BEN)
    folders["Ann"].rename(folders["Ben"])
    with pytest.raises(ProfileError, match="somebody else's"):
        recalled(memory, BEN)


def test_retention_leaves_no_byte_at_the_next_write(memory: ChromaMemory, tmp_path: Path, clock: Clock) -> None:
    memory.remember(trip("Ann", "drive xylophone faster"))
    memory.remember(trip("Ben", "drive xylophone faster"))
    clock.pass_by(days=91)
    assert recalled(memory, ANN) == []
    memory.remember(trip("Ann", "hurry up"))
    assert recalled(memory, ANN) == ["hurry up"]
    assert memory.sweep() == 1
    assert spelled(tmp_path, "xylophone") == set()


def test_a_cut_profile_is_said_and_the_others_go_on(memory: ChromaMemory, tmp_path: Path) -> None:
    memory.remember(trip("Ben", "drive faster"))
    for part in (0.0, 0.1, 0.5, 0.99):
        memory.remember(trip("Ann", "drive faster"))
        path = max((tmp_path / "home").rglob("chroma.sqlite3"), key=lambda one: one.stat().st_mtime_ns)
        with path.open("r+b") as file:
            file.truncate(int(part * path.stat().st_size))
        uses: list[Callable[[], object]] = [
            lambda: recalled(memory, ANN),
            lambda: memory.remember(trip("Ann", "drive faster")),
            lambda: memory.export(ANN),
        ]
        for use in uses:
            with pytest.raises(ProfileError, match="'Ann'") as caught:
                use()
            assert "Other profiles are not affected" in caught.value.hint
        assert recalled(memory, BEN) == ["drive faster"]
        assert memory.people() == (BEN,)
        assert memory.erase(ANN)


def test_what_a_crash_left_behind_is_swept_away(memory: ChromaMemory, tmp_path: Path, clock: Clock) -> None:
    memory.remember(trip("Ann", "drive faster"))
    (folder,) = [one for one in (tmp_path / "home" / "chroma").iterdir() if one.is_dir()]
    half = folder / "0123.draft"
    half.mkdir()
    (half / "chroma.sqlite3").write_bytes(b"xylophone")
    assert recalled(memory, ANN) == ["drive faster"]
    assert [path.name for path in folder.iterdir()] == ["00000001"]
    assert spelled(tmp_path, "xylophone") == set()


def test_the_index_holds_nothing_but_the_index(memory: ChromaMemory, tmp_path: Path) -> None:
    """Chroma writes out memory it never cleared: here the words of many strings that are no more."""
    words = ["xylophone marmalade " * 88 for _ in range(20_000)]
    del words
    memory.remember(trip("Ann", "drive faster"))
    (path,) = (tmp_path / "home").rglob("data_level0.bin")
    assert path.stat().st_size > 0
    assert not any(path.read_bytes())
    assert not any((path.parent / "length.bin").read_bytes())
    header = path.parent / "header.bin"
    for content in (b"\x07" + header.read_bytes()[1:], b"", header.read_bytes()[:20]):
        header.write_bytes(content)
        with pytest.raises(ValueError, match="form that is not known"):
            _blank(path.parents[1])


WRITER = """
import sys
sys.path.insert(0, sys.argv[1])
from pathlib import Path
from memory_trips import trip
from chauffeur.memory.chroma import ChromaMemory
memory = ChromaMemory(Path(sys.argv[2]))
for number in range(1000):
    memory.remember(trip("Ann", f"drive faster {number}"))
    print(number, flush=True)
"""


def test_kill_9_while_writing_loses_nothing_acknowledged(memory: ChromaMemory, tmp_path: Path) -> None:
    command = [sys.executable, "-c", WRITER, str(Path(__file__).parent), str(tmp_path / "home")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        acknowledged = [process.stdout.readline().strip() for _ in range(2)]
        process.kill()
        acknowledged += process.stdout.read().split()
    kept = [one["instruction"].split()[-1] for one in json.loads(memory.export(ANN))["trips"]]
    assert kept[: len(acknowledged)] == acknowledged
    memory.remember(trip("Ann", "drive faster"))
    assert len(json.loads(memory.export(ANN))["trips"]) == len(kept) + 1


def test_with_the_salt_lost_a_person_is_erased_all_the_same(memory: ChromaMemory, tmp_path: Path) -> None:
    for person in ("Ann", "Ben"):
        memory.remember(trip(person, "drive faster"))
    salt = tmp_path / "home" / "chroma" / "salt"
    salt.unlink()
    fresh = ChromaMemory(tmp_path / "home")
    with pytest.raises(ProfileError, match="salt is missing"):
        fresh.remember(trip("Ann", "drive faster"))
    assert fresh.erase(ANN)
    assert not salt.exists()
    assert fresh.erase(BEN)
    assert not fresh.erase(BEN)
    assert not [path for path in salt.parent.iterdir() if path.is_dir()]
