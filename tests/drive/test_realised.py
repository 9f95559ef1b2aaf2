"""Wishes about things in sight, driven from end to end in a town, and the judge that holds the drives against them."""

from __future__ import annotations

import ast
import asyncio
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("libsumo")

from chauffeur.bench.referees import referee_for
from chauffeur.concept import (
    NOBODY,
    Instruction,
    Limits,
    Plan,
    PlanRequest,
    Program,
    Result,
    Scenario,
    Thoughts,
    result_of,
)
from chauffeur.concept.utterance import Act, acts_from_json
from chauffeur.drive import realised
from chauffeur.drive.episode import Referee
from chauffeur.drive.realised import MeaningReferee
from chauffeur.drive.recording import RecordedTrip
from chauffeur.drive.session import Session, parse_wish
from chauffeur.planners.meaning import MeaningPlanner
from chauffeur.worlds.base import World

LEFT_LANE, RIGHT_LANE = ("4:0:-1", 6.0), ("4:0:-2", 6.0)
BUS = {"kind": "bus", "colour": "red", "ahead_m": 18.0, "drives": True}
BLUE = {"kind": "car", "colour": "blue", "ahead_m": 30.0, "left_m": -2.8}
SILVER = {"kind": "car", "colour": "silver", "ahead_m": 44.0, "left_m": -2.8}
CROSSES = {
    "kind": "pedestrian", "colour": "yellow", "ahead_m": 57.0, "left_m": -3.6, "heading": "left", "speed_mps": 1.3,
    "for_m": 11.0, "near_m": 34.0,
}  # fmt: skip
STANDS = {"kind": "pedestrian", "colour": "red", "ahead_m": 25.0, "left_m": -3.6}
COMING = {"kind": "van", "colour": "white", "ahead_m": 40.0, "left_m": 7.0, "heading": "against", "speed_mps": 7.0}
CORNER = [
    {"kind": "car", "colour": colour, "ahead_m": at, "left_m": -2.8, "way": ["right"]}
    for colour, at in (("red", 96.0), ("black", 112.0))
]


class Fixed:
    """A planner that always drives the same program."""

    id = model = "fixed"

    def __init__(self, source: str) -> None:
        self._source = source

    async def plan(self, request: PlanRequest) -> Plan:
        return Plan(Thoughts("As ever."), Program(self._source), planner=self.id)


def driven(
    wish: str | Instruction, stage: list[Any], planner: Any = None, acts: list[Any] | None = None, **config: Any
) -> Any:
    """(the trip, its judge) of a wish in Gridford, among nobody else than the stage."""
    start = config.pop("start", RIGHT_LANE)
    base = {"town": "Gridford", "start": list(start), "vehicles": 0, "people": 0, "stage": stage, **config}
    judges: list[Referee | None] = []

    def judge(world: World, scenario: Scenario, plan: Plan, words: str) -> Referee | None:
        made = acts_from_json(acts) if acts is not None else None
        referee = referee_for(world, scenario, plan, words) if made is None else MeaningReferee(world, made, "labels")
        judges.append(referee)
        return referee

    session = Session(planner=planner or MeaningPlanner(), referee=judge, max_s=75.0)
    words = parse_wish(wish, NOBODY) if isinstance(wish, str) else wish
    trip: RecordedTrip = asyncio.run(session.drive(words, Scenario("s", "town", base, 1), 1, Limits()))
    return trip, judges[0] if judges else None


