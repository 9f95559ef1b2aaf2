"""What is remembered, of whom, and what is left on the disk."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from memory_trips import Clock, context, trip

from chauffeur.concept import (
    NOBODY,
    ActionMatrix,
    Feedback,
    History,
    Instruction,
    Parameters,
    PersonId,
    Trajectory,
)
from chauffeur.concept.data import data_home
from chauffeur.memory import Memory, VaultMemory, interpret_feedback
from chauffeur.memory.records import MAX_CHARS

pytestmark = pytest.mark.usefixtures("unsynced")

ANN, BEN = PersonId("Ann"), PersonId("Ben")
Wishes = Callable[..., list[str]]


def recall(memory: Memory, person: PersonId, text: str = "drive faster", k: int = 3) -> History:
    return memory.recall(person, Instruction(text), context(), k)


def test_a_trip_comes_back_whole(memory: Memory, clock: Clock) -> None:
    assert isinstance(memory, Memory)
    memory.remember(
        trip("Ann", "Drive faster", thoughts="They are late."), Feedback("too fast", speed=-1, strength=0.6)
    )
    clock.pass_by(minutes=5)
    assert memory.attach_feedback(ANN, Feedback("way too close", gap=-1, approval=-1, strength=1.0))
    (item,) = recall(memory, ANN).items
    assert item.trip_id == "t1"
    assert item.when == "2026-03-01T12:00:00.000+00:00"
    assert (item.instruction, item.context) == ("Drive faster", "I am driving at 30.0 m/s.")
    assert (item.world, item.intent, item.thoughts) == ("highway", "x", "They are late.")
    assert item.policy.startswith("def p():")
    assert item.settings == (("target_speed_mps", 28.0),)
    assert [one.text for one in item.feedback] == ["too fast", "way too close"]
    assert item.feedback[1] == Feedback("way too close", gap=-1, approval=-1, strength=1.0)
    assert item.outcome == "success"
    assert item.similarity == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize(
    ("policy", "text"),
    [
        (Parameters(15.0, 10.0, 2.0, -1), '"target_speed_mps": 15.0'),
        (ActionMatrix((1.0, 0.1, 0.0), (1.0, 2.0, 3.0)), '"mpc": [1.0, 2.0, 3.0]'),
        (Trajectory(((1.0, 0.0),), 0.5), '"period_s": 0.5'),
    ],
)
def test_policies_other_than_programs_are_kept_as_json(memory: Memory, policy: Parameters, text: str) -> None:
    memory.remember(trip("Ann", "drive faster", policy=policy))
    assert text in recall(memory, ANN).items[0].policy


def test_a_refused_wish_is_kept_with_its_refusal(memory: Memory) -> None:
    from dataclasses import replace

    one = trip("Ann", "drive faster")
    memory.remember(replace(one, plan=replace(one.plan, policy=None, refusal="I do not fly.")))
    (item,) = recall(memory, ANN).items
    assert (item.policy, item.thoughts) == ("", "I do not fly.")


def test_feedback_changes_only_that_person(vault: VaultMemory, tmp_path: Path) -> None:
    vault.remember(trip("Ann", "drive faster"))
    before = vault.export(ANN), recall(vault, ANN)
    files = {path: path.read_bytes() for path in (tmp_path / "home").rglob("*.db")}
    vault.remember(trip("Ben", "drive faster"), Feedback("too slow", speed=1))
    assert vault.attach_feedback(BEN, Feedback("too close", gap=-1), "t1")
    vault.forget_last(BEN)
    vault.erase(BEN)
    assert (vault.export(ANN), recall(vault, ANN)) == before
    assert {path: path.read_bytes() for path in files} == files


def test_feedback_goes_to_the_last_trip_or_to_the_one_named(memory: Memory) -> None:
    memory.remember(trip("Ann", "drive faster", id="a"))
    memory.remember(trip("Ann", "drive faster", id="b"))
    memory.remember(trip("Ann", "drive faster", id="a"))
    assert memory.attach_feedback(ANN, Feedback("last"))
    assert memory.attach_feedback(ANN, Feedback("second"), "b")
    assert memory.attach_feedback(ANN, Feedback("a again"), "a")
    assert not memory.attach_feedback(ANN, Feedback("lost"), "c")
    assert not memory.attach_feedback(BEN, Feedback("lost"))
    trips = json.loads(memory.export(ANN))["trips"]
    assert [[one["text"] for one in kept["feedback"]] for kept in trips] == [[], ["second"], ["last", "a again"]]


def test_recall_of_nobody_and_of_strangers_writes_nothing(memory: Memory, tmp_path: Path) -> None:
    for person in (NOBODY, PersonId("  "), ANN):
        assert recall(memory, person) == History()
        assert not memory.attach_feedback(person, Feedback("x"))
        assert memory.forget_last(person) is None
        assert not memory.erase(person)
        assert json.loads(memory.export(person))["trips"] == []
    memory.remember(trip("", "drive faster"))
    memory.remember(trip(" \t", "drive faster"))
    assert memory.people() == ()
    assert not (tmp_path / "home").exists()


def test_forget_last_tells_what_it_forgot(memory: Memory, wishes: Wishes) -> None:
    memory.remember(trip("Ann", "drive faster", id="a"))
    memory.remember(trip("Ann", "drive a lot faster", id="b"), Feedback("no"))
    forgotten = memory.forget_last(ANN)
    assert forgotten is not None
    assert (forgotten.trip_id, forgotten.feedback) == ("b", (Feedback("no"),))
    assert wishes(memory, "Ann") == ["drive faster"]
    memory.forget_last(ANN)
    assert memory.forget_last(ANN) is None
    assert memory.people() == (ANN,)


def test_erase_leaves_no_file_and_no_trip(vault: VaultMemory, tmp_path: Path) -> None:
    vault.remember(trip("Ann", "drive faster"))
    vault.remember(trip("Ben", "drive faster"))
    assert vault.erase(ANN)
    assert not vault.erase(ANN)
    assert vault.people() == (BEN,)
    assert recall(vault, ANN) == History()
    assert len(list((tmp_path / "home").rglob("*.key"))) == len(list((tmp_path / "home").rglob("*.db"))) == 1
    vault.remember(trip("Ann", "hurry up"))
    assert [item.instruction for item in recall(vault, ANN).items] == ["hurry up"]


def test_no_word_is_readable_on_the_disk(vault: VaultMemory, tmp_path: Path) -> None:
    words = ["Annabelle", "xylophone", "marmalade", "quicksand", "hippopotamus", "zeppelin"]
    vault.remember(
        trip(words[0], f"drive {words[1]}", id=words[5], thoughts=words[2], where=words[3]), Feedback(words[4])
    )
    vault.attach_feedback(PersonId(words[0]), Feedback(f"more {words[4]}"))
    for path in (tmp_path / "home").rglob("*"):
        text = (path.read_bytes() if path.is_file() else b"").lower() + str(path).lower().encode()
        for word in words:
            for code in ("utf-8", "utf-16-le", "utf-16-be"):
                assert word.lower().encode(code) not in text


def test_files_are_for_their_owner_alone(vault: VaultMemory, tmp_path: Path) -> None:
    vault.remember(trip("Ann", "drive faster"))
    modes = {path.suffix: path.stat().st_mode & 0o777 for path in (tmp_path / "home").rglob("*") if path.is_file()}
    assert set(modes.values()) == {0o600}
    assert (tmp_path / "home" / "keys").stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize(
    "name", ["../../etc/passwd", "/etc/passwd", "a/b", "..", "\x00", "ü" * 400, "CON", "*", "\ud800"]
)
def test_any_name_is_only_a_name(memory: Memory, tmp_path: Path, wishes: Wishes, name: str) -> None:
    memory.remember(trip(name, "drive faster \ud800", id="\ud800", thoughts="\ud800"), Feedback("\ud800"))
    assert wishes(memory, name) == ["drive faster \ud800"]
    assert memory.attach_feedback(PersonId(name), Feedback("x"), "\ud800")
    assert memory.people() == (PersonId(name),)
    folders = {path.relative_to(tmp_path).parts[1] for path in tmp_path.rglob("*") if path.is_file()}
    assert folders in ({"profiles", "keys"}, {"chroma"})
    assert memory.erase(PersonId(name))


def test_the_same_name_in_other_code_points_is_the_same_person(memory: Memory, wishes: Wishes) -> None:
    memory.remember(trip("Zoe\u0308", "drive faster"))
    assert wishes(memory, " Zo\u00eb ") == ["drive faster"]


def test_retention_hides_at_once_and_deletes_at_the_next_write(tmp_path: Path, clock: Clock, wishes: Wishes) -> None:
    vault = VaultMemory(tmp_path, clock=clock)
    vault.remember(trip("Ann", "drive faster"))
    clock.pass_by(days=89)
    vault.remember(trip("Ann", "drive much faster"))
    assert len(wishes(vault, "Ann")) == 2
    clock.pass_by(days=2)
    assert wishes(vault, "Ann") == ["drive much faster"]
    assert len(json.loads(vault.export(ANN))["trips"]) == 2
    vault.remember(trip("Ann", "hurry up"))
    assert len(json.loads(vault.export(ANN))["trips"]) == 2


def test_a_runaway_text_is_cut(memory: Memory) -> None:
    memory.remember(trip("Ann", "drive faster", thoughts="x" * (MAX_CHARS + 1), where="y" * MAX_CHARS))
    (item,) = recall(memory, ANN).items
    assert len(item.thoughts) == MAX_CHARS
    assert item.thoughts.endswith("…")
    assert item.context == "y" * MAX_CHARS


def test_the_export_is_json_with_everything(vault: VaultMemory, clock: Clock) -> None:
    vault.remember(trip("Ann", "drive faster"))
    clock.pass_by(hours=1)
    vault.attach_feedback(ANN, interpret_feedback("a bit too fast"))
    document = json.loads(vault.export(ANN))
    assert (document["format"], document["person"]) == ("chauffeur-profile-1", "Ann")
    (kept,) = document["trips"]
    assert kept["instruction"] == "drive faster"
    assert kept["feedback"] == [
        {"when": "2026-03-01T13:00:00.000+00:00", "text": "a bit too fast", "speed": -1, "gap": 0, "comfort": 0,
         "approval": 0, "strength": 0.35}
    ]  # fmt: skip


def test_the_data_directory(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("CHAUFFEUR_HOME", str(tmp_path / "own"))
    assert data_home() == tmp_path / "own"
    VaultMemory().remember(trip("Ann", "drive faster"))
    assert (tmp_path / "own" / "profiles").is_dir()
    monkeypatch.delenv("CHAUFFEUR_HOME")
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "share"))
    assert data_home() == tmp_path / "share" / "chauffeur"
    monkeypatch.delenv("XDG_DATA_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert data_home() == tmp_path / ".local" / "share" / "chauffeur"


TEXT = st.text(st.characters(codec=None), max_size=60)


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(name=TEXT.filter(lambda name: name.strip() != ""), text=TEXT, thoughts=TEXT, said=TEXT, trip_id=TEXT)
def test_any_unicode_goes_there_and_back(
    tmp_path: Path, name: str, text: str, thoughts: str, said: str, trip_id: str
) -> None:
    vault = VaultMemory(tmp_path / "any")
    vault.erase(PersonId(name))
    vault.remember(trip(name, text, id=trip_id, thoughts=thoughts), Feedback(said))
    assert vault.attach_feedback(PersonId(name), Feedback(said * 2), trip_id)
    (kept,) = json.loads(vault.export(PersonId(name)))["trips"]
    assert (kept["instruction"], kept["thoughts"]) == (text, thoughts)
    assert [one["text"] for one in kept["feedback"]] == [said, said * 2]
    assert PersonId(name) in vault.people()
    forgotten = vault.forget_last(PersonId(name))
    assert forgotten is not None
    assert forgotten.instruction == text


def test_importing_memory_brings_no_heavy_library() -> None:
    code = "import sys, chauffeur.memory; print([m for m in ('torch', 'openai', 'highway_env') if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_the_latest_judged_trips_of_a_kind_of_world_whatever_was_wished(memory: Memory) -> None:
    for number, wish in enumerate(("drive faster", "keep more distance", "park near the exit", "overtake")):
        memory.remember(trip("Ann", wish, id=f"t{number}"), Feedback("too fast", speed=-1) if number != 3 else None)
    found = memory.latest(PersonId("Ann"), "highway", 2)
    assert [item.trip_id for item in found.items] == ["t2", "t1"]
    assert {item.similarity for item in found.items} == {-1.0}
    assert memory.latest(PersonId("Ann"), "parking", 2).items == ()
    assert memory.latest(PersonId("Ben"), "highway", 2).items == ()
    assert memory.latest(PersonId("Ann"), "highway", 0).items == ()
