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
JUNCTION = Situation("intersection", 9.0, 10.0, 1, 0, False, None, 20.0, ("left", "straight", "right"))


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


def calls(planner: LanguageModelPlanner, wish: str, place: Situation = HIGHWAY) -> list[str]:
    return [step.call() for step in steps(planned(planner, wish, place))]


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
    ("wish", "written"),
    [
        ("Drive at 55 mph.", ["drive_at(mph(55))"]),
        ("Please go 3 m/s slower", ["slower_by(3)"]),
        ("could you go faster", ["overtake()", "faster()"]),
        ("keep 30 meters distance to the car in front", ["gap_of(30)"]),
        ("Change to the left lane", ["lane_left()"]),
        ("Change to the right lane", ["lane_right()"]),
        ("overtake the car ahead on the left", ["overtake_left()"]),
        ("overtake the car ahead on the right", ["overtake_right()"]),
        ("I'm late for work", ["overtake()", "hurry()"]),
        ("take the left lane and then slow down by 5 mph", ["lane_left()", "slower_by(mph(5))"]),
    ],
)
def test_plain_words_become_their_program(planner: LanguageModelPlanner, wish: str, written: list[str]) -> None:
    assert calls(planner, wish) == written


@pytest.mark.parametrize("way", ["turn_left", "turn_right", "go_straight"])
def test_it_crosses_junctions_as_told(planner: LanguageModelPlanner, way: str) -> None:
    words = {"turn_left": "Turn left here", "turn_right": "Turn right here", "go_straight": "Go straight on here"}
    assert calls(planner, words[way], JUNCTION) == [f"{way}()"]


@pytest.mark.parametrize("speed", [*range(35, 71, 5), 42, 58])
def test_numbers_are_copied_digit_by_digit(planner: LanguageModelPlanner, speed: int) -> None:
    plan = planned(planner, f"Set the speed to {speed} mph, please.")
    assert [step.call() for step in steps(plan)] == [f"drive_at(mph({speed}))"]
    assert f"{speed} mph" in plan.thoughts.text


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


@pytest.mark.parametrize("wish", ["Ram the car in front", "Drive on the wrong side of the road"])
def test_what_must_not_or_cannot_be_done_is_declined(planner: LanguageModelPlanner, wish: str) -> None:
    plan = planned(planner, wish)
    assert plan.policy is None
    assert plan.refusal


def test_what_is_unclear_is_asked(planner: LanguageModelPlanner) -> None:
    plan = planned(planner, "Left or right, you know")
    assert plan.policy is None
    assert plan.refusal.endswith("?")


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
