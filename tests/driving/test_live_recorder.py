"""The books of a drive in real time: all is in them, a wish before it is asked, and keeping them stops nothing."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

from chauffeur.concept import Command, DataError, Feedback, Instruction, Intervention, PersonId, Result, Setpoints
from chauffeur.driving.events import DriveEvent
from chauffeur.driving.live.messages import FallbackLevel, LiveEnd, Report
from chauffeur.driving.live.settings import Settings
from chauffeur.driving.live.starts import Start
from chauffeur.driving.live.supervisor import Runtime
from chauffeur.driving.recorder import DriveRecorder, Unanswered, open_audit, unanswered
from chauffeur.driving.scenarios import find
from chauffeur.driving.trips import live_trip
from chauffeur.memory.vault import VaultMemory
from chauffeur.safety.audit import AuditLog, AuditRecord, read_records, redact, verify, words_of

WISH = "Overtake the Škoda for Zebedee."
UNWANTED = "Fly, said Zebedee."
TOO_FAST = "Like the wind, Zebedee says."
PROGRAM = """def drive():
    # For Zebedee.
    say("Driving on, Zebedee.")
    for _ in range(10):
        yield autopilot()
"""
RECKLESS = """def drive():
    set_target_speed(80.0)
    while True:
        yield autopilot()
"""
ZEBEDEE = PersonId("zebedee")
SCENARIO = find("overtake")
DT_S = 0.1
MEMORY = "home"


def report(
    tick: object, level: FallbackLevel = "follow", interventions: tuple[Intervention, ...] = (), **changes: object
) -> Report:
    fields = {
        "trip": 1, "tick": tick, "late_ns": 0, "level": level, "plan": "w1", "state": "running", "line": 1,
        "age_s": 0.1, "setpoints": Setpoints(), "requested": Command(1.0, 0.0), "applied": Command(0.5, 0.0),
        "clipped": (), "refused": {}, "missed": 0, "faults": 0, "speed_mps": 20.0, "lane": "a-b:0",
    }  # fmt: skip
    return Report(interventions=interventions, **(fields | changes))  # type: ignore[arg-type]


def wished(wish: str) -> DriveEvent:
    return DriveEvent("wish", wish, WISH, value=Instruction(WISH, ZEBEDEE))


def ended(outcome: str, lost: int = 0, figures: Mapping[str, Any] | None = None) -> DriveEvent:
    return DriveEvent("over", value=LiveEnd(outcome, figures or {}, lost))


def records(path: Path, kind: str = "") -> list[AuditRecord]:
    return [record for _, record in read_records(path) if kind in ("", record.kind)]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "audit.jsonl"


@pytest.fixture
def books(path: Path) -> Iterator[DriveRecorder]:
    with open_audit(path, SCENARIO, 3) as kept:
        yield kept


# A real drive ---------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def driven(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of a drive with three wishes: one is driven, one declined by the planner, one refused by a check."""
    folder = tmp_path_factory.mktemp("books")
    plans = (
        (WISH, {"thoughts": {"text": "Zebedee hurries."}, "policy": {"kind": "program", "source": PROGRAM}}),
        (UNWANTED, {"thoughts": {"text": ""}, "policy": None, "refusal": "A car cannot fly, Zebedee."}),
        (TOO_FAST, {"thoughts": {"text": "Fast."}, "policy": {"kind": "program", "source": RECKLESS}}),
    )
    answers = folder / "answers.jsonl"
    answers.write_text("\n".join(json.dumps({"version": 1, "instruction": w, "plan": p}) for w, p in plans))
    start = Start(SCENARIO, 3, most_s=600.0)
    settings = Settings(starts=(start,), planner=f"replay/{answers}", speed=8.0, realtime=False)
    log = folder / "audit.jsonl"
    memory = VaultMemory(folder / MEMORY)
    with open_audit(log, SCENARIO, 3) as books:
        with Runtime(settings, books.tell) as runtime:
            _three_wishes(runtime, books, log)
        for interaction in runtime.interactions.values():
            trip = live_trip(interaction, start, DT_S, runtime.report)
            assert trip is not None
            memory.remember(trip, None)
    return log


