"""A free drive ends when the wish is done as said, all of it, and held; and says what was reached."""

from __future__ import annotations

import asyncio
import sys
from functools import cache

import pytest

from chauffeur.cli.parts import planner_named
from chauffeur.concept import (
    Instruction,
    Limits,
    MissingExtraError,
    PersonId,
    Plan,
    PlanRequest,
    Program,
    Scenario,
    Thoughts,
    result_of,
)
from chauffeur.driving.again import drive_again
from chauffeur.driving.episode import drive_without_program
from chauffeur.driving.judge.choice import referee_for
from chauffeur.driving.judge.setpoints import GAP_M, SPEED_MPS
from chauffeur.driving.judge.trace import HELD_S
from chauffeur.driving.recording import RecordedTrip
from chauffeur.driving.scenarios import BUILT_IN, find, planner_for, seeds_with_lead, suiting
from chauffeur.driving.session import Session
from chauffeur.hmi.words import account_words, end_words, trip_words
from chauffeur.memory.choice import open_memory
from chauffeur.memory.feedback import interpret_feedback
from chauffeur.planners.base import Planner
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.track.dynamics import parameters


@cache
def planner(spec: str) -> Planner:
    return planner_named(spec, None)


def driven(wish: str, scenario: Scenario, by: Planner | None = None) -> RecordedTrip:
    chosen = by if by is not None else planner(planner_for("", scenario))
    session = Session(chosen, referee=referee_for)
    return asyncio.run(session.drive(Instruction(wish), scenario, scenario.seed, Limits()))


class Fixed:
    """A planner with one answer."""

    id = "fixed"

    def __init__(self, source: str, intent: str, settings: tuple[tuple[str, float], ...] = ()) -> None:
        self._plan = Plan(Thoughts("I drive."), Program(source), intent=intent, settings=settings, planner=self.id)

    async def plan(self, request: PlanRequest) -> Plan:
        del request
        return self._plan


def reached(recorded: RecordedTrip) -> dict[str, float]:
    return {metric.id: metric.value for metric in recorded.trip.metrics}


def test_overtaking_with_a_return_ends_back_in_the_lane() -> None:
    wish = "Overtake and come back."
    recorded = driven(wish, suiting(wish))
    first, last = recorded.frames[0].observation, recorded.final
    assert recorded.trip.outcome == "success" and last is not None
    assert first.ego.lane == last.ego.lane, "back where it began"
    assert first.front is not None
    lead = next(other for other in last.others if other.id == first.front.vehicle)
    assert lead.x_m < last.ego.x_m, "and past it"
    assert "back in the lane" in end_words(recorded.trip)
    again = drive_again(recorded, Limits(), referee_for).trip
    assert again is not None and again.trip == recorded.trip


def test_a_gap_is_reached_and_held() -> None:
    recorded = driven("Keep 40 m to the car ahead.", find("overtake"))
    assert recorded.trip.outcome == "success"
    tail = recorded.frames[-round(HELD_S / 0.1) + 1 :]
    gaps = [frame.observation.front.distance_m for frame in tail if frame.observation.front is not None]
    assert len(gaps) == len(tail) and all(abs(gap - 40.0) <= 1.2 for gap in gaps)
    assert reached(recorded)["asked-gap-v1"] == 40.0
    assert abs(reached(recorded)["end-gap-v1"] - 40.0) <= 1.2
    assert "Gap 40 m" in end_words(recorded.trip)


def test_a_lane_that_is_crossed_for_an_instant_is_not_held() -> None:
    there_and_back = """def drive():
    ego = get_ego_vehicle()
    home = get_lane_of(ego)
    beside = get_left_lane(ego)
    set_target_lane(beside)
    while get_lane_of(ego) != beside:
        yield autopilot()
    set_target_lane(home)
    for _ in range(60):
        yield autopilot()
"""
    recorded = driven("Change to the left lane.", find("overtake"), Fixed(there_and_back, "lane.left"))
    assert recorded.trip.outcome == "failure"
    assert "not done: change to the left lane (" in account_words(recorded.trip)


