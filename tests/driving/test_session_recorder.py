"""A real drive in an audit log: all that was wished, planned, judged and done is there, and the drive never notices."""

from __future__ import annotations

import asyncio
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from chauffeur.concept import (
    LAMPILOT_LIMITS,
    NOBODY,
    ActionMatrix,
    Command,
    DataError,
    Frame,
    Instruction,
    Observation,
    PersonId,
    Plan,
    PlannerError,
    Setpoints,
    Thoughts,
    VehicleState,
    Verdict,
)
from chauffeur.concept.trace import Intervention
from chauffeur.driving.events import DriveEvent, told_to
from chauffeur.driving.recorder import DriveRecorder, open_audit, with_head
from chauffeur.driving.recording import RecordedTrip, compare_trips
from chauffeur.driving.scenarios import find
from chauffeur.driving.session import Session, parse_wish
from chauffeur.driving.trips import scenario_hash
from chauffeur.planners.base import Planner
from chauffeur.planners.registry import make_planner
from chauffeur.safety.audit import AuditLog, AuditRecord, head_path, read_records, redact, verify, words_of
from roads import a_road

WISH = "Overtake the Škoda for Zebedee."
PROGRAM = """def overtake():
    # For Zebedee.
    say("Changing lanes, Zebedee.")
    for _ in range(25):
        yield autopilot()
"""
KEY = b"a key of thirty-two bytes, quite"
SCENARIO = find("cruise", None)


@pytest.fixture
def planner(tmp_path: Path) -> Planner:
    """Answers the wish from a file."""
    path = tmp_path / "answers.jsonl"
    thoughts = {"text": "Zebedee is in a hurry."}
    plan = {"thoughts": thoughts, "policy": {"kind": "program", "source": PROGRAM}, "intent": "overtake.left"}
    no = {"thoughts": {"text": ""}, "policy": None, "refusal": "A car cannot fly, Zebedee."}
    answers = ((WISH, plan), ("Fly, said Zebedee.", no))
    path.write_text("\n".join(json.dumps({"version": 1, "instruction": w, "plan": p}) for w, p in answers))
    return make_planner(f"replay/{path}")


def drive(planner: Planner, auditor: DriveRecorder | None, wish: str = WISH, person: str = "zebedee") -> RecordedTrip:
    session = Session(planner=planner)
    if auditor is not None:
        session.tell = auditor.tell
    return asyncio.run(session.drive(parse_wish(wish, PersonId(person)), SCENARIO, 3, LAMPILOT_LIMITS))


def records(path: Path) -> list[AuditRecord]:
    return [record for _, record in read_records(path)]


def of_kind(path: Path, kind: str) -> list[AuditRecord]:
    return [record for record in records(path) if record.kind == kind]