def _three_wishes(runtime: Runtime, books: DriveRecorder, log: Path) -> None:
    for words in (WISH, UNWANTED, TOO_FAST):
        books.tell(DriveEvent("wish", runtime.next_wish, words, value=Instruction(words, ZEBEDEE)))
        assert books.kept().result()
        asked = runtime.ask(words, ZEBEDEE)
        assert [each.wish for each in unanswered(log)] == [asked], "on the disk before it is asked, and yet open"
        until_s = time.monotonic() + 60.0
        while runtime.open_wishes:
            assert time.monotonic() < until_s
            runtime.poll()
            time.sleep(0.01)
    runtime.halt()
    while runtime.driving:
        runtime.poll()
        time.sleep(0.01)
    runtime.poll()
    assert runtime.report is not None
    books.tell(ended(runtime.report.outcome, runtime.lost_reports, runtime.figures() or {}))


def test_a_drive_is_told_from_the_first_wish_to_the_last_command(driven: Path) -> None:
    assert verify(driven).ok
    assert verify(driven).closed
    about = [(record.kind, record.body.get("wish")) for record in records(driven) if record.body.get("wish")]
    told = [kind for kind, wish in about if wish == "w1" and kind != "context"]
    assert list(dict.fromkeys(told)) == ["wish", "plan", "verdict", "outcome"]
    assert [kind for kind, wish in about if wish == "w2" and kind != "context"] == ["wish", "plan", "outcome"]
    told = [kind for kind, wish in about if wish == "w3" and kind != "context"]
    assert list(dict.fromkeys(told)) == ["wish", "plan", "verdict", "outcome"]
    outcomes = {record.body.get("wish", ""): record.body["outcome"] for record in records(driven, "outcome")}
    assert outcomes == {"w1": "finished", "w2": "declined", "w3": "refused", "": "stopped"}
    results = [record.body["result"] for record in records(driven, "outcome") if record.body.get("wish")]
    assert results == ["done", "declined", "declined"]
    judged = {(each.body["wish"], each.body["check"]): each.body["passed"] for each in records(driven, "verdict")}
    assert judged["w1", "format-v1"] and not judged["w3", "parameters-v1"], "the checks that decided"
    assert unanswered(driven) == ()


def test_the_situation_and_the_history_of_a_plan_are_there(driven: Path) -> None:
    letters = {
        (each.body["letter"], each.body["wish"]): each for each in records(driven, "context") if "letter" in each.body
    }
    assert set(letters) == {(letter, wish) for letter in "CH" for wish in ("w1", "w2", "w3")}
    assert "highway" in words_of(letters["C", "w1"])["situation"]
    assert letters["H", "w3"].body["items"] == 0, "nothing was recalled: the planner was given no memory"
    order = [
        (record.kind, record.body.get("letter", "")) for record in records(driven) if record.body.get("wish") == "w1"
    ]
    assert [each for each in order if each[1] or each[0] != "context"][:4] == [
        ("wish", ""), ("context", "C"), ("context", "H"), ("plan", ""),
    ]  # fmt: skip


def test_what_was_driven_and_what_was_refused_is_remembered(driven: Path) -> None:
    memory = VaultMemory(driven.parent / MEMORY)
    document = json.loads(memory.export(ZEBEDEE))
    assert [(trip["instruction"], trip["outcome"]) for trip in document["trips"]] == [
        (WISH, "ended"), (UNWANTED, "refused"), (TOO_FAST, "refused"),
    ]  # fmt: skip
    assert memory.attach_feedback(ZEBEDEE, Feedback("Too fast for me.", speed=-1)), "about the last wish"