def test_a_program_that_still_has_to_come_back_is_waited_for() -> None:
    stays = """def drive():
    ego = get_ego_vehicle()
    lead = detect_front_vehicle_in(get_lane_of(ego))
    set_target_lane(get_left_lane(ego))
    set_target_speed(31.0)
    while get_distance_between_vehicles(ego, lead) < 20.0:
        yield autopilot()
    for _ in range(100):
        yield autopilot()
"""
    recorded = driven("Overtake.", find("overtake"), Fixed(stays, "overtake.left"))
    assert recorded.trip.outcome == "success"
    assert recorded.frames[-1].program == "finished", "it had ten more seconds to do"


def test_a_speed_that_traffic_does_not_allow_is_not_done() -> None:
    recorded = driven("Drive at 100 km/h.", find("overtake"))
    assert recorded.trip.outcome in ("failure", "timeout")
    assert "held the car up" in account_words(recorded.trip)


def test_a_speed_is_held_within_tolerance() -> None:
    recorded = driven("Slow down to 90 km/h.", find("cruise"))
    assert recorded.trip.outcome == "success"
    tail = recorded.frames[-round(HELD_S / 0.1) + 1 :]
    assert all(abs(frame.observation.ego.speed_mps - 25.0) <= SPEED_MPS for frame in tail)


def test_a_passing_flash_of_the_gap_is_not_enough() -> None:
    falls_back = """def drive():
    set_target_speed(20.0)
    while True:
        yield autopilot()
"""
    settings = (("gap_m", 40.0),)
    recorded = driven("Keep 40 m.", find("overtake"), Fixed(falls_back, "gap.set", settings))
    gaps = [f.observation.front.distance_m for f in recorded.frames if f.observation.front is not None]
    assert any(abs(gap - 40.0) < GAP_M for gap in gaps), "it was there for a moment"
    assert recorded.trip.outcome == "timeout"


def test_who_says_nothing_of_what_was_understood_claims_nothing() -> None:
    source = "def drive():\n    yield autopilot()\n"
    recorded = driven("Do your best.", find("overtake"), Fixed(source, ""))
    assert recorded.trip.outcome == "ended"


@pytest.mark.parametrize(
    "scenario",
    [one for one in BUILT_IN if one.world != "track"],  # its manoeuvres are set, and its wishes say how, not what
    ids=lambda scenario: scenario.id,
)
def test_every_advertised_wish_is_done(scenario: Scenario) -> None:
    recorded = driven(scenario.wish, scenario)
    assert recorded.trip.outcome == "success", (account_words(recorded.trip), recorded.trip.plan.intent)
    assert all(verdict.passed for verdict in recorded.trip.verdicts)
    assert suiting(scenario.wish).config.get("type") == scenario.config.get("type"), "the wish finds such a road"


@pytest.mark.parametrize(
    ("wish", "name"),
    [
        ("Overtake the car in front of you and then move back to the right lane.", "overtake"),
        ("Overtake on the right.", "left-lane"),
        ("Take the next right at the lights.", "intersection"),
        ("Leave a bit more space to the car ahead.", "following"),
        ("Could you park on the shoulder?", "emergency-lane"),
        ("Park in B7.", "parking"),
        ("Park close to the lift.", "parking-lift"),
        ("Find a parking spot under a roof.", "parking-lift"),
        ("Drive at 100 km/h.", "cruise"),
    ],
)
def test_a_wish_finds_a_road_that_can_carry_it(wish: str, name: str) -> None:
    assert suiting(wish).id == name


def test_a_lot_with_places_to_park_near_is_driven_by_who_knows_them() -> None:
    assert [planner_for("", find(name)) for name in ("parking-lift", "parking")] == ["vilad", "talk2drive"]
    assert planner_for("keyword", find("parking-lift")) == "keyword"


def test_a_wish_about_the_road_finds_a_car_that_looks_at_it(monkeypatch: pytest.MonkeyPatch) -> None:
    for parts in ("osqp", "vehiclemodels", "moderngl", "libsumo"):  # whatever is installed, it is the same road
        assert suiting("Hurry, but it is icy out there").id == "track-left-turn-sunny"
        assert suiting("Overtake, though it is slippery.").id == "overtake"
        monkeypatch.setitem(sys.modules, parts, None)


