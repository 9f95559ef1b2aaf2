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
from chauffeur.concept.utterance import Act, Utterance, acts_from_json
from chauffeur.driving.episode import Referee
from chauffeur.driving.judge import acts
from chauffeur.driving.judge.choice import referee_for
from chauffeur.driving.judge.referee import ActsReferee
from chauffeur.driving.judge.trace import DriveTrace
from chauffeur.driving.recording import RecordedTrip
from chauffeur.driving.session import Session, parse_wish
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
        referee = referee_for(world, scenario, plan, words) if made is None else ActsReferee(world, made, "labels")
        judges.append(referee)
        return referee

    session = Session(planner=planner or MeaningPlanner(), referee=judge, max_s=75.0)
    words = parse_wish(wish, NOBODY) if isinstance(wish, str) else wish
    trip: RecordedTrip = asyncio.run(session.drive(words, Scenario("s", "town", base, 1), 1, Limits()))
    return trip, judges[0] if judges else None


class ByActs:
    """The planner of meaning for words that are read already, whatever the parser makes of them."""

    id = model = "meaning"

    def __init__(self, acts: list[Any]) -> None:
        self._acts = acts_from_json(acts)

    async def plan(self, request: PlanRequest) -> Plan:
        return MeaningPlanner().plan_of(Utterance(request.instruction.text, self._acts), request)


def car(colour: str, state: str | None = None) -> Any:
    return {"kind": "car", "colour": colour, **({"state": state} if state else {})}


RED_BUS = {"kind": "bus", "colour": "red"}
WALKER = {"kind": "pedestrian"}
YELLOW_WALKER = {**WALKER, "colour": "yellow"}
TO_RIGHT, TO_LEFT = {"act": "turn", "side": "right"}, {"act": "turn", "side": "left"}


GONE = {"type": "until", "event": "gone", "ref": WALKER}
GREEN = {"type": "once", "event": "green", "ref": {"kind": "light"}}
VAN_GONE = {"type": "after", "event": "gone", "ref": {"kind": "van", "colour": "white"}}


def at(rel: str, ref: Any) -> Any:
    return {"rel": rel, "ref": ref}


@pytest.mark.parametrize(
    ("acts", "stage", "start"),
    [
        ([{"act": "park", "place": at("behind", car("silver"))}], [BUS, BLUE, SILVER], RIGHT_LANE),
        ([{"act": "follow", "target": RED_BUS}], [{**BUS, "turns": ["right"]}, BLUE], RIGHT_LANE),
        ([{"act": "follow", "target": {"kind": "bus", "deictic": True}}], [{**BUS, "turns": ["left"]}], LEFT_LANE),
        ([{"act": "wait", "when": GONE}, TO_RIGHT], [CROSSES, SILVER], RIGHT_LANE),
        ([{"act": "yield", "target": YELLOW_WALKER}, {"act": "straight"}], [CROSSES, STANDS], RIGHT_LANE),
        ([{"act": "straight", "when": GREEN}], [SILVER], RIGHT_LANE),
        ([{**TO_LEFT, "when": VAN_GONE}], [COMING], LEFT_LANE),
        (
            [TO_RIGHT, {"act": "stop", "place": at("behind", car("black", "parked"))}],
            [{**BLUE, "colour": "black"}, *CORNER], RIGHT_LANE,
        ),
        (
            [{"act": "stop", "place": at("beside", {**WALKER, "colour": "red"})}],
            [{**STANDS, "ahead_m": 40.0}, {**STANDS, "colour": "blue"}], RIGHT_LANE,
        ),
        (
            [{"act": "pass", "target": car("blue", "parked"), "manner": "slow"},
             {"act": "stop", "place": at("in_front_of", car("silver"))}],
            [BLUE, SILVER], RIGHT_LANE,
        ),
        ([TO_LEFT, TO_RIGHT], [], LEFT_LANE),
    ],
)  # fmt: skip
def test_what_is_asked_for_is_done(acts: list[Any], stage: list[Any], start: Any) -> None:
    trip, judge = driven("As labelled.", stage, ByActs(acts), acts=acts, start=start)
    assert judge is not None, trip.trip.plan.thoughts.text
    assert [(one.act.act, one.result, one.why) for one in judge.judged if one.result != "done"] == []
    assert (trip.trip.outcome, trip.trip.judged_by) == ("success", "labels")
    assert trip.trip.plan.acts == acts_from_json(acts), "what the plan claims to do"


def test_words_that_are_read_are_judged_by_the_reading() -> None:
    trip, _ = driven("Turn left, then turn right.", [], start=LEFT_LANE)
    assert (trip.trip.outcome, trip.trip.judged_by, result_of(trip.trip)) == ("success", "reading", Result.DONE)


def test_a_bus_that_turns_is_followed_round_the_corner() -> None:
    trip, _ = driven("Follow that bus.", [{**BUS, "turns": ["right"]}])
    seen = [frame.observation for frame in trip.frames]
    turned = [abs(one.heading_rad - seen[0].ego.heading_rad) for now in seen for one in now.others if one.kind == "bus"]
    assert max(turned) > 1.0
    ego, bus = trip.final.ego, next(one for one in trip.final.others if one.kind == "bus")
    assert math.hypot(ego.x_m - bus.x_m, ego.y_m - bus.y_m) < 60.0