def test_a_drive_is_told_from_the_wish_to_the_last_command(planner: Planner, tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    with open_audit(path, SCENARIO, 3) as auditor:
        recorded = drive(planner, auditor)
    closing = auditor.close()
    assert closing.complete
    found = verify(path, head=closing.head)
    assert found.ok, found.findings
    assert found.lost == 0
    kinds = [record.kind for record in records(path)]
    assert kinds[:6] == ["opened", "wish", "context", "context", "context", "plan"]
    assert kinds[-2:] == ["outcome", "closed"]

    opened = records(path)[0].body
    assert (opened["scenario"], opened["seed"], opened["simulated"]) == (SCENARIO.id, 3, True)
    assert opened["scenario_sha256"] == scenario_hash(SCENARIO)
    assert words_of(of_kind(path, "wish")[0]) == {"person": "zebedee", "wish": WISH}
    assert words_of(of_kind(path, "context")[0])["context"] == recorded.trip.context.text
    assert words_of(of_kind(path, "plan")[0])["program"] == PROGRAM
    verdicts = [record.body for record in of_kind(path, "verdict")]
    assert [(body["check"], body["passed"]) for body in verdicts] == [
        (v.check, v.passed) for v in recorded.trip.verdicts
    ]
    outcome = of_kind(path, "outcome")[0]
    assert (outcome.body["outcome"], outcome.body["duration_s"]) == (recorded.trip.outcome, recorded.trip.duration_s)
    assert words_of(outcome)["trip"] == recorded.trip.id
    filed = with_head(recorded, closing)
    assert verify(path, head=dict(filed.trip.record)["audit_head"]).after_head == 0
    assert compare_trips(filed, recorded) is None
    assert compare_trips(recorded, drive(planner, None)) is None, "the drive is the same with and without a log"

    # Every command is there, to the last bit.
    assert len(recorded.frames) > 40
    asked: list[Command] = []
    done: list[Command] = []
    ticks: list[int] = []
    for record in of_kind(path, "actuation"):
        body = record.body
        these = [Command(*pair) for pair in body["requested"]]
        otherwise = {place: Command(a, s) for place, a, s in body["applied_otherwise"]}
        asked += these
        done += [otherwise.get(place, command) for place, command in enumerate(these)]
        ticks += range(body["ticks"][0], body["ticks"][1] + 1)
        assert len(body["speed_mps"]) == len(these) <= 10
    assert asked == [frame.requested for frame in recorded.frames]
    assert done == [frame.applied for frame in recorded.frames]
    assert ticks == [frame.observation.tick for frame in recorded.frames]
    setpoints = [wish for record in of_kind(path, "actuation") for wish in record.body["wishes"]]
    assert setpoints[0][1]["time_headway_s"] == recorded.frames[0].setpoints.time_headway_s
    said = "".join(words_of(record).get("said", "") for record in of_kind(path, "actuation"))
    assert said == "Changing lanes, Zebedee."
    assert path.stat().st_size < 1500 * recorded.trip.duration_s + 10_000


def test_what_led_to_a_drive_is_on_the_disk_before_it_starts(planner: Planner, tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    seen: list[set[str]] = []

    def watch(event: DriveEvent) -> None:
        if event.kind == "period" and not seen:
            seen.append(set(verify(path).kinds))

    with open_audit(path, SCENARIO, 3) as auditor:
        session = Session(planner=planner, tell=told_to(auditor.tell, watch))
        asyncio.run(session.drive(parse_wish(WISH, NOBODY), SCENARIO, 3, LAMPILOT_LIMITS))
    assert seen == [{"opened", "wish", "context", "plan", "verdict"}]


def test_privacy_mode_holds_no_word_of_the_drive(planner: Planner, tmp_path: Path) -> None:
    key_file = tmp_path / "key"
    key_file.write_bytes(KEY)
    for key in (None, key_file):
        path = tmp_path / f"audit-{key is not None}.jsonl"
        with open_audit(path, SCENARIO, 3, key_file=key, private=True) as auditor:
            recorded = drive(planner, auditor)
            drive(planner, auditor, "Fly, said Zebedee.")
        content = path.read_text().casefold()
        for word in ("zebedee", "berhol", "hurry", "overtake", "fly", recorded.trip.id, "i am driving"):
            assert word not in content, word
        assert verify(path).ok
        assert of_kind(path, "actuation")


def test_erasing_a_person_leaves_the_others(planner: Planner, tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    with open_audit(path, SCENARIO, 3) as auditor:
        drive(planner, auditor)
        drive(planner, auditor, "Fly, said Zebedee.", "ana")
    head = auditor.close().head
    done = redact(path, PersonId("zebedee"))
    assert done.records >= 6
    content = path.read_text()
    assert "berhol" not in content
    assert "Fly, said Zebedee." in content
    assert verify(path, head=head).redacted == done.texts


def test_a_refused_wish_is_told_too(planner: Planner, tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    with open_audit(path, SCENARIO, 3) as auditor:
        drive(planner, auditor, "Fly, said Zebedee.")
    plan, outcome = of_kind(path, "plan")[0], of_kind(path, "outcome")[0]
    assert plan.body["refused"] is True
    assert words_of(plan)["refusal"] == "A car cannot fly, Zebedee."
    assert outcome.body["outcome"] == "refused"
    assert not of_kind(path, "actuation")


def test_a_drive_that_breaks_off_is_told(planner: Planner, tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    with pytest.raises(PlannerError), open_audit(path, SCENARIO, 3) as auditor:
        drive(planner, auditor, "A wish that the file has no answer to.")
    outcome = of_kind(path, "outcome")[0]
    assert outcome.body["outcome"] == "not_driven"
    assert outcome.body["error"] == "PlannerError"
    with pytest.raises(KeyboardInterrupt), open_audit(path, SCENARIO, 3) as auditor:
        auditor.tell(DriveEvent("wish", value=Instruction("Stop.", PersonId("ana"))))
        auditor.tell(DriveEvent("period", value=a_frame(0)))
        raise KeyboardInterrupt
    assert of_kind(path, "outcome")[1].body["outcome"] == "broken_off"
    assert len(of_kind(path, "actuation")) == 1
    assert verify(path).ok


def test_a_full_disk_does_not_disturb_the_drive(planner: Planner) -> None:
    with open_audit(Path("/dev/full"), SCENARIO, 3) as auditor:
        recorded = drive(planner, auditor)
    assert recorded.trip.outcome == "ended"
    assert compare_trips(recorded, drive(planner, None)) is None
    assert not auditor.close().complete
    assert "No space left" in auditor.close().trouble
    with pytest.raises(DataError):  # a folder: refused before the drive
        open_audit(Path("/dev"), SCENARIO, 3)


GENTLE = Command(0.5, 0.0)


def a_frame(tick: int, *interventions: Intervention, requested: Command = GENTLE) -> Frame:
    ego = VehicleState(0, "car", 0.0, 0.0, 0.0, 20.0, 5.0, 2.0, "a-b:0")
    shot = Observation(round(tick * 0.1, 3), tick, "highway", ego, (), (), a_road(()), None, None, False, False)
    return Frame(shot, Setpoints(), requested, requested, "running", 1, interventions=interventions)


def too_close(reason: str = "2 m too close") -> Intervention:
    return Intervention("gap-v1", reason, Command(1.5, 0.1), Command(-3.0, 0.1))


def test_the_first_intervention_of_a_stretch_is_written_at_once(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    log = AuditLog(path, about={})
    auditor = DriveRecorder(log)
    for tick in range(30):
        auditor.tell(DriveEvent("period", value=a_frame(tick, *[too_close(f"tick {tick}")] * (tick >= 4))))
        if tick == 4:
            assert log.flush()
            assert [row[0] for row in of_kind(path, "intervention")[0].body["interventions"]] == [4]
    auditor.close()
    rows = [row for record in of_kind(path, "intervention") for row in record.body["interventions"]]
    assert [row[0] for row in rows] == list(range(4, 30))
    assert rows[0] == [4, 0.4, "tick 4", [1.5, 0.1], [-3.0, 0.1]]
    assert len(of_kind(path, "intervention")) == 4
    assert {record.body["rule"] for record in of_kind(path, "intervention")} == {"gap-v1"}
    assert len(of_kind(path, "actuation")) == 3


def test_commands_that_are_no_numbers_and_missing_ticks_are_told_as_they_are(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    auditor = DriveRecorder(AuditLog(path, about={}))
    for tick in (0, 1, 5):
        auditor.tell(DriveEvent("period", value=a_frame(tick, requested=Command(float("nan"), float("-inf")))))
    auditor.close()
    bodies = [record.body for record in of_kind(path, "actuation")]
    assert [body["ticks"] for body in bodies] == [[0, 1], [5, 5]]
    assert bodies[0]["requested"] == [["NaN", "-Infinity"]] * 2
    assert verify(path).ok


def test_what_a_planner_of_somebody_else_hands_over_cannot_stop_the_drive(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    strange: Any = None
    number: Any = 5
    with open_audit(path, SCENARIO, 3) as auditor:
        auditor.tell(DriveEvent("wish", value=Instruction("Go.", PersonId("ana"))))
        auditor.tell(DriveEvent("plan", value=replace(Plan(Thoughts("R"), None), settings=strange)))
        auditor.tell(DriveEvent("plan", value=replace(Plan(Thoughts("R"), None), raw=number)))
        auditor.tell(DriveEvent("plan", value=Plan(Thoughts("R"), ActionMatrix((1.0, 2.0, 3.0), (4.0, 5.0, 6.0)))))
        verdicts: Any = (Verdict("format-v1", False, "No.", 3, "Ask again."), "not a verdict")
        auditor.tell(DriveEvent("verdicts", value=verdicts))
        auditor.tell(DriveEvent("over"))
    found = verify(path)
    assert found.ok
    assert found.lost == 1
    assert of_kind(path, "gap")[0].body == {"lost": {"plan": 1}, "why": "the record could not be made (TypeError)"}
    assert "AttributeError" in of_kind(path, "plan")[0].body["fault"]
    assert json.loads(words_of(of_kind(path, "plan")[1])["policy"])["pid"] == [1.0, 2.0, 3.0]
    assert of_kind(path, "verdict")[0].body["line"] == 3


def test_drives_follow_one_another_in_one_log(planner: Planner, tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    heads: list[str] = []
    for _ in range(2):
        with open_audit(path, SCENARIO, 3) as auditor:
            drive(planner, auditor)
        heads.append(auditor.close().head)
    found = verify(path, head=heads[0])
    assert found.ok
    assert found.kinds["opened"] == found.kinds["outcome"] == found.kinds["closed"] == 2
    assert found.head == heads[1] == head_path(path).read_text().strip()
