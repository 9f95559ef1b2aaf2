"""The model that ships: it loads, is small, writes what plain words say, and keeps sides, directions and numbers."""

from __future__ import annotations

import asyncio
import json
from dataclasses import replace

import pytest

from chauffeur.concept import (
    Context,
    History,
    HistoryItem,
    Instruction,
    Limits,
    Plan,
    PlanRequest,
    Program,
    Situation,
    SystemMessage,
)
from chauffeur.concept.nouns import Lead
from chauffeur.planners.onboard.dialect import DialectStep, Number, StepCondition, read
from chauffeur.planners.onboard.driven import drive_alike
from chauffeur.planners.onboard.language_model import SHIPPED, LanguageModelPlanner
from chauffeur.planners.registry import make_planner

HIGHWAY = Situation("highway", 25.0, 31.3, 3, 1, False, Lead(7, 40.0, 24.0), None)


@pytest.fixture(scope="module")
def planner() -> LanguageModelPlanner:
    return LanguageModelPlanner(SHIPPED)


def planned(
    planner: LanguageModelPlanner, wish: str, place: Situation = HIGHWAY, history: History | None = None
) -> Plan:
    request = PlanRequest(
        Instruction(wish), Context("", place), SystemMessage(""), history or History(), limits=Limits()
    )
    return asyncio.run(planner.plan(request))


def steps(plan: Plan) -> tuple[DialectStep, ...]:
    assert isinstance(plan.policy, Program), plan.refusal
    return read(plan.policy.source)


def test_it_is_small_and_says_what_it_is() -> None:
    size = sum(path.stat().st_size for path in SHIPPED.iterdir())
    assert size <= 30e6
    about = json.loads((SHIPPED / "model.json").read_text(encoding="utf-8"))
    card = (SHIPPED / "MODEL_CARD.md").read_text(encoding="utf-8")
    assert about["version"] in card
    assert about["data"][:16] in card
    assert about["data"][:16] in (SHIPPED / "DATA_CARD.md").read_text(encoding="utf-8")


def test_it_is_the_default_planner() -> None:
    planner = make_planner("onboard")
    assert planner.id == "onboard"
    assert planner.model == json.loads((SHIPPED / "model.json").read_text(encoding="utf-8"))["version"]


@pytest.mark.parametrize(
    ("wish", "other"),
    [
        ("move to the {} lane", ("left", "right")),
        ("pass that truck on the {}", ("left", "right")),
        ("{} lane, please", ("left", "right")),
        ("go {}", ("faster", "slower")),
    ],
)
def test_opposite_words_make_opposite_programs(
    planner: LanguageModelPlanner, wish: str, other: tuple[str, str]
) -> None:
    first, second = (steps(planned(planner, wish.format(word)))[-1].meaning for word in other)
    assert first.manoeuvre == second.manoeuvre
    if first.direction is not None:
        assert {first.direction, second.direction} == set(other)
    else:
        assert first.change * second.change < 0


@pytest.mark.parametrize(
    ("wish", "call"),
    [
        ("same as last time", "gap_of(40)"),
        ("like last time", "gap_of(40)"),
        ("a bit more distance than last time", "gap_of(1.15 * 40)"),
    ],
)
def test_a_correction_reads_history(planner: LanguageModelPlanner, wish: str, call: str) -> None:
    item = HistoryItem(
        trip_id="t1",
        when="2026-01-01T08:00:00Z",
        instruction="Keep 40 meters to the car in front.",
        context="",
        world="highway",
        intent="gap.set",
        thoughts="",
        policy="def drive():\n    yield from gap_of(40)\n",
    )
    plan = planned(planner, wish, history=History((item,)))
    assert [step.call() for step in steps(plan)] == [call]


def test_the_same_request_gives_the_same_plan(planner: LanguageModelPlanner) -> None:
    first, second = (planned(planner, "ease off a little would you") for _ in range(2))
    assert (first.policy, first.refusal, first.thoughts) == (second.policy, second.refusal, second.thoughts)


def test_what_it_writes_is_shown_as_it_comes() -> None:
    pieces: list[tuple[str, int]] = []
    planner = LanguageModelPlanner(SHIPPED, on_text=lambda piece, attempt: pieces.append((piece, attempt)))
    plan = planned(planner, "Change to the left lane")
    assert len(pieces) > 1
    assert "".join(piece for piece, attempt in pieces if attempt == pieces[-1][1]) == plan.raw


def test_the_same_manoeuvre_at_another_time_is_another_drive() -> None:
    request = PlanRequest(Instruction("go left"), Context("", HIGHWAY), SystemMessage(""), History(), limits=Limits())
    left = DialectStep("lane_left")
    assert drive_alike((left,), (left,), "go left", request)
    for other in (replace(left, condition=StepCondition("if", "clear_left")), replace(left, wait_s=Number(10.0))):
        assert not drive_alike((left,), (other,), "go left", request)
    assert not drive_alike((), (), "go left", request)
