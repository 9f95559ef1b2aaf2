"""Town calls: answers, wishes, and which kind of road understands them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import pytest
from straight_road import StraightRoad

from chauffeur.concept import Command, Setpoints
from chauffeur.programs import ProgramExecutor, check_source, render_docs
from chauffeur.programs.catalogue import APIS, NOTHING_AHEAD_M, TOWN_APIS, TOWN_CALLS, vocabulary_of

DRIVE = "def go():\n    {first}\n    while True:\n        yield proceed(check_speed_limit())\n"


@dataclass
class Street:
    """A perception with lights, people, junctions and places; the rest is of a straight road."""

    road: StraightRoad
    gap: tuple[float, float] | None = (6.8, 0.0)
    light: tuple[str, float] | None = ("red", 23.0)
    person: float | None = None
    junction: tuple[float, tuple[str, ...]] | None = (40.0, ("left", "straight"))
    places: dict[str, float] = field(default_factory=lambda: {"church": 120.0})

    def __getattr__(self, name: str) -> object:
        return getattr(self.road.perception(), name)

    def gap_ahead(self) -> tuple[float, float] | None:
        return self.gap

    def light_ahead(self) -> tuple[str, float] | None:
        return self.light

    def person_ahead(self) -> float | None:
        return self.person

    def junction_ahead(self) -> tuple[float, tuple[str, ...]] | None:
        return self.junction

    def lane_beside(self, side: int) -> str | None:
        return self.road.perception().adjacent_lane(self.road.perception().lane_of(0), side)

    def place_ahead(self, name: str) -> float | None:
        return self.places.get(name)


class Town:
    """A world whose perception is a street's."""

    def __init__(self) -> None:
        self.road = StraightRoad()
        self.street = Street(self.road)

    def perception(self) -> Street:
        return self.street

    def driver(self) -> Town:
        return self

    def settle(self, setpoints: Setpoints) -> Setpoints:
        return setpoints

    def command(self, setpoints: Setpoints) -> Command:
        raise AssertionError(f"stop and proceed ask no driver: {setpoints}")


@pytest.fixture(scope="module")
def executor() -> Iterator[ProgramExecutor]:
    with ProgramExecutor() as one:
        yield one


def test_the_papers_program_drives_in_a_town(executor: ProgramExecutor) -> None:
    source = """
def start_driving_with_front_vehicle_check():
    while True:
        (is_front_vehicle, distance_to_front_vehicle, speed_of_front_vehicle) = check_front_vehicle()
        if (is_front_vehicle and distance_to_front_vehicle < 5 and speed_of_front_vehicle == 0.0):
            yield stop()
        else:
            speed_limit = check_speed_limit()
            yield proceed(speed_limit)
"""
    town = Town()
    assert executor.start(source, town) == "running"  # type: ignore[arg-type]
    limit = town.road.perception().speed_limit(town.road.perception().lane_of(0))
    assert executor.tick().setpoints.target_speed_mps == limit
    town.street.gap = (3.0, 0.0)
    assert executor.tick().setpoints.target_speed_mps == 0.0
    town.street.gap = None
    assert executor.tick().setpoints.target_speed_mps == limit


def test_what_is_asked_is_answered(executor: ProgramExecutor) -> None:
    asked = (
        "check_traffic_light()", "check_stop_sign()", "check_people()", "get_distance_to_junction()",
        'can_go("left")', 'can_go("right")', 'get_distance_to_place("church")', 'get_distance_to_place("moon")',
    )  # fmt: skip
    source = "def go():\n" + "".join(f"    say(str({one}))\n    yield\n" for one in asked)
    assert executor.start(source, Town()) == "running"  # type: ignore[arg-type]
    said = [executor.tick().said[0] for _ in asked]
    nothing, sign = f"(False, {NOTHING_AHEAD_M})", "(True, 300.0)"
    assert said == ["('red', 23.0)", sign, nothing, "40.0", "True", "False", "120.0", "-1.0"]


def test_a_lane_that_is_not_there_is_said(executor: ProgramExecutor) -> None:
    town = Town()
    lanes = {side: town.road.perception().adjacent_lane(town.road.perception().lane_of(0), side) for side in (-1, 1)}
    source = "def go():\n    say(str([change_lane_left(), change_lane_right()]))\n    yield stop()\n"
    assert executor.start(source, town) == "running"  # type: ignore[arg-type]
    tick = executor.tick()
    assert tick.said == (str([lanes[-1] is not None, lanes[1] is not None]),)
    assert tick.setpoints.target_speed_mps == 0.0


def test_roads_know_none_of_it(executor: ProgramExecutor) -> None:
    source = DRIVE.format(first="pass")
    assert not check_source(source).passed
    assert check_source(source, vocabulary="town").passed
    assert executor.start(source, StraightRoad()) == "failed"
    own = "def go():\n    stop = 3\n    proceed = stop\n    while proceed:\n        yield autopilot()\n"
    assert check_source(own).passed
    assert executor.start(own, StraightRoad()) == "running"
    assert executor.tick().state == "running"
    assert not check_source(own, vocabulary="town").passed


def test_programs_of_roads_are_programs_of_towns() -> None:
    assert APIS.items() <= TOWN_APIS.items()
    assert {api.name for api in TOWN_CALLS}.isdisjoint(APIS)
    assert (vocabulary_of("town"), vocabulary_of("highway"), vocabulary_of("intersection")) == ("town", "road", "road")
    for api in TOWN_CALLS:
        assert api.signature in render_docs("town")
        assert api.signature not in render_docs()
        example = api.example.replace("...", "pass")
        assert check_source(f"def go():\n    {example}\n    yield\n", vocabulary="town").passed, api.name
