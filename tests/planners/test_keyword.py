"""The substring baseline, faults included."""

from __future__ import annotations

import asyncio

import pytest

from chauffeur.concept import Context, Instruction, Plan, PlanRequest, Program, Situation, SystemMessage
from chauffeur.planners.keyword import KeywordPlanner, keyword_intent
from chauffeur.programs import check_source

HIGHWAY = Situation("highway", 25.0, 31.2928, 2, 1, False, None, None)
CROSSING = Situation("intersection", 10.0, 10.0, 1, 0, False, None, 85.0, ("left", "straight", "right"))


def plan(words: str, situation: Situation = HIGHWAY) -> Plan:
    request = PlanRequest(Instruction(words), Context("", situation), SystemMessage(""))
    return asyncio.run(KeywordPlanner().plan(request))


@pytest.mark.parametrize(
    ("words", "world", "intent"),
    [
        ("Do not speed up", "highway", "speed.increase"),
        ("You're driving too fast", "highway", "speed.increase"),
        ("Is that right?", "highway", "lane.right"),
        ("Please do not turn", "intersection", "turn.left"),
        ("It is breakfast time", "highway", "speed.increase"),
        ("Speed up", "highway", ""),
        ("please slow down", "highway", "speed.decrease"),
        ("change to the left lane", "highway", "lane.left"),
    ],
)
def test_documented_faults_are_kept(words: str, world: str, intent: str) -> None:
    assert keyword_intent(words, world)[0] == intent


@pytest.mark.parametrize(
    ("words", "situation", "speed"),
    [
        ("go fast", HIGHWAY, 13.89),
        ("go slow", HIGHWAY, 8.33),
        ("whatever", HIGHWAY, 11.11),
        ("go fast", CROSSING, 8.33),
        ("go slow", CROSSING, 4.17),
        ("stop", CROSSING, 0.0),
    ],
)
def test_fixed_numbers(words: str, situation: Situation, speed: float) -> None:
    assert dict(plan(words, situation).settings)["target_speed_mps"] == speed


@pytest.mark.parametrize("situation", [HIGHWAY, CROSSING])
@pytest.mark.parametrize("words", ["left", "right", "turn left", "turn right", "straight", "stop", "fast", "slow", "x"])
def test_every_program_is_in_the_language(words: str, situation: Situation) -> None:
    policy = plan(words, situation).policy
    assert isinstance(policy, Program)
    assert check_source(policy.source).passed
