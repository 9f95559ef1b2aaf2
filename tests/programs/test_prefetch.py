"""Answers given beforehand are the host's answers, used or not, and the record of calls stays complete."""

from __future__ import annotations

from collections import Counter
from typing import Any

import pytest
from straight_road import StraightRoad

from chauffeur.programs import Budget, ProgramExecutor
from chauffeur.programs.binding import DrivingApis
from chauffeur.programs.catalogue import TOWN_APIS
from chauffeur.programs.prefetch import FORESEEABLE, OF_WISHES

ASKING = """
def look():
    ego = get_ego_vehicle()
    while True:
        lane = get_lane_of(ego)
        speed = get_speed_of(ego)
        front = detect_front_vehicle_in(lane, 100)
        set_target_speed(speed + 1)
        wanted = get_target_speed()
        yield autopilot()
"""


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    """How often each API reached the host."""
    counts: Counter[str] = Counter()
    real = DrivingApis.call

    def call(self: DrivingApis, name: str, arguments: Any, keywords: Any, slot: object = None) -> Any:
        counts[name] += 1
        return real(self, name, arguments, keywords, slot)

    monkeypatch.setattr(DrivingApis, "call", call)
    return counts


def _made(source: str, ticks: int, **options: Any) -> list[list[tuple[str, Any]]]:
    world = StraightRoad()
    with ProgramExecutor(budget=Budget(turn_s=1.0, tick_s=2.0), **options) as executor:
        executor.start(source, world)
        results = [executor.tick() for _ in range(ticks)]
    return [[(call.name, call.result) for call in result.made] for result in results]


def test_the_second_period_asks_the_host_only_what_changed(asked: Counter[str]) -> None:
    made = _made(ASKING, 5)
    assert asked["get_lane_of"] == asked["get_speed_of"] == asked["detect_front_vehicle_in"] == 1
    assert asked["set_target_speed"] == 0  # it waits for the end of the period
    assert asked["get_target_speed"] == 5  # what is wished changed just before
    names = [name for name, _ in made[-1]]
    assert names == [
        "get_lane_of",
        "get_speed_of",
        "detect_front_vehicle_in",
        "set_target_speed",
        "get_target_speed",
        "autopilot",
    ]


def test_what_is_asked_every_so_often_is_foreseen_then(asked: Counter[str]) -> None:
    source = """
def main():
    ego = get_ego_vehicle()
    tick = 0
    while True:
        if tick % 5 == 0:
            get_speed_of(ego)
        tick = tick + 1
        yield autopilot()
"""
    made = _made(source, 31)
    assert asked["get_speed_of"] == 2  # the first time, and when it turns out how often
    assert [any(name == "get_speed_of" for name, _ in one) for one in made] == [i % 5 == 0 for i in range(31)]


def test_many_questions_take_slots_over_from_others(asked: Counter[str]) -> None:
    source = """
def main():
    ego = get_ego_vehicle()
    while True:
        lane = get_lane_of(ego)
        for i in range(150):
            front = detect_front_vehicle_in(lane, 20.0 + i)
        say(f"{get_speed_of(ego):.3f} {get_target_speed():.3f}")
        set_target_speed(get_target_speed() + 0.5)
        say(f"{get_target_speed():.3f}")
        yield autopilot()
"""
    world = StraightRoad()
    with ProgramExecutor(budget=Budget(turn_s=1.0, tick_s=2.0, calls=1000)) as executor:
        executor.start(source, world)
        for _ in range(4):
            speed = world.perception().vehicle(0).speed_mps
            wanted = executor.tick()
            assert wanted.said[0].split()[0] == f"{speed:.3f}"
            assert wanted.said[1] == f"{float(wanted.said[0].split()[1]) + 0.5:.3f}"
            assert [call.name for call in wanted.made].count("detect_front_vehicle_in") == 150
    assert asked["detect_front_vehicle_in"] > 150


def test_answers_of_wishes_are_fresh_after_a_wish() -> None:
    source = """
def main():
    v = 10
    while True:
        before = get_target_speed()
        v = v + 1
        set_target_speed(v)
        say(f"{before:.0f} {get_target_speed():.0f}")
        yield autopilot()
"""
    world = StraightRoad()
    with ProgramExecutor(budget=Budget(turn_s=1.0, tick_s=2.0)) as executor:
        executor.start(source, world)
        said = [executor.tick().said[0] for _ in range(4)]
    assert [text.split()[1] for text in said] == ["11", "12", "13", "14"]
    assert [text.split()[0] for text in said[1:]] == ["11", "12", "13"]


def test_an_error_in_a_period_keeps_the_answers_used_before_it() -> None:
    source = """
def main():
    yield autopilot()
    get_speed_of(get_ego_vehicle())
    yield autopilot()
    get_speed_of(get_ego_vehicle())
    say(1 / 0)
"""
    made = _made(source, 3)
    assert [name for name, _ in made[2]] == ["get_ego_vehicle", "get_speed_of"]


def test_a_wish_that_waited_holds_when_the_program_fails_after_it() -> None:
    source = "def main():\n    set_desired_time_headway(1.25)\n    set_target_speed(7.0)\n    say(1 / 0)\n    yield\n"
    with ProgramExecutor(budget=Budget(turn_s=1.0, tick_s=2.0)) as executor:
        executor.start(source, StraightRoad())
        tick = executor.tick()
    assert tick.error is not None
    assert (tick.setpoints.time_headway_s, tick.setpoints.target_speed_mps) == (1.25, 7.0)
    assert [call.name for call in tick.made] == ["set_desired_time_headway", "set_target_speed"]


def test_foreseen_answers_count_as_calls() -> None:
    source = (
        "def main():\n    while True:\n        for i in range(150):\n            get_target_speed()\n        yield\n"
    )
    long = "def main():\n    while True:\n        for i in range(500):\n            get_target_speed()\n        yield\n"
    with ProgramExecutor(budget=Budget(turn_s=1.0, tick_s=2.0, calls=100)) as executor:
        executor.start(source, StraightRoad())
        error = executor.tick().error
        assert error is not None
        assert "100 calls" in str(error)
    with ProgramExecutor(budget=Budget(turn_s=1.0, tick_s=2.0)) as executor:
        executor.start(long, StraightRoad())
        assert "200 calls" in str(executor.tick().error)


def test_keywords_and_odd_arguments_go_to_the_host(asked: Counter[str]) -> None:
    source = """
def main():
    while True:
        get_speed_of(veh=get_ego_vehicle())
        try:
            get_speed_of([])
        except TypeError as error:
            say("refused")
        yield autopilot()
"""
    _made(source, 3, gate=False)
    assert asked["get_speed_of"] == 6


def test_only_questions_are_foreseen() -> None:
    assert {TOWN_APIS[name].effect for name in FORESEEABLE} == {"read"}
    assert OF_WISHES <= FORESEEABLE
