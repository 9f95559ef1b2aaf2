"""Planners of gains: what a model's words are read as, what it is asked, and the fixed gains."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

import pytest

from chauffeur.concept import (
    NOBODY,
    ActionMatrix,
    ConfigError,
    Context,
    Instruction,
    PlanRequest,
    Situation,
    SystemMessage,
    Usage,
)
from chauffeur.planners.base import Planner, Prose
from chauffeur.planners.motion import FixedGainsPlanner, MotionPlanner, read_matrix
from chauffeur.planners.prompts import Message
from chauffeur.safety.gain_box import gain_box

GOOD = "Thoughts: Snow, so gently.\nP = [[0.2, 0.01, 0.1], [5, 10, 300]]"


class Scripted:
    """A model that says what it was given, one reply a turn."""

    id = model = "scripted"

    def __init__(self, *replies: str) -> None:
        self.replies = list(replies)
        self.asked: list[list[Message]] = []

    async def write(self, messages: Sequence[Message]) -> Prose:
        self.asked.append(list(messages))
        return Prose(self.replies.pop(0), True, self.model, Usage(10, 5, None, 1))


def request(words: str = "Gently, please.") -> PlanRequest:
    situation = Situation("track", 0.0, 13.9, 2, 1, False, None, None)
    context = Context("I am on a test track. It is snowing.", situation)
    return PlanRequest(Instruction(words, NOBODY), context, SystemMessage(""))


def test_a_reply_is_read_with_its_thoughts() -> None:
    policy, reply = read_matrix(GOOD)
    assert policy == ActionMatrix((0.2, 0.01, 0.1), (5.0, 10.0, 300.0))
    assert reply.thoughts == "Snow, so gently."


@pytest.mark.parametrize(
    "text",
    ["", "I would say moderately.", "P = [[1, 2], [3, 4]]", "P = [[a, b, c], [d, e, f]]", "P = [[1,2,3],[4,5," * 50],
)
def test_what_is_no_matrix_is_a_problem_and_no_exception(text: str) -> None:
    policy, reply = read_matrix(text)
    assert policy is None
    assert "action matrix" in reply.problem


def test_a_refusal_is_a_refusal_even_beside_a_matrix() -> None:
    policy, reply = read_matrix(f"REFUSE: That is unlawful.\n{GOOD}")
    assert policy is None
    assert reply.refusal == "That is unlawful."


def test_the_model_is_told_box_weather_and_wish_and_its_gains_come_with_settings() -> None:
    model = Scripted(GOOD)
    planner = MotionPlanner(model)
    assert isinstance(planner, Planner)
    plan = asyncio.run(planner.plan(request()))
    assert isinstance(plan.policy, ActionMatrix)
    assert dict(plan.settings)["ws"] == 300.0
    asked = model.asked[0]
    box = gain_box()
    assert f"Ws: {box.low['Ws']:g} to {box.high['Ws']:g}" in asked[0]["content"]
    assert "It is snowing." in asked[-1]["content"]
    assert "Gently, please." in asked[-1]["content"]


def test_gains_outside_the_box_are_repaired_once() -> None:
    model = Scripted("Thoughts: Hard!\nP = [[9, 0, 0], [5, 10, 300]]", GOOD)
    plan = asyncio.run(MotionPlanner(model).plan(request()))
    assert isinstance(plan.policy, ActionMatrix)
    assert plan.policy.pid[0] == 0.2
    assert "Kp of 9 is outside" in model.asked[1][-1]["content"]
    assert plan.usage.requests == 2


def test_a_model_that_gives_nothing_twice_is_unusable() -> None:
    plan = asyncio.run(MotionPlanner(Scripted("Hm.", "Hm.")).plan(request()))
    assert plan.policy is None
    assert plan.intent == "unusable"


def test_fixed_gains_are_always_the_same_and_inside_the_box() -> None:
    plans = [asyncio.run(FixedGainsPlanner().plan(request(words))).policy for words in ("Hurry!", "Slowly.")]
    assert plans[0] == plans[1]
    assert isinstance(plans[0], ActionMatrix)
    assert not gain_box().outside(plans[0])
    with pytest.raises(ConfigError, match="no variant"):
        FixedGainsPlanner.from_spec("x")
