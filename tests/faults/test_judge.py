"""The judge sees what must not be: each test drives a real world and then tells a lie, or drives badly."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest
from judge import Heard, judge

from chauffeur.concept import Command, Setpoints
from chauffeur.driving.actuate import actuate
from chauffeur.driving.live.messages import Report
from chauffeur.driving.live.starts import Start
from chauffeur.driving.scenarios import find
from chauffeur.safety.shield import Shield
from chauffeur.worlds.highway import HighwayWorld

PERIOD_S = 0.1
START = Start(find("overtake"), 17)

CommandSource = Callable[[HighwayWorld, Setpoints], Command]


def own_driver(world: HighwayWorld, setpoints: Setpoints) -> Command:
    return world.driver().command(world.driver().settle(setpoints))


def drive(ticks: int, hands: CommandSource = own_driver, *, shielded: bool = True) -> list[Heard]:
    """What control would report of a trip, a period each."""
    world = HighwayWorld()
    world.reset(START.scenario, START.seed)
    shield = Shield(world.dt_s, START.limits) if shielded else None
    setpoints = world.driver().initial_setpoints()
    heard: list[Heard] = []
    for tick in range(ticks):
        if world.ended:
            break
        observation = world.observe()
        done = actuate(world, observation, hands(world, setpoints), None, shield)
        report = Report(
            trip=1, tick=tick, late_ns=0, level="follow", plan="w1", state="running", line=1, age_s=0.05,
            setpoints=setpoints, requested=done.requested, applied=done.applied,
            interventions=done.interventions, clipped=(), refused={},
            missed=0, faults=0, speed_mps=observation.ego.speed_mps, lane=observation.ego.lane,
        )  # fmt: skip
        heard.append(Heard(report, round((tick + 1) * PERIOD_S * 1e9)))
    return heard


def unsafe(heard: list[Heard], plans: tuple[str, ...] = ("w1",)) -> tuple[str, ...]:
    return judge(heard, START, plans).unsafe()


def changed(heard: list[Heard], place: int, **fields: object) -> list[Heard]:
    copy = list(heard)
    copy[place] = replace(copy[place], report=replace(copy[place].report, **fields))  # pyright: ignore[reportArgumentType]
    return copy


@pytest.fixture(scope="module")
def trip() -> list[Heard]:
    return drive(40)


def test_a_good_trip_is_safe(trip) -> None:
    deeds = judge(trip, START, ("w1",))
    assert deeds.unsafe() == ()
    assert (deeds.outcome, deeds.untrue, deeds.longest_silence_s) == ("driven", 0, PERIOD_S)


def test_a_plan_nobody_checked_is_seen_where_it_is_followed(trip) -> None:
    assert "w7" in unsafe(changed(trip, 20, plan="w7"))[0]
    assert unsafe(changed(trip, 20, plan="w7", level="keep")) == ()
    assert judge(changed(trip, 20, plan="w7"), START, ("w1",)).unsafe(ignored_plans=("w7",)) == ()


def test_commands_that_are_none_are_seen(trip) -> None:
    nan = Command(float("nan"), 0.0)
    assert "actuator" in unsafe(changed(trip, 39, requested=nan, interventions=()))[0]
    assert any("actuator" in words for words in unsafe(changed(trip, 39, applied=Command(7.0, 0.0))))


def test_a_report_that_is_not_true_is_seen(trip) -> None:
    assert any("not true" in words for words in unsafe(changed(trip, 10, speed_mps=1.0)))
    assert any("not true" in words for words in unsafe(changed(trip, 10, applied=Command(0.123, 0.0))))


def test_silence_is_seen(trip) -> None:
    late = [*trip[:20], *(replace(each, at_ns=each.at_ns + round(25 * PERIOD_S * 1e9)) for each in trip[20:])]
    assert unsafe(late) == ("control was silent",)


def test_an_ego_that_runs_into_its_leader_is_to_blame() -> None:
    heard = drive(300, lambda world, setpoints: Command(5.0, own_driver(world, setpoints).steering_rad), shielded=False)
    deeds = judge(heard, START, ("w1",))
    assert (deeds.outcome, deeds.blamed) == ("collision", "ego")
    assert "collision of the ego's making" in deeds.unsafe()
    assert "too fast" in deeds.unsafe()


def test_an_ego_that_leaves_the_road_is_seen() -> None:
    deeds = judge(drive(100, lambda world, setpoints: Command(0.0, 0.4), shielded=False), START, ("w1",))
    assert deeds.outcome in ("off_road", "collision")
    assert deeds.unsafe()