@pytest.mark.parametrize(
    ("act", "start", "words"),
    [
        ({"act": "park", "place": at("behind", car("green"))}, RIGHT_LANE, "I see no green car."),
        ({"act": "park", "place": at("behind", {"kind": "car"})}, RIGHT_LANE, "the blue one or the silver one?"),
        (TO_LEFT, ("0:0:1", 6.0), "no way leads to the left"),
    ],
)
def test_what_cannot_be_done_is_said_before_driving(act: Any, start: Any, words: str) -> None:
    trip, _ = driven("As labelled.", [BLUE, SILVER], ByActs([act]), start=start)
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
ON_GREEN = {"act": "straight", "when": GREEN}
GATE = {"kind": "gate"}


@pytest.mark.parametrize(
    ("program", "act", "stage", "result"),
    [
        (ON, {"act": "park", "place": at("behind", car("silver"))}, [SILVER], "not_done"),
        (HALT, {"act": "stop", "place": at("behind", car("silver"))}, [SILVER], "not_done"),
        (HALT, {"act": "stop"}, [], "done"),
        (HALT, {"act": "follow", "target": {"kind": "bus"}}, [BUS], "not_done"),
        (ON, {"act": "follow", "target": {"kind": "bus"}}, [BUS], "done"),
        (RIGHT, {"act": "follow", "target": {"kind": "bus"}}, [{**BUS, "turns": []}], "not_done"),
        (RIGHT, {"act": "turn", "side": "left"}, [], "opposite"),
        (RIGHT, {"act": "turn", "side": "right"}, [], "done"),
        (RIGHT, {"act": "turn", "side": "right", "not": True}, [], "opposite"),
        (ON, ON_GREEN, [], "done"),
        (HALT, ON_GREEN, [], "not_done"),
        (ON, {"act": "yield", "target": WALKER}, [CROSSES], "done"),
        (ON, {"act": "lane", "side": "left"}, [], "not_done"),
        (ON, {"act": "avoid", "target": car("blue")}, [BLUE], "done"),
        (HALT, {"act": "avoid", "target": car("blue")}, [BLUE], "not_done"),
        (ON, {"act": "stop", "place": at("near", GATE)}, [], "not_done"),
        (HALT, {"act": "stop", "place": at("near", GATE)}, [], "not_judged"),
        (ON, {"act": "straight", "when": {"type": "once", "event": "opens", "ref": GATE}}, [], "not_judged"),
        (RIGHT, {"act": "u_turn"}, [], "not_done"),
    ],
)
def test_the_judge_tells_done_from_not_done(program: str, act: Any, stage: list[Any], result: str) -> None:
    """By what was driven alone: the program knows nothing of the words that it is judged by."""
    _, judge = driven("Drive on.", stage, Fixed(program), acts=[act], duration_s=50.0)
    assert judge is not None
    assert [one.result for one in judge.judged] == [result], judge.judged


def test_a_stage_names_whom_words_mean() -> None:
    """Where a benchmark says who is meant, standing behind another one of that colour is not what was asked."""
    twin = {**SILVER, "ahead_m": 30.0}
    world_stage = [twin, SILVER]
    place = {"rel": "behind", "ref": {"kind": "car", "colour": "silver"}}
    (act,) = acts_from_json([{"act": "park", "place": place}])
    judges: list[ActsReferee] = []

    def judge(world: Any, scenario: Scenario, plan: Plan, words: str) -> Referee:
        del scenario, plan, words
        assert act.place is not None
        assert act.place.ref is not None
        judges.append(ActsReferee(world, [act], "labels", {act.place.ref: (world.staged[1],)}))
        return judges[0]

    session = Session(planner=Fixed(behind(20001)), referee=judge, max_s=40.0)
    config = {"town": "Gridford", "start": list(RIGHT_LANE), "vehicles": 0, "people": 0, "stage": world_stage}
    asyncio.run(session.drive(parse_wish("Park.", NOBODY), Scenario("s", "town", config, 1), 1, Limits()))
    assert [one.result for one in judges[0].judged] == ["not_done"]


def behind(number: int) -> str:
    return f"def go():\n    for _ in range(700):\n        yield stop_behind(agent({number}))\n"


def test_the_judge_shares_nothing_with_what_drives() -> None:
    """It imports the meaning of words, geometry and the contract of worlds, and nothing that plans, reads or drives."""
    names = ("trace", "references", "conditions", "manoeuvres", "standing", "setpoints", "acts", "referee")
    trees = [ast.parse((Path(acts.__file__).parent / f"{name}.py").read_text(encoding="utf-8")) for name in names]
    nodes = [node for tree in trees for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    own = {node.module for node in nodes if node.module is not None and node.module.startswith("chauffeur")}
    assert own
    allowed = ("chauffeur.concept", "chauffeur.geometry", "chauffeur.driving.judge", "chauffeur.worlds.base")
    tells = {"chauffeur.language.meaning.words"}  # says acts, and reads none
    assert all(name.startswith(allowed) for name in own - tells)


def test_purposes_and_refusals_are_no_acts_to_be_judged() -> None:
    trace = DriveTrace(None, None)  # type: ignore[arg-type]
    assert acts.judge([Act("refuse"), Act("turn", purpose=True)], trace) == ()
