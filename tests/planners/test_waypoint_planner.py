"""A model's waypoints as a policy: what it is asked, what is driven, and what is declined."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from chauffeur.concept import CameraImage, ConfigError, Instruction, Limits, PlanRequest, Trajectory, Usage
from chauffeur.driving.scenarios import find
from chauffeur.driving.session import Session
from chauffeur.planners.base import Prose
from chauffeur.planners.keyword import KeywordPlanner
from chauffeur.planners.prompts.waypoints import motion_words, read_motion
from chauffeur.planners.registry import make_planner
from chauffeur.planners.waypoints import WaypointPlanner

WAY = "[(4.0, 0.0), (8.0, 0.1), (12.0, 0.2), (16.0, 0.3), (20.0, 0.4), (24.0, 0.5)]"


class Says:
    """A model that says one thing, and keeps what it was asked."""

    id, model = "says", "says-v1"

    def __init__(self, text: str, *, whole: bool = True) -> None:
        self.text, self.whole, self.asked = text, whole, list[Any]()

    async def write(self, messages: Any) -> Prose:
        self.asked.append(messages)
        return Prose(self.text, self.whole, self.model, Usage())


@pytest.fixture(scope="module")
def request_made() -> PlanRequest:
    session = Session(KeywordPlanner())
    return asyncio.run(session.request(Instruction("A bit slower."), find("cruise"), 1, Limits()))


def test_waypoints_are_a_trajectory_and_the_answer_is_the_reason(request_made: PlanRequest) -> None:
    plan = asyncio.run(WaypointPlanner(Says(f"The road is free. {WAY}")).plan(request_made))
    assert isinstance(plan.policy, Trajectory)
    assert plan.policy.period_s == 0.5
    assert plan.policy.waypoints_m[-1] == (24.0, 0.5)
    assert "The road is free." in plan.thoughts.text
    assert (plan.planner, plan.model) == ("waypoints/says", "says-v1")


@pytest.mark.parametrize("said", ["I would rather not.", "[(4.0, 0.0)]", f"{WAY} or {WAY.replace('0.5', '9.5')}"])
def test_an_answer_without_waypoints_drives_nothing(said: str, request_made: PlanRequest) -> None:
    plan = asyncio.run(WaypointPlanner(Says(said)).plan(request_made))
    assert (plan.policy, plan.intent) == (None, "unusable")
    assert plan.refusal


def test_an_answer_that_was_cut_drives_nothing(request_made: PlanRequest) -> None:
    assert asyncio.run(WaypointPlanner(Says(WAY, whole=False)).plan(request_made)).policy is None


def test_the_question_has_picture_wish_and_own_motion(request_made: PlanRequest) -> None:
    model = Says(WAY)
    picture = CameraImage("front", 0.0, np.zeros((90, 160, 3), np.uint8))
    asyncio.run(WaypointPlanner(model).plan(replace(request_made, images=(picture,))))
    caption, shown, text = model.asked[0][0]["content"]
    assert caption["text"] == "Front camera, now:"
    assert shown["image_url"]["url"].startswith("data:image/jpeg;base64,")
    assert "The passenger says: A bit slower." in text["text"]
    history, command = read_motion(text["text"])
    steady = request_made.context.situation.speed_mps
    assert history[:, 0] == pytest.approx([-2.0 * steady, -1.5 * steady, -steady, -0.5 * steady, 0.0], abs=0.01)
    assert command == ""


def test_motion_that_is_told_is_not_made_up(request_made: PlanRequest) -> None:
    model, told = Says(WAY), motion_words(np.array([[-3.0, 0.0, 0.0]] * 4 + [[0.0, 0.0, 0.0]]), "turn left")
    context = replace(request_made.context, text=f"A street.\n{told}")
    asyncio.run(WaypointPlanner(model).plan(replace(request_made, context=context)))
    assert read_motion(model.asked[0][0]["content"][-1]["text"])[1] == "turn left"


def test_it_is_made_by_its_name() -> None:
    made = make_planner("waypoints/openai/some-vlm", base_url="http://localhost:8040/v1")
    assert made.id == "waypoints/openai/some-vlm"
    with pytest.raises(ConfigError):
        make_planner("waypoints/onboard")
