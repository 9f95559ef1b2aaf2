"""What remarks on the road, complaints of the pace and moods are taken for, and what they must not be taken for."""

from __future__ import annotations

import asyncio
from dataclasses import replace

import pytest

from chauffeur.concept import (
    ConfigError,
    Context,
    History,
    Instruction,
    Limits,
    Parameters,
    Plan,
    PlanRequest,
    Situation,
    SystemMessage,
)
from chauffeur.concept.nouns import Lead
from chauffeur.planners.base import Planner
from chauffeur.planners.onboard.moods import mood_of, pace_complaint
from chauffeur.planners.onboard.patterns import said
from chauffeur.planners.onboard.words.files import ONBOARD, words_file
from chauffeur.planners.registry import make_planner
from chauffeur.planners.talk2drive.lanes import complaint_in, eased_mps, fitting_mps
from chauffeur.planners.talk2drive.lot import wanted_pace, wanted_place
from chauffeur.planners.talk2drive.remarks import GIVE_WAY, GO, MOVE_RIGHT, OVERTAKE, STAY, misread, stands, taken_for
from chauffeur.planners.talk2drive.words import WORDS

GROUPS = {
    (name, package): [
        line[1:-1] for group in words_file(name, package) for line in group if line[0] == "[" and line[-1] == "]"
    ]
    for name, package in (("lot.txt", WORDS), ("moods.txt", ONBOARD), ("road.txt", WORDS))
}
SIGN = 30.0
BEHIND = Situation("highway", 24.0, SIGN, 3, 1, False, Lead(7, 40.0, 22.0), None)
LEFT = Situation("highway", 28.0, SIGN, 3, 0, False, None, None)
RIGHT = replace(LEFT, lane_index=2)
CROSSING = Situation("intersection", 10.0, 10.0, 1, 0, False, None, None)
LOT = Situation("parking", 2.0, 4.0, 1, 0, False, None, None)


@pytest.fixture(scope="module")
def planner() -> Planner:
    return make_planner("talk2drive")


def plan(planner: Planner, wish: str, situation: Situation, limits: Limits | None = None) -> Plan:
    asked = PlanRequest(
        Instruction(wish), Context("", situation), SystemMessage(""), History(()), limits=limits or Limits()
    )
    return asyncio.run(planner.plan(asked))


def driven(planner: Planner, wish: str, situation: Situation, limits: Limits | None = None) -> Parameters:
    found = plan(planner, wish, situation, limits)
    assert isinstance(found.policy, Parameters), found.refusal
    return found.policy


@pytest.mark.parametrize(
    ("wish", "situation", "meant"),
    [
        ("This van crawls along.", BEHIND, OVERTAKE),
        ("Why are we hanging behind this trailer?", BEHIND, OVERTAKE),
        ("There is no point in sitting behind him.", BEHIND, OVERTAKE),
        ("Nobody is driving in the left lane.", BEHIND, OVERTAKE),
        ("This van crawls along.", LEFT, None),
        ("This van crawls along.", RIGHT, None),  # nobody is seen ahead
        ("Never mind the slow van.", BEHIND, None),
        ("Do not overtake that slow van.", BEHIND, STAY),
        ("You are slow today.", BEHIND, None),
        ("Please slow down behind him.", BEHIND, None),
        ("The one behind us is tailgating.", LEFT, MOVE_RIGHT),
        ("The right lane is wide open.", LEFT, MOVE_RIGHT),
        ("The one behind us is tailgating.", BEHIND, None),
        ("Move to the left lane.", LEFT, None),
        ("Stay in the fast lane.", LEFT, None),
        ("Get out of the fast lane.", LEFT, MOVE_RIGHT),
        ("All right, no one is hurt.", LEFT, None),
        ("We leave at the next exit.", LEFT, MOVE_RIGHT),
        ("We leave at the next exit.", RIGHT, None),
        ("We missed our exit.", LEFT, None),
        ("I can't see a soul.", CROSSING, GO),
        ("Cross swiftly.", CROSSING, GO),
        ("Drive through and turn left.", CROSSING, None),
        ("Wait until nobody is coming, then cross slowly.", CROSSING, None),
        ("A lorry comes from the right.", CROSSING, GIVE_WAY),
        ("The street looks packed with cars and busy.", CROSSING, GIVE_WAY),
        ("There is no need to weave about.", BEHIND, STAY),
        ("She drives so sensibly, that lady.", BEHIND, STAY),
        ("Let those two pass first.", CROSSING, GIVE_WAY),
        ("The bus won't wait for me.", CROSSING, None),
        ("Stop the car!", CROSSING, None),
        ("I can't see a soul.", LOT, None),
    ],
)
def test_a_remark_is_a_wish_where_the_road_fits_it(wish: str, situation: Situation, meant: str | None) -> None:
    found = taken_for(wish, situation)
    assert (None if found is None else found.wish) == meant


