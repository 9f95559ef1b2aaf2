"""The person's memory beside a drive: nothing waits for it, nothing is lost, and their orders are carried out."""

from __future__ import annotations

import dataclasses
import fcntl
import json
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import ClassVar

import pytest

from chauffeur.concept import (
    Causes,
    Context,
    Feedback,
    History,
    HistoryItem,
    Instruction,
    PersonId,
    Plan,
    ProfileError,
    Program,
    Situation,
    Thoughts,
    Trip,
)
from chauffeur.driving.talk.memory_worker import Kept, MemoryWorker, News, OpinionKept
from chauffeur.driving.talk.messages import MemoryOrder, MemoryState, Note
from chauffeur.memory import VaultMemory
from chauffeur.memory.feedback import interpret_feedback

ANA = PersonId("ana")
SITUATION = Situation("highway", 25.0, 31.0, 2, 1, False, None, None)
TRIP = Trip(
    "0123456789abcdef",
    Instruction("Slow down a bit.", ANA),
    Context("We drive.", SITUATION),
    History(),
    Plan(Thoughts("Slower."), Program("def drive():\n    yield autopilot()\n")),
    (),
    "ended",
    Causes(),
    (),
    12.0,
    "overtake",
    3,
)
TOO_FAST = interpret_feedback("a bit too fast")


@pytest.fixture
def home(tmp_path: Path) -> Path:
    return tmp_path / "memory"


@pytest.fixture
def keeper(home: Path) -> Iterator[MemoryWorker]:
    keeper = MemoryWorker(ANA, home)
    yield keeper
    keeper.close(5.0)


def until(keeper: MemoryWorker, holds: Callable[[list[News]], bool], within_s: float = 60.0) -> list[News]:
    """What was told until something was."""
    news: list[News] = []
    end_s = time.monotonic() + within_s
    while not holds(news):
        assert time.monotonic() < end_s, news
        news += keeper.poll()
        time.sleep(0.005)
    return news


def told(kind: type, text: str = "") -> Callable[[list[News]], bool]:
    return lambda news: any(isinstance(each, kind) and text in str(each) for each in news)


def remembered(home: Path) -> list[dict[str, object]]:
    return json.loads(VaultMemory(home).export(ANA))["trips"]


def test_an_opinion_waits_for_its_trip_and_both_are_on_the_disk_when_that_is_told(
    keeper: MemoryWorker, home: Path
) -> None:
    keeper.opinion("w1", TOO_FAST)
    assert not any(isinstance(each, Kept) for each in keeper.poll())
    keeper.trip("w1", TRIP)
    news = until(keeper, told(OpinionKept))
    texts = [each.text for each in news if isinstance(each, Kept)]
    assert texts == [f"remembered as trip {TRIP.id}", f"remembered as trip {TRIP.id}, with your opinion"]
    ((trip,),) = (remembered(home),)
    assert [each["text"] for each in trip["feedback"]] == ["a bit too fast"]  # pyright: ignore
    until(keeper, told(MemoryState, "a bit too fast"))


def test_a_wish_that_was_never_driven_takes_no_opinion(keeper: MemoryWorker, home: Path) -> None:
    keeper.opinion("w1", TOO_FAST)
    keeper.trip("w1", None)
    news = until(keeper, told(OpinionKept))
    assert told(Note, "no trip that your opinion could be kept with")(news)
    assert remembered(home) == []


def test_a_locked_memory_holds_nobody_up_and_loses_nothing(keeper: MemoryWorker, home: Path) -> None:
    (home / "profiles").mkdir(parents=True)
    lock = os.open(home / "profiles" / "lock", os.O_RDWR | os.O_CREAT)
    fcntl.flock(lock, fcntl.LOCK_EX)
    keeper.trip("w1", TRIP)
    keeper.opinion("w1", TOO_FAST)
    begun_s = time.monotonic()
    for _ in range(20):
        assert not any(isinstance(each, Kept) for each in keeper.poll()), "nothing is called remembered that is not"
        time.sleep(0.01)
    assert time.monotonic() - begun_s < 5.0, "polling never waits for the lock"
    os.close(lock)
    until(keeper, told(OpinionKept))
    assert len(remembered(home)) == 1


