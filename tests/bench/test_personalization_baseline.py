"""The rule-based systems: the published one with its faults, and the fair one."""

from __future__ import annotations

import asyncio

import pytest

from chauffeur.bench.personalization.baseline import KeywordParameters
from chauffeur.concept import Context, Instruction, Limits, Parameters, PlanRequest, Situation, SystemMessage

HIGHWAY = Situation("highway", 24.0, 31.3, 2, 1, False, None, None)
LEFT = Situation("highway", 24.0, 31.3, 2, 0, False, None, None)
CROSSING = Situation("intersection", 8.0, 10.0, 1, 0, False, None, 60.0)
LOT = Situation("parking", 3.0, 4.17, 1, 0, False, None, None)


def plan(words: str, place: Situation = HIGHWAY, *, fair: bool = False) -> Parameters:
    request = PlanRequest(Instruction(words), Context("", place), SystemMessage(""), limits=Limits())
    found = asyncio.run(KeywordParameters(fair=fair).plan(request)).policy
    assert isinstance(found, Parameters)
    return found


def test_speeds_stand_in_the_published_proportions_and_below_the_sign() -> None:
    assert plan("Nothing in particular.").target_speed_mps == 24.0
    assert plan("Please speed up.").target_speed_mps == pytest.approx(30.0)
    assert plan("Drive slower.").target_speed_mps == pytest.approx(18.0)
    assert plan("Drive fast.", CROSSING).target_speed_mps == 10.0
    assert plan("Drive slower.", CROSSING).target_speed_mps == pytest.approx(6.0)


def test_the_published_rules_have_their_faults() -> None:
    assert plan("Do not speed up.").target_speed_mps > 24.0
    assert plan("You drive too fast.").target_speed_mps > 24.0
    assert plan("Is that right?", LEFT).lane == 1
    assert plan("Speed up.").target_speed_mps == 24.0
    assert plan("Park near the stadium.", LOT).route == "nearest"
    assert plan("It is about time.", LOT).route == "exit"


def test_the_fair_rules_have_them_not() -> None:
    assert plan("Do not speed up.", fair=True).target_speed_mps == 24.0
    assert plan("You drive too fast.", fair=True).target_speed_mps < 24.0
    assert plan("Speed up.", fair=True).target_speed_mps > 24.0
    assert plan("Park near the stadium.", LOT, fair=True).route == "stadium"
    assert plan("It is about time.", LOT, fair=True).route == ""
    assert plan("Please don't overtake anybody.", fair=True).lane == 0


def test_both_change_lanes_where_there_is_one() -> None:
    for fair in (False, True):
        assert plan("Please overtake that car.", fair=fair).lane == -1
        assert plan("Go to the right lane.", fair=fair).lane == 0  # there is none
