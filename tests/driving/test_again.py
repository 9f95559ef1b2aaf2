"""A recording read back is as foreign as a model's reply: what it says is checked, bounded and filtered by today's."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pytest

from chauffeur.concept import LAMPILOT_LIMITS, ChauffeurError, DataError, Instruction, Limits, Program, Scenario
from chauffeur.driving.again import DrivenAgain, drive_again
from chauffeur.driving.judge.choice import referee_for
from chauffeur.driving.recording import RecordedTrip, compare_trips, read_trip, write_trip
from chauffeur.driving.scenarios import find
from chauffeur.driving.session import Session
from chauffeur.planners.base import Planner
from chauffeur.planners.registry import make_planner

MOST = Limits()


@pytest.fixture(scope="module")
def honest() -> RecordedTrip:
    return driven("Slow down a bit.", "cruise", Limits())


def driven(wish: str, name: str, limits: Limits) -> RecordedTrip:
    planner: Planner = make_planner("onboard")
    scenario = find(name)
    session = Session(planner, referee=referee_for)
    return asyncio.run(session.drive(Instruction(wish), scenario, scenario.seed, limits))


def again(recorded: RecordedTrip, most: Limits = MOST) -> DrivenAgain:
    return drive_again(recorded, most, referee_for)


def through_a_file(recorded: RecordedTrip, folder: Path) -> RecordedTrip:
    path = folder / "trip.mcap"
    trip = recorded.trip
    return read_trip(write_trip(path, trip, recorded.frames, recorded.scenario, final=recorded.final))


def with_record(recorded: RecordedTrip, **values: Any) -> RecordedTrip:
    record = {**dict(recorded.trip.record), **values}
    kept = tuple((key, value) for key, value in record.items() if value is not None)
    return replace(recorded, trip=replace(recorded.trip, record=kept))


def with_program(recorded: RecordedTrip, source: str) -> RecordedTrip:
    return replace(recorded, trip=replace(recorded.trip, plan=replace(recorded.trip.plan, policy=Program(source))))


WILD = {"max_over_limit_mps": 69.0, "min_time_headway_s": 0.0, "max_time_headway_s": 1e9, "max_speed_mps": None}


def program(*lines: str) -> str:
    return "def main():\n" + "".join(f"    {line}\n" for line in (*lines, "while True:", "    yield autopilot()"))


FAST = program("set_target_speed(68.0)")


@pytest.mark.parametrize("limits", [MOST, Limits("ana", 0.0, 1.5, 10.0, 30.0)])
def test_an_honest_trip_is_the_same_bit_for_bit(tmp_path: Path, limits: Limits) -> None:
    recorded = through_a_file(driven("Slow down a bit.", "cruise", limits), tmp_path)
    found = again(recorded)
    assert found.trip is not None and not found.notes and not found.refusal
    assert compare_trips(recorded, found.trip) is None


def test_one_under_other_limits_of_the_house_is_the_same_under_those(tmp_path: Path) -> None:
    recorded = through_a_file(driven("Speed up to 120 km/h.", "cruise", LAMPILOT_LIMITS), tmp_path)
    found = again(recorded, LAMPILOT_LIMITS)
    assert found.trip is not None and compare_trips(recorded, found.trip) is None
    assert again(recorded).notes, "and under today's own it is said what differs"


def test_an_emergency_stop_is_the_same(tmp_path: Path) -> None:
    recorded = through_a_file(driven("Stop!", "cruise", MOST), tmp_path)
    found = again(recorded)
    assert found.trip is not None and compare_trips(recorded, found.trip) is None


@pytest.mark.parametrize(
    ("wish", "source"),
    [
        ("Slow down a bit.", FAST),
        ("Stop!", FAST),  # words of an emergency do not vouch for another program than the car's own
        ("Slow down a bit.", program("speed = get_speed_limit()", "set_target_speed(speed * 2.0 + 7.0)")),
        ("Slow down a bit.", "def main():\n    while True:\n        set_target_speed(68.0)\n"),
        ("Slow down a bit.", program("import os", "os.system('true')")),
        ("Slow down a bit.", program("set_desired_time_headway(0.0)")),
    ],
)
def test_a_program_is_refused_as_a_planners_would_be(honest: RecordedTrip, wish: str, source: str) -> None:
    foreign = with_program(with_record(honest, limits={"name": "default", **WILD}), source)
    foreign = replace(foreign, trip=replace(foreign.trip, instruction=Instruction(wish)))
    found = again(foreign)
    limit = honest.frames[0].observation.road[honest.frames[0].observation.ego.lane].speed_limit_mps
    if found.trip is None:
        assert found.refusal
    else:
        assert max(one.observation.ego.speed_mps for one in found.trip.frames) < limit + 2.0
    assert any("wider limits" in note for note in found.notes)


@pytest.mark.parametrize("name", ["default", "lampilot", "vehicle", "my own"])
def test_of_recorded_limits_only_what_is_stricter_counts(honest: RecordedTrip, name: str) -> None:
    found = again(with_program(with_record(honest, limits={"name": name, **WILD}), FAST))
    assert found.trip is None and "245 km/h" in found.refusal
    assert "max_over_limit_mps 1.0" in found.notes[0] and "min_time_headway_s 0.5" in found.notes[0]


@pytest.mark.parametrize("odd", [math.nan, math.inf, -math.inf, 1e308])
def test_odd_numbers_of_limits_loosen_nothing(honest: RecordedTrip, odd: float) -> None:
    values = dict.fromkeys(WILD, odd) | {"min_time_headway_s": -odd}
    found = again(with_program(with_record(honest, limits={"name": "x", **values}), FAST))
    assert found.trip is None or max(one.observation.ego.speed_mps for one in found.trip.frames) < 35.0


def test_without_the_filter_it_was_recorded_and_with_it_it_is_driven(honest: RecordedTrip) -> None:
    found = again(with_record(honest, shield=None, minimum_speed=None))
    assert found.trip is not None
    assert [("safety filter" in note, "least speed" in note) for note in found.notes] == [(True, False), (False, True)]


@pytest.mark.parametrize("limits", [None, "fast", {"name": "x", "max_over_limit_mps": "much"}, [1, 2]])
def test_limits_that_are_none_are_named(honest: RecordedTrip, limits: object) -> None:
    with pytest.raises(DataError, match="under which limits"):
        again(with_record(honest, limits=limits))


@pytest.mark.parametrize(
    "spoil",
    [
        lambda one: replace(one, world="no such world"),
        lambda one: replace(one, config={}),
        lambda one: replace(one, config={"lanes": "many"}),
        lambda one: replace(one, config={**one.config, "vehicles": 10**30}),
        lambda one: replace(one, config={**one.config, "duration_s": math.nan}),
        lambda one: replace(one, world="town", config={"town": 3}),
        lambda one: replace(one, world="parking", config={"lot": [[[]]]}),
    ],
)
def test_a_scenario_that_is_none_is_said_in_words(honest: RecordedTrip, spoil: Callable[[Scenario], Scenario]) -> None:
    try:
        again(replace(honest, scenario=spoil(honest.scenario)))
    except ChauffeurError as error:
        assert str(error)


def test_a_seed_that_is_none_is_said_in_words(honest: RecordedTrip) -> None:
    for seed in (-1, 2**70):
        try:
            again(replace(honest, trip=replace(honest.trip, seed=seed)))
        except ChauffeurError as error:
            assert str(error)


def test_todays_limits_of_the_person_hold(honest: RecordedTrip) -> None:
    """What was set after the recording holds for it as well."""
    slow = asdict(MOST) | {"max_speed_mps": 5.0}
    found = again(honest, Limits(**slow))
    assert found.notes and "max_speed_mps 5.0" in found.notes[0]
    assert (
        found.trip is None
        or found.trip.frames[-1].observation.ego.speed_mps < honest.frames[-1].observation.ego.speed_mps
    )