def test_half_a_profile_is_told_once_and_after_erasing_it_memory_goes_on(keeper: MemoryWorker, home: Path) -> None:
    keeper.trip("w1", TRIP)
    until(keeper, told(Kept, TRIP.id))
    (profile,) = (home / "profiles").glob("*.db")
    profile.write_bytes(profile.read_bytes()[: profile.stat().st_size // 2])
    keeper.trip("w2", dataclasses.replace(TRIP, id="1123456789abcdef"))
    news = until(keeper, told(Kept, "not remembered yet"))
    (trouble,) = [each.trouble for each in news if isinstance(each, Kept) and each.trouble]
    assert "cannot be used" in trouble and "erase" in trouble
    keeper.order(MemoryOrder("erase", sure=True))
    news = until(keeper, told(Kept, "erased at your wish"))
    keeper.trip("w3", dataclasses.replace(TRIP, id="2123456789abcdef"))
    until(keeper, told(Kept, "2123456789abcdef"))
    assert [trip["trip"] for trip in remembered(home)] == ["2123456789abcdef"]


def test_what_cannot_be_kept_to_the_end_is_said(home: Path) -> None:
    keeper = MemoryWorker(ANA, home)
    (home).mkdir(parents=True)
    (home / "profiles").write_text("this is no folder")
    keeper.trip("w1", TRIP)
    news = keeper.close(20.0)
    assert told(Kept, "w1 could not be remembered")(news)


def test_in_privacy_mode_nothing_is_written_and_that_is_shown(keeper: MemoryWorker, home: Path) -> None:
    keeper.trip("w1", TRIP)
    until(keeper, told(Kept, TRIP.id))
    keeper.order(MemoryOrder("private"))
    until(keeper, lambda news: any(isinstance(each, MemoryState) and each.private for each in news))
    profiles = {path: path.read_bytes() for path in (home / "profiles").iterdir()}
    keeper.trip("w2", dataclasses.replace(TRIP, id="1123456789abcdef"))
    keeper.opinion("w2", TOO_FAST)
    news = until(keeper, told(OpinionKept))
    assert told(Kept, "not remembered: privacy mode")(news)
    assert {path: path.read_bytes() for path in (home / "profiles").iterdir()} == profiles
    keeper.order(MemoryOrder("public"))
    until(keeper, lambda news: any(isinstance(each, MemoryState) and not each.private for each in news))


def test_the_last_trip_is_forgotten_and_everything_is_exported(keeper: MemoryWorker, home: Path) -> None:
    for number in (1, 2):
        keeper.trip(f"w{number}", dataclasses.replace(TRIP, id=f"{number}123456789abcdef"))
        until(keeper, told(Kept, f"{number}123456789abcdef"))
    keeper.order(MemoryOrder("forget_last"))
    news = until(keeper, told(Kept, "forgotten at your wish"))
    assert [each.wish for each in news if isinstance(each, Kept)] == ["w2"]
    keeper.order(MemoryOrder("export"))
    (note,) = [each for each in until(keeper, told(Note, "written to")) if isinstance(each, Note)]
    path = Path(note.text.rpartition("written to ")[2])
    assert [trip["trip"] for trip in json.loads(path.read_text())["trips"]] == ["1123456789abcdef"]
    assert path.stat().st_mode & 0o077 == 0, "it is for nobody else to read"


@pytest.mark.parametrize(
    ("order", "said"),
    [
        (MemoryOrder("erase"), "Say that you are sure"),
        (MemoryOrder("retention", days=0.5), "0.5 is no whole number of days"),
        (MemoryOrder("retention", days=-3.0), "Use 1 day or more"),
        (MemoryOrder("retention", days=float("inf")), "no whole number of days"),
        (MemoryOrder("retention", days=30.0), "Trips are kept for 30 days"),
        (MemoryOrder("retention"), "until they are erased"),
        (MemoryOrder("forget_last"), "Nothing is remembered of ana"),
        (MemoryOrder("show"), "What is remembered of ana"),
    ],
)
def test_orders_are_answered_in_words(keeper: MemoryWorker, order: MemoryOrder, said: str) -> None:
    keeper.order(order)
    until(keeper, told(Note, said))


class Notebook:
    """A memory of somebody else's making: it keeps trips in a list, and cannot forget a single one."""

    kept: ClassVar[list[Trip]] = []

    def __init__(self, home: Path) -> None:
        del home

    def remember(self, trip: Trip, feedback: Feedback | None = None) -> None:
        del feedback
        self.kept.append(trip)

    def attach_feedback(self, person: PersonId, feedback: Feedback, trip_id: str | None = None) -> bool:
        del person, feedback
        return any(trip.id == trip_id for trip in self.kept)

    def export(self, person: PersonId) -> str:
        trips = [
            {"trip": trip.id, "when": "", "instruction": trip.instruction.text, "outcome": trip.outcome, "feedback": []}
            for trip in self.kept
        ]
        return json.dumps({"person": person, "trips": trips})

    def forget_last(self, person: PersonId) -> HistoryItem | None:
        raise ProfileError(f"A notebook cannot forget one trip of {person}.", hint="Erase all of it.")


def test_the_chosen_memory_is_used_and_says_what_it_cannot_do(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Notebook, "kept", [])
    known = {"notebook": Notebook}
    monkeypatch.setattr("chauffeur.memory.choice.load_plugin", lambda group, name: known[name])
    monkeypatch.setenv("CHAUFFEUR_MEMORY", "notebook")
    keeper = MemoryWorker(ANA, home)
    keeper.trip("w1", TRIP)
    keeper.opinion("w1", TOO_FAST)
    news = until(keeper, told(OpinionKept))
    shown = [each for each in news + until(keeper, told(MemoryState)) if isinstance(each, MemoryState)][-1]
    assert (shown.memory, shown.encrypted, shown.newest[0].text) == ("notebook", False, "Slow down a bit.")
    keeper.order(MemoryOrder("forget_last"))
    until(keeper, told(Note, "A notebook cannot forget one trip of ana."))
    keeper.order(MemoryOrder("private"))
    until(keeper, lambda news: any(isinstance(each, MemoryState) and each.private for each in news))
    keeper.trip("w2", dataclasses.replace(TRIP, id="1123456789abcdef"))
    until(keeper, told(Kept, "privacy mode"))
    keeper.close(5.0)
    assert [trip.id for trip in Notebook.kept] == [TRIP.id]
    assert not (home / "profiles").exists(), "nothing of it goes into the vault"


def test_all_that_can_be_done_with_the_vault_can_be_done_with_chroma(home: Path) -> None:
    pytest.importorskip("chromadb", reason="Chroma is not installed: pip install 'chauffeur[chroma]'")
    keeper = MemoryWorker(ANA, home, memory="chroma")
    keeper.trip("w1", TRIP)
    keeper.opinion("w1", TOO_FAST)
    news = until(keeper, told(MemoryState, "a bit too fast"))
    assert not [each for each in news if isinstance(each, MemoryState)][-1].encrypted
    keeper.order(MemoryOrder("export"))
    until(keeper, told(Note, "was written to"))
    keeper.order(MemoryOrder("retention", 30.0))
    until(keeper, told(Note, "for 30 days"))
    keeper.order(MemoryOrder("private"))
    until(keeper, told(Note, "Privacy mode is on"))
    keeper.trip("w2", dataclasses.replace(TRIP, id="1123456789abcdef"))
    until(keeper, told(Kept, "privacy mode"))
    keeper.order(MemoryOrder("forget_last"))
    until(keeper, told(Note, "Forgotten: “Slow down a bit.”"))
    keeper.order(MemoryOrder("public"))
    keeper.trip("w3", dataclasses.replace(TRIP, id="2123456789abcdef"))
    until(keeper, told(Kept, "2123456789abcdef"))
    keeper.order(MemoryOrder("erase", sure=True))
    until(keeper, told(Note, "Erased: the profile of ana."))
    keeper.close(5.0)
