"""Instructions in a town, on board: recalled from what was learned, refused in words where the map has no such way."""

from __future__ import annotations

import asyncio

import numpy as np
import pytest

from chauffeur.bench.leaderboard.instructed import navigator_of
from chauffeur.concept import Context, Instruction, Parameters, Plan, PlanRequest, Program, Situation, SystemMessage
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


@pytest.mark.parametrize(
    ("text", "call"),
    [
        ("In about 120 meters, take a left at the lights.", "turn_left_at_next_intersection()"),
        ("At the second junction, make a right turn.", "turn_right_at_next_intersection()"),
        ("Bear right at the fork in 60 meters.", "turn_right_at_next_intersection()"),
        ("At the first split, go straight on.", "go_straight_at_next_intersection()"),
        ("Get into the lane on your left now.", "change_lane_left()"),
        ("Change into the right lane in 40 meters, then go left at the stop sign.", "change_lane_right()"),
    ],
)
def test_an_instruction_is_driven_as_it_was_learned(text: str, call: str) -> None:
    plan = planned(text)
    assert call in source_of(plan)
    assert plan.raw, "what was recalled is said"
    assert "snippets-" in plan.model


@pytest.mark.parametrize(
    "text", ["Continue straight at the signal.", "Just keep to this road for 300 meters.", "Stay on this road."]
)
def test_who_goes_straight_on_turns_nowhere(text: str) -> None:
    source = source_of(planned(text))
    assert "turn_left" not in source
    assert "turn_right" not in source
    assert "change_lane" not in source


def test_what_was_not_learned_is_left_to_others() -> None:
    assert plan_in_town(ONBOARD, asked("Tell me a joke.")) is None
    highway = asked("Turn left at the lights.")
    situation = Situation("highway", 8.0, 13.9, 3, 1, False, None, None)
    elsewhere = PlanRequest(highway.instruction, Context("", situation), SystemMessage(""))
    assert plan_in_town(ONBOARD, elsewhere) is None


@pytest.mark.parametrize(
    ("text", "turns", "lane", "words"),
    [
        ("Turn left at the lights.", ("straight", "right"), 1, "No way leads to the left"),
        ("Keep straight ahead at the junction.", ("left", "right"), 1, "No way leads straight on"),
        ("Turn right.", (), 1, "no junction"),
        ("Move over to the left lane now.", EVERY_WAY, 0, "no lane to the left"),
        ("Move over to the right lane now.", EVERY_WAY, 2, "no lane to the right"),
    ],
)
def test_a_way_that_is_not_there_is_refused_in_words(text: str, turns: tuple[Turn, ...], lane: int, words: str) -> None:
    plan = planned(text, turns, lane)
    assert plan.policy is None
    assert words in plan.refusal


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


@pytest.mark.parametrize(
    ("text", "intent", "says"),
    [
        ("Please don't go left here, carry on straight ahead.", "straight on", ()),
        ("Take a left, no, a right.", "way right", ()),
        ("At the third street go right.", "way right", ("range(2)", 'pass_a_way("right")')),
        ("After three more junctions turn left.", "way left", ("range(3)", 'pass_a_way("left")')),
        ("Keep going for 150 meters, then stop.", "on+stop", ("drive_on(150)", "yield stop()")),
        ("Please stop at the next corner.", "stop", ("get_distance_to_junction() <", "yield stop()")),
    ],
)
def test_denials_corrections_counts_and_distances_are_heeded(text: str, intent: str, says: tuple[str, ...]) -> None:
    plan = planned(text)
    assert plan.intent == intent
    source = source_of(plan)
    assert all(one in source for one in says)
    assert "turn_left" not in source or intent == "way left"


@pytest.mark.parametrize(
    ("text", "place"),
    [("Bring us to the museum.", "museum"), ("Drop me off in front of the post office.", "post office")],
)
def test_a_place_is_driven_to(text: str, place: str) -> None:
    policy = planned(text).policy
    assert isinstance(policy, Parameters)
    assert policy.route == place


STANDING = Situation("town", 0.0, 11.1, 1, 0, False, None, None, EVERY_WAY)


def planned_at(situation: Situation, text: str) -> Plan:
    request = PlanRequest(Instruction(text), Context("I am in a town.", situation), SystemMessage(""))
    return asyncio.run(ONBOARD.plan(request))


@pytest.mark.parametrize(
    "story",
    [
        "My neighbour used to turn left at every junction, what a character.",
        "When we were kids we always stopped at the bakery on the way home.",
        "Thank you, that was a lovely bit of driving just now.",
    ],
)
def test_a_story_asks_for_nothing(story: str) -> None:
    plan = planned(story)
    assert plan.policy is None
    assert not plan.offer or plan.intent == "ask"


@pytest.mark.parametrize(
    ("text", "route"),
    [
        ("I have to pick up a prescription, so the chemist's, please.", "pharmacy"),
        ("Take me to the muse... sorry, no, the town hall.", "town hall"),
        ("Train station please, but we go by the bakery first", "bakery"),
        ("Run us over to school, lessons begin at quarter to nine.", "school"),
    ],
)
def test_a_place_is_found_by_what_people_call_it(text: str, route: str) -> None:
    plan = planned(text)
    assert isinstance(plan.policy, Parameters), plan.refusal
    assert plan.policy.route == route


def test_where_there_is_no_place_it_asks_where() -> None:
    assert "Name a place" in planned("Take us somewhere nice to eat.").refusal
    assert "where you live" in planned("Let's go home now.").refusal


@pytest.mark.parametrize(("text", "least", "most"), [("a bit slower, please", 8.0, 11.0), ("drive faster", 11.0, 11.2)])
def test_a_change_of_speed_at_a_stand_is_measured_from_what_is_set_out_for(
    text: str, least: float, most: float
) -> None:
    plan = planned_at(STANDING, text)
    assert plan.policy is not None, plan.refusal
    assert least <= dict(plan.settings)["target_speed_mps"] <= most


@pytest.mark.parametrize("text", ["Wait here, do not drive off yet.", "Don't set off, her seat belt is not fastened."])
def test_who_is_to_wait_stands(text: str) -> None:
    source = source_of(planned(text))
    assert "while True:\n        yield stop()" in source


def test_a_turn_that_is_far_away_is_not_at_the_next_junction() -> None:
    source = source_of(planned("In 300 metres turn right."))
    order = ["drive_on(260)", 'if can_go("right")', "turn_right_at_next_intersection()"]
    assert sorted(order, key=source.index) == order


def test_what_is_not_sure_is_asked_and_a_yes_drives_it() -> None:
    plan = planned("The old fellow would have gone left at this point.")
    assert plan.policy is None
    if plan.offer:
        assert planned(plan.offer).policy is not None
