"""What the words deny is neither driven nor offered; more room always is room that may be driven."""

from __future__ import annotations

import asyncio

import pytest

from chauffeur.concept import Instruction, Limits, Plan
from chauffeur.driving.episode import make_world
from chauffeur.driving.scenarios import find
from chauffeur.driving.session import Session, check_drive
from chauffeur.planners.base import Planner
from chauffeur.planners.registry import make_planner


@pytest.fixture(scope="module", params=["onboard", "talk2drive"])
def planner(request: pytest.FixtureRequest) -> Planner:
    return make_planner(request.param)


def plan_of(planner: Planner, words: str, scenario: str) -> Plan:
    request = asyncio.run(Session(planner).request(Instruction(words), find(scenario), 3, Limits()))
    return asyncio.run(planner.plan(request))


@pytest.mark.parametrize("scenario", ["overtake", "emergency-lane"])
@pytest.mark.parametrize(
    "words", ["don't pull over", "no need to pull over", "Please do not pull over here.", "I don't want you to stop."]
)
def test_a_denied_stop_is_neither_driven_nor_offered(planner: Planner, words: str, scenario: str) -> None:
    plan = plan_of(planner, words, scenario)
    assert "pull over" not in plan.thoughts.text.partition("Shall I")[2]
    assert "stop" not in plan.thoughts.text.partition("Shall I")[2]
    assert plan.policy is None or not plan.intent.startswith(("pull_over", "stop"))


@pytest.mark.parametrize("words", ["drop back a little", "a bit more distance to the car ahead, please"])
def test_more_room_behind_a_car_that_is_too_near_is_at_least_what_the_limits_allow(words: str) -> None:
    planner = make_planner("onboard")
    plan = plan_of(planner, words, "overtake")
    assert plan.policy is not None, plan.refusal
    scenario = find("overtake")
    observation = make_world(scenario).reset(scenario, 3)
    assert observation.front is not None
    assert all(verdict.passed or not verdict.stops for verdict in check_drive(plan, observation, Limits()))