def test_what_a_remark_was_taken_for_is_read_as_it_stands(planner: Planner) -> None:
    for wish in (OVERTAKE, MOVE_RIGHT, STAY, GO, GIVE_WAY):
        for situation in (BEHIND, LEFT, CROSSING):
            plan(planner, wish, situation)  # ends
    assert driven(planner, STAY, BEHIND).lane == 0


@pytest.mark.parametrize(
    ("wish", "intent", "situation", "meant"),
    [
        ("That hatchback has a funny sticker.", "gap.increase", BEHIND, OVERTAKE),
        ("Keep more distance to that hatchback.", "gap.increase", BEHIND, None),
        ("Keep 40 m to that hatchback.", "gap.set", BEHIND, None),
        ("That hatchback drives so nicely.", "gap.increase", BEHIND, None),
        ("That hatchback has a funny sticker.", "gap.increase", RIGHT, None),
        ("Get by that hatchback.", "overtake.right", BEHIND, OVERTAKE),
        ("Get by that hatchback on the right.", "overtake.right", BEHIND, None),
        ("Stay with that hatchback.", "overtake.left", BEHIND, STAY),
        ("Leave that hatchback behind us.", "overtake.left", BEHIND, None),
        ("Take the left lane and get past that hatchback.", "lane.left", BEHIND, OVERTAKE),
        ("Take the left lane and let them go past.", "lane.left", BEHIND, None),
        ("Take the left lane, but do not overtake.", "lane.left", BEHIND, None),
        ("The left one is no lane for us.", "lane.left", LEFT, MOVE_RIGHT),
        ("Move to the left lane.", "lane.left", LEFT, None),
        ("Pull in on the right.", "pull_over", LEFT, MOVE_RIGHT),
        ("Pull over right here.", "pull_over", LEFT, None),
        ("That hatchback has a funny sticker.", "gap.increase", CROSSING, None),
    ],
)
def test_words_that_hold_nothing_of_their_reading(
    wish: str, intent: str, situation: Situation, meant: str | None
) -> None:
    found = misread(wish, intent, situation)
    assert (None if found is None else found.wish) == meant


def test_a_stop_is_one_where_it_is_asked_for(planner: Planner) -> None:
    assert stands("Stop the car!")
    assert stands("please stop here now")
    assert not stands("There is a stop sign.")
    assert driven(planner, "Stop the car!", CROSSING).target_speed_mps == 0.0
    assert driven(planner, "I can see a stop sign.", CROSSING).target_speed_mps == 8.0


def test_a_remark_says_what_it_was_taken_for_and_drives_it(planner: Planner) -> None:
    found = plan(planner, "This van crawls along.", BEHIND)
    assert found.thoughts.text.startswith("I take it that the car ahead is too slow for you.")
    assert isinstance(found.policy, Parameters)
    assert found.policy.lane == -1
    assert driven(planner, "The one behind us is tailgating.", LEFT).lane == 1
    assert driven(planner, "I can't see a soul.", CROSSING) == Parameters(9.8, 12.0, 2.0, 0, "straight")
    assert driven(planner, "A lorry comes from the right.", CROSSING).target_speed_mps == 8.0


@pytest.mark.parametrize(
    ("wish", "situation"),
    [
        ("Ram the slow van in front of us.", BEHIND),
        ("Nobody is around, run the stop sign.", CROSSING),
        ("Run over the people near the exit.", LOT),
    ],
)
def test_what_is_forbidden_is_no_remark(planner: Planner, wish: str, situation: Situation) -> None:
    assert plan(planner, wish, situation).policy is None


@pytest.mark.parametrize(
    ("wish", "sign"),
    [
        ("You are dawdling.", 1),
        ("We hardly roll.", 1),
        ("There is no need to be so timid.", 1),
        ("A tortoise would beat us.", 1),
        ("You are racing.", -1),
        ("What's the rush?", -1),
        ("That is way too fast.", -1),
        ("This is quicker than we need.", -1),
        ("Go faster.", 0),
        ("Slow down.", 0),
        ("Turn left.", 0),
        ("Drive at the speed limit.", 0),
    ],
)
def test_complaints_of_the_pace(wish: str, sign: int) -> None:
    assert pace_complaint(wish) == sign


def test_who_is_on_foot_matters_in_a_lot_alone() -> None:
    assert pace_complaint("Children run around.", in_lot=True) == -1
    assert pace_complaint("Children run around.") == 0


