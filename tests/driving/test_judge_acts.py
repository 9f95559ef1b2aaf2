"""One predicate an act, over drives that are drawn: a motorway of three lanes, and a street with two junctions."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

import pytest

from chauffeur.concept import Lead, Observation, Parameters, Plan, Setpoints, Thoughts, VehicleState
from chauffeur.concept.utterance import acts_from_json
from chauffeur.driving.judge.acts import judge
from chauffeur.driving.judge.sources import acts_of
from chauffeur.driving.judge.trace import DriveTrace
from chauffeur.geometry import Lane, Polyline, RoadGraph

WIDTH_M = 4.0
LEFT, MIDDLE, RIGHT = 0, 1, 2


def lane(name: str, points: list[tuple[float, float]], **about: Any) -> Lane:
    return Lane(name, Polyline.of(points), WIDTH_M, about.pop("limit", 30.0), **about)


MOTORWAY = RoadGraph(
    (
        *(lane(f"m{k}", [(0, -WIDTH_M * k), (5000, -WIDTH_M * k)], road="m", index=k) for k in range(3)),
        lane("m3", [(0, -3 * WIDTH_M), (5000, -3 * WIDTH_M)], road="m", index=3, kind="emergency", closed=True),
    )
)


class Leg(NamedTuple):
    """Some seconds of a drive: at what speed, in which lane, and what the policy asks for."""

    s: float
    mps: float
    lane: int = MIDDLE
    wants: float | None = None


class Other(NamedTuple):
    """Another vehicle: where it begins, ahead of the car, in which lane; its speed, and the lane that it changes to."""

    ahead_m: float
    mps: float
    lane: int = MIDDLE
    goes: tuple[float, int] = (math.inf, 0)


def vehicle(number: int, x_m: float, place: int, mps: float) -> VehicleState:
    return VehicleState(number, "car", x_m, -WIDTH_M * place, 0.0, mps, 5.0, 2.0, f"m{place}")


def driven(legs: list[Leg], others: tuple[Other, ...] = ()) -> DriveTrace:
    trace: DriveTrace | None = None
    x_m, tick = 0.0, 0
    for leg in legs:
        for _ in range(round(leg.s * 10)):
            t = tick / 10
            ego = vehicle(0, x_m, leg.lane, leg.mps)
            seen = tuple(
                vehicle(k + 1, one.ahead_m + one.mps * t, one.goes[1] if t >= one.goes[0] else one.lane, one.mps)
                for k, one in enumerate(others)
            )
            before = [one for one in seen if one.lane == ego.lane and one.x_m > x_m]
            lead = min(before, key=lambda one: one.x_m, default=None)
            front = None if lead is None else Lead(lead.id, lead.x_m - x_m, lead.speed_mps)
            now = Observation(t, tick, "highway", ego, seen, (), MOTORWAY, front, None, False, False)
            trace = trace or DriveTrace(MOTORWAY, now)
            wants = leg.mps if leg.wants is None else leg.wants
            trace.add(now, Setpoints(target_speed_mps=wants, target_lane=ego.lane))
            x_m, tick = x_m + leg.mps / 10, tick + 1
    assert trace is not None
    return trace


def results(acts: list[Any], trace: DriveTrace, **settings: float) -> list[str]:
    return [one.result for one in judge(acts_from_json(acts), trace, settings=settings)]


ON = [Leg(10, 25)]
SLOWS, HURRIES = [Leg(2, 25), Leg(6, 20)], [Leg(2, 25), Leg(6, 30)]
TO_LEFT, TO_RIGHT = [Leg(2, 25), Leg(6, 25, LEFT)], [Leg(2, 25), Leg(6, 25, RIGHT)]
BY_LEFT = [Leg(2, 30), Leg(8, 30, LEFT), Leg(6, 30)]
STOPS = [Leg(2, 25), Leg(6, 0)]
ON_SHOULDER = [Leg(2, 25), Leg(6, 0, 3)]
AHEAD = (Other(40, 20),)
SAME = (Other(40, 25),)
CUTS_IN = (Other(60, 25), Other(20, 25, RIGHT, (4.0, MIDDLE)))
CAR = {"kind": "car", "where": "ahead"}
WAITS = [Leg(2, 25), Leg(6, 0), Leg(2, 25)]
IN_5_S = {"type": "once", "event": "time", "value": 5.0, "unit": "s"}
CLOSER = {"type": "if", "event": "closer", "value": 20.0, "unit": "m", "ref": CAR}
SLOWER = {"type": "if", "event": "slower", "value": 100.0, "unit": "km/h", "ref": CAR}


def speed(**about: Any) -> dict[str, Any]:
    return {"act": "speed", **about}


def gap(**about: Any) -> dict[str, Any]:
    return {"act": "gap", **about}


@pytest.mark.parametrize(
    ("act", "legs", "others", "result"),
    [
        (speed(value=72.0, unit="km/h"), SLOWS, (), "done"),
        (speed(value=80.0, unit="km/h"), SLOWS, (), "not_done"),
        (speed(value=72.0, unit="km/h"), [Leg(5, 25), Leg(1, 20), Leg(3, 25)], (), "not_done"),
        (speed(value=72.0, unit="km/h", direction="faster"), SLOWS, (), "not_done"),
        (speed(value=18.0, unit="km/h", measure="by", direction="slower"), SLOWS, (), "done"),
        (speed(value=18.0, unit="km/h", measure="by", direction="faster"), SLOWS, (), "not_done"),
        (speed(value=0.8, unit="share", measure="times"), SLOWS, (), "done"),
        (speed(value=80.0, unit="km/h", measure="at_most"), SLOWS, (), "done"),
        (speed(value=80.0, unit="km/h", measure="at_least"), SLOWS, (), "not_done"),
        (speed(value=10.0, unit="m/s", measure="under_limit"), SLOWS, (), "done"),
        (speed(aim="limit"), HURRIES, (), "done"),
        (speed(aim="traffic"), SLOWS, AHEAD, "done"),
        (speed(direction="slower"), SLOWS, (), "done"),
        (speed(direction="slower"), ON, (), "not_done"),
        (speed(direction="faster"), SLOWS, (), "not_done"),
        (speed(direction="same"), ON, (), "done"),
        (speed(direction="faster", **{"not": True}), HURRIES, (), "opposite"),
        (speed(direction="faster", **{"not": True}), SLOWS, (), "done"),
        (speed(style="relaxed"), SLOWS, (), "done"),
        (speed(), ON, (), "not_judged"),
        (speed(direction="slower", when=IN_5_S), SLOWS, (), "not_done"),
        (speed(direction="slower", when={"type": "once", "event": "other"}), SLOWS, (), "not_judged"),
        (speed(direction="slower", when=CLOSER), ON, SAME, "not_judged"),
        (gap(value=40.0, unit="m"), ON, SAME, "done"),
        (gap(value=50.0, unit="m"), ON, SAME, "not_done"),
        (gap(value=30.0, unit="m", measure="at_least"), ON, SAME, "done"),
        (gap(value=30.0, unit="m", measure="at_most"), ON, SAME, "not_done"),
        (gap(value=1.4, unit="s"), ON, SAME, "done"),
        (gap(value=8.0, unit="lengths"), ON, SAME, "done"),
        (gap(value=40.0, unit="m"), ON, (), "not_done"),
        (gap(direction="more"), [Leg(6, 20), Leg(4, 25)], SAME, "done"),
        (gap(direction="more"), ON, SAME, "not_done"),
        (gap(direction="less"), [Leg(3, 30), Leg(5, 25)], SAME, "done"),
        (gap(value=30.0, unit="m", measure="by", direction="more"), [Leg(6, 20), Leg(4, 25)], SAME, "done"),
        ({"act": "lane", "side": "left"}, TO_LEFT, (), "done"),
        ({"act": "lane", "side": "left"}, [Leg(2, 25), Leg(1, 25, LEFT), Leg(5, 25)], (), "not_done"),
        ({"act": "lane", "side": "left"}, TO_RIGHT, (), "opposite"),
        ({"act": "lane", "side": "left", "value": 2.0, "unit": "lanes"}, TO_LEFT, (), "not_done"),
        ({"act": "lane", "side": "left", "value": 2.0, "unit": "lanes"}, [Leg(1, 25, RIGHT), *TO_LEFT], (), "done"),
        ({"act": "lane", "to": "leftmost"}, TO_LEFT, (), "done"),
        ({"act": "lane", "to": "rightmost"}, TO_RIGHT, (), "done"),
        ({"act": "lane", "to": "middle"}, TO_RIGHT, (), "not_done"),
        ({"act": "lane", "to": "original"}, BY_LEFT, (), "done"),
        ({"act": "lane", "to": "behind target", "target": CAR}, TO_LEFT, SAME, "not_done"),
        ({"act": "lane", "not": True}, TO_LEFT, (), "opposite"),
        ({"act": "lane", "not": True}, ON, (), "done"),
        ({"act": "keep"}, ON, (), "done"),
        ({"act": "keep"}, TO_LEFT, (), "opposite"),
        ({"act": "pass", "target": CAR}, BY_LEFT, AHEAD, "done"),
        ({"act": "pass", "target": {"kind": "truck"}}, BY_LEFT, AHEAD, "done"),
        ({"act": "pass"}, ON, AHEAD, "not_done"),
        ({"act": "pass", "side": "left"}, BY_LEFT, AHEAD, "done"),
        ({"act": "pass", "side": "right"}, BY_LEFT, AHEAD, "not_done"),
        ({"act": "pass", "target": CAR}, BY_LEFT, (Other(200, 29), Other(-20, 25, RIGHT)), "not_done"),
        ({"act": "pass", "not": True}, BY_LEFT, AHEAD, "opposite"),
        ({"act": "pass", "not": True}, ON, SAME, "done"),
        ({"act": "pass", "when": SLOWER}, BY_LEFT, AHEAD, "done"),
        ({"act": "pass"}, ON, (), "not_judged"),
        ({"act": "follow", "target": CAR}, ON, SAME, "done"),
        ({"act": "follow", "target": CAR}, TO_LEFT, SAME, "not_done"),
        ({"act": "yield", "target": {"kind": "van"}}, ON, CUTS_IN, "done"),
        ({"act": "yield", "target": {"kind": "van"}}, ON, SAME, "not_done"),
        ({"act": "yield", "not": True}, ON, CUTS_IN, "opposite"),
        ({"act": "stop"}, STOPS, (), "done"),
        ({"act": "stop"}, ON, (), "not_done"),
        ({"act": "stop", "not": True}, STOPS, (), "opposite"),
        ({"act": "pull_over"}, STOPS, (), "not_done"),
        ({"act": "pull_over"}, ON_SHOULDER, (), "done"),
        ({"act": "stop", "place": {"rel": "after", "ref": {"kind": "building"}}}, STOPS, (), "not_judged"),
        ({"act": "wait", "when": {**IN_5_S, "type": "until"}}, WAITS, (), "done"),
        ({"act": "wait", "when": {**IN_5_S, "type": "until", "value": 15.0}}, WAITS, (), "not_done"),
        ({"act": "go"}, ON, (), "done"),
        ({"act": "go"}, [Leg(5, 0)], (), "not_done"),
        ({"act": "enter", "target": {"kind": "lot"}}, ON, (), "not_judged"),
    ],
)  # fmt: skip
def test_an_act_is_done_or_not(act: Any, legs: list[Leg], others: tuple[Other, ...], result: str) -> None:
    assert results([act], driven(legs, others)) == [result]


def test_acts_are_done_in_their_order() -> None:
    passing, slower = {"act": "pass"}, speed(value=90.0, unit="km/h")
    trace = driven([*BY_LEFT, Leg(5, 25)], AHEAD)
    assert results([passing, {"act": "lane", "to": "original"}, slower], trace) == ["done"] * 3
    assert results([slower, passing], trace) == ["done", "not_done"], "it was passed before that"
    assert results([speed(value=200.0), passing], trace) == ["not_done", "not_done"]
    assert results([{"act": "lane", "not": True}, slower], driven(SLOWS)) == ["done", "not_done"]


def test_a_number_of_the_plan_is_reached_where_words_name_a_change_only() -> None:
    slower, trace = speed(direction="slower"), driven(SLOWS)
    assert results([slower], trace, target_speed_mps=20.0) == ["done"]
    assert results([slower], trace, target_speed_mps=15.0) == ["not_done"]
    assert results([slower, {"act": "lane"}], trace, target_speed_mps=15.0)[0] == "done", "a later act sets it anew"
    wider = driven([Leg(6, 20), Leg(4, 25)], SAME)
    assert [results([gap(direction="more")], wider, gap_m=size) for size in (70.0, 90.0)] == [["done"], ["not_done"]]


# Junctions ------------------------------------------------------------------------------------------------------------

STREET = RoadGraph(
    (
        lane("a", [(0, 0), (50, 0)], successors=("j1s", "j1r")),
        lane("j1s", [(50, 0), (70, 0)], junction="1", successors=("b",)),
        lane("j1r", [(50, 0), (60, -4), (60, -20)], junction="1", successors=("r",)),
        lane("r", [(60, -20), (60, -200)]),
        lane("b", [(70, 0), (120, 0)], successors=("j2s", "j2r")),
        lane("j2s", [(120, 0), (140, 0)], junction="2", successors=("c",)),
        lane("c", [(140, 0), (300, 0)]),
        lane("j2r", [(120, 0), (130, -4), (130, -20)], junction="2", successors=("d",)),
        lane("d", [(130, -20), (130, -200)]),
    )
)
FIRST_RIGHT, SECOND_RIGHT = ("a", "j1r", "r"), ("a", "j1s", "b", "j2r", "d")
AHEAD_ON = ("a", "j1s", "b", "j2s", "c")


def along(names: tuple[str, ...]) -> DriveTrace:
    trace: DriveTrace | None = None
    tick = 0
    for name in names:
        way = STREET[name]
        for step in range(int(way.length_m)):
            pose = way.centre.at(float(step))
            ego = VehicleState(0, "car", pose.x_m, pose.y_m, pose.heading_rad, 10.0, 5.0, 2.0, name)
            now = Observation(tick / 10, tick, "street", ego, (), (), STREET, None, None, False, False)
            trace = trace or DriveTrace(STREET, now)
            trace.add(now, Setpoints(10.0))
            tick += 1
    assert trace is not None
    return trace


TURN, SECOND = {"act": "turn", "side": "right"}, {"rel": "at", "ref": {"kind": "junction", "ordinal": 2}}


@pytest.mark.parametrize(
    ("acts", "way", "found"),
    [
        ([TURN], FIRST_RIGHT, ["done"]),
        ([TURN], SECOND_RIGHT, ["not_done"]),
        ([TURN], AHEAD_ON, ["not_done"]),
        ([{**TURN, "side": "left"}], FIRST_RIGHT, ["opposite"]),
        ([{**TURN, "place": SECOND}], SECOND_RIGHT, ["done"]),
        ([{**TURN, "place": SECOND}], FIRST_RIGHT, ["not_done"]),
        ([{**TURN, "not": True}], FIRST_RIGHT, ["opposite"]),
        ([{**TURN, "not": True}], AHEAD_ON, ["done"]),
        ([{"act": "straight"}], AHEAD_ON, ["done"]),
        ([{"act": "straight"}], FIRST_RIGHT, ["not_done"]),
        ([{"act": "straight"}, TURN], SECOND_RIGHT, ["done", "not_done"]),
        ([TURN, {"act": "straight"}], FIRST_RIGHT, ["done", "done"]),
        ([{"act": "u_turn"}], FIRST_RIGHT, ["not_done"]),
    ],
)
def test_ways_are_taken_at_the_junction_that_was_meant(acts: list[Any], way: tuple[str, ...], found: list[str]) -> None:
    assert results(acts, along(way)) == found


# Plans ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("intent", "settings", "acts"),
    [
        ("overtake.left", (), [{"act": "pass", "side": "left"}]),
        ("turn.straight", (), [{"act": "straight"}]),
        ("speed.cap", (("target_speed_mps", 25.0),), [speed(measure="at_most")]),
        ("gap.increase+style.hurry", (), [gap(direction="more"), speed(style="hurry")]),
        ("lane.return", (), [{"act": "lane", "to": "original"}]),
        ("speed.set", (), []),
        ("small_talk", (), []),
    ],
)
def test_acts_of_a_plan_are_those_of_its_intent(intent: str, settings: Any, acts: list[Any]) -> None:
    plan = Plan(Thoughts(""), None, intent=intent, settings=settings)
    assert acts_of(plan) == acts_from_json(acts)
    ways = replace(plan, intent="", policy=Parameters(10.0, 1.0, 1.0, 0, "left"))
    assert acts_of(ways) == acts_from_json([{"act": "turn", "side": "left"}])