@pytest.mark.parametrize("scenario", BUILT_IN, ids=lambda one: one.id)
def test_the_wish_that_a_scenario_is_listed_with_is_shown_there(scenario: Scenario) -> None:
    assert suiting(scenario.wish) == scenario
    assert suiting(scenario.wish.upper().rstrip(".") + "!") == scenario
    assert suiting(scenario.wish.replace("I'm", "I am")) == scenario


@pytest.mark.parametrize("wish", ["Turn left and stop near the crosswalk.", "Careful, there's ice in that bend."])
def test_a_wish_whose_road_needs_what_is_not_installed_says_what(wish: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.startswith("vehiclemodels")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "vehiclemodels", None)
    parameters.cache_clear()
    with pytest.raises(MissingExtraError, match=r"-m pip install .*\[motion\]"):
        driven(wish, suiting(wish))


def test_roads_to_talk_on_keep_a_vehicle_to_overtake() -> None:
    scenario = find("overtake")
    world = HighwayWorld()
    for seed in seeds_with_lead(scenario, scenario.seed, 4):
        front = world.reset(scenario, seed).front
        assert front is not None and front.distance_m <= 100.0
        episode = drive_without_program(world, None, 40.0, record=False)  # nobody wishes anything
        assert episode.outcome == "ended"
        front = episode.final.front
        assert front is not None and front.distance_m <= 100.0, seed
    cruise = find("cruise")
    assert seeds_with_lead(cruise, 9, 3) == (9, 10, 11), "where nobody is ahead, nobody is looked for"


def test_feedback_on_a_gap_is_kept_to_in_the_next_drive() -> None:
    scenario, memory = find("following"), open_memory()
    session = Session(planner("onboard"), memory, referee=referee_for)

    def again() -> dict[str, float]:
        wish = Instruction(scenario.wish, PersonId("ada"))
        return reached(asyncio.run(session.drive(wish, scenario, scenario.seed, Limits())))

    once = again()
    assert memory.attach_feedback(PersonId("ada"), interpret_feedback("a bit too close still"))
    after = again()
    assert after["asked-gap-v1"] > once["asked-gap-v1"] + 3.0, "what was said counts"
    for drive in (once, after):
        assert abs(drive["end-gap-v1"] - drive["asked-gap-v1"]) <= max(GAP_M, 0.03 * drive["asked-gap-v1"])


LEFT_LANE = """def drive():
    set_target_lane(get_left_lane(get_ego_vehicle()))
    for _ in range(100):
        yield autopilot()
"""


def test_what_is_judged_is_what_was_said_and_not_what_the_plan_says() -> None:
    place = find("overtake")
    misread = driven("Change to the right lane.", place, Fixed(LEFT_LANE, "lane.left")).trip
    assert (result_of(misread), misread.judged_by) == ("not done", "reading")
    untold = driven("Change to the left lane.", place, Fixed(LEFT_LANE, "")).trip
    assert (result_of(untold), untold.judged_by) == ("done", "reading")
    mood = driven("What a lovely morning.", find("cruise"), Fixed(SLOW, "speed.set", (("target_speed_mps", 25.0),)))
    assert (mood.trip.outcome, mood.trip.judged_by) == ("success", "plan"), "nothing is read in it, so the plan's acts"


SLOW = """def drive():
    set_target_speed(25.0)
    while True:
        yield autopilot()
"""


@pytest.mark.parametrize("wish", ["Slow down when it rains", "Drive at 90 km/h after the bridge"])
def test_a_condition_that_is_not_used_is_named_and_never_ticked(wish: str) -> None:
    recorded = driven(wish, find("cruise"), Fixed(SLOW, "speed.set", (("target_speed_mps", 25.0),)))
    assert result_of(recorded.trip) == "partly done"
    assert recorded.trip.unused[0] in wish
    sign, label, tone = trip_words(recorded.trip)
    assert sign != "✓" and label.startswith("Partly done") and tone == "neutral"
    assert f"not used: “{recorded.trip.unused[0]}”" in account_words(recorded.trip)


def test_what_was_told_not_to_be_done_is_not_driven() -> None:
    recorded = driven("Do not overtake that car.", find("overtake"), Fixed(LEFT_LANE, "overtake.left"))
    assert (result_of(recorded.trip), recorded.frames) == ("declined", ())