@pytest.mark.parametrize(
    ("wish", "stage", "start"),
    [
        ("Park behind the silver car.", [BUS, BLUE, SILVER], RIGHT_LANE),
        ("Follow the red bus.", [{**BUS, "turns": ["right"]}, BLUE], RIGHT_LANE),
        ("Follow that bus.", [{**BUS, "turns": ["left"]}, SILVER], LEFT_LANE),
        ("Wait for the pedestrian to cross, then turn right.", [CROSSES, SILVER], RIGHT_LANE),
        ("Let the pedestrian in yellow go first, then go straight.", [CROSSES, STANDS], RIGHT_LANE),
        ("Once the light turns green, go straight.", [SILVER], RIGHT_LANE),
        ("Turn left after the white van has passed.", [COMING], LEFT_LANE),
        ("Turn right and stop behind the parked black car.", [{**BLUE, "colour": "black"}, *CORNER], RIGHT_LANE),
        (
            "Stop next to the pedestrian in red.",
            [{**STANDS, "ahead_m": 40.0}, {**STANDS, "colour": "blue"}],
            RIGHT_LANE,
        ),
        ("Pass the parked blue car slowly, then stop in front of the silver car.", [BLUE, SILVER], RIGHT_LANE),
        ("Turn left, then turn right.", [], LEFT_LANE),
    ],
)
def test_what_was_said_is_done(wish: str, stage: list[Any], start: Any) -> None:
    trip, judge = driven(wish, stage, start=start)
    assert judge is not None, trip.trip.plan.thoughts.text
    assert [(one.act.act, one.result, one.why) for one in judge.judged if one.result != "done"] == []
    assert trip.trip.outcome == "success"
    assert trip.trip.judged_by == "reading"
    assert trip.trip.unused == ()
    assert result_of(trip.trip) is Result.DONE


def test_a_bus_that_turns_is_followed_round_the_corner() -> None:
    trip, _ = driven("Follow that bus.", [{**BUS, "turns": ["right"]}])
    seen = [frame.observation for frame in trip.frames]
    turned = [abs(one.heading_rad - seen[0].ego.heading_rad) for now in seen for one in now.others if one.kind == "bus"]
    assert max(turned) > 1.0
    ego, bus = trip.final.ego, next(one for one in trip.final.others if one.kind == "bus")
    assert math.hypot(ego.x_m - bus.x_m, ego.y_m - bus.y_m) < 60.0


@pytest.mark.parametrize(
    ("wish", "stage", "words"),
    [
        ("Park behind the green car.", [BLUE, SILVER], "I see no green car."),
        ("Park behind the car.", [BLUE, SILVER], "Which car do you mean: the blue one or the silver one?"),
        ("Turn left.", [], "no way leads to the left"),
    ],
)
def test_what_cannot_be_done_is_said_before_driving(wish: str, stage: list[Any], words: str) -> None:
    start = RIGHT_LANE if wish != "Turn left." else ("0:0:1", 6.0)
    trip, _ = driven(wish, stage, start=start)
    assert words in trip.trip.plan.refusal
    assert trip.frames == ()


def test_what_is_left_out_is_asked_about_part_by_part() -> None:
    trip, _ = driven("Turn right, then enter the parking lot.", [])
    assert trip.trip.plan.policy is None
    assert trip.trip.plan.refusal == (
        "I cannot enter the lot: I do not drive off the street. Shall I do the rest: turn right?"
    )
    answered = replace(parse_wish(trip.trip.plan.offer, NOBODY), confirmed=trip.trip.plan.refusal)
    trip, judge = driven(answered, [])
    assert [one.result for one in judge.judged] == ["done", "not_judged"]
    assert result_of(trip.trip) is Result.PARTLY_DONE
    assert trip.trip.unused


# The judge ------------------------------------------------------------------------------------------------------------

ON = "def go():\n    while True:\n        yield proceed(check_speed_limit())\n"
HALT = "def go():\n    for _ in range(400):\n        yield stop()\n"
RIGHT = ON.replace("    while", "    turn_right_at_next_intersection()\n    while")
GREEN = {"act": "straight", "when": {"type": "once", "event": "green", "ref": {"kind": "light"}}}


