"""What is said outright: whom (not) to pass, what comes later, two things that are one, how far something is."""

from __future__ import annotations

from pathlib import Path

import pytest
from parameters_asked import BEHIND, LEFT, LOT, driven, plan

from chauffeur.planners.base import Planner
from chauffeur.planners.registry import make_planner


@pytest.fixture(scope="module")
def planner() -> Planner:
    return make_planner("talk2drive")


ROWS = [
    line.split("\t") for line in (Path(__file__).parents[1] / "language/wordings.tsv").read_text("utf-8").splitlines()
]
PASS, STAY = ([text for reader, text, kind in ROWS if (reader, kind) == ("overtake", one)] for one in ("pass", "stay"))


@pytest.mark.parametrize("wish", PASS)
def test_who_asks_for_it_passes(planner: Planner, wish: str) -> None:
    assert driven(planner, wish, BEHIND).lane == -1


@pytest.mark.parametrize("wish", [*STAY, "Overtake him, no wait, stay behind him.", "Pass him, sorry, don't pass him."])
def test_who_forbids_it_does_not(planner: Planner, wish: str) -> None:
    found = driven(planner, wish, BEHIND)
    assert found.lane >= 0
    assert found.target_speed_mps <= BEHIND.speed_mps


def test_what_was_taken_back_is_dangerous_all_the_same(planner: Planner) -> None:
    assert plan(planner, "Ram him, no wait, overtake him.", BEHIND).policy is None


@pytest.mark.parametrize("wish", ["Wait five seconds, then overtake.", "Wait ten seconds and then move right."])
def test_what_is_for_later_is_not_done_at_once(planner: Planner, wish: str) -> None:
    found = plan(planner, wish, BEHIND)
    assert found.policy is None
    assert "when it is time" in found.refusal


def test_a_lane_and_its_speed_are_one_wish(planner: Planner) -> None:
    found = driven(planner, "Slow down and move to the right lane.", LEFT)
    assert (found.lane, found.target_speed_mps < LEFT.speed_mps) == (1, True)
    assert plan(planner, "Slow down to 20 m/s, then overtake.", BEHIND).policy is None


def test_how_far_an_exit_is_is_no_gap(planner: Planner) -> None:
    assert driven(planner, "Two more miles and it's exit only on the far side.", LEFT).lane == 1


@pytest.mark.parametrize("wish", ["Keep 40 metres to the car ahead.", "Drop back by 12 m behind that estate."])
def test_a_gap_is_none_of_these_parameters(planner: Planner, wish: str) -> None:
    assert "keeps the gap" in plan(planner, wish, BEHIND).refusal


def test_metres_in_a_lot_are_no_gap(planner: Planner) -> None:
    assert driven(planner, "There's a free bay two yards off.", LOT).route == "nearest"
