"""Instructions in a town, on board: recalled from what was learned, refused in words where the map has no such way."""

from __future__ import annotations

import asyncio

import numpy as np
import pytest

from chauffeur.bench.leaderboard.instructed import navigator_of
from chauffeur.concept import Context, Instruction, Plan, PlanRequest, Program, Situation, SystemMessage
from chauffeur.describe.navigation import NavigationInstruction
from chauffeur.geometry import LanePlace, Turn, plan_route
from chauffeur.planners.onboard.language_model import SHIPPED, LanguageModelPlanner
from chauffeur.planners.onboard.town import plan_in_town, snippets, steps_of
from chauffeur.programs import check_source
from chauffeur.worlds.town.library import OWN_TOWNS, load

ONBOARD = LanguageModelPlanner(SHIPPED)
EVERY_WAY: tuple[Turn, ...] = ("left", "straight", "right")


def asked(text: str, turns: tuple[Turn, ...] = EVERY_WAY, lane: int = 1, lanes: int = 3) -> PlanRequest:
    situation = Situation("town", 8.0, 13.9, lanes, lane, False, None, None, turns)
    return PlanRequest(Instruction(text), Context("I am in a town.", situation), SystemMessage(""))


def planned(text: str, turns: tuple[Turn, ...] = EVERY_WAY, lane: int = 1, lanes: int = 3) -> Plan:
    return asyncio.run(ONBOARD.plan(asked(text, turns, lane, lanes)))


def source_of(plan: Plan) -> str:
    assert isinstance(plan.policy, Program), plan.refusal
    assert check_source(plan.policy.source, vocabulary="town").passed
    return plan.policy.source


def test_what_was_not_learned_is_left_to_others() -> None:
    assert plan_in_town(ONBOARD, asked("Tell me a joke.")) is None
    highway = asked("Turn left at the lights.")
    situation = Situation("highway", 8.0, 13.9, 3, 1, False, None, None)
    elsewhere = PlanRequest(highway.instruction, Context("", situation), SystemMessage(""))
    assert plan_in_town(ONBOARD, elsewhere) is None


def test_a_place_and_a_stop_are_put_together() -> None:
    source = source_of(planned("Turn right after the church and let me out."))
    order = ['get_distance_to_place("church")', "turn_right_at_next_intersection()", "yield stop()"]
    assert sorted(order, key=source.index) == order
    assert [step.place for step in steps_of("Turn left past St. Mary's Church.", snippets()) or ()] == [
        "St. Mary's Church"
    ]


def said_in(town: str, count: int) -> list[tuple[NavigationInstruction, tuple[Turn, ...], int, int]]:
    """(instruction, ways at the junction, lane, lanes) along routes of a town, true and misleading ones."""
    pack, found = load(town), []
    rng = np.random.default_rng(11)
    lanes = [one for one in pack.road.lanes if one.kind == "driving" and not one.junction and one.length_m > 25.0]
    for _ in range(count):
        a, b = (lanes[int(i)] for i in rng.integers(len(lanes), size=2))
        route = plan_route(pack.road, LanePlace(a.id, 5.0, 0.0), LanePlace(b.id, b.length_m / 2.0, 0.0))
        if route is None or len(route.lanes) < 3:
            continue
        navigator, last = navigator_of(pack, route), 0.0
        for at, ways, before in navigator.junctions:
            beside = [one.id for one in pack.road.abreast(before) if one.kind == "driving"]
            for share in (0.1, 0.6, 0.95):
                for misleading in (False, True):
                    said = navigator.instruction(last + (at - last) * share, rng, misleading)
                    found.append((said, ways, beside.index(before), len(beside)))
            last = at
        for left_m in (120.0, 8.0):
            if navigator.length_m - last > left_m:
                found.append((navigator.instruction(navigator.length_m - left_m, rng), EVERY_WAY, 0, 1))
    return found


@pytest.fixture(scope="module")
def everything_said() -> list[tuple[NavigationInstruction, tuple[Turn, ...], int, int]]:
    towns = sorted(folder.name for folder in OWN_TOWNS.iterdir() if folder.is_dir())
    return [one for town in towns for one in said_in(town, 70)]


def test_instructions_are_of_many_classes(
    everything_said: list[tuple[NavigationInstruction, object, int, int]],
) -> None:
    safe = {said.kind for said, *_ in everything_said if said.safe_to_execute}
    wrong = {said.kind for said, *_ in everything_said if not said.safe_to_execute}
    assert len(safe) >= 60
    assert len(wrong) >= 8
    assert all(kind.startswith("misleading/") for kind in wrong)
    assert len({said.text for said, *_ in everything_said}) > 800


def test_misleading_instructions_are_refused_and_no_others(
    everything_said: list[tuple[NavigationInstruction, tuple[Turn, ...], int, int]],
) -> None:
    turns = [
        one for one in everything_said if not one[0].kind.removeprefix("misleading/").startswith(("change", "arrive"))
    ]
    step = max(1, len(turns) // 150)
    driven = {True: 0, False: 0}
    for said, ways, lane, lanes in turns[::step]:
        plan = plan_in_town(ONBOARD, asked(said.text, ways, lane, lanes))
        assert plan is not None, said.text
        assert (plan.policy is not None) is said.safe_to_execute, (said, ways, plan.refusal)
        driven[said.safe_to_execute] += 1
    assert min(driven.values()) > 30


def test_a_turn_that_is_far_away_is_not_at_the_next_junction() -> None:
    source = source_of(planned("In 300 metres turn right."))
    order = ["drive_on(260)", 'if can_go("right")', "turn_right_at_next_intersection()"]
    assert sorted(order, key=source.index) == order