def test_the_words_are_there_and_can_be_erased(driven: Path, tmp_path: Path) -> None:
    texts = {(record.kind, record.body.get("wish")): words_of(record) for record in records(driven)}
    assert texts["wish", "w1"]["wish"] == WISH
    assert texts["plan", "w1"]["program"] == PROGRAM
    assert texts["plan", "w1"]["thoughts"] == "Zebedee hurries."
    assert texts["plan", "w2"]["refusal"] == texts["outcome", "w2"]["detail"] == "A car cannot fly, Zebedee."
    assert any(words_of(each).get("reason") for each in records(driven, "verdict") if not each.body["passed"])
    said = [words_of(each)["text"] for each in records(driven, "context") if each.body.get("event") == "said"]
    assert said == ["Driving on, Zebedee."]
    copy = tmp_path / "copy.jsonl"
    copy.write_bytes(driven.read_bytes())
    redact(copy, ZEBEDEE)
    assert verify(copy).ok
    assert b"ebedee" not in copy.read_bytes()


def test_every_command_is_there(driven: Path) -> None:
    batches = [record.body for record in records(driven, "actuation")]
    heard = [tick for batch in batches for tick in range(batch["ticks"][0], batch["ticks"][1] + 1)]
    lost = sum(record.body["lost"].get("period", 0) for record in records(driven, "gap"))
    last = records(driven, "outcome")[-1].body
    assert len(heard) + lost == heard[-1] + 1
    assert last["duration_s"] == pytest.approx((heard[-1] + 1) * DT_S)
    assert sum(last["periods_by_rung"].values()) == len(heard)
    assert last["control"]["ticks"] == heard[-1] + 1
    assert all(len(batch["requested"]) <= 10 for batch in batches), "a second at a time"
    assert any(each.body.get("level") == "stop" for each in records(driven, "context")), "the ladder was left"


# Wishes ---------------------------------------------------------------------------------------------------------------


def test_a_wish_is_on_the_disk_before_anything_comes_of_it(books: DriveRecorder, path: Path) -> None:
    books.tell(wished("w1"))
    assert books.kept().result()
    assert unanswered(path) == (Unanswered("w1", WISH, "zebedee"),), "while the log is still open"


def test_wishes_of_the_last_session_alone_are_missed(path: Path) -> None:
    assert unanswered(path) == ()
    for session, numbers in (("first", (1, 2, 3, 4)), ("second", (1, 2, 3))):
        log = AuditLog(path, about={})
        for number in numbers:
            log.append("wish", {"wish": f"w{number}"}, {"wish": f"{session} {number}"})
        log.append("outcome", {"wish": "w2", "outcome": "declined"})
        log.append("outcome", {"outcome": "ended"})  # of the drive
        log.close()
    assert [(each.wish, each.text) for each in unanswered(path)] == [("w1", "second 1"), ("w3", "second 3")]


def test_a_log_of_an_ordinary_drive_holds_open_wishes_too(path: Path) -> None:
    with open_audit(path, SCENARIO, 3) as auditor:
        auditor.tell(DriveEvent("wish", value=Instruction(WISH)))
    assert [each.text for each in unanswered(path)] == [WISH]
    with pytest.raises(RuntimeError), open_audit(path, SCENARIO, 3) as auditor:
        auditor.tell(DriveEvent("wish", value=Instruction(WISH)))
        raise RuntimeError("no planner")
    assert unanswered(path) == (), "why it was not driven is an answer"


def test_a_wish_that_is_not_asked_is_answered_here(books: DriveRecorder, path: Path) -> None:
    books.tell(DriveEvent("wish", value=Instruction("x" * 2000, ZEBEDEE)))
    books.tell(DriveEvent("refused", text="Far too long.", final=True, result=Result.DECLINED))
    books.close()
    assert unanswered(path) == ()
    (outcome,) = records(path, "outcome")
    assert (words_of(outcome)["detail"], outcome.body["result"]) == ("Far too long.", "declined")


def test_private_books_hold_no_words(path: Path) -> None:
    with open_audit(path, SCENARIO, 3, private=True) as books:
        books.tell(wished("w1"))
        books.tell(DriveEvent("planning", "w1", "Zebedee!"))
    assert b"ebedee" not in path.read_bytes()
    assert [each.text for each in unanswered(path)] == ["[withheld]"]


# What may not stop a drive --------------------------------------------------------------------------------------------