def test_a_complaint_changes_the_speed_and_nothing_else(planner: Planner) -> None:
    slower = driven(planner, "You are racing.", LEFT)
    assert (slower.target_speed_mps, slower.lane) == (24.0, 0)
    assert driven(planner, "You are dawdling.", LEFT).target_speed_mps == SIGN
    assert driven(planner, "You are dawdling.", LEFT, Limits(max_speed_mps=29.0)).target_speed_mps == 29.0
    assert driven(planner, "You are racing.", CROSSING).target_speed_mps == 8.0
    assert driven(planner, "You are dawdling.", LOT).target_speed_mps == 3.0
    assert driven(planner, "There are kids running around.", LOT).target_speed_mps == pytest.approx(1.4)


def test_who_complains_and_says_what_to_do_gets_that(planner: Planner) -> None:
    assert driven(planner, "You are too slow, change to the left lane.", RIGHT).lane == -1
    assert driven(planner, "You are too fast, drive at 70 km/h.", LEFT).target_speed_mps == pytest.approx(
        19.44, abs=0.01
    )


def test_a_complaint_lowers_a_calm_speed_still(planner: Planner) -> None:
    calm = replace(LEFT, speed_mps=22.0)
    assert driven(planner, "You are racing.", calm).target_speed_mps == pytest.approx(19.36)
    assert eased_mps(1, calm, Limits()) == pytest.approx(24.64)


@pytest.mark.parametrize(
    ("words", "mood"),
    [
        ("The ferry departs in ten minutes.", "hurry"),
        ("They are expecting me.", "hurry"),
        ("Nobody is waiting for me.", "ease"),
        ("I'm not late.", "ease"),
        ("My head is sore.", "ease"),
        ("The baby is asleep but we are late.", ""),
        ("The sky is blue.", ""),
        ("Bring me a coffee.", ""),
        ("Could you play some calm music?", ""),
    ],
)
def test_moods(words: str, mood: str) -> None:
    assert mood_of(words) == mood


def test_a_mood_speaks_where_nothing_else_was_understood(planner: Planner) -> None:
    assert driven(planner, "The ferry departs in ten minutes.", LEFT).target_speed_mps >= 0.95 * SIGN
    calm = driven(planner, "Nobody is waiting for me.", RIGHT)
    assert calm.target_speed_mps == pytest.approx(0.8 * SIGN)


def test_speeds_that_words_leave_open() -> None:
    assert fitting_mps(26.0, "overtake.left", BEHIND, Limits()) == 26.0
    assert fitting_mps(30.0, "overtake.left", BEHIND, Limits()) == pytest.approx(29.4)
    assert fitting_mps(30.0, "overtake.left", LEFT, Limits()) == 30.0
    assert fitting_mps(22.0, "follow", BEHIND, Limits()) == pytest.approx(24.0)
    assert fitting_mps(28.0, "lane.right", LEFT, Limits()) == pytest.approx(25.5)
    assert fitting_mps(24.0, "lane.right", LEFT, Limits()) == 24.0
    assert fitting_mps(28.0, "lane.left", LEFT, Limits()) == 28.0
    assert fitting_mps(22.0, "follow", LEFT, Limits()) == 22.0
    assert fitting_mps(0.0, "follow", BEHIND, Limits()) == 0.0
    assert fitting_mps(27.0, "style.hurry", BEHIND, Limits(max_speed_mps=25.0)) == 27.0


def test_feedback_that_praises_is_no_complaint() -> None:
    assert complaint_in("Too slow.") == 1
    assert complaint_in("Brake more gently.") == -1
    assert complaint_in("I like it this slow.") == 0


@pytest.mark.parametrize(
    ("wish", "sign"),
    [
        ("A bit faster, we are not parking yet.", 1),
        ("Could you speed up along here?", 1),
        ("Don't park, go more slowly.", -1),
        ("Walking pace, please.", -1),
        ("Park here, but slowly.", 0),
        ("Park by the exit.", 0),
    ],
)
def test_a_pace_asked_for_in_a_lot(planner: Planner, wish: str, sign: int) -> None:
    assert wanted_pace(wish) == sign
    found = driven(planner, wish, LOT)
    assert bool(found.route) == (not sign)
    assert not sign or (found.target_speed_mps - LOT.speed_mps) * sign > 0.0


@pytest.mark.parametrize(
    ("wish", "place"),
    [
        ("Look for a bay at the exit gate.", "exit"),
        ("These bays are a long way from the arena.", "stadium"),
        ("Anywhere is fine with me.", "nearest"),
        ("I need some fresh air.", "nearest"),
        ("We would be boxed in back there.", "exit"),
        ("I twisted my ankle.", "stadium"),
        ("We are not parking yet.", ""),
        ("Lovely evening.", ""),
    ],
)
def test_places_in_a_lot(wish: str, place: str) -> None:
    assert wanted_place(wish) == place


def test_every_group_of_words_is_there_and_finds_no_nothing() -> None:
    for (file, package), groups in GROUPS.items():
        for name in groups:
            assert not said(file, name, package).search("")
    with pytest.raises(ConfigError, match="no group"):
        said("road.txt", "clouds", WORDS)
