"""What the embedded planners make of a wish in a place, row by row: `wishes.tsv`.

A row has the planner, the place, the wish, and checks. Those of lane, route, speed and intent look at what is driven,
if need be after one yes; the others at the first answer.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest
from parameters_asked import BEHIND, LEFT, LOT, plan

from chauffeur.concept import History, Lead, Limits, Parameters, Plan, Program, Situation
from chauffeur.planners.base import Planner
from chauffeur.planners.onboard.dialect import read
from chauffeur.planners.registry import make_planner
from chauffeur.planners.talk2drive.hints import hint_of
from chauffeur.programs import check_source

TOWN = Situation("town", 8.0, 13.9, 3, 1, False, None, None, ("left", "straight", "right"))
SLOW = Situation("highway", 20.0, 31.3, 3, 1, False, Lead(7, 40.0, 19.0), None)
CROSSING = Situation("intersection", 10.0, 10.0, 1, 0, False, None, None)
PLACES = {
    "behind": BEHIND,
    "behind, middle": replace(BEHIND, lane_index=1),
    "crossing": CROSSING,
    "junction": Situation("intersection", 9.0, 10.0, 1, 0, False, None, 20.0, ("left", "straight", "right")),
    "left": LEFT,
    "left, capped": LEFT,
    "left, middle": replace(LEFT, lane_index=1),
    "lot": LOT,
    "right": replace(LEFT, lane_index=2),
    "road": Situation("highway", 25.0, 31.3, 3, 1, False, Lead(7, 40.0, 24.0), None),
    "slow crossing": replace(CROSSING, speed_mps=8.0, speed_limit_mps=11.0),
    "slow road": SLOW,
    "slow road, leftmost": replace(SLOW, lane_index=0),
    "town": TOWN,
    "town, leftmost": replace(TOWN, lane_index=0),
    "town, rightmost": replace(TOWN, lane_index=2),
    "town, no junction": replace(TOWN, turns=()),
    "town, no way left": replace(TOWN, turns=("straight", "right")),
    "town, no way on": replace(TOWN, turns=("left", "right")),
    "town, standing": replace(TOWN, speed_mps=0.0, speed_limit_mps=11.1, lane_count=1, lane_index=0),
}
CAP_MPS = 29.0
"""Of the person in a place that is `capped`."""
COMPARED: dict[str, Callable[[float, float], bool]] = {
    "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge,
    "=": lambda found, wanted: found == pytest.approx(wanted, abs=0.01),
}  # fmt: skip
ROWS = [line.split("\t") for line in Path(__file__).with_name("wishes.tsv").read_text("utf-8").splitlines()]


@cache
def planner_named(name: str) -> Planner:
    return make_planner(name)


def planned(planner: str, place: str, wish: str, confirmed: str = "") -> Plan:
    limits = Limits(max_speed_mps=CAP_MPS) if place.endswith("capped") else Limits()
    return plan(planner_named(planner), wish, PLACES[place], limits, confirmed=confirmed)


def holds(check: str, first: Plan, driven: Plan) -> bool:
    """Whether a check holds of the first answer, and of what is driven after a yes."""
    name, _, value = check.partition(" ")
    policy = driven.policy
    match name:
        case "declines":
            return first.policy is None and bool(first.refusal)
        case "asks":
            return first.policy is None and first.refusal.endswith("?")
        case "unasked":
            return first.policy is not None
        case "offers":  # nothing, or nothing but with a question
            return not first.offer or (value == "nothing unasked" and first.intent == "ask")
        case "a":  # yes drives
            return not first.offer or policy is not None
        case "says":
            return value in f"{first.thoughts.text} {first.refusal}"
        case "calls":
            assert isinstance(first.policy, Program), first.refusal
            return [step.call() for step in read(first.policy.source)] == value.split(" + ")
        case "learned":
            return bool(first.raw) and "snippets-" in first.model
        case "has" | "lacks":
            assert isinstance(first.policy, Program), first.refusal
            assert check_source(first.policy.source, vocabulary="town").passed
            return (value.replace("\\n", "\n") in first.policy.source) is (name == "has")
        case "intent":
            exact = value.startswith("= ")
            return driven.intent == value[2:] if exact else driven.intent.startswith(tuple(value.split(" or ")))
        case "speed":
            sign, wanted = value.split()
            speed_mps = dict(driven.settings)["target_speed_mps"]
            assert not isinstance(policy, Parameters) or policy.target_speed_mps == speed_mps
            return COMPARED[sign](speed_mps, float(wanted))
        case "lane":
            assert isinstance(policy, Parameters), driven.refusal
            return policy.lane >= int(value[3:]) if value.startswith(">= ") else policy.lane == int(value)
        case "route":
            assert isinstance(policy, Parameters), driven.refusal
            return policy.route == value.replace("none", "")
        case _:
            raise ValueError(check)


@pytest.mark.parametrize(("planner", "place", "wish", "checks"), [row for row in ROWS if row[0] != "hint"])
def test_a_wish_is_answered_as_its_row_says(planner: str, place: str, wish: str, checks: str) -> None:
    first = planned(planner, place, wish)
    driven = planned(planner, place, first.offer, first.refusal) if first.offer else first
    for check in checks.split("; "):
        either = check.removesuffix(" or declines")
        declines = either != check and first.policy is None
        assert declines or holds(either, first, driven), (check, first.intent, first.refusal, driven.policy)


@pytest.mark.parametrize(("place", "wish", "kind"), [row[1:] for row in ROWS if row[0] == "hint"])
def test_a_hint_is_sorted_where_it_is_said(place: str, wish: str, kind: str) -> None:
    found = hint_of(wish, PLACES[place], History())
    assert found is not None and found.kind == kind
    assert 0.0 < found.share <= 1.0 and not found.because
