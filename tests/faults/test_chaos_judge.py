"""The judge sees what must not be: each test drives a real world and then tells a lie, or drives badly."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from chauffeur.bench.chaos.judge import judge, recovery
from chauffeur.bench.chaos.outside import HeardOutside
from chauffeur.bench.chaos.witness import Stall
from chauffeur.concept import Command, Setpoints
from chauffeur.drive.actuate import actuate
from chauffeur.drive.live.messages import Report
from chauffeur.drive.live.starts import Start
from chauffeur.drive.scenarios import find
from chauffeur.safety.shield import Shield
from chauffeur.worlds.highway import HighwayWorld

PERIOD_S = 0.1
START = Start(find("overtake"), 17)

CommandSource = Callable[[HighwayWorld, Setpoints], Command]


def own_driver(world: HighwayWorld, setpoints: Setpoints) -> Command:
    return world.driver().command(world.driver().settle(setpoints))


def drive(ticks: int, hands: CommandSource = own_driver, *, shielded: bool = True) -> list[HeardOutside]:
    """What control would report of a trip, a period each."""
    world = HighwayWorld()
    world.reset(START.scenario, START.seed)
    shield = Shield(world.dt_s, START.limits) if shielded else None
    setpoints = world.driver().initial_setpoints()
    heard: list[HeardOutside] = []
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
        heard.append(HeardOutside(report, round((tick + 1) * PERIOD_S * 1e9)))
    return heard


def unsafe(heard: list[HeardOutside], plans: tuple[str, ...] = ("w1",)) -> tuple[str, ...]:
    return judge(heard, START, plans, PERIOD_S).unsafe()


def changed(heard: list[HeardOutside], place: int, **fields: object) -> list[HeardOutside]:
    copy = list(heard)
    copy[place] = replace(copy[place], report=replace(copy[place].report, **fields))  # pyright: ignore[reportArgumentType]
    return copy


@pytest.fixture(scope="module")
def trip() -> list[HeardOutside]:
    return drive(40)


def test_a_good_trip_is_safe(trip) -> None:
    deeds = judge(trip, START, ("w1",), PERIOD_S)
    assert deeds.unsafe() == ()
    assert (deeds.outcome, deeds.untrue, deeds.longest_silence) == ("driven", 0, 1.0)


def test_a_plan_nobody_checked_is_seen_where_it_is_followed(trip) -> None:
    assert "w7" in unsafe(changed(trip, 20, plan="w7"))[0]
    assert unsafe(changed(trip, 20, plan="w7", level="keep")) == ()
    assert judge(changed(trip, 20, plan="w7"), START, ("w1",), PERIOD_S).unsafe(ignored_plans=("w7",)) == ()


def test_commands_that_are_none_are_seen(trip) -> None:
    nan = Command(float("nan"), 0.0)
    assert "actuator" in unsafe(changed(trip, 39, requested=nan, interventions=()))[0]
    assert any("actuator" in words for words in unsafe(changed(trip, 39, applied=Command(7.0, 0.0))))


def test_a_report_that_is_not_true_is_seen(trip) -> None:
    assert any("not true" in words for words in unsafe(changed(trip, 10, speed_mps=1.0)))
    assert any("not true" in words for words in unsafe(changed(trip, 10, applied=Command(0.123, 0.0))))


def test_silence_is_seen(trip) -> None:
    late = [*trip[:20], *(replace(each, at_ns=each.at_ns + round(5 * PERIOD_S * 1e9)) for each in trip[20:])]
    assert unsafe(late) == ("control was silent",)


def test_silence_is_excused_only_while_the_machine_itself_stood_still(trip) -> None:
    period_ns = round(PERIOD_S * 1e9)
    late = [*trip[:20], *(replace(each, at_ns=each.at_ns + 5 * period_ns) for each in trip[20:])]
    begun = trip[19].at_ns

    def found(*stalls: tuple[int, float, float]) -> tuple[float, float, tuple[str, ...]]:
        seen = [Stall(cpu, begun + round(a * period_ns), begun + round(b * period_ns), 0) for cpu, a, b in stalls]
        deeds = judge(late, START, ("w1",), PERIOD_S, seen)
        return deeds.longest_silence, deeds.unexplained_silence, deeds.unsafe()

    assert found((0, 0.5, 5.5)) == (6.0, 1.0, ())
    assert found((0, 0.5, 2.5)) == (6.0, 4.0, ())
    assert found((0, 0.5, 2.4)) == (6.0, 4.1, ("control was silent",))
    assert found((0, -9.0, 0.0), (1, 6.0, 20.0)) == (6.0, 6.0, ("control was silent",))  # before it, and after it
    assert found((0, 1.0, 2.0), (1, 1.0, 2.0), (0, 1.5, 2.0)) == (6.0, 5.0, ("control was silent",))  # counted once


def test_an_ego_that_runs_into_its_leader_is_to_blame() -> None:
    heard = drive(300, lambda world, setpoints: Command(5.0, own_driver(world, setpoints).steering_rad), shielded=False)
    deeds = judge(heard, START, ("w1",), PERIOD_S)
    assert (deeds.outcome, deeds.blamed) == ("collision", "ego")
    assert "collision of the ego's making" in deeds.unsafe()
    assert "too fast" in deeds.unsafe()


def test_an_ego_that_leaves_the_road_is_seen() -> None:
    deeds = judge(drive(100, lambda world, setpoints: Command(0.0, 0.4), shielded=False), START, ("w1",), PERIOD_S)
    assert deeds.outcome in ("off_road", "collision")
    assert deeds.unsafe()


def test_recovery_is_counted_from_the_fault(trip) -> None:
    fault_ns = trip[10].at_ns
    assert recovery(trip, (), fault_ns, ()).to_follow_s == 0.0
    down = trip
    for place in range(12, 20):
        down = changed(down, place, level="keep" if place > 15 else "hold")
    found = recovery(changed(down, 25, plan="w2"), (), fault_ns, ("w2",))
    assert (found.worst, found.to_follow_s, found.to_new_plan_s) == ("keep", 1.0, 1.5)
    for place in range(20, 40):
        down = changed(down, place, level="stop")
    assert recovery(down, (), fault_ns, ()).to_follow_s is None
    assert recovery(down, [replace(trip[0], at_ns=fault_ns + 9_000_000_000)], fault_ns, ()).to_follow_s == 9.0