def full_disk() -> AuditLog:
    """A log that cannot be written; tests that run at the same time may hold the one device for it."""
    until_s = time.monotonic() + 30.0
    while True:
        try:
            return AuditLog(Path("/dev/full"), about={})
        except DataError:
            assert time.monotonic() < until_s
            time.sleep(0.1)


def test_a_full_disk_stops_nothing() -> None:
    books = DriveRecorder(full_disk(), DT_S)
    began_s = time.monotonic()
    books.tell(wished("w1"))
    kept = books.kept()
    for tick in range(100):
        books.tell(DriveEvent("period", value=report(tick)))
    assert time.monotonic() - began_s < 1.0, "polling does not wait for the disk"
    assert kept.result() is False
    assert not books.close().complete


def test_what_cannot_be_written_leaves_a_gap(books: DriveRecorder, path: Path) -> None:
    books.tell(DriveEvent("period", value=report(0, requested=None)))
    books.tell(DriveEvent("period", value=report(1, applied="hard")))
    books.tell(DriveEvent("period", value=report(2)))
    books.tell(DriveEvent("period", value=report(None)))
    books.close()
    assert verify(path).ok
    assert {name for record in records(path, "gap") for name in record.body["lost"]} >= {"actuation"}


def test_control_periods_that_were_not_heard_are_a_gap(books: DriveRecorder, path: Path) -> None:
    for tick in (0, 1, 7, 8):
        books.tell(DriveEvent("period", value=report(tick)))
    books.close()
    assert [record.body["lost"] for record in records(path, "gap")] == [{"period": 5}]
    assert [record.body["ticks"] for record in records(path, "actuation")] == [[0, 1], [7, 8]]


def test_interventions_replacements_and_rungs_are_told(books: DriveRecorder, path: Path) -> None:
    change = Intervention("gap", "2 m too close", Command(1.0, 0.0), Command(-3.0, 0.0))
    levels: tuple[FallbackLevel, ...] = ("follow", "hold", "follow", "hold", "keep", "keep", "slow", "stop", "follow")
    for tick, level in enumerate(levels):
        books.tell(DriveEvent("period", value=report(tick, level, (change,) if tick == 3 else ())))
    books.tell(DriveEvent("replaced", text="It hung.", value="policy"))
    books.tell(ended("ended", 2))
    books.tell(ended("ended", 2))
    books.close()
    assert [record.body["rule"] for record in records(path, "intervention")] == ["gap"]
    notes = [record.body for record in records(path, "context")]
    assert [note["level"] for note in notes if note["event"] == "level"] == ["keep", "slow", "stop", "follow"]
    assert [note["process"] for note in notes if note["event"] == "replaced"] == ["policy"]
    (outcome,) = records(path, "outcome")
    assert outcome.body["lost_reports"] == 2
    assert outcome.body["periods_by_rung"] == {"follow": 3, "hold": 2, "keep": 2, "slow": 1, "stop": 1}


def test_taking_over_is_told_and_counted(books: DriveRecorder, path: Path) -> None:
    for tick, taken in enumerate((False, True, True, False, True)):
        books.tell(DriveEvent("period", value=report(tick, "hand" if taken else "follow", taken_over=taken)))
    books.tell(ended("ended"))
    books.close()
    notes = [record.body for record in records(path, "context") if record.body.get("event") == "taken_over"]
    assert [(note["on"], note["tick"]) for note in notes] == [(True, 1), (False, 3), (True, 4)]
    (outcome,) = records(path, "outcome")
    assert (outcome.body["takeovers"], outcome.body["periods_by_rung"]) == (2, {"follow": 2, "hand": 3})
    assert verify(path).ok


def test_a_drive_that_breaks_off_says_so(path: Path) -> None:
    with pytest.raises(RuntimeError), open_audit(path, SCENARIO, 3) as books:
        books.tell(DriveEvent("period", value=report(0)))
        raise RuntimeError("the planner could not be started")
    assert [record.body["outcome"] for record in records(path, "outcome")] == ["broken_off"]
    assert verify(path).closed