@pytest.mark.parametrize(
    ("program", "act", "stage", "result"),
    [
        (
            ON,
            {"act": "park", "place": {"rel": "behind", "ref": {"kind": "car", "colour": "silver"}}},
            [SILVER],
            "not_done",
        ),
        (
            HALT,
            {"act": "stop", "place": {"rel": "behind", "ref": {"kind": "car", "colour": "silver"}}},
            [SILVER],
            "not_done",
        ),
        (HALT, {"act": "stop"}, [], "done"),
        (HALT, {"act": "follow", "target": {"kind": "bus"}}, [BUS], "not_done"),
        (ON, {"act": "follow", "target": {"kind": "bus"}}, [BUS], "done"),
        (RIGHT, {"act": "follow", "target": {"kind": "bus"}}, [{**BUS, "turns": []}], "not_done"),
        (RIGHT, {"act": "turn", "side": "left"}, [], "opposite"),
        (RIGHT, {"act": "turn", "side": "right"}, [], "done"),
        (RIGHT, {"act": "turn", "side": "right", "not": True}, [], "opposite"),
        (ON, GREEN, [], "done"),
        (HALT, GREEN, [], "not_done"),
        (ON, {"act": "yield", "target": {"kind": "pedestrian"}}, [CROSSES], "done"),
        (ON, {"act": "lane", "side": "left"}, [], "not_done"),
        (ON, {"act": "avoid", "target": {"kind": "car", "colour": "blue"}}, [BLUE], "done"),
        (HALT, {"act": "avoid", "target": {"kind": "car", "colour": "blue"}}, [BLUE], "not_done"),
        (ON, {"act": "stop", "place": {"rel": "near", "ref": {"kind": "gate"}}}, [], "not_judged"),
    ],
)
def test_the_judge_tells_done_from_not_done(program: str, act: Any, stage: list[Any], result: str) -> None:
    """By what was driven alone: the program knows nothing of the words that it is judged by."""
    _, judge = driven("Whatever.", stage, Fixed(program), acts=[act], duration_s=50.0)
    assert judge is not None
    assert [one.result for one in judge.judged] == [result], judge.judged


def test_a_stage_names_whom_words_mean() -> None:
    """Where a benchmark says who is meant, standing behind another one of that colour is not what was asked."""
    twin = {**SILVER, "ahead_m": 30.0}
    world_stage = [twin, SILVER]
    place = {"rel": "behind", "ref": {"kind": "car", "colour": "silver"}}
    (act,) = acts_from_json([{"act": "park", "place": place}])
    judges: list[MeaningReferee] = []

    def judge(world: Any, scenario: Scenario, plan: Plan, words: str) -> Referee:
        del scenario, plan, words
        assert act.place is not None
        assert act.place.ref is not None
        judges.append(MeaningReferee(world, [act], "labels", {act.place.ref: (world.staged[1],)}))
        return judges[0]

    session = Session(planner=Fixed(behind(20001)), referee=judge, max_s=40.0)
    config = {"town": "Gridford", "start": list(RIGHT_LANE), "vehicles": 0, "people": 0, "stage": world_stage}
    asyncio.run(session.drive(parse_wish("Park.", NOBODY), Scenario("s", "town", config, 1), 1, Limits()))
    assert [one.result for one in judges[0].judged] == ["not_done"]


def behind(number: int) -> str:
    return f"def go():\n    for _ in range(700):\n        yield stop_behind(agent({number}))\n"


def test_the_judge_shares_nothing_with_what_drives() -> None:
    """It imports the meaning of words, geometry and the contract of worlds, and nothing that plans, reads or drives."""
    tree = ast.parse(Path(realised.__file__).read_text(encoding="utf-8"))
    modules = {node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    own = {name for name in modules if name.startswith("chauffeur")}
    assert own
    assert all(
        name.startswith(("chauffeur.concept", "chauffeur.geometry")) or name == "chauffeur.worlds.base" for name in own
    )


def test_purposes_and_refusals_are_no_acts_to_be_judged() -> None:
    trace = realised.DriveTrace(None, None)  # type: ignore[arg-type]
    assert realised.judge([Act("refuse"), Act("turn", purpose=True)], trace) == ()
