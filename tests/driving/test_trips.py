"""A wish of a drive in real time as a trip: what is kept, what is not, and what it says of how it ended."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from chauffeur.concept import (
    Command,
    Feedback,
    History,
    Instruction,
    Outcome,
    Parameters,
    PersonId,
    Plan,
    Program,
    Setpoints,
    Thoughts,
)
from chauffeur.describe import describe
from chauffeur.driving.events import DriveEvent, EventKind
from chauffeur.driving.live.messages import Report
from chauffeur.driving.live.plan_messages import TOOK_OVER, PlanningInputs, Request
from chauffeur.driving.live.starts import Start
from chauffeur.driving.live.supervisor import Interaction
from chauffeur.driving.scenarios import find
from chauffeur.driving.trips import live_trip
from chauffeur.memory.vault import VaultMemory
from chauffeur.worlds.highway import HighwayWorld

DT_S = 0.1
START = Start(find("overtake"), 3)
PLAN = Plan(Thoughts("I pass it."), Program("def drive():\n    yield autopilot()\n"), planner="written")


@pytest.fixture(scope="module")
def brief() -> PlanningInputs:
    context = describe(HighwayWorld().reset(START.scenario, START.seed))
    return PlanningInputs("w1", Instruction("Pass it.", PersonId("ana")), context, History(), PLAN, 1, 7)


def report(tick: int, outcome: str = "") -> Report:
    return Report(
        trip=1, tick=tick, late_ns=0, level="follow", plan="w1", state="running", line=1, age_s=0.1,
        setpoints=Setpoints(), requested=Command(0.0, 0.0), applied=Command(0.0, 0.0),
            interventions=(), clipped=(), refused={}, missed=0,
        faults=0, speed_mps=20.0, lane=None, ended=bool(outcome), outcome=outcome,
    )  # fmt: skip


def closed(brief: PlanningInputs | None, kind: EventKind, *, begun: int | None, at: int, text: str = "") -> Interaction:
    answer = DriveEvent(kind, "w1", text, 1, at)
    started = DriveEvent("started", "w1", "", 1, begun or 0)
    before = () if begun is None else (started, DriveEvent("said", "w1", "Now.", 1, begun + 5))
    return Interaction(Request("w1", "Pass it.", "ana"), "closed", 0.0, answer, [*before, answer], brief)


@pytest.mark.parametrize(
    ("kind", "begun", "last", "outcome", "driven_s"),
    [
        ("finished", 10, "", "ended", 5.0),
        ("superseded", 10, "", "ended", 5.0),
        ("interrupted", 10, "ended", "ended", 5.0),
        ("interrupted", 10, "collision", "collision", 5.0),
        ("interrupted", 10, "off_road", "off_road", 5.0),
        ("failed", 10, "", "failure", 5.0),
        ("declined", None, "", "refused", 0.0),
        ("refused", None, "", "refused", 0.0),
    ],
)
def test_how_a_wish_ended_is_how_its_trip_ended(
    brief: PlanningInputs, kind: EventKind, begun: int | None, last: str, outcome: Outcome, driven_s: float
) -> None:
    trip = live_trip(closed(brief, kind, begun=begun, at=60, text="Why."), START, DT_S, report(60, last))
    assert trip is not None
    assert (trip.outcome, trip.duration_s) == (outcome, pytest.approx(driven_s))
    assert (trip.instruction, trip.context, trip.plan) == (brief.instruction, brief.context, PLAN)
    assert (trip.causes.refused, trip.causes.policy_failed) == (outcome == "refused", outcome == "failure")
    assert trip.causes.detail == ("Why." if outcome in ("refused", "failure") else "")
    assert dict(trip.record)["live"] is True
    assert "taken_over" not in dict(trip.record)
    if begun is not None:
        assert trip.said == ((pytest.approx(1.5), "Now."),)


def test_parameters_are_remembered_and_recalled_with_what_was_said_of_them(
    brief: PlanningInputs, tmp_path: Path
) -> None:
    plan = Plan(Thoughts("I park."), Parameters(3.0, 5.0, 1.0, route="B4"), planner="talk2drive", intent="park")
    trip = live_trip(closed(replace(brief, plan=plan), "finished", begun=10, at=60), START, DT_S, report(60))
    assert trip is not None
    assert trip.plan == plan
    memory = VaultMemory(tmp_path)
    memory.remember(trip, None)
    assert memory.attach_feedback(PersonId("ana"), Feedback("Too slow.", speed=1, strength=0.6))
    (item,) = memory.recall(PersonId("ana"), brief.instruction, brief.context, 3).items
    assert "B4" in item.policy
    assert [feedback.text for feedback in item.feedback] == ["Too slow."]


def test_that_the_person_took_over_is_kept_with_the_trip(brief: PlanningInputs) -> None:
    trip = live_trip(closed(brief, "interrupted", begun=10, at=60, text=TOOK_OVER), START, DT_S, report(60))
    assert trip is not None
    assert (trip.outcome, dict(trip.record)["taken_over"]) == ("ended", True)


@pytest.mark.parametrize("kind", ["finished", "superseded", "interrupted", "failed"])
def test_what_was_never_begun_is_no_trip(brief: PlanningInputs, kind: EventKind) -> None:
    assert live_trip(closed(brief, kind, begun=None, at=60), START, DT_S, report(60)) is None


@pytest.mark.parametrize("kind", ["stale", "unplanned"])
def test_what_never_had_a_plan_to_drive_is_no_trip(brief: PlanningInputs, kind: EventKind) -> None:
    assert live_trip(closed(brief, kind, begun=None, at=60), START, DT_S, report(60)) is None
    assert live_trip(closed(None, "declined", begun=None, at=60), START, DT_S, report(60)) is None


def test_an_end_that_the_supervisor_alone_could_tell_is_timed_by_control(brief: PlanningInputs) -> None:
    trip = live_trip(closed(brief, "interrupted", begun=10, at=0), START, DT_S, report(110))
    assert trip is not None
    assert trip.duration_s == pytest.approx(10.0)


def test_the_same_wish_said_later_is_another_trip(brief: PlanningInputs) -> None:
    one = live_trip(closed(brief, "finished", begun=10, at=60), START, DT_S, None)
    other = live_trip(closed(replace(brief, tick=8), "finished", begun=10, at=60), START, DT_S, None)
    assert one is not None
    assert other is not None
    assert one.id != other.id
